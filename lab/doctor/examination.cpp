#include "lab/doctor/examination.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <fmt/format.h>
#include <functional>

namespace kilvo::lab {

std::string number_text(double x) { return fmt::format("{:.10g}", x + 0.0); }

std::string vector_text(const Eigen::Vector3d& p) {
  return fmt::format("[{}, {}, {}]", number_text(p.x()), number_text(p.y()), number_text(p.z()));
}

std::string rotation_text(const SO3& R) {
  std::array<std::string, 9> x;
  for (int i = 0; i < 9; ++i) {
    const double value = R.matrix()(i / 3, i % 3);
    x[static_cast<std::size_t>(i)] = number_text(std::abs(value) < 1e-12 ? 0.0 : value);
  }
  return fmt::format("[{}]", fmt::join(x, ", "));
}

SO3 turned_by(const SO3& described, const Refinement& r) { return described * SO3::Exp(r.taken_vector() / degrees(1)); }

std::string turn_text(const SO3& turn) {
  const Eigen::Vector3d v = turn.Log();
  const double angle = v.norm();
  Eigen::Index main = 0;
  const Eigen::Vector3d axis = v / std::max(angle, 1e-12);
  axis.cwiseAbs().maxCoeff(&main);
  if (std::abs(axis[main]) > 0.93) {
    const bool half = angle > 3.1;
    return fmt::format("{:.1f} degrees about {}", degrees(angle) * (axis[main] < 0 && !half ? -1 : 1), "xyz"[main]);
  }
  return fmt::format("{:.1f} degrees about ({:.2f}, {:.2f}, {:.2f})", degrees(angle), axis.x(), axis.y(), axis.z());
}

bool Diagnosis::unknown() const {
  // Rates and units are right on a robot that stands still, too.
  return findings.empty() && std::ranges::none_of(checks, [](const Check& c) {
           return (c.verdict == Check::Verdict::good || c.verdict == Check::Verdict::note) && !c.at_rest;
         });
}

void Examination::check(Sensor sensor, const std::string& what, Check::Verdict verdict, const std::string& detail) {
  diagnosis_.checks.push_back({sensor, what, verdict, detail});
}

void Examination::find(Finding finding) {
  check(finding.sensor, finding.cause, Check::Verdict::wrong, finding.text);
  diagnosis_.findings.push_back(std::move(finding));
}

void Examination::find_offset(Sensor sensor, double offset, double sigma, const std::string& evidence) {
  const double right = time_offsets_of(robot_)[index_of(sensor)] + offset;
  const std::string key = std::string(name_of(sensor)) + ".time_offset";
  Finding f{sensor, fmt::format("{}_clock", name_of(sensor)), {}, {}, {}, offset, fmt::format("s"), {}, true};
  const char* side = offset > 0 ? "early" : "late";
  f.text = fmt::format("the stamps of the {} are {:.1f} ms too {} (against the {})", name_of(sensor), 1e3 * std::abs(offset), side,
                       sensor == Sensor::imu ? "other sensors" : "IMU");
  if (sensor == Sensor::lidar && !recorded_.sweeps.empty()) {
    const double span = recorded_.stamps[static_cast<std::size_t>(Sensor::lidar)].period;
    if (recorded_.reading.without_deskew) {
      if (std::abs(offset - 0.5 * span) < 0.1 * span)
        f.text += ", as of clouds that are measured during a sweep: lidar.deskew: true, if their points have times";
    } else if (std::abs(std::abs(offset) - span) < 0.1 * span)
      f.text += fmt::format(
          ": by one sweep; the sweeps are stamped at their {}",
          offset < 0 ? "end, while point times count from the stamp" : "beginning, while point times count back from the stamp");
  }
  f.evidence = fmt::format("{}; {:.1f} ms, standard deviation {:.1f} ms", evidence, 1e3 * offset, 1e3 * sigma);
  f.remedy = fmt::format("{}: {:.4f}", key, right);
  f.changes = {{key, fmt::format("{:.4f}", right)}};
  find(std::move(f));
}

void Examination::find_rotation(Finding f, const SO3& before, const SO3& after, const std::string& key) {
  f.size = degrees((after * before.inverse()).Log().norm());
  f.unit = "deg";
  f.remedy = fmt::format("{}: {}", key, rotation_text(after));
  f.changes.push_back({key, rotation_text(after)});
  find(std::move(f));
}

// `sigma`: rad, in the sensor's frame, in which the change is given as well; `method`: degrees that the method itself may be off by.
void Examination::refine_rotation(Sensor sensor, const std::string& what, const SO3& described, const SO3& measured,
                                  const Eigen::Vector3d& sigma, double method, const std::string& key) {
  constexpr double largest = 0.5;  // degrees
  const Eigen::Vector3d turn = (described.inverse() * measured).Log();
  Refinement r = refinement(sensor, what, {degrees(turn.x()), degrees(turn.y()), degrees(turn.z())},
                            {degrees(sigma.x()), degrees(sigma.y()), degrees(sigma.z())}, method, largest, "deg");
  r.changes = {{key, rotation_text(turned_by(described, r))}};
  refinements_.push_back(std::move(r));
}

void Examination::refine_offset(Sensor sensor, double offset, double sigma, double method) {
  constexpr double largest = 0.002;  // s
  Refinement r = refinement(sensor, fmt::format("clock of the {}", name_of(sensor)), {offset}, {sigma}, method, largest, fmt::format("s"));
  r.changes = {
      {fmt::format("{}.time_offset", name_of(sensor)), fmt::format("{:.5f}", time_offsets_of(original_)[index_of(sensor)] + r.taken[0])}};
  refinements_.push_back(std::move(r));
}

std::vector<InertialSample> Examination::mended_imu() const {
  std::vector<InertialSample> out = recorded_.imu;
  for (InertialSample& s : out) {
    s.gyro = gyro_axes_ * s.gyro;
    s.accel = accel_axes_ * s.accel;
  }
  return out;
}

LidarWay Examination::smoothed_way() const {
  const std::vector<SweepPose> none;
  const TranslationFit fit = translation_.value_or(TranslationFit{});
  SE3 T_IL = robot_.lidar.T_imu_lidar;
  if (lidar_.known) T_IL.R = SO3::nearest(lidar_.error * original_.lidar.T_imu_lidar.R.matrix());
  return {translation_ ? way_ : none, T_IL, lidar_offset_, mended_imu(), gyro(), fit.g_W, fit.ba};
}

SenseAgreement Examination::agreement(const std::vector<Turn>& turns, const SO3& mount, double least_explained) const {
  SenseAgreement out;
  out.present = !turns.empty();
  if (turns.size() < 30 || recorded_.imu.size() < 100) return out;
  const GyroPath path = gyro();
  out.as_described = explained_by(turns, path, 0, mount.matrix());
  TurnAgreement best = agree(turns, path, 0);
  out.weakest = best.weakest;
  out.turning = best.turning;
  constexpr double least_turning = 0.03;  // rad/s
  if (!(best.turning > least_turning)) return out;
  out.turned = true;
  double offset = 0;
  constexpr double clearly = 0.6;  // of what is not explained
  for (const double candidate : likely_offsets(turns, path)) {
    const TurnAgreement other = agree(turns, path, candidate);
    if (1 - other.explained < clearly * (1 - best.explained) && std::abs(candidate) > 0.04) {
      best = other;
      offset = candidate;
    }
  }
  out.scale = best.scale;
  out.offset = offset;
  out.explained = best.explained;
  out.error = best.axes * mount.matrix().transpose();
  out.known = best.explained > least_explained;
  // A tenth of the turning is that of a mount that is 18 degrees off.
  out.agrees = std::abs(offset) < 0.04 && std::abs(best.scale - 1) < 0.2 && 1 - out.as_described < (1 - best.explained) + 0.1;
  return out;
}

Diagnosis Examination::run() {
  examine_rates();
  if (recorded_.imu.size() < 100) {
    check(Sensor::imu, "all", Check::Verdict::unknown, "fewer than 100 IMU samples");
    return diagnosis_;
  }
  examine_acceleration_unit();
  for (const auto half : {&InertialSample::gyro, &InertialSample::accel}) examine_frozen_axes(half);
  register_sweeps();
  agree_with_gyro();
  settle_axes();
  examine_lidar();
  lidar_way_ = smoothed_way();
  examine_legs();
  settle_joint_speeds();
  examine_upright();
  examine_camera();
  blame_imu_for_all();
  suspect_locked_joints();
  const bool legs = recorded_.legs.size() >= 100 && robot_.legs.type == "joints";
  const bool open = std::ranges::any_of(diagnosis_.seems_wrong, std::identity());
  // Where no LiDAR's way tells whether the soles stand, their acceleration does.
  const bool accelerated = !lidar_way().empty() || leg_acceleration_.rows > 0;
  const bool sweeps = recorded_.sweeps.size() >= 30;
  diagnosis_.settled = !open && (legs || sweeps) && (!sweeps || lidar_.known) && (!legs || (legs_.known && legs_turned() && accelerated));
  return diagnosis_;
}

}  // namespace kilvo::lab
