// The way of the legs against that of the LiDAR: lengths of the URDF, height of the IMU.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <tuple>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

constexpr double window = 1.0;                  // s, of a displacement
constexpr double least_way = 0.12;              // m in a window
constexpr double scale_tolerance = 0.035;       // soles that slip and roll take 1 %
constexpr double agreed_tolerance = 0.013;      // where the robot stands as much higher
constexpr double slip_tolerance = 0.08;         // of a way that is too short, where nothing tells the height, or that slipping makes
constexpr double stance_tolerance = 0.025;      // links are known to 1 %, soles roll
constexpr double leg_height_tolerance = 0.028;  // m: ground that gives way takes 2 cm

struct Lowest {
  std::size_t foot = 0, corner = 0;
  double height = 1e9;
};

Lowest lowest_of(const LegPose& pose, const Eigen::Vector3d& up_link, std::size_t first_foot = 0, std::size_t last_foot = 1) {
  Lowest out;
  for (std::size_t f = first_foot; f <= last_foot; ++f) {
    for (int i = 0; i < pose.foot[f].corners; ++i) {
      const double height = up_link.dot(pose.foot[f].p[static_cast<std::size_t>(i)]);
      if (height < out.height) out = {f, static_cast<std::size_t>(i), height};
    }
  }
  return out;
}

// Height of the LiDAR above the floor: of the lowest dense layer of points around the robot while it stands.
std::optional<double> height_by_lidar(const std::vector<Sweep>& sweeps, const std::vector<SweepPose>& way, const Eigen::Vector3d& up_W,
                                      double still_until) {
  constexpr double layer = 0.01;  // m
  std::vector<int> counts(400, 0);
  int all = 0;
  for (std::size_t i = 0; i < std::min(way.size(), sweeps.size()); ++i) {
    if (!way[i].good || way[i].t > still_until) continue;
    for (const TimedPoint& p : *sweeps[i].points) {
      const Eigen::Vector3d x = way[i].T_WL.R * p.p.cast<double>();
      const double height = up_W.dot(x), along = (x - height * up_W).norm();
      if (height > -0.2 || height < -3.9 || along > 3) continue;
      ++counts[static_cast<std::size_t>(-height / layer)];
      ++all;
    }
  }
  if (all < 500) return std::nullopt;
  // The floor: the layer of most points, and their mean about it.
  std::size_t best = 0;
  for (std::size_t k = 2; k + 2 < counts.size(); ++k) {
    const auto sum = [&](std::size_t j) { return counts[j - 2] + counts[j - 1] + counts[j] + counts[j + 1] + counts[j + 2]; };
    if (best < 2 || sum(k) > sum(best)) best = k;
  }
  if (best < 4 || best + 4 >= counts.size()) return std::nullopt;
  double sum = 0, n = 0;
  for (std::size_t k = best - 4; k <= best + 4; ++k) {
    sum += counts[k] * (static_cast<double>(k) + 0.5) * layer;
    n += counts[k];
  }
  if (n < 0.15 * all) return std::nullopt;
  return sum / n;
}

/// The robot walks over the lowest corner of its soles; in windows of a second its way is held against the LiDAR's.
class WayOfLegs {
 public:
  WayOfLegs(const Eigen::Vector3d& up_W, const Eigen::Vector3d& p_link_lidar) : up_W_(up_W), p_link_lidar_(p_link_lidar) {}

