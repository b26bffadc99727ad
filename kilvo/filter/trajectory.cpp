#include "kilvo/filter/trajectory.hpp"

#include <algorithm>

namespace kilvo {
namespace {

SE3 between(const Trajectory::Entry& a, const Trajectory::Entry& b, Time t) {
  const double span = to_seconds(b.t - a.t);
  const double s = to_seconds(t - a.t) / span;
  const double s2 = s * s, s3 = s2 * s;
  const Eigen::Vector3d p =
      (2 * s3 - 3 * s2 + 1) * a.T_WI.p + (s3 - 2 * s2 + s) * span * a.v_W + (3 * s2 - 2 * s3) * b.T_WI.p + (s3 - s2) * span * b.v_W;
  return {a.T_WI.R * SO3::Exp(s * (a.T_WI.R.inverse() * b.T_WI.R).Log()), p};
}

}  // namespace

void Trajectory::push(Time t, const SE3& T_WI, const Eigen::Vector3d& v_W) {
  if (!entries_.empty() && t < entries_.back().t) return;
  if (!entries_.empty() && t == entries_.back().t) {
    entries_.back() = {t, T_WI, v_W};
    return;
  }
  // Dropping in batches keeps the cost per push constant.
  if (entries_.size() >= 64 && entries_.front().t < t - 2 * keep_) {
    const auto first =
        std::lower_bound(entries_.begin(), entries_.end(), t - keep_, [](const Entry& e, Time value) { return e.t < value; });
    // The entry before the kept span stays, so that the whole span can be interpolated.
    if (first != entries_.begin()) entries_.erase(entries_.begin(), first - 1);
  }
  entries_.push_back({t, T_WI, v_W});
}

void Trajectory::correct(Time t, const SE3& corrected, const Eigen::Vector3d& dv_W) {
  const auto before = at(t);
  if (!before) return;
  const SE3 C = corrected * before->inverse();
  while (entries_.back().t > t) entries_.pop_back();
  for (Entry& e : entries_) {
    e.T_WI = C * e.T_WI;
    e.T_WI.p -= dv_W * to_seconds(t - e.t);
    e.v_W = C.R * e.v_W + dv_W;
  }
}

std::optional<SE3> Trajectory::at(Time t) const {
  if (entries_.empty() || t < entries_.front().t || t > entries_.back().t) return std::nullopt;
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), t, [](const Entry& e, Time value) { return e.t < value; });
  if (after->t == t) return after->T_WI;
  return between(*(after - 1), *after, t);
}

}  // namespace kilvo
