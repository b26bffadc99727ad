#include "kilvo/input/reorder_buffer.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace kilvo {
namespace {

// Of one sensor no more waits than this: bytes, and time between the oldest and the newest.
constexpr std::size_t most_bytes = std::size_t{64} << 20;
constexpr Duration most_time = std::chrono::seconds(3);

std::size_t bytes_of(const Measurement& m) {
  if (const auto* scan = std::get_if<LidarScan>(&m)) return scan->points.size() * sizeof(LidarPoint);
  if (const auto* image = std::get_if<CameraImage>(&m)) return image->image.pixels.size();
  return sizeof(Measurement);
}

}  // namespace

Time completion_of(const Measurement& m) {
  const auto* scan = std::get_if<LidarScan>(&m);
  return scan == nullptr ? stamp_of(m) : end_of(*scan);
}

bool ReorderBuffer::is_later(const Entry& a, const Entry& b) {
  return std::tuple(a.completion, a.measurement.index(), a.arrival) > std::tuple(b.completion, b.measurement.index(), b.arrival);
}

void ReorderBuffer::push(Time completion, Measurement m) {
  bytes_[m.index()] += bytes_of(m);
  heap_.push_back({completion, arrivals_++, std::move(m)});
  std::ranges::push_heap(heap_, is_later);
}

Measurement ReorderBuffer::pop() {
  std::ranges::pop_heap(heap_, is_later);
  Measurement m = std::move(heap_.back().measurement);
  heap_.pop_back();
  bytes_[m.index()] -= bytes_of(m);
  return m;
}

int ReorderBuffer::bound(Sensor s, Time newest) {
  std::size_t& bytes = bytes_[index_of(s)];
  int given_up = 0;
  // Nothing that waits is older than what waits at the front.
  while (bytes > most_bytes || newest - first() > most_time) {
    const auto rank = [s](const Entry& e) { return std::tuple(e.measurement.index() != index_of(s), e.completion, e.arrival); };
    const auto oldest = std::ranges::min_element(heap_, {}, rank);
    const std::size_t size = bytes_of(oldest->measurement);
    if (bytes == size || (bytes <= most_bytes && newest - oldest->completion <= most_time)) break;
    bytes -= size;
    heap_.erase(oldest);
    std::ranges::make_heap(heap_, is_later);
    ++given_up;
  }
  return given_up;
}

}  // namespace kilvo