  /// `T_W`: the link by the LiDAR, if known.
  void add(double t, const LegPose& pose, const std::optional<SE3>& T_W, bool still) {
    if (!T_W) {
      last_.reset();
      return;
    }
    const Eigen::Vector3d up = T_W->R.inverse() * up_W_;
    still_ = still_ && still;
    if (still_) {
      if (heights_.empty()) still_from_ = t;
      still_until_ = t;
      heights_.push_back(up.dot(p_link_lidar_) - lowest_of(pose, up).height);
      uneven_.push_back(lowest_of(pose, up, 1, 1).height - lowest_of(pose, up, 0, 0).height);
    }
    if (last_ && t - last_t_ < 0.05) {
      const Lowest stands = lowest_of(last_pose_, last_->R.inverse() * up_W_);
      by_legs_ -= T_W->R * pose.foot[stands.foot].p[stands.corner] - last_->R * last_pose_.foot[stands.foot].p[stands.corner];
    } else {
      begin(t, *T_W);
    }
    if (t - begin_ >= window) {
      const Eigen::Vector3d way = flat(T_W->p - from_);
      if (way.norm() > least_way) ratios_.push_back(flat(by_legs_).dot(way) / way.squaredNorm());
      begin(t, *T_W);
    }
    last_ = T_W;
    last_pose_ = pose;
    last_t_ = t;
  }

  /// Way by the legs through way by the LiDAR, and its standard deviation.
  std::pair<double, double> scale() const {
    if (ratios_.size() < 5) return {1, INFINITY};
    std::vector<double> sorted = ratios_;
    std::ranges::sort(sorted);
    const std::size_t n = sorted.size();
    const double spread = sorted[n * 3 / 4] - sorted[n / 4];
    return {sorted[n / 2], 0.74 * 1.25 * spread / std::sqrt(static_cast<double>(n))};
  }
  std::size_t windows() const { return ratios_.size(); }
  /// From the lowest corner up to the LiDAR while the robot stands at the beginning.
  std::optional<double> height() const { return median_of(heights_); }
  /// How much lower the left sole is then.
  std::optional<double> uneven() const { return median_of(uneven_); }
  double still_until() const { return still_until_; }

 private:
  std::optional<double> median_of(std::vector<double> values) const {
    if (values.size() < 50 || still_until_ - still_from_ < 0.8) return std::nullopt;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
  }
  Eigen::Vector3d flat(const Eigen::Vector3d& v) const { return v - up_W_ * up_W_.dot(v); }
  void begin(double t, const SE3& T_W) {
    begin_ = t;
    from_ = T_W.p;
    by_legs_.setZero();
  }

  Eigen::Vector3d up_W_, p_link_lidar_;
  std::optional<SE3> last_;
  LegPose last_pose_;
  double last_t_ = -1, begin_ = 0, still_from_ = 0, still_until_ = -1;
  Eigen::Vector3d by_legs_ = Eigen::Vector3d::Zero(), from_ = Eigen::Vector3d::Zero();
  bool still_ = true;
  std::vector<double> ratios_, heights_, uneven_;
};

std::string detail_of(double scale, double sigma, std::size_t windows, const std::optional<double>& height) {
  const bool on_the_spot = windows == 0 && std::isfinite(sigma);
  const std::string way = on_the_spot ? ", on the spot" : fmt::format(", in {} s", windows);
  return fmt::format(
      "way by the legs / way by the LiDAR {:.3f}, standard deviation {:.3f}{}; height of the LiDAR by the legs less that by its "
      "points {}",
      scale, sigma, way, height ? fmt::format("{:.1f} cm", 100 * *height) : "unknown");
}

}  // namespace

Examination::LegWay Examination::measure_leg_way(const LegHypothesis* hypothesis) const {
  const GyroPath path = gyro();
  const Eigen::Vector3d up_W = -translation_->g_W.normalized();
  const SE3 T_link_imu = robot_.imu.T_link_imu, T_link_lidar = T_link_imu * robot_.lidar.T_imu_lidar;
  const LidarWay& lidar = lidar_way();
  WayOfLegs way(up_W, T_link_lidar.p);
  for (const LegPose& pose : legs_under(hypothesis)) {
    const double t = pose.t + leg_offset_;
    const auto T_WI = lidar.at(t, path);
    const bool inside = T_WI && path.covers(t - 0.1, t + 0.1);
    way.add(t, pose, inside ? std::optional(*T_WI * T_link_imu.inverse()) : std::nullopt,
            inside && path.rate(t - 0.1, t + 0.1).norm() < 0.06);
  }
  LegWay out;
  std::tie(out.scale, out.sigma) = way.scale();
  out.windows = way.windows();
  out.uneven = way.uneven();
  if (const auto by_legs = way.height()) {
    if (const auto by_points = height_by_lidar(recorded_.sweeps, way_, up_W, way.still_until())) out.height = *by_legs - *by_points;
  }
  return out;
}

