// What a registration says of the map's errors, which the next sweeps will meet again.
#include <algorithm>
#include <cmath>

#include "kilvo/lidar/outer_sum.hpp"
#include "kilvo/lidar/point_to_plane.hpp"

namespace kilvo {
namespace {

// What leaves a plane within one voxel, a picture on a wall, is about as large as half of the voxel: were it smaller, it would not matter,
// and were it larger, it would be the plane.
constexpr double bumps_of_a_plane = 4;

// A point that range noise e carries outwards comes to lie in a cell that is seen at a flatter angle and weighs differently from the one
// that it left: what the rows of a plane say together is off along the normal n by E[w e] / w = sigma^2 (dw / dr) / w, m. `variance`: of
// one point along n. Along the plane a point moves by the sine of its angle of incidence times e, and the range by the same share of that.
double pull_of_noise(const Eigen::Vector3d& n, const Eigen::Vector3d& beam, double variance, const LidarConfig& config) {
  const double range = beam.norm(), cosine = n.dot(beam) / range, sine2 = 1 - cosine * cosine;
  const double range2 = config.range_noise * config.range_noise, angle2 = config.angle_noise * config.angle_noise;
  // On a plane at the distance h the cosine is h / r.
  const double slope = 2 * (angle2 * range - range2 * cosine * cosine / range);
  return -cosine * sine2 * range2 * slope / variance;
}

}  // namespace

PoseCovariance LidarModel::systematic() const {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  std::vector<Vector6> pull_of_plane(rows_of_plane_.size(), Vector6::Zero());  // of its own error on b
  std::vector<OuterRow> rows;                                                  // of bumps, then of the planes' pulls
  rows.reserve(associations_.size());
  Vector6 pull = Vector6::Zero();
  for (std::size_t i = 0; i < associations_.size(); ++i) {
    const Association& a = associations_[i];
    if (a.plane == nullptr) continue;
    pull_of_plane[a.shared] += a.weight * std::sqrt(a.plane_variance) * a.row.J;
    const double alike = std::max(1.0, rows_of_plane_[a.shared] / bumps_of_a_plane);
    rows.emplace_back(a.row.J, alike * a.weight * a.weight * static_cast<double>(a.plane->roughness_variance));
    // A point that is alone in its cell weighs as it does itself.
    const double count = clusters_[i].count, together = 1 - 1 / count;
    pull += a.weight * together * pull_of_noise(a.n_I, clusters_[i].mean.cast<double>() - p_IL_, a.variance * count, config_) * a.row.J;
  }
  OuterSum M;
  M.add(rows.data(), rows.size());
  rows.clear();
  for (const Vector6& of_plane : pull_of_plane) rows.emplace_back(of_plane, 1);
  rows.emplace_back(pull, 1);
  M.add(rows.data(), rows.size());
  const PoseCovariance known = PoseCovariance::Identity() - weak_part(report_.degeneracy);
  return known.transpose() * M.lower().selfadjointView<Eigen::Lower>() * known;
}

std::vector<EpochInformation> LidarModel::by_epoch() const {
  std::vector<std::pair<std::uint32_t, std::vector<OuterRow>>> rows;
  for (const Association& a : associations_) {
    if (a.plane == nullptr) continue;
    auto it = std::ranges::find_if(rows, [&a](const auto& of_epoch) { return of_epoch.first == a.epoch; });
    if (it == rows.end()) it = rows.insert(it, {a.epoch, {}});
    it->second.emplace_back(a.row.J, a.weight);
  }
  std::vector<EpochInformation> out;
  PoseCovariance all = PoseCovariance::Zero();
  for (const auto& [epoch, of_epoch] : rows) {
    OuterSum sum;
    sum.add(of_epoch.data(), of_epoch.size());
    all += out.emplace_back(epoch, sum.lower().selfadjointView<Eigen::Lower>()).A;
  }
  const Degeneracy& d = report_.degeneracy;
  const PoseCovariance known = PoseCovariance::Identity() - weak_part(d);
  const std::array<double, 6> of_all = along_weak(d, all);
  for (EpochInformation& e : out) {
    if (trust_ > 0) {
      std::array<double, 6> share = along_weak(d, e.A);
      for (std::size_t k = 0; k < share.size(); ++k) share[k] = of_all[k] > 0 ? d.taken[k] * share[k] / of_all[k] : 0;
      e.kept = weak_part(d, share);
    }
    e.A = (known.transpose() * e.A * known).eval();
  }
  return out;
}

}  // namespace kilvo
