// The camera: size of its images, rotation of its mount, focal length, principal point, clock.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double camera_rotation_tolerance = 2;    // degrees
constexpr double focal_tolerance = 0.035;          // of the focal length; on rough walks a right one was 2.2 % off
constexpr double camera_clock_tolerance = 0.0045;  // s

Eigen::Vector3d rotation_sigma(const CameraFit& fit) { return {fit.fit.sigma(0), fit.fit.sigma(1), fit.fit.sigma(2)}; }

Eigen::Vector3d position_sigma(const CameraFit& placed) { return {placed.fit.sigma(5), placed.fit.sigma(6), placed.fit.sigma(7)}; }

// How far off the described place is, along the axes along which it is. Along the view the place is known least: on rough walks a right one
// was 7 cm off, by 6 standard deviations of the scatter. The right place brings the corners to their lines.
Eigen::Vector3d off_place(const CameraFit& fit, const CameraFit& placed, const Eigen::Vector3d& described) {
  constexpr double tolerance = 0.05, tolerance_if_explained = 0.03, explained = 0.85, sure_of_position = 5;  // m, m, -, -
  const double least = placed.error < explained * fit.error ? tolerance_if_explained : tolerance;
  Eigen::Vector3d out = placed.p_IC - described;
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(out[i]) > least + sure_of_position * position_sigma(placed)[i])) out[i] = 0;
  }
  return out;
}

bool looks_turned(const CameraFit& fit) {
  return degrees(fit.fit.x.head<3>().norm()) > std::max(camera_rotation_tolerance, sure * degrees(rotation_sigma(fit).norm()));
}

// What is wrong leaves the corners farther from their lines: what is right in its place leaves less than this share of it.
bool explains(const CameraFit& other, const CameraFit& described) {
  constexpr double better = 0.95;
  return !described.fit.good || other.error < better * described.error;
}

}  // namespace

void Examination::examine_camera() {
  const auto& stamps = recorded_.stamps[static_cast<std::size_t>(Sensor::camera)];
  if (stamps.count < 10) return;
  CameraMount& m = robot_.camera;
  constexpr double on_the_robot = 3, nearest = 0.03;  // m
  if (const double length = m.T_imu_camera.p.norm(); length > on_the_robot) {
    const LengthUnit unit = unit_of(length, nearest);
    const Eigen::Vector3d right = unit.metres * m.T_imu_camera.p;
    find({Sensor::camera,
          "camera_unit",
          fmt::format("the camera's position of {:.0f} m on the IMU is in {}", length, unit.name),
          "no robot is as large",
          "camera.T_imu_camera.p: " + vector_text(right),
          length,
          "m",
          {{"camera.T_imu_camera.p", vector_text(right)}},
          true});
    m.T_imu_camera.p = right;
  }
  if (recorded_.image_width != m.width || recorded_.image_height != m.height) {
    const std::string is = fmt::format("{} x {}", recorded_.image_width, recorded_.image_height);
    find({Sensor::camera,
          "camera_size",
          fmt::format("the images are {}, described as {} x {}", is, m.width, m.height),
          "size of the images",
          "camera.width, camera.height (and the intrinsics that belong to them)",
          0,
          "px",
          {{"camera.width", fmt::format("{}", recorded_.image_width)}, {"camera.height", fmt::format("{}", recorded_.image_height)}},
          true});
    m.width = recorded_.image_width;
    m.height = recorded_.image_height;
  }
  const GyroPath path = gyro();
  const LidarWay& way = lidar_way();
  const CameraTracks tracks(recorded_.tracks, path, way.empty() ? nullptr : &way);
  if (tracks.pairs() < 20 || tracks.turning() < 0.05) {
    check(Sensor::camera, "mount, intrinsics, clock", Check::Verdict::unknown,
          fmt::format("{} pairs of images with corners to follow while the robot turned ({:.2f} rad/s)", tracks.pairs(), tracks.turning()));
    return;
  }
  if (try_camera_hypotheses(tracks)) {
    const auto& last = diagnosis_.findings.back();
    if (last.cause != "camera_rotation") return;
  }
  examine_camera_fit(tracks);
}

