#include "kilvo/vision/camera.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace kilvo {
namespace {

constexpr double widest_radius = 100;  // 89.4 degrees: farther from the axis a pinhole camera sees nothing
constexpr int most_iterations = 50;
constexpr double converged = 1e-14;  // of the direction; a step of Newton's method that is as small is the last

void require(bool good, const std::string& what) {
  if (!good) throw std::invalid_argument("camera." + what);
}

void check(const CameraMount& mount, bool fisheye) {
  require(fisheye || mount.model == "pinhole_radtan", "model is '" + mount.model + "', must be pinhole_radtan or equidistant");
  require(mount.width >= 16, "width must be at least 16 pixels");
  require(mount.height >= 16, "height must be at least 16 pixels");
  require(std::isfinite(mount.fx) && mount.fx > 0, "fx must be a positive number of pixels");
  require(std::isfinite(mount.fy) && mount.fy > 0, "fy must be a positive number of pixels");
  require(std::isfinite(mount.cx), "cx must be a number of pixels");
  require(std::isfinite(mount.cy), "cy must be a number of pixels");
  const std::size_t count = mount.distortion.size();
  require(count == 0 || count == 4 || (count == 5 && !fisheye),
          "distortion has " + std::to_string(count) + " coefficients, must have " + (fisheye ? "none or 4" : "none, 4 or 5"));
  require(std::ranges::all_of(mount.distortion, [](double k) { return std::isfinite(k); }), "distortion must be finite numbers");
}

double value_of(const std::vector<double>& polynomial, double x) {  // from the constant up
  double out = 0;
  for (std::size_t i = polynomial.size(); i-- > 0;) out = out * x + polynomial[i];
  return out;
}

/// Where the polynomial changes its sign in (0, end), in order. Between the roots of its derivative it is monotonic: one bisection each.
std::vector<double> roots_of(const std::vector<double>& polynomial, double end) {
  if (polynomial.size() < 2) return {};
  std::vector<double> derivative;
  for (std::size_t i = 1; i < polynomial.size(); ++i) derivative.push_back(static_cast<double>(i) * polynomial[i]);
  std::vector<double> limits = roots_of(derivative, end), out;
  limits.push_back(end);
  double low = 0;
  for (const double limit : limits) {
    double high = limit;
    const bool positive = value_of(polynomial, low) > 0;
    if (positive != (value_of(polynomial, high) > 0)) {
      for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        ((value_of(polynomial, middle) > 0) == positive ? low : high) = middle;
      }
      out.push_back(low);
    }
    low = limit;
  }
  return out;
}

/// How fast the distorted radius grows with the undistorted one, at least, in any direction; as a polynomial of the latter.
std::vector<double> growth_of(const std::array<double, 5>& k, bool fisheye) {
  if (fisheye) return {1, 0, 3 * k[0], 0, 5 * k[1], 0, 7 * k[2], 0, 9 * k[3]};
  // The tangential part moves x by r^2 q + 2 x (q'x), q = (p2, p1): along x at worst by -3 r^2 |q|.
  return {1, -6 * std::hypot(k[2], k[3]), 3 * k[0], 0, 5 * k[1], 0, 7 * k[4]};
}

/// The radial part alone, by the undistorted radius or angle, and its derivative.
struct Radial {
  double value, slope;
};
Radial radial(const std::array<double, 5>& k, bool fisheye, double r) {
  const double s = r * r;
  if (fisheye) {
    return {r * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))), 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])))};
  }
  return {r * (1 + s * (k[0] + s * (k[1] + s * k[4]))), 1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[4]))};
}

/// The radius or angle that becomes `wanted`, between 0 and `largest`: Newton's method, halving where it leaves what is known.
double undistorted(const std::array<double, 5>& k, bool fisheye, double wanted, double largest) {
  double low = 0, high = largest, r = std::min(wanted, largest);
  for (int i = 0; i < most_iterations; ++i) {
    const Radial at = radial(k, fisheye, r);
    (at.value < wanted ? low : high) = r;
    double next = r - (at.value - wanted) / at.slope;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= converged * (1 + r)) return next;
    r = next;
  }
  return r;
}

/// Where a point of the plane z = 1 seems to lie.
Eigen::Vector2d radtan_at(const std::array<double, 5>& k, double x, double y) {
  const double xx = x * x, yy = y * y, xy = x * y, s = xx + yy, scale = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  return {x * scale + 2 * k[2] * xy + k[3] * (s + 2 * xx), y * scale + k[2] * (s + 2 * yy) + 2 * k[3] * xy};
}

/// The same, and the derivative by it.
struct Distorted {
  Eigen::Vector2d at;
  Eigen::Matrix2d J;
};
Distorted radtan(const std::array<double, 5>& k, const Eigen::Vector2d& m) {
  const double x = m.x(), y = m.y(), xx = x * x, yy = y * y, xy = x * y, s = xx + yy;
  const double scale = 1 + s * (k[0] + s * (k[1] + s * k[4])), slope = 2 * (k[0] + s * (2 * k[1] + s * 3 * k[4]));  // d scale / d s * 2
  const double p1 = k[2], p2 = k[3];
  Distorted out;
  out.at = radtan_at(k, x, y);
  const double across = xy * slope + 2 * (p1 * x + p2 * y);
  out.J << scale + xx * slope + 2 * p1 * y + 6 * p2 * x, across, across, scale + yy * slope + 6 * p1 * y + 2 * p2 * x;
  return out;
}

}  // namespace

