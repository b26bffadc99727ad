#include "kilvo/estimator/frame_queue.hpp"

#include <algorithm>
#include <utility>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {
namespace {

bool is_scan(const FrameQueue::Frame& f) { return std::holds_alternative<LidarScan>(f.what); }

}  // namespace

std::optional<FrameQueue::Frame> FrameQueue::push(LidarScan scan) {
  const Time begin = begin_of(scan), end = end_of(scan);
  return insert(Frame{std::move(scan), begin, end});
}

std::optional<FrameQueue::Frame> FrameQueue::push(CameraImage image) {
  const Time t = image.t;
  return insert(Frame{std::move(image), t, t});
}

std::optional<FrameQueue::Frame> FrameQueue::insert(Frame frame) {
  const auto after = std::ranges::upper_bound(frames_, frame.end, {}, &Frame::end);
  frames_.insert(after, std::move(frame));
  if (frames_.back().end - frames_.front().end <= longest_wait) return std::nullopt;
  std::optional<Frame> oldest = std::move(frames_.front());
  frames_.pop_front();
  return oldest;
}

std::optional<FrameQueue::Frame> FrameQueue::pop(Time until) {
  if (!has_one_until(until)) return std::nullopt;
  auto next = frames_.begin();
  if (!is_scan(*next)) {
    const Time image = next->end;
    const auto before = std::ranges::find_if(frames_, [&](const Frame& f) { return f.end <= until && f.middle() <= image && is_scan(f); });
    if (before == frames_.end() && waits_for_scan(image, until)) return std::nullopt;
    if (before != frames_.end()) next = before;
  }
  Frame chosen = std::move(*next);
  frames_.erase(next);
  return {std::move(chosen)};
}

// A scan whose middle is before the image is still being taken: it goes first, if it comes at all.
bool FrameQueue::waits_for_scan(Time image, Time until) const {
  if (ended_ || !with_scans_ || !last_middle_ || *last_middle_ + scan_period_ > image) return false;
  const bool has_passed = std::ranges::any_of(frames_, [image](const Frame& f) { return is_scan(f) && f.middle() > image; });
  return !has_passed && until < image + 6 * scan_period_ / 10 && image - *last_middle_ < 3 * scan_period_;
}

}  // namespace kilvo
