#include "kilvo/estimator/frame_queue.hpp"

#include <algorithm>
#include <utility>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {
namespace {

bool is_scan(const FrameQueue::Frame& f) { return std::holds_alternative<LidarScan>(f.what); }

}  // namespace

std::optional<FrameQueue::Frame> FrameQueue::push(LidarScan scan) {
  std::vector<LidarScan> scans;
  if (recut_) scans = recutter_.add(scan);
  if (!recut_) scans.push_back(std::move(scan));
  std::optional<Frame> crowded_out;
  for (LidarScan& s : scans) {
    const Time begin = begin_of(s), end = end_of(s);
    crowded_out = insert(Frame{std::move(s), begin, end});
  }
  return crowded_out;
}

std::optional<FrameQueue::Frame> FrameQueue::push(CameraImage image) {
  const Time t = image.t;
  if (recut_) recutter_.add_image(t);
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
  // One that is recut comes with the scan that the image lies in.
  const auto tenths = recut_ ? 12 : 6;
  return !has_passed && until < image + tenths * scan_period_ / 10 && image - *last_middle_ < 3 * scan_period_;
}

}  // namespace kilvo
