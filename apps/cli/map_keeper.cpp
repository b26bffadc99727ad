#include "apps/cli/map_keeper.hpp"

namespace kilvo::cli {
namespace {

constexpr std::size_t most_waiting = 8;  // sweeps and images

}  // namespace

MapKeeper::MapKeeper(const lab::MappingConfig& config, bool threaded) : map_(config), queue_(most_waiting) {
  if (threaded) thread_ = std::thread([this] { put_all(); });
}

MapKeeper::~MapKeeper() { join(); }

void MapKeeper::put(const Item& item) {
  if (const auto* colours = std::get_if<std::vector<ColouredPoint>>(&item)) {
    map_.colour(*colours);
  } else {
    map_.add(std::get<std::vector<Eigen::Vector4f>>(item));
  }
}

void MapKeeper::put_all() {
  try {
    while (const auto item = queue_.pop()) put(*item);
  } catch (...) {
    error_ = std::current_exception();
    queue_.close();
  }
}

void MapKeeper::take(Item item) {
  if (thread_.joinable()) {
    queue_.push(std::move(item));
  } else {
    put(item);
  }
}

void MapKeeper::add(std::vector<Eigen::Vector4f> points_W) { take(std::move(points_W)); }

void MapKeeper::colour(std::vector<ColouredPoint> points) { take(std::move(points)); }

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
