#include "apps/cli/map_keeper.hpp"

namespace kilvo::cli {
namespace {

constexpr std::size_t most_waiting = 8;  // sweeps

}  // namespace

MapKeeper::MapKeeper(const lab::MappingConfig& config, bool threaded) : map_(config), queue_(most_waiting) {
  if (threaded) thread_ = std::thread([this] { add_all(); });
}

MapKeeper::~MapKeeper() { join(); }

void MapKeeper::add_all() {
  try {
    while (const auto points = queue_.pop()) map_.add(*points);
  } catch (...) {
    error_ = std::current_exception();
    queue_.close();
  }
}

void MapKeeper::add(std::vector<Eigen::Vector4f> points_W) {
  if (thread_.joinable()) {
    queue_.push(std::move(points_W));
  } else {
    map_.add(points_W);
  }
}

void MapKeeper::join() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

const lab::MapBuilder& MapKeeper::finish() {
  join();
  if (error_) std::rethrow_exception(error_);
  return map_;
}

}  // namespace kilvo::cli
