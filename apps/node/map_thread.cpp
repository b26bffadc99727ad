#include "apps/node/map_thread.hpp"

#include <utility>

#include "apps/live/levelling.hpp"
#include "apps/node/clouds.hpp"
#include "lab/mapping/ply.hpp"

namespace kilvo::node {
namespace {

constexpr std::size_t most_waiting = 64;  // sweeps and images: some seconds, while a map is written

}  // namespace

MapThread::MapThread(std::string frame, const lab::MappingConfig& config, Outlet outlet)
    : config_(config), frame_(std::move(frame)), outlet_(std::move(outlet)), map_(config) {
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
    Output output = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    put(std::move(output));
    lock.lock();
  }
}

void MapThread::put(Output output) {
  if (output.is_sweep && outlet_.is_wanted(Topic::cloud))
    outlet_.publish(Topic::cloud, output.t, cloud_message(output.points_W, output.t, frame_));
  if (!output.coloured.empty() && outlet_.is_wanted(Topic::coloured))
    outlet_.publish(Topic::coloured, output.t, cloud_message(output.coloured, output.t, frame_));
  const std::lock_guard lock(map_mutex_);
  // The map of another epoch is of another world.
  if (std::exchange(epoch_, output.epoch) != output.epoch) {
    map_ = lab::MapBuilder(config_);
    turn_.reset();
  }
  if (output.R_LW) {
    turn_ = output.R_LW;
    Levelling::apply(turn_->inverse(), output);
  }
  if (output.is_sweep) map_.add(output.points_W);
  if (!output.coloured.empty()) map_.colour(output.coloured);
}

std::size_t MapThread::save(const std::string& path) {
  const std::lock_guard lock(map_mutex_);
  lab::write_ply(path, map_, turn_.value_or(SO3()));
  return map_.size();
}

void MapThread::clear() {
  {
    const std::lock_guard lock(waiting_mutex_);
    waiting_.clear();
  }
  const std::lock_guard lock(map_mutex_);
  map_ = lab::MapBuilder(config_);
  turn_.reset();
}

std::uint64_t MapThread::given_up() const {
  const std::lock_guard lock(waiting_mutex_);
  return given_up_;
}

}  // namespace kilvo::node
