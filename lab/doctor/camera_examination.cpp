// The camera: size of its images, rotation of its mount, focal length, principal point, clock.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double camera_rotation_tolerance = 2;    // degrees
constexpr double focal_tolerance = 0.06;           // of the focal length
constexpr double camera_clock_tolerance = 0.0045;  // s

Eigen::Vector3d rotation_sigma(const CameraFit& fit) { return {fit.fit.sigma(0), fit.fit.sigma(1), fit.fit.sigma(2)}; }

bool is_turned(const CameraFit& fit) {
  return degrees(fit.fit.x.head<3>().norm()) > std::max(camera_rotation_tolerance, sure * degrees(rotation_sigma(fit).norm()));
}

}  // namespace

void Examination::examine_camera() {
  const auto& stamps = recorded_.stamps[static_cast<std::size_t>(Sensor::camera)];
  if (stamps.count < 10) return;
  CameraMount& m = robot_.camera;
  constexpr double on_the_robot = 3;  // m
  if (m.T_imu_camera.p.norm() > on_the_robot) {
    const Eigen::Vector3d right = 1e-3 * m.T_imu_camera.p;
    find({Sensor::camera,
          "camera_unit",
          fmt::format("the camera's position of {:.0f} m on the IMU is in millimetres", m.T_imu_camera.p.norm()),
          "no robot is as large",
          "camera.T_imu_camera.p: " + vector_text(right),
          m.T_imu_camera.p.norm(),
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
  const Eigen::Vector3d sigma(placed.fit.sigma(5), placed.fit.sigma(6), placed.fit.sigma(7));
  const auto in_metres = [](const Eigen::Vector3d& v) { return fmt::format("({:.3f}, {:.3f}, {:.3f})", v.x(), v.y(), v.z()); };
  const std::string detail =
      fmt::format("measured {} m, standard deviations {}, described {}", in_metres(placed.p_IC), in_metres(sigma), in_metres(described));
  // Along the view the place is known least: on rough walks a right one was 7 cm off, by 6 standard deviations of the scatter.
  constexpr double tolerance = 0.05, sure_of_position = 5, method = 0.03, largest = 0.04;  // m, -, m, m
  bool wrong = false;
  for (int i = 0; i < 3; ++i) wrong |= std::abs(error[i]) > tolerance + sure_of_position * sigma[i];
  if (!wrong) {
    Refinement r = refinement(Sensor::camera, "position of the camera on the IMU", {error.x(), error.y(), error.z()},
                              {sigma.x(), sigma.y(), sigma.z()}, method, largest, "m");
    r.changes = {{"camera.T_imu_camera.p", vector_text(described + r.taken_vector())}};
    refinements_.push_back(std::move(r));
    check(Sensor::camera, "position of the mount", sigma.maxCoeff() > tolerance ? Check::Verdict::unknown : Check::Verdict::good, detail);
    return false;
  }
  const bool found_before = std::ranges::any_of(diagnosis_.findings, [](const Finding& f) { return f.cause == "camera_position"; });
  if (found_before || seems_wrong(Sensor::lidar)) return false;
  if (is_turned(fit) && accuse_principal_point(tracks, fit, placed.error)) return true;
  // The right place brings the corners to their lines (from 0.11 to 0.08 px for 6 cm aside; along the view they hardly tell).
  constexpr double explains = 0.85, farthest = 0.3;  // -, m
  const Eigen::Vector3d view = robot_.camera.T_imu_camera.R * Eigen::Vector3d::UnitZ();
  const double across = (error - view.dot(error) * view).norm();
  if (placed.error > explains * fit.error && accuse_lens(tracks, fit, across > farthest)) return true;
  Eigen::Vector3d right = described;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(error[i]) > tolerance + sure_of_position * sigma[i]) right[i] = std::round(1e3 * placed.p_IC[i]) / 1e3;
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

// Another lens explains the images better than any turn, focal length or place of the camera. `surely`: these cannot be right.
bool Examination::accuse_lens(const CameraTracks& tracks, const CameraFit& fit, bool surely) {
  Finding f{Sensor::camera, "camera_lens", "", "", "camera.model, camera.distortion, camera.fx and camera.fy", 0, "", {}, true};
  f.text = "no place, rotation or focal length of the camera explains the images: its distortion, its model, or fx against fy is wrong";
  f.evidence = fmt::format("corners of the images are {:.2f} px from their epipolar lines at best", fit.error);
  const double enough = 0.7 * fit.error;
  double least = enough;
  const auto attempt = [&](const char* what, auto change) {
    CameraMount m = robot_.camera;
    change(m);
    const CameraFit then = tracks.fit({m, 0}, true, true);
    if (!then.fit.good || then.error >= least) return;
    least = then.error;
    f.text = fmt::format("the camera's lens is described wrongly: {}", what);
    f.evidence = fmt::format("corners of the images are {:.2f} px from their epipolar lines then, {:.2f} px before", then.error, fit.error);
  };
  attempt("the distortion has the wrong signs", [](CameraMount& m) {
    for (double& k : m.distortion) k = -k;
  });
  attempt("it has no such distortion", [](CameraMount& m) { m.distortion.clear(); });
  attempt("fx and fy should be the same", [](CameraMount& m) { m.fy = m.fx; });
  if (least == enough && !surely) return false;
  find(std::move(f));
  return true;
}

// A principal point that is off moves the image as a turn of the camera does, but for its corners. `other`: px, by another explanation.
bool Examination::accuse_principal_point(const CameraTracks& tracks, const CameraFit& fit, double other) {
  const CameraMount& m = robot_.camera;
  const Eigen::Vector3d turn = fit.fit.x.head<3>();
  constexpr double largest_turn = 15;  // degrees
  if (degrees(turn.norm()) >= largest_turn) return false;
  CameraMount best = m;
  double error = 0.97 * std::min(fit.error, other), least = 0.3 * turn.norm();
  for (const double side : {1.0, -1.0}) {
    CameraMount c = m;
    c.cx += side * m.fx * std::tan(turn.y());
    c.cy -= side * m.fy * std::tan(turn.x());
    const CameraFit moved = tracks.fit({c, 0}, true, true);
    if (!moved.fit.good || moved.error > error || moved.fit.x.head<3>().norm() > least) continue;
    const Eigen::Vector3d rest = moved.fit.x.head<3>();
    best = c;
    best.cx += side * m.fx * std::tan(rest.y());
    best.cy -= side * m.fy * std::tan(rest.x());
    error = moved.error;
  }
  if (best.cx == m.cx && best.cy == m.cy) return false;
  const double off = std::hypot(best.cx - m.cx, best.cy - m.cy);
  find({Sensor::camera,
        "camera_principal_point",
        fmt::format("the camera's principal point is about ({:.0f}, {:.0f}) px, described as ({:.0f}, {:.0f})", best.cx, best.cy, m.cx,
                    m.cy),
        fmt::format("corners of the images are {:.2f} px from their epipolar lines then, {:.2f} px with a turned camera", error, fit.error),
        "camera.cx, camera.cy",
        off,
        "px",
        {{"camera.cx", fmt::format("{:.1f}", best.cx)}, {"camera.cy", fmt::format("{:.1f}", best.cy)}},
        true});
  robot_.camera = best;
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
  if (!lidar_way().empty() && placed.fit.good && examine_camera_position(tracks, fit, placed)) return;
  const SO3 before = robot_.camera.T_imu_camera.R;
  constexpr double method = 0.08, focal_method = 0.0025, clock_method = 0.0002;  // degrees, of the focal length, s
  refine_rotation(Sensor::camera, "rotation of the camera on the IMU", before, fit.R_IC, sigma, method, "camera.T_imu_camera.R");
  Refinement r = refinement(Sensor::camera, "focal length", {fit.focal - 1}, {fit.fit.sigma(3)}, focal_method, 0.01, fmt::format("-"));
  r.changes = {{"camera.fx", fmt::format("{:.3f}", (1 + r.taken[0]) * robot_.camera.fx)},
               {"camera.fy", fmt::format("{:.3f}", (1 + r.taken[0]) * robot_.camera.fy)}};
  refinements_.push_back(std::move(r));
  refine_offset(Sensor::camera, fit.offset, fit.fit.sigma(4), clock_method);
  if (is_turned(fit) && accuse_principal_point(tracks, fit, fit.error)) return;
  if (is_turned(fit)) {
    std::erase_if(diagnosis_.findings, [](const Finding& x) { return x.cause == "camera_rotation"; });
    accuse_camera_rotation(fit.R_IC, rotation);
  } else {
    check(Sensor::camera, "rotation of the mount", uncertain > 2 ? Check::Verdict::unknown : Check::Verdict::good, rotation);
  }
  const double focal_sigma = fit.fit.sigma(3);
  const std::string focal = fmt::format("{:.4f} times the described one, standard deviation {:.4f}", fit.focal, focal_sigma);
  const auto holds = [&] {
    if (fit.error >= 0.85 * tracks.fit({robot_.camera, 0}, false, true).error) return false;
    // Of a camera at another place than described the LiDAR's way looks like another focal length.
    return placed.fit.good && std::log(placed.focal) / fit.fit.x[3] > 0.5;
  };
  if (std::abs(fit.fit.x[3]) > std::max(focal_tolerance, sure * focal_sigma) && holds()) {
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
