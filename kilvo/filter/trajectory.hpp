// Time-ordered poses of the IMU with a pose at any time between: the paper's state buffer. Bounded: old entries fall off.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "kilvo/filter/state.hpp"

namespace kilvo {

class Trajectory {
 public:
  struct Entry {
    Time t{};
    SE3 T_WI;
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  // m/s
  };

  /// Keeps at most `keep` of time before the newest entry.
  explicit Trajectory(Duration keep) : keep_(keep) {}

  /// Appends; an entry of the newest time replaces it; an older one is ignored.
  void push(Time t, const SE3& T_WI, const Eigen::Vector3d& v_W);

  /// The pose at `t` becomes `corrected`, its velocity changes by `dv_W`. Entries before move along rigidly, so the correction of a sweep
  /// is no motion and relative motion stays what it was (but for dv, which had moved them); entries after `t` are dropped.
  void correct(Time t, const SE3& corrected, const Eigen::Vector3d& dv_W);

  void clear() { entries_.clear(); }
  std::size_t size() const { return entries_.size(); }
  Time oldest() const { return entries_.front().t; }
  Time newest() const { return entries_.back().t; }

  /// Pose at `t`: cubic Hermite in position (the velocities are known), constant rate in rotation. None outside [oldest, newest].
  std::optional<SE3> at(Time t) const;

 private:
  std::vector<Entry> entries_;
  Duration keep_;
};

}  // namespace kilvo
