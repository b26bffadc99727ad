// What may be wrong with a camera by much: its frame, intrinsics of another image, a mount the wrong way round, any rotation, images that
// are late.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr double much_better_images = 0.7;  // of the error that a hypothesis may leave

struct CameraHypothesis {
  std::string cause, text, key;
  CameraMount mount;
  std::vector<Change> changes;
};

std::vector<CameraHypothesis> hypotheses(const CameraMount& m) {
  std::vector<CameraHypothesis> out;
  const auto add = [&](const char* cause, const std::string& text, const std::string& remedy, const CameraMount& mount,
                       std::vector<Change> changes) {
    out.push_back({cause, text, remedy, mount, std::move(changes)});
  };
  CameraMount c = m;
  Eigen::Matrix3d optical;  // of the body frame's axes: x right, y down, z forward
  optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  c.T_imu_camera.R = m.T_imu_camera.R * SO3::nearest(optical);
  add("camera_frame", "the camera's rotation is that of a body frame (x forward), not of an optical one (z forward)",
      "camera.T_imu_camera.R", c, {{"camera.T_imu_camera.R", rotation_text(c.T_imu_camera.R)}});
  c = m;
  c.T_imu_camera.R = m.T_imu_camera.R * SO3::nearest(optical.transpose());
  add("camera_frame", "the camera's rotation has the optical rotation twice", "camera.T_imu_camera.R", c,
      {{"camera.T_imu_camera.R", rotation_text(c.T_imu_camera.R)}});
  c = m;
  c.T_imu_camera = m.T_imu_camera.inverse();
  add("camera_inverted", "the camera's mount is given the wrong way round (camera from IMU)", "camera.T_imu_camera", c,
      {{"camera.T_imu_camera.p", vector_text(c.T_imu_camera.p)}, {"camera.T_imu_camera.R", rotation_text(c.T_imu_camera.R)}});
  c = m;
  std::swap(c.cx, c.cy);
  add("camera_principal_point", "cx and cy of the camera are exchanged", "camera.cx, camera.cy", c,
      {{"camera.cx", number_text(c.cx)}, {"camera.cy", number_text(c.cy)}});
  constexpr double alike = 0.1;  // as focal lengths are
  if (m.cx > 0 && std::abs(m.cy / m.cx - 1) < alike) {
    c = m;
    std::swap(c.fx, c.cx);
    std::swap(c.fy, c.cy);
    add("camera_focal", "fx and fy of the camera are exchanged with cx and cy", "camera.fx, camera.fy, camera.cx, camera.cy", c,
        {{"camera.fx", number_text(c.fx)},
         {"camera.fy", number_text(c.fy)},
         {"camera.cx", number_text(c.cx)},
         {"camera.cy", number_text(c.cy)}});
  }
  for (const double factor : {2.0, 0.5}) {
    c = m;
    c.fx *= factor;
    c.fy *= factor;
    add("camera_focal", fmt::format("the camera's focal length is {} of the right one", factor > 1 ? "half" : "twice"),
        "camera.fx, camera.fy", c, {{"camera.fx", number_text(c.fx)}, {"camera.fy", number_text(c.fy)}});
    c = m;
    c.fx *= factor;
    add("camera_focal", fmt::format("the camera's fx is {} of the right one", factor > 1 ? "half" : "twice"), "camera.fx", c,
        {{"camera.fx", number_text(c.fx)}});
    c = m;
    c.fy *= factor;
    add("camera_focal", fmt::format("the camera's fy is {} of the right one", factor > 1 ? "half" : "twice"), "camera.fy", c,
        {{"camera.fy", number_text(c.fy)}});
  }
  for (const double factor : {2.0, 0.5}) {
    c = m;
    for (double* x : {&c.fx, &c.fy, &c.cx, &c.cy}) *x *= factor;
    add("camera_focal", fmt::format("the camera's intrinsics are those of images of {} the size", factor > 1 ? "half" : "twice"),
        "camera.fx, camera.fy, camera.cx, camera.cy", c,
        {{"camera.fx", number_text(c.fx)},
         {"camera.fy", number_text(c.fy)},
         {"camera.cx", number_text(c.cx)},
         {"camera.cy", number_text(c.cy)}});
  }
  for (const Eigen::Matrix3d& p : signed_permutations()) {
    if (p.determinant() < 0 || p.isApprox(Eigen::Matrix3d::Identity())) continue;
    c = m;
    c.T_imu_camera.R = m.T_imu_camera.R * SO3::nearest(p);
    add("camera_rotation", fmt::format("the camera is turned against its description by {} of the camera", turn_text(SO3::nearest(p))),
        "camera.T_imu_camera.R", c, {{"camera.T_imu_camera.R", rotation_text(c.T_imu_camera.R)}});
  }
  return out;
}

}  // namespace