// Of a robot that stays on the spot: it turns and sways over soles that stand, as far as its legs are long.
void Examination::measure_leg_size(LegWay& way) const {
  constexpr double method = 0.02, still = 0.002;  // of the scale, m: soles that roll
  const LegHypothesis* mend = leg_mend_ ? &*leg_mend_ : nullptr;
  const StanceFit fit = fit_stances(recorded_legs_, robot_, mend, lidar_way(), gyro(), leg_offset_, {std::nullopt, false, true});
  if (!fit.good || !(fit.scale > 0) || fit.moved > still) return;
  way.windows = 0;
  way.scale = 1 / fit.scale;
  way.sigma = std::hypot(method, fit.scale_sigma * way.scale * way.scale);
}

// Legs that turn as the robot does under no change that was tried are wrong where their way is not the LiDAR's: rough encoders walk as far.
bool Examination::way_contradicts_legs(const std::string& evidence) {
  if (!translation_ || way_.empty() || translation_->g_W.norm() < 5) return false;
  if (seems_wrong(Sensor::legs) || seems_wrong(Sensor::imu)) return false;
  const LegWay way = measure_leg_way(nullptr);
  if (!std::isfinite(way.sigma) || !is_no_way_of_legs(way.scale, way.sigma)) return false;
  // Nor by a mount that is turned about the vertical.
  const SO3 described = robot_.imu.T_link_imu.R;
  const std::vector<SO3> mounts = upright_mounts();
  constexpr std::size_t every = 4;  // of 36
  bool none = true;
  for (std::size_t k = 0; k < mounts.size() && none; k += every) {
    robot_.imu.T_link_imu.R = mounts[k];
    const LegWay other = measure_leg_way(nullptr);
    none = std::isfinite(other.sigma) && is_no_way_of_legs(other.scale, other.sigma);
  }
  robot_.imu.T_link_imu.R = described;
  if (!none) return false;
  accuse_leg_joints(fmt::format("{}; {}", evidence, detail_of(way.scale, way.sigma, way.windows, way.height)));
  return true;
}

// Legs of the same axes left and right turn the same when their joints are exchanged; only the way differs.
bool Examination::accuse_exchanged_legs(double scale, const std::string& evidence) {
  // Right legs that slip fall short by less than exchanged ones do.
  if (scale < 1 && 1 - scale < slip_tolerance) return false;
  for (const LegHypothesis& h : leg_hypotheses(recorded_legs_, robot_)) {
    if (h.cause != "joints_swapped") continue;
    const LegWay way = measure_leg_way(&h);
    if (!std::isfinite(way.sigma) || std::abs(way.scale - 1) > std::min(scale_tolerance, 0.5 * std::abs(scale - 1))) return false;
    // Exchanged legs are as long, and turn as well.
    constexpr double as_well = 0.03;  // of the turning
    const auto turning = [&](const LegHypothesis* legs) { return score_legs(legs_under(legs), leg_offset_, false).explained; };
    if (std::abs(way.height.value_or(0)) > leg_height_tolerance || turning(&h) < turning(nullptr) - as_well) return false;
    Finding f{h.culprit, h.cause, h.name, {}, h.setting, scale - 1, {}, {}, true};
    f.evidence = fmt::format("{}; {:.3f} when they are exchanged", evidence, way.scale);
    find_on_legs(std::move(f), h);
    return true;
  }
  return false;
}

