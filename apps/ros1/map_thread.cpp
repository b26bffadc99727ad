#include "apps/ros1/map_thread.hpp"

#include <ros/names.h>
#include <utility>

#include "apps/ros1/clouds.hpp"
#include "lab/mapping/ply.hpp"

namespace kilvo::ros1 {
namespace {

constexpr std::size_t most_waiting = 64;  // sweeps and images: some seconds, while a map is written
constexpr std::uint32_t most_unsent = 4;  // clouds

}  // namespace

MapThread::MapThread(const Names& names, const lab::MappingConfig& config) : config_(config), frame_(names.map_frame), map_(config) {
  ros::NodeHandle node;
  cloud_ = node.advertise<CloudMessage>(ros::names::resolve(names.cloud), most_unsent);
  coloured_ = node.advertise<CloudMessage>(ros::names::resolve(names.coloured), most_unsent);
  thread_ = std::thread([this] { run(); });
}

MapThread::~MapThread() {
  {
    const std::lock_guard lock(waiting_mutex_);
    ended_ = true;
  }
  news_.notify_one();
  thread_.join();
}

void MapThread::take(Output output) {
  {
    const std::lock_guard lock(waiting_mutex_);
    if (waiting_.size() >= most_waiting) {
      waiting_.pop_front();
      ++given_up_;
    }
    waiting_.push_back(std::move(output));
  }
  news_.notify_one();
}

void MapThread::run() {
  std::unique_lock lock(waiting_mutex_);
  while (true) {
    news_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (ended_) return;
    const Output output = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    put(output);
    lock.lock();
  }
}

void MapThread::put(const Output& output) {
  if (output.is_sweep && cloud_.getNumSubscribers() > 0) cloud_.publish(cloud_message(output.points_W, output.t, frame_));
  if (!output.coloured.empty() && coloured_.getNumSubscribers() > 0) coloured_.publish(cloud_message(output.coloured, output.t, frame_));
  const std::lock_guard lock(map_mutex_);
  // The map of another epoch is of another world.
  if (std::exchange(epoch_, output.epoch) != output.epoch) map_ = lab::MapBuilder(config_);
  if (output.is_sweep) map_.add(output.points_W);
  if (!output.coloured.empty()) map_.colour(output.coloured);
}

std::size_t MapThread::save(const std::string& path) {
  const std::lock_guard lock(map_mutex_);
  lab::write_ply(path, map_);
  return map_.size();
}

void MapThread::clear() {
  {
    const std::lock_guard lock(waiting_mutex_);
    waiting_.clear();
  }
  const std::lock_guard lock(map_mutex_);
  map_ = lab::MapBuilder(config_);
}

std::uint64_t MapThread::given_up() const {
  const std::lock_guard lock(waiting_mutex_);
  return given_up_;
}

}  // namespace kilvo::ros1
