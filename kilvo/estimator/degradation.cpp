#include "kilvo/estimator/degradation.hpp"

#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

// A third each would be a sweep that knows all directions equally well.
constexpr double least_share = 0.005;
// A cloud that is a sheet or a line; the information speaks for itself, so this alone degrades only what is next to flat.
constexpr double least_ratio = 1e-4;
// Each says two things, of seven that are looked for.
constexpr int fewest_visual_points = 10;

}  // namespace

double eigenvalue_ratio(std::span<const PointXYZI> points) {
  if (points.size() < 4) return 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  // A share of a large cloud is spread as the whole is.
  constexpr std::size_t enough = 2000;
  const std::size_t step = 1 + points.size() / enough;
  double n = 0;
  for (std::size_t i = 0; i < points.size(); i += step, ++n) {
    const Eigen::Vector3d x = points[i].head<3>().cast<double>();
    sum += x;
    squares += x * x.transpose();
  }
  const Eigen::Matrix3d scatter = squares / n - (sum / n) * (sum / n).transpose();
  const Eigen::Vector3d l = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  return l[2] > 0 ? std::max(0.0, l[0]) / l[2] : 0;
}

std::vector<Indicator> indicators_of(std::span<const PointXYZI> points, const RegistrationReport& report) {
  const double ratio = eigenvalue_ratio(points), share = report.degeneracy.smallest_share;
  return {{"lidar_ratio", ratio, ratio < least_ratio},
          {"lidar_share", share, report.matched > 0 && (report.degeneracy.weak_count > 0 || share < least_share)}};
}

std::vector<Indicator> indicators_of(int visual_points) {
  return {{"visual_points", static_cast<double>(visual_points), visual_points < fewest_visual_points}};
}

}  // namespace kilvo