Camera::Camera(const CameraMount& mount)
    : fisheye_(mount.model == "equidistant"),
      width_(mount.width),
      height_(mount.height),
      fx_(mount.fx),
      fy_(mount.fy),
      cx_(mount.cx),
      cy_(mount.cy) {
  check(mount, fisheye_);
  std::ranges::copy(mount.distortion, k_.begin());
  const double end = fisheye_ ? std::numbers::pi / 2 : widest_radius;
  const std::vector<double> turns = roots_of(growth_of(k_, fisheye_), end);
  largest_ = turns.empty() ? end : turns.front();
  window_ = find_window();
}

Camera::Window Camera::find_window() const {
  Window window;
  constexpr int steps = 16;
  for (int k = 0; k <= steps; ++k) {
    const double u = (width_ - 1) * static_cast<double>(k) / steps, v = (height_ - 1) * static_cast<double>(k) / steps;
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(u, 0), {u, height_ - 1}, {0, v}, {width_ - 1, v}}) {
      const auto ray = unproject(pixel);
      constexpr float all = 1e6F;  // it sees up to a limit of its own: project() decides
      if (!ray) return {-all, all, -all, all};
      const Eigen::Vector2f r = ray->head<2>().cast<float>();
      window = {std::min(window.left, r.x()), std::max(window.right, r.x()), std::min(window.top, r.y()), std::max(window.bottom, r.y())};
    }
  }
  return window;
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& p_C) const {
  const double x = p_C.x(), y = p_C.y(), z = p_C.z();
  if (!(z > 0)) return std::nullopt;
  const double rho = std::sqrt(x * x + y * y);
  const Eigen::Vector2d focal(fx_, fy_), middle(cx_, cy_);
  if (!fisheye_) {
    if (!(rho <= largest_ * z)) return std::nullopt;
    return focal.cwiseProduct(radtan_at(k_, x / z, y / z)) + middle;
  }
  const double angle = std::atan2(rho, z);
  if (!(angle <= largest_)) return std::nullopt;
  const double scale = rho < 1e-8 * z ? 1 / z : radial(k_, true, angle).value / rho;
  return Eigen::Vector2d(fx_ * scale * x + cx_, fy_ * scale * y + cy_);
}

std::optional<Camera::Projection> Camera::project_with_jacobian(const Eigen::Vector3d& p_C) const {
  const double x = p_C.x(), y = p_C.y(), z = p_C.z();
  if (!(z > 0)) return std::nullopt;
  const double rho = std::sqrt(x * x + y * y);
  const Eigen::Vector2d focal(fx_, fy_), middle(cx_, cy_);
  Projection out;
  if (!fisheye_) {
    if (!(rho <= largest_ * z)) return std::nullopt;
    const Distorted seen = radtan(k_, {x / z, y / z});
    out.pixel = focal.cwiseProduct(seen.at) + middle;
    out.J.leftCols<2>() = focal.asDiagonal() * seen.J / z;
    out.J.col(2) = -out.J.leftCols<2>() * Eigen::Vector2d(x / z, y / z);
    return out;
  }
  const double angle = std::atan2(rho, z);
  if (!(angle <= largest_)) return std::nullopt;
  const Radial seen = radial(k_, true, angle);
  const double square = rho * rho + z * z;
  const bool on_axis = rho < 1e-8 * z;
  const double scale = on_axis ? 1 / z : seen.value / rho;                              // pixel = scale (x, y)
  const double by_rho = on_axis ? 0 : (seen.slope * z / square - scale) / (rho * rho);  // d scale / d rho / rho
  out.pixel = {fx_ * scale * x + cx_, fy_ * scale * y + cy_};
  const double by_z = -seen.slope / square;
  out.J << scale + by_rho * x * x, by_rho * x * y, by_z * x, by_rho * x * y, scale + by_rho * y * y, by_z * y;
  out.J = focal.asDiagonal() * out.J.eval();
  return out;
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d seen((pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_);
  const double radius = seen.norm();
  if (!std::isfinite(radius)) return std::nullopt;
  if (radius == 0 && (fisheye_ || (k_[2] == 0 && k_[3] == 0))) return Eigen::Vector3d::UnitZ();
  const double r = undistorted(k_, fisheye_, radius, largest_);
  if (fisheye_) {
    if (radius > radial(k_, true, largest_).value || r >= std::numbers::pi / 2) return std::nullopt;
    return (seen * (std::tan(r) / radius)).homogeneous();
  }
  Eigen::Vector2d m = radius > 0 ? Eigen::Vector2d(seen * (r / radius)) : seen;  // right but for the tangential part
  for (int i = 0; i < most_iterations; ++i) {
    const Distorted now = radtan(k_, m);
    const Eigen::Vector2d step = now.J.inverse() * (now.at - seen);
    m -= step;
    if (!(m.norm() <= largest_ * (1 + 1e-9))) return std::nullopt;
    if (step.norm() <= converged * (1 + m.norm())) return m.homogeneous();
  }
  return std::nullopt;
}

}  // namespace kilvo
