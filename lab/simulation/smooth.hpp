// Curves that a body can follow: smooth to the second derivative, and exactly at rest where they should be.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

namespace kilvo::lab {

/// From 0 (x <= 0) to 1 (x >= 1); first and second derivative are 0 at both ends.
inline double smooth_step(double x) {
  const double u = std::clamp(x, 0.0, 1.0);
  return u * u * u * (10 - 15 * u + 6 * u * u);
}

/// 0 outside (0, 1), 1 in its middle; first and second derivative are 0 at both ends.
inline double smooth_bump(double x) {
  const double u = std::clamp(x, 0.0, 1.0), w = u * (1 - u);
  return 64 * w * w * w;
}

/// A uniform B-spline of degree 5: four times continuously differentiable, exactly constant where six neighbouring control points are
/// equal, exactly linear where they are in line. It does not pass through its control points; it follows them.
template <int N>
class SmoothCurve {
 public:
  using Point = Eigen::Matrix<double, N, 1>;

  /// Control point i acts around the time i * spacing.
  explicit SmoothCurve(double spacing) : spacing_(spacing) {}

  void add(const Point& control) { controls_.push_back(control); }

  /// Before the first and after the last control point the curve stays where they are.
  Point at(double t) const {
    const double x = t / spacing_, whole = std::floor(x), f = x - whole, g = 1 - f, f2 = f * f, g2 = g * g;
    const double weights[] = {g2 * g2 * g / 120,
                              (26 + f * (-50 + f * (20 + f * (20 + f * (-20 + 5 * f))))) / 120,
                              (66 + f2 * (-60 + f2 * (30 - 10 * f))) / 120,
                              (66 + g2 * (-60 + g2 * (30 - 10 * g))) / 120,
                              (26 + g * (-50 + g * (20 + g * (20 + g * (-20 + 5 * g))))) / 120,
                              f2 * f2 * f / 120};
    Point out = Point::Zero();
    const auto last = static_cast<std::ptrdiff_t>(controls_.size()) - 1;
    for (std::ptrdiff_t k = 0; k < 6; ++k) {
      const std::ptrdiff_t i = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(whole) - 2 + k, 0, last);
      out += weights[k] * controls_[static_cast<std::size_t>(i)];
    }
    return out;
  }

 private:
  double spacing_;  // s
  std::vector<Point> controls_;
};

/// The first and second derivative of f at t by central differences of fourth order: exact to a millionth for what moves below 50 Hz.
template <class F>
auto first_derivative(F&& f, double t, double h = 4e-4) {
  return ((f(t - 2 * h) - 8 * f(t - h) + 8 * f(t + h) - f(t + 2 * h)) / (12 * h)).eval();
}
template <class F>
auto second_derivative(F&& f, double t, double h = 4e-4) {
  return ((-f(t - 2 * h) + 16 * f(t - h) - 30 * f(t) + 16 * f(t + h) - f(t + 2 * h)) / (12 * h * h)).eval();
}

}  // namespace kilvo::lab
