// The IMU: its units, its axes, and whether it is what all others disagree with.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <numeric>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double per_degree = 57.29577951308232;
constexpr double rate_tolerance = 0.2;  // of the nominal rate
constexpr std::size_t fewest_stamps = 9;

double median_norm(const std::vector<InertialSample>& imu) {
  std::vector<double> norms;
  for (const InertialSample& s : imu) norms.push_back(s.accel.norm());
  const auto middle = norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2);
  std::ranges::nth_element(norms, middle);
  return *middle;
}

bool is_far_from_one(double scale) { return scale > 1.15 || scale < 0.87; }

// In both halves of the turning, unless it is a unit: sweeps that are registered badly for a while, as those of a runner are, turn too
// little only so long.
bool is_far_throughout(const std::vector<Turn>& turns, const GyroPath& path, double offset) {
  constexpr double unit = 1.5;  // and more
  const double whole = agree(turns, path, offset).scale;
  if (whole > unit || whole < 1 / unit) return true;
  const auto squared = [](double sum, const Turn& turn) { return sum + turn.theta[0].squaredNorm(); };
  const double all = std::accumulate(turns.begin(), turns.end(), 0.0, squared);
  auto middle = turns.begin();
  for (double sum = 0; middle != turns.end() && sum < 0.5 * all; ++middle) sum = squared(sum, *middle);
  const double first = agree({turns.begin(), middle}, path, offset).scale, second = agree({middle, turns.end()}, path, offset).scale;
  return is_far_from_one(first) && is_far_from_one(second) && (first > 1) == (second > 1);
}

bool is_identity(const Eigen::Matrix3d& m) { return m.isApprox(Eigen::Matrix3d::Identity(), 1e-9); }

}  // namespace

void Examination::examine_rates() {
  const auto nominal = rates_of(robot_);
  for (std::size_t i = 0; i < sensor_count; ++i) {
    const StampStatistics& s = recorded_.stamps[i];
    const auto sensor = static_cast<Sensor>(i);
    if (s.count < fewest_stamps || !(s.period > 0) || !(nominal[i] > 0)) continue;
    const double rate = 1 / s.period;
    const std::string measured = fmt::format("{:.1f} Hz, described as {:.1f} Hz", rate, nominal[i]);
    if (std::abs(rate / nominal[i] - 1) < rate_tolerance) {
      check(sensor, "rate", Check::Verdict::good, measured);
      diagnosis_.checks.back().at_rest = true;
      continue;
    }
    const std::string key = std::string(name_of(sensor)) + ".rate", value = fmt::format("{:.0f}", rate);
    find({sensor,
          std::string(name_of(sensor)) + "_rate",
          fmt::format("the {} comes at {}", name_of(sensor), measured),
          fmt::format("median of {} steps between stamps", s.count - 1),
          key + ": " + value,
          rate,
          "Hz",
          {{key, value}},
          false});
  }
}

