// Scans and images that wait for the IMU. They update the state in the order of their times: the middle of a scan, the stamp of an image.
#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <variant>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// Scans and images wait no longer for the IMU; nothing older is propagated again.
inline constexpr Duration longest_wait = std::chrono::seconds(2);

class FrameQueue {
 public:
  struct Frame {
    std::variant<LidarScan, CameraImage> what;
    Time begin, end;  // of the scan; the image's stamp
    Sensor sensor() const { return std::holds_alternative<LidarScan>(what) ? Sensor::lidar : Sensor::camera; }
    Time middle() const { return begin + (end - begin) / 2; }
  };

  /// `scan_rate`: nominal, Hz. `with_scans`: scans are to be expected.
  FrameQueue(double scan_rate, bool with_scans) : scan_period_(from_seconds(1 / scan_rate)), with_scans_(with_scans) {}

  /// Takes a frame; gives back the oldest when too many wait.
  std::optional<Frame> push(LidarScan scan);
  std::optional<Frame> push(CameraImage image);

  /// The next one that is complete at `until`, the newest time of the IMU. An image waits for a scan whose middle is before it.
  std::optional<Frame> pop(Time until);
  bool has_one_until(Time t) const { return !frames_.empty() && frames_.front().end <= t; }
  bool empty() const { return frames_.empty(); }
  Time first_end() const { return frames_.front().end; }

  /// A scan updated the state at this time.
  void scan_used(Time middle) { last_middle_ = middle; }
  std::optional<Time> last_middle() const { return last_middle_; }

  /// No more scans will come: nothing waits for one.
  void end() { ended_ = true; }
  /// What still waits.
  std::deque<Frame> take_rest() { return std::exchange(frames_, {}); }

 private:
  std::optional<Frame> insert(Frame frame);
  bool waits_for_scan(Time image, Time until) const;

  Duration scan_period_;
  bool with_scans_;
  std::deque<Frame> frames_;  // by end
  std::optional<Time> last_middle_;
  bool ended_ = false;
};

}  // namespace kilvo
