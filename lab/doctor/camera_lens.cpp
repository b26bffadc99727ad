// The camera's lens: principal point, fy against fx, distortion. What is wrong with it looks like a turn of the camera, another focal
// length or another place, and leaves the corners off their epipolar lines.
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <fmt/format.h>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

// Radius at the corner of the image, in focal lengths.
double corner_of(const CameraMount& m) { return std::hypot(m.width / m.fx, m.height / m.fy) / 2; }

double coefficient(const CameraMount& m, std::size_t i) { return i < m.distortion.size() ? m.distortion[i] : 0; }

// What a lens does to the image that another one does not, px.
struct LensChange {
  double principal_point, focal, aspect, distortion;
  LensChange(const CameraMount& was, const CameraMount& is) {
    const double r = corner_of(is), corner = r * is.fx;
    principal_point = std::hypot(is.cx - was.cx, is.cy - was.cy);
    focal = corner * std::abs(std::log(is.fx / was.fx));
    aspect = corner * std::abs(std::log(is.fy / is.fx * was.fx / was.fy));
    const double k1 = coefficient(is, 0) - coefficient(was, 0), k2 = coefficient(is, 1) - coefficient(was, 1);
    distortion = corner * std::abs((k1 + k2 * r * r) * r * r);
  }
};

}  // namespace

// `otherwise`: px, as close as the corners come to their lines without another lens; of that another one must leave less than this `share`.
bool Examination::examine_lens(const CameraTracks& tracks, double otherwise, double share) {
  constexpr std::array causes{"camera_lens", "camera_principal_point", "camera_focal"};
  const auto of_lens = [&](const Finding& f) { return std::ranges::find(causes, f.cause) != causes.end(); };
  if (std::ranges::any_of(diagnosis_.findings, of_lens)) return false;
  const CameraFit fit = tracks.fit_with_lens({robot_.camera, 0});
  if (!fit.fit.good || fit.error > share * otherwise) return false;
  const CameraMount &was = robot_.camera, &is = fit.mount;
  const LensChange change(was, is);
  const double most = std::max({change.principal_point, change.focal, change.aspect, change.distortion});
  Finding f{Sensor::camera, "camera_lens", "", "", "", most, "px", {}, true};
  const std::string k = fmt::format("[{:.4f}]", fmt::join(is.distortion, ", "));
  if (most == change.principal_point) {
    f.cause = "camera_principal_point";
    f.text = fmt::format("the camera's principal point is about ({:.0f}, {:.0f}) px, described as ({:.0f}, {:.0f})", is.cx, is.cy, was.cx,
                         was.cy);
  } else if (most == change.distortion) {
    f.text = fmt::format("the camera's distortion is another one: about {}", k);
  } else {
    f.cause = "camera_focal";
    f.text = fmt::format("the camera's focal lengths are about {:.1f} and {:.1f} px, described as {:.1f} and {:.1f}", is.fx, is.fy, was.fx,
                         was.fy);
  }
  f.evidence = fmt::format(
      "corners of the images are {:.2f} px from their epipolar lines with fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f}, distortion {}; "
      "{:.2f} px with any rotation, place and focal length of the camera",
      fit.error, is.fx, is.fy, is.cx, is.cy, k, otherwise);
  f.remedy = "camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion: those of this lens and this size of image";
  const std::array<std::pair<const char*, double>, 4> numbers{{{"fx", is.fx}, {"fy", is.fy}, {"cx", is.cx}, {"cy", is.cy}}};
  for (const auto& [name, value] : numbers) f.changes.push_back({fmt::format("camera.{}", name), fmt::format("{:.1f}", value)});
  f.changes.push_back({"camera.distortion", k});
  find(std::move(f));
  const SE3 mount = was.T_imu_camera;
  robot_.camera = is;
  robot_.camera.T_imu_camera = mount;
  examine_camera_fit(tracks);
  return true;
}

}  // namespace kilvo::lab