void Examination::examine_acceleration_unit() {
  const double norm = median_norm(recorded_.imu);
  const std::string evidence = fmt::format("median norm of the acceleration: {:.3f}", norm);
  if (norm > 6.5 && norm < 14) {
    check(Sensor::imu, "unit of the acceleration", Check::Verdict::good, evidence + " m/s^2");
    diagnosis_.checks.back().at_rest = true;
    return;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double mean_norm = 0;
  for (const InertialSample& s : recorded_.imu) {
    mean += s.accel / static_cast<double>(recorded_.imu.size());
    mean_norm += s.accel.norm() / static_cast<double>(recorded_.imu.size());
  }
  // A robot that walks stays upright: what is left of gravity has one direction. What has none is motion alone.
  if (mean.norm() < 0.3 * mean_norm) {
    find({Sensor::imu,
          "accel_gravity",
          "gravity has been taken out of the acceleration",
          fmt::format("{}; the mean vector is {:.3f}", evidence, mean.norm()),
          "the driver must publish what the accelerometer measures, gravity included",
          norm,
          "",
          {},
          true});
    return;
  }
  if (norm > 0.7 && norm < 1.4) {
    accel_axes_ *= gravity;
    find({Sensor::imu,
          "accel_unit",
          "the acceleration is in g, not in m/s^2",
          evidence,
          "the driver should publish m/s^2; the estimator converts g by itself",
          norm,
          "",
          {},
          false});
    return;
  }
  if (!(norm > 0)) return;
  const double thousandths = norm / 1000;
  const bool milli_g = thousandths > 0.7 && thousandths < 1.4;
  accel_axes_ *= gravity / norm;
  find({Sensor::imu,
        "accel_unit",
        milli_g ? "the acceleration is in thousandths of g (or in cm/s^2), not in m/s^2"
                : fmt::format("the acceleration has a wrong unit or scale: gravity measures {:.4g}", norm),
        evidence,
        "the driver must publish m/s^2",
        norm,
        "",
        {},
        true});
}

void Examination::agree_with_gyro() {
  try_gyro_in_degrees();
  if (lidar_.known && is_far_from_one(lidar_.scale) && is_far_throughout(lidar_turns_, gyro(), lidar_.offset)) {
    const bool deg = std::abs(lidar_.scale / per_degree - 1) < 0.15;
    const double factor = deg ? per_degree : lidar_.scale;
    gyro_axes_ /= factor;
    find({Sensor::imu,
          "gyro_unit",
          deg ? std::string("the gyro is in degrees per second, not in rad/s")
              : fmt::format("the gyro measures {:.3g} times the turning", lidar_.scale),
          fmt::format("turning by the gyro against that of the LiDAR's sweeps: {:.2f}", lidar_.scale),
          "the driver must publish rad/s",
          lidar_.scale,
          "",
          {},
          true});
    lidar_ = agreement(lidar_turns_, robot_.lidar.T_imu_lidar.R, 0.8);
  }
  if (recorded_.legs.empty() || robot_.legs.type != "joints") return;
  stepping_ = stepping_of(legs_under(nullptr));
  if (!stepping_.walks()) return;
  leg_turns_ = leg_turns(legs_under(nullptr), turn_interval);
  legs_ = agreement(leg_turns_, robot_.imu.T_link_imu.R.inverse(), 0.5);
  if (lidar_.known || leg_turns_.empty()) return;
  // Without a LiDAR the legs judge the gyro's unit.
  const Eigen::Matrix3d before = gyro_axes_;
  gyro_axes_ = before / per_degree;
  const SenseAgreement in_degrees = agreement(leg_turns_, robot_.imu.T_link_imu.R.inverse(), 0.5);
  if (in_degrees.known && 1 - in_degrees.explained < 0.5 * (1 - legs_.explained)) {
    legs_ = in_degrees;
    accuse_gyro_in_degrees(fmt::format("the legs explain {:.0f} % of its turning then", 100 * in_degrees.explained));
  } else {
    gyro_axes_ = before;
  }
}

void Examination::accuse_imu_axes(const Eigen::Matrix3d& gyro, const Eigen::Matrix3d& accel, const std::string& evidence) {
  Finding f;
  f.sensor = Sensor::imu;
  f.evidence = evidence;
  const bool same = gyro.isApprox(accel, 1e-9);
  f.cause = same && gyro.determinant() > 0 ? "imu_rotated" : "imu_axes";
  if (same && gyro.determinant() > 0) {
    f.text = fmt::format("the IMU's axes are turned against the description by {}", turn_text(SO3::nearest(gyro)));
  } else if (same) {
    f.text = "the IMU's axes are left-handed";
  } else if (is_identity(accel)) {
    f.text = gyro.determinant() < 0 ? "the gyro's axes have a wrong sign (left-handed)" : "the gyro's axes do not fit the accelerometer's";
  } else if (is_identity(gyro)) {
    f.text = accel.determinant() < 0 ? "the accelerometer's axes have a wrong sign (left-handed)"
                                     : "the accelerometer's axes do not fit the gyro's";
  } else {
    f.text = "the axes of gyro and accelerometer differ from the description and from each other";
  }
  f.text += fmt::format(": gyro {}, accelerometer {} would be right", axes_text(gyro), axes_text(accel));
  f.remedy = "the driver must publish both in one right-handed frame; for one that is only turned, the mounts can be turned instead";
  find(std::move(f));
  gyro_axes_ = gyro * gyro_axes_;
  accel_axes_ = accel * accel_axes_;
}

void Examination::settle_axes() {
  if (!lidar_.known) {
    // Feet that roll leave much unexplained in any axes, and a walk that hardly leans or turns fits a mirrored gyro as well: other axes
    // must explain what the described ones cannot.
    constexpr double clearly = 0.5;  // of what is not explained
    if (!legs_.known || !legs_turned() || 1 - legs_.explained > clearly * (1 - legs_.as_described)) return;
    const double better = smaller_by(1 - legs_.explained, 1 - legs_.as_described, independent_turns());
    if (better < sure_among(signed_permutations().size())) return;
    const Eigen::Matrix3d G = nearest_permutation(legs_.error).transpose();
    if (G.determinant() < 0 && !legs_explain_turning(legs_.explained))
      accuse_imu_axes(G, Eigen::Matrix3d::Identity(), "the legs turn as the gyro does only with axes of the other hand");
    return;
  }
  const Eigen::Matrix3d G =
      nearest_permutation(lidar_.error).transpose();  // gyro -> the axes of the description, if the LiDAR's mount is right
  const Eigen::Matrix3d before = gyro_axes_;
  gyro_axes_ = G * before;
  const SO3 R_IL = SO3::nearest(G * lidar_.error * robot_.lidar.T_imu_lidar.R.matrix());
  const TranslationRows rows(first_, recorded_.imu, gyro(), R_IL, lidar_.offset);
  gyro_axes_ = before;
  Eigen::Matrix3d A = G;
  double rms = 0;
  if (const auto as_gyro = rows.fit(G * accel_axes_)) {
    rms = as_gyro->rms;
    // A robust standard deviation of n rows is known to 1 / sqrt(n); wrong axes leave a fifth more than right ones, sweeps being rough.
    const double n = static_cast<double>(rows.size());
    double best = std::min(0.88, 1 - 2.5 / std::sqrt(n)) * as_gyro->rms;
    for (const Eigen::Matrix3d& axes : signed_permutations()) {
      const auto other = rows.fit(axes * accel_axes_);
      if (!other || other->rms >= best) continue;
      best = rms = other->rms;
      A = axes;
    }
  }
  const std::string evidence =
      fmt::format("turning and acceleration of the LiDAR's sweeps against the IMU's ({:.0f} % explained, {:.2f} m/s left)",
                  100 * lidar_.explained, rms);
  if (is_identity(G) && is_identity(A)) {
    check(Sensor::imu, "axes", Check::Verdict::good, evidence);
    return;
  }
  const bool proper = G.determinant() > 0 && A.isApprox(G, 1e-9);
  const bool legs_disagree_too = legs_.known && nearest_permutation(legs_.error).transpose().isApprox(G, 1e-9);
  // Points that are mirrored by M turn by -M and move by M: one fault of the LiDAR, two of the IMU.
  // All three reversed at once is an accelerometer of the other sign.
  const bool mirrored = G.determinant() > 0 && A.isApprox(-G, 1e-9) && !is_identity(G);
  if ((proper || mirrored) && !legs_disagree_too) return;  // the LiDAR's mount: examined next
  accuse_imu_axes(G, A, evidence);
  lidar_ = agreement(lidar_turns_, robot_.lidar.T_imu_lidar.R, 0.8);
  if (!leg_turns_.empty()) legs_ = agreement(leg_turns_, robot_.imu.T_link_imu.R.inverse(), 0.5);
}

// Where every other sense is turned, or early, by the same, it is the IMU that is.
void Examination::blame_imu_for_all() {
  std::vector<Finding>& all = diagnosis_.findings;
  const auto of = [&all](const std::string& cause) { return std::ranges::find(all, cause, &Finding::cause); };
  const auto lidar = of("lidar_rotation"), mount = of("imu_mount_rotation"), camera = of("camera_rotation");
  constexpr double alike = 0.04;  // rad
  if (lidar != all.end() && mount != all.end() && (lidar->turn - mount->turn).norm() < std::max(alike, 0.2 * lidar->turn.norm())) {
    Finding f = *mount;
    f.cause = "imu_rotated";
    f.text = fmt::format("the IMU's axes are turned against the description by {}", turn_text(SO3::Exp(mount->turn)));
    f.evidence = "LiDAR and legs agree with each other and disagree with the IMU by the same rotation";
    f.changes.insert(f.changes.end(), lidar->changes.begin(), lidar->changes.end());
    if (camera != all.end()) f.changes.insert(f.changes.end(), camera->changes.begin(), camera->changes.end());
    std::erase_if(all, [](const Finding& x) {
      return x.cause == "lidar_rotation" || x.cause == "imu_mount_rotation" || x.cause == "camera_rotation";
    });
    all.push_back(f);
  }
  const auto lidar_clock = of("lidar_clock"), leg_clock = of("legs_clock"), camera_clock = of("camera_clock");
  if (lidar_clock == all.end() || (leg_clock == all.end() && camera_clock == all.end())) return;
  const Finding& other = leg_clock != all.end() ? *leg_clock : *camera_clock;
  constexpr double same_time = 0.009;  // s
  if (std::abs(lidar_clock->size - other.size) > same_time) return;
  // Stamps are late by what it takes to make and send a message: sensors that are all late by as little are so each by itself.
  constexpr double usual_delay = 0.008;  // s
  if (lidar_clock->size < 0 && lidar_clock->size > -usual_delay) return;
  // A camera that is off by another time says that it is not the IMU that all are off against.
  constexpr double other_time = 0.003;  // s
  for (const Refinement& r : refinements_) {
    if (r.sensor == Sensor::camera && r.unit == "s" && std::abs(r.change.front() - lidar_clock->size) > other_time) return;
  }
  const double offset = -lidar_clock->size;
  std::erase_if(all, [](const Finding& x) { return x.cause == "lidar_clock" || x.cause == "legs_clock" || x.cause == "camera_clock"; });
  robot_.imu.time_offset = original_.imu.time_offset;
  find_offset(Sensor::imu, offset, 0.001, "the other sensors agree with each other and are off against the IMU by the same time");
}

}  // namespace kilvo::lab