void Examination::accuse_camera_rotation(const SO3& R_IC, const std::string& evidence) {
  const SO3 before = robot_.camera.T_imu_camera.R;
  Finding f;
  f.sensor = Sensor::camera;
  f.cause = "camera_rotation";
  f.text = fmt::format("the camera is turned against its description by {} of the camera", turn_text(before.inverse() * R_IC));
  f.evidence = evidence;
  f.turn = (R_IC * before.inverse()).Log();
  robot_.camera.T_imu_camera.R = R_IC;
  find_rotation(std::move(f), original_.camera.T_imu_camera.R, R_IC, "camera.T_imu_camera.R");
}

// The camera turns with the robot, and so goes a way of its own. True where the position is wrong, or what looks like that: then the camera
// has been examined.
bool Examination::examine_camera_position(const CameraTracks& tracks, const CameraFit& fit, const CameraFit& placed) {
  const Eigen::Vector3d described = robot_.camera.T_imu_camera.p, error = placed.p_IC - described;
  const Eigen::Vector3d sigma = position_sigma(placed), off = off_place(fit, placed, described);
  const auto in_metres = [](const Eigen::Vector3d& v) { return fmt::format("({:.3f}, {:.3f}, {:.3f})", v.x(), v.y(), v.z()); };
  const std::string detail =
      fmt::format("measured {} m, standard deviations {}, described {}", in_metres(placed.p_IC), in_metres(sigma), in_metres(described));
  if (off.isZero(0)) {
    constexpr double known = 0.05, method = 0.03, largest = 0.04;  // m
    Refinement r = refinement(Sensor::camera, "position of the camera on the IMU", {error.x(), error.y(), error.z()},
                              {sigma.x(), sigma.y(), sigma.z()}, method, largest, "m");
    r.changes = {{"camera.T_imu_camera.p", vector_text(described + r.taken_vector())}};
    refinements_.push_back(std::move(r));
    check(Sensor::camera, "position of the mount", sigma.maxCoeff() > known ? Check::Verdict::unknown : Check::Verdict::good, detail);
    return false;
  }
  const bool found_before = std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "camera_position"; });
  if (found_before || seems_wrong(Sensor::lidar)) return false;
  if (!explains(placed, fit)) {
    check(Sensor::camera, "position of the mount", Check::Verdict::unknown, detail + "; the images fit the described one as well");
    return false;
  }
  Eigen::Vector3d right = described;
  for (int i = 0; i < 3; ++i) {
    if (off[i] != 0) right[i] = std::round(1e3 * placed.p_IC[i]) / 1e3;
  }
  find({Sensor::camera,
        "camera_position",
        fmt::format("the camera is {:.0f} cm from where it is described, {} m off", 100 * error.norm(), in_metres(error)),
        fmt::format("{}; corners of the images are {:.2f} px from their epipolar lines then, {:.2f} px before", detail, placed.error,
                    fit.error),
        "camera.T_imu_camera.p: " + vector_text(right),
        error.norm(),
        "m",
        {{"camera.T_imu_camera.p", vector_text(right)}},
        true});
  robot_.camera.T_imu_camera.p = right;
  examine_camera_fit(tracks);
  return true;
}