void Examination::examine_leg_lengths() {
  if (!translation_ || way_.empty() || translation_->g_W.norm() < 5) {
    examine_leg_size();
    return;
  }
  LegWay way = measure_leg_way(nullptr);
  if (!std::isfinite(way.sigma)) measure_leg_size(way);
  const auto& [by_way, sigma, windows, height, uneven] = way;
  // The feet that stand tell it better than the way over soles that roll; a place of the IMU that is wrong would spoil that, and show as a
  // height that these legs do not explain.
  constexpr double floor_is_even = 0.025, legs_are_even = 0.012, far_enough = 0.925;  // m, m, of the way: two legs disagree
  const bool disagree = windows > 0 && by_way + sigma < far_enough && !is_no_way_of_legs(by_way, sigma);
  if (uneven && std::abs(*uneven) > (disagree ? legs_are_even : floor_is_even)) {
    accuse_uneven_legs(*uneven);
    return;
  }
  double scale = by_way;
  const double legs = legs_under(nullptr).front().foot[0].p[0].norm();
  const auto expected = [legs](double s) { return (1 - 1 / s) * legs; };
  const auto explains = [&](double s) {
    return !height || std::abs(*height - expected(s)) < std::max(leg_height_tolerance, 0.5 * std::abs(expected(s)));
  };
  const bool agreed = height && std::abs(*height - expected(scale)) < 0.5 * std::abs(expected(scale));
  const double tolerance = agreed ? agreed_tolerance : height || scale > 1 ? scale_tolerance : slip_tolerance;
  bool scale_wrong = std::abs(scale - 1) > std::max(tolerance, sure * sigma);
  if (scale_wrong && accuse_exchanged_legs(scale, detail_of(scale, sigma, windows, height))) return;
  // The way of a robot that runs, slips or rolls over its soles is not that of its legs, but it stands as high as described.
  const bool slips = scale_wrong && (!explains(scale) || (height && std::abs(*height - expected(scale)) > std::abs(*height)));
  if (slips && windows > 0 && is_no_way_of_legs(scale, sigma)) {
    const std::string way_detail = detail_of(scale, sigma, windows, height);
    if (!accuse_lidar_instead(1 / scale, way_detail)) accuse_leg_joints(way_detail);
    return;
  }
  if (slips) {
    scale = 1;
    scale_wrong = false;
  }
  if (stances_ && !scale_wrong) {
    const double by_stances = 1 / stances_->scale;
    if (explains(by_stances) && std::abs(by_stances - 1) > std::max(stance_tolerance, sure * stances_->scale_sigma)) {
      scale = by_stances;
      scale_wrong = true;
    }
  }
  // A LiDAR that was found elsewhere is known to some centimetres only.
  const bool moved = std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "lidar_position"; });
  const bool height_wrong = height && std::abs(*height) > (moved ? 3 : 1) * leg_height_tolerance;
  const std::string detail = detail_of(scale_wrong ? scale : by_way, sigma, windows, height);
  if (!scale_wrong && !height_wrong) {
    const Check::Verdict verdict = slips ? Check::Verdict::note : Check::Verdict::good;
    check(Sensor::legs, "lengths of the legs", std::isfinite(sigma) ? verdict : Check::Verdict::unknown, detail);
    return;
  }
  // Legs that are too long walk too far and stand too high; an IMU that is too high only stands too high.
  const bool lengths = height_wrong ? (scale - 1) * *height > 0 && std::abs(scale - 1) > 0.02 : true;
  if (lengths && accuse_lidar_instead(1 / scale, detail)) return;
  if (lengths) {
    accuse_leg_lengths(scale, height.value_or(0));
  } else {
    accuse_imu_place(*height);
  }
  diagnosis_.findings.back().evidence = detail;
}

}  // namespace kilvo::lab
