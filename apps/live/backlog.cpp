#include "apps/live/backlog.hpp"

#include <algorithm>
#include <numeric>

namespace kilvo::live {
namespace {

// By Sensor. A second of legs, and of an IMU as fast as they; two scans and two images.
constexpr std::array<std::size_t, sensor_count> most = {1000, 1000, 2, 2};

}  // namespace

void Backlog::make_room(Sensor s) {
  const auto i = static_cast<std::size_t>(s);
  if (count_[i] < most[i]) return;
  waiting_.erase(std::ranges::find_if(waiting_, [s](const Arrival& a) { return sensor_of(a.m) == s; }));
  --count_[i];
  ++dropped_[i];
}

void Backlog::push(Arrival arrival) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    const Sensor s = sensor_of(arrival.m);
    make_room(s);
    ++count_[static_cast<std::size_t>(s)];
    waiting_.push_back(std::move(arrival));
    deepest_ = std::max(deepest_, waiting_.size());
  }
  ready_.notify_one();
}

bool Backlog::take(std::vector<Arrival>& out) {
  out.clear();
  std::unique_lock lock(mutex_);
  ready_.wait(lock, [this] { return !waiting_.empty() || closed_; });
  out.swap(waiting_);
  count_.fill(0);
  return !out.empty();
}

void Backlog::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  ready_.notify_all();
}

std::array<std::uint64_t, sensor_count> Backlog::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::uint64_t Backlog::given_up() const {
  const auto each = dropped();
  return std::accumulate(each.begin(), each.end(), std::uint64_t{0});
}

std::size_t Backlog::deepest() const {
  const std::lock_guard lock(mutex_);
  return deepest_;
}

}  // namespace kilvo::live