void Examination::examine_camera_fit(const CameraTracks& tracks) {
  const CameraFit fit = tracks.fit({robot_.camera, 0}, true, true);
  if (!fit.fit.good) {
    check(Sensor::camera, "mount, intrinsics, clock", Check::Verdict::unknown, "too few tracks");
    return;
  }
  const Eigen::Vector3d sigma = rotation_sigma(fit);
  const double angle = degrees(fit.fit.x.head<3>().norm()), uncertain = degrees(sigma.norm());
  const std::string evidence = fmt::format("corners of the images are {:.2f} px from their epipolar lines", fit.error);
  const std::string rotation =
      fmt::format("{:.2f} degrees from the description, standard deviation {:.2f}; {}", angle, uncertain, evidence);
  if (fit.error > 3) {
    check(Sensor::camera, "mount, intrinsics, clock", Check::Verdict::unknown, rotation);
    return;
  }
  const CameraFit placed = lidar_way().empty() ? fit : tracks.fit_with_position({robot_.camera, 0});
  const double focal_sigma = fit.fit.sigma(3);
  const bool refocused = std::abs(fit.fit.x[3]) > std::max(focal_tolerance, sure * focal_sigma);
  const bool moved = !lidar_way().empty() && placed.fit.good;
  const bool seems_turned = looks_turned(fit), turned = seems_turned && explains(fit, tracks.fit_unturned({robot_.camera, 0}));
  const bool seems_moved = moved && !off_place(fit, placed, robot_.camera.T_imu_camera.p).isZero(0);
  // A camera that is turned or moved leaves 0.98 or more. Where neither explains anything it may be the lens, or nothing.
  const double share = turned || refocused || (seems_moved && explains(placed, fit)) ? 0.95 : 0.85;
  if ((seems_turned || refocused || seems_moved) && examine_lens(tracks, moved ? std::min(fit.error, placed.error) : fit.error, share))
    return;
  if (moved && examine_camera_position(tracks, fit, placed)) return;
  const SO3 before = robot_.camera.T_imu_camera.R;
  constexpr double method = 0.08, focal_method = 0.0025, clock_method = 0.0002;  // degrees, of the focal length, s
  if (turned || !seems_turned)
    refine_rotation(Sensor::camera, "rotation of the camera on the IMU", before, fit.R_IC, sigma, method, "camera.T_imu_camera.R");
  Refinement r = refinement(Sensor::camera, "focal length", {fit.focal - 1}, {fit.fit.sigma(3)}, focal_method, 0.01, fmt::format("-"));
  r.changes = {{"camera.fx", fmt::format("{:.3f}", (1 + r.taken[0]) * robot_.camera.fx)},
               {"camera.fy", fmt::format("{:.3f}", (1 + r.taken[0]) * robot_.camera.fy)}};
  refinements_.push_back(std::move(r));
  refine_offset(Sensor::camera, fit.offset, fit.fit.sigma(4), clock_method);
  if (turned) {
    std::erase_if(diagnosis_.findings, [](const Finding& x) { return x.cause == "camera_rotation"; });
    accuse_camera_rotation(fit.R_IC, rotation);
  } else {
    check(Sensor::camera, "rotation of the mount", uncertain > 2 || seems_turned ? Check::Verdict::unknown : Check::Verdict::good,
          rotation);
  }
  const std::string focal = fmt::format("{:.4f} times the described one, standard deviation {:.4f}", fit.focal, focal_sigma);
  const auto holds = [&] {
    if (fit.error >= 0.85 * tracks.fit({robot_.camera, 0}, false, true).error) return false;
    // Of a camera at another place than described the LiDAR's way looks like another focal length.
    return placed.fit.good && std::log(placed.focal) / fit.fit.x[3] > 0.5;
  };
  if (refocused && holds()) {
    const double fx = fit.focal * robot_.camera.fx, fy = fit.focal * robot_.camera.fy;
    find({Sensor::camera,
          "camera_focal",
          fmt::format("the camera's focal length is {:.1f} px, described as {:.1f} px", fx, robot_.camera.fx),
          focal + "; " + evidence,
          fmt::format("camera.fx: {:.2f}, camera.fy: {:.2f}", fx, fy),
          fit.focal - 1,
          "",
          {{"camera.fx", fmt::format("{:.2f}", fx)}, {"camera.fy", fmt::format("{:.2f}", fy)}},
          true});
  } else {
    check(Sensor::camera, "focal length", focal_sigma > 0.05 ? Check::Verdict::unknown : Check::Verdict::good, focal);
  }
  const double offset_sigma = fit.fit.sigma(4);
  if (std::abs(fit.offset) > std::max(camera_clock_tolerance, sure * offset_sigma)) {
    find_offset(Sensor::camera, fit.offset, offset_sigma, evidence);
  } else {
    check(Sensor::camera, "clock", Check::Verdict::good,
          fmt::format("{:.2f} ms against the IMU, standard deviation {:.2f} ms", 1e3 * fit.offset, 1e3 * offset_sigma));
  }
}

}  // namespace kilvo::lab