bool Examination::try_camera_hypotheses(const CameraTracks& tracks) {
  const double described = tracks.error({robot_.camera, 0});
  // How well it can be: small turns, focal length and clock are for the fit.
  std::vector<double> offsets = tracks.likely_offsets(1.3);
  offsets.insert(offsets.begin(), 0);
  // Where places move the image as much as turns do, its motion may not tell: some images late are tried one by one.
  constexpr double bad = 1, farthest = 0.3, step = 0.02;  // px, s
  if (described > bad) {
    for (int k = 1; k * step <= farthest; ++k) offsets.insert(offsets.end(), {k * step, -k * step});
  }
  double best = much_better_images * described;
  const CameraHypothesis* which = nullptr;
  const CameraFit refined = tracks.fit({robot_.camera, 0}, true, true);
  // What a small correction of the description achieves, a hypothesis must surpass.
  if (refined.fit.good && degrees(refined.fit.x.head<3>().norm()) < 15) {
    CameraMount m = robot_.camera;
    m.T_imu_camera.R = refined.R_IC;
    m.fx *= refined.focal;
    m.fy *= refined.focal;
    best = std::min(best, 0.9 * tracks.error({m, refined.offset}));
  }
  double offset = 0;
  for (const double candidate : offsets) {
    if (std::abs(candidate) < 0.05) continue;
    const double error = tracks.error({robot_.camera, candidate});
    if (error >= best) continue;
    best = error;
    offset = candidate;
  }
  const std::vector<CameraHypothesis> all = hypotheses(robot_.camera);
  for (const CameraHypothesis& h : all) {
    const double error = tracks.error({h.mount, 0});
    if (error >= best) continue;
    best = error;
    which = &h;
  }
  const auto evidence_of = [described](double error) {
    return fmt::format("corners of the images are {:.2f} px from their epipolar lines then, {:.2f} px as described", error, described);
  };
  // None of these.
  if (best > bad) {
    CameraMount m = robot_.camera;
    m.T_imu_camera.R = tracks.fit_any_rotation({m, 0}).R_IC;
    if (const double error = tracks.error({m, 0}); error < much_better_images * best) {
      accuse_camera_rotation(m.T_imu_camera.R, evidence_of(error));
      return true;
    }
  }
  const std::string evidence = evidence_of(best);
  if (which != nullptr) {
    const SO3 before = robot_.camera.T_imu_camera.R;
    robot_.camera = which->mount;
    Finding f{Sensor::camera, which->cause, which->text, evidence, which->key, 0, "", which->changes, true};
    f.turn = (robot_.camera.T_imu_camera.R * before.inverse()).Log();
    find(std::move(f));
    return true;
  }
  if (offset == 0) return false;
  const CameraFit fit = tracks.fit({robot_.camera, offset}, false, true);
  find_offset(Sensor::camera, fit.fit.good ? fit.offset : offset, fit.fit.good ? fit.fit.sigma(4) : 0.005, evidence);
  return true;
}

}  // namespace kilvo::lab
