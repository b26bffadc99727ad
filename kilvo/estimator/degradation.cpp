#include "kilvo/estimator/degradation.hpp"

#include "kilvo/math/decompositions.hpp"

namespace kilvo {

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
  return {{"lidar_ratio", eigenvalue_ratio(points), false},
          {"lidar_share", report.degeneracy.smallest_share, report.degeneracy.weak_count > 0}};
}

std::vector<Indicator> indicators_of(int visual_points, bool carries) {
  return {{"visual_points", static_cast<double>(visual_points), !carries}};
}

}  // namespace kilvo
