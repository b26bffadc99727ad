#include "kilvo/lidar/relocate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "kilvo/filter/update.hpp"

namespace kilvo {
namespace {

// The grid: what a registration starting from its points can reach.
constexpr double step = 0.25, yaw_step = 0.09;                         // m, rad
constexpr int most_steps = 8, most_steps_up = 2, most_steps_yaw = 35;  // all round
// Clusters that are looked up for each pose of a small grid; of a larger one few for each, to choose the best of that number.
constexpr std::size_t probe_count = 160, few_probes = 32, small_grid = 4000;
constexpr std::size_t finalists = 12;
constexpr double near_surface = 0.08, per_metre = 0.02;  // m
// So much of what meets a surface lies on it when the pose is right; a second pose must be worse by a tenth.
constexpr double least_share = 0.75, clearly = 0.1;
constexpr int fewest_rows_found = 60;
constexpr double same_place = 0.15, same_heading = 0.05;

struct Candidate {
  SE3 T_WI;
  double score = 0;
};

struct Probe {
  Eigen::Vector3d p_I;
  double reach;
};

std::vector<Probe> probes_of(std::span<const PointCluster> clusters, std::size_t count) {
  std::vector<Probe> out;
  const std::size_t stride = std::max<std::size_t>(1, clusters.size() / count);
  for (std::size_t i = 0; i < clusters.size(); i += stride) {
    const Eigen::Vector3d p = clusters[i].mean.cast<double>();
    out.push_back({p, near_surface + per_metre * p.norm()});
  }
  return out;
}

double score_of(const VoxelMap& map, std::span<const Probe> probes, const SE3& T_WI) {
  double on = 0;
  for (const Probe& probe : probes) {
    const Eigen::Vector3d x = T_WI * probe.p_I;
    const Plane* plane = map.plane_at(x);
    if (plane == nullptr) continue;
    const double r = std::abs(plane->normal.cast<double>().dot(x - plane->centre)) / probe.reach;
    on += std::max(0.0, 1 - r * r);
  }
  return on / static_cast<double>(std::max<std::size_t>(1, probes.size()));
}

struct Grid {
  std::vector<Candidate> poses;
  bool is_whole = true;  // within three sigmas there is no other
};

Grid grid_around(const Estimate& e) {
  Grid out;
  const auto steps = [&out](double sigma, double size, int most) {
    const int wanted = static_cast<int>(std::ceil(std::max(0.0, 3 * sigma - size / 2) / size));
    out.is_whole = out.is_whole && wanted <= most;
    return std::min(most, wanted);
  };
  const Eigen::Vector3d up_W = -e.x.g.normalized();
  const Eigen::Vector3d sigma = e.P.diagonal().segment<3>(at::p).cwiseMax(0).cwiseSqrt();
  const Eigen::Vector3d up_I = e.x.R.matrix().transpose() * up_W;
  const double sigma_yaw = std::sqrt(std::max(0.0, up_I.dot(e.P.block<3, 3>(at::R, at::R) * up_I)));
  const int nx = steps(sigma.x(), step, most_steps), ny = steps(sigma.y(), step, most_steps), nz = steps(sigma.z(), step, most_steps_up);
  const int nyaw = steps(std::min(sigma_yaw, std::numbers::pi / 3), yaw_step, most_steps_yaw);
  for (int k = -nyaw; k <= nyaw; ++k) {
    const SO3 R = SO3::Exp(k * yaw_step * up_W) * e.x.R;
    for (int i = -nx; i <= nx; ++i) {
      for (int j = -ny; j <= ny; ++j) {
        for (int h = -nz; h <= nz; ++h) out.poses.push_back({{R, e.x.p + step * Eigen::Vector3d(i, j, h)}});
      }
    }
  }
  return out;
}

bool are_alike(const SE3& a, const SE3& b, double place, double heading) {
  return (a.p - b.p).norm() < place && (a.R.inverse() * b.R).Log().norm() < heading;
}

void score(std::span<Candidate> poses, const VoxelMap& map, std::span<const PointCluster> clusters, std::size_t probes) {
  const std::vector<Probe> looked_up = probes_of(clusters, probes);
  for (Candidate& c : poses) c.score = score_of(map, looked_up, c.T_WI);
}

// The best of the grid, no two of them neighbours.
std::vector<Candidate> best_of(std::vector<Candidate> all) {
  std::ranges::stable_sort(all, std::greater{}, &Candidate::score);
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    if (out.size() == finalists) break;
    if (std::ranges::none_of(out, [&c](const Candidate& o) { return are_alike(o.T_WI, c.T_WI, 1.1 * step, 1.1 * yaw_step); })) out.push_back(c);
  }
  return out;
}

// The registration from a pose of the grid: first with wide gates, then with narrow ones, which judge it. `model` makes one.
template <class Model>
FoundPose registered_from(Estimate e, const SE3& T_WI, const Model& model) {
  e.x.R = T_WI.R;
  e.x.p = T_WI.p;
  FoundPose out;
  for (const auto& [position, rotation] : {std::pair(0.2, 0.06), std::pair(0.06, 0.02), std::pair(0.02, 0.006)}) {
    e.P.setZero();
    e.P.diagonal().segment<3>(at::R).array() = rotation * rotation;
    e.P.diagonal().segment<3>(at::p).array() = position * position;
    UpdateConfig patient;
    patient.max_iterations = 10;
    const Covariance gate = e.P;
    LidarModel registration = model(), judge = model();
    e = update(e, registration, patient).posterior;
    out.info = judge(e.x, 0.25 * gate);
    const RegistrationReport& report = judge.report();
    out.share = report.matched < fewest_rows_found ? 0 : static_cast<double>(report.matched) / (report.matched + report.rejected);
  }
  out.x = e.x;
  return out;
}

}  // namespace

bool needs_search(const Covariance& P, const PoseCovariance& known) {
  const PoseCovariance pose = known * P.topLeftCorner<6, 6>() * known.transpose();
  return pose.diagonal().tail<3>().maxCoeff() > well_known_position * well_known_position ||
         pose.diagonal().head<3>().maxCoeff() > well_known_rotation * well_known_rotation;
}

std::optional<FoundPose> find_pose(const VoxelMap& map, std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL,
                                   const Estimate& expected, const LidarConfig& config, const Workers& workers) {
  Grid grid = grid_around(expected);
  if (grid.poses.size() > small_grid) {
    score(grid.poses, map, clusters, few_probes);
    std::ranges::stable_sort(grid.poses, std::greater{}, &Candidate::score);
    grid.poses.resize(small_grid);
  }
  score(grid.poses, map, clusters, probe_count);
  const auto model = [&] { return LidarModel(map, clusters, p_IL, PoseCovariance::Zero(), config, workers); };
  std::vector<FoundPose> found;
  for (const Candidate& c : best_of(std::move(grid.poses))) found.push_back(registered_from(expected, c.T_WI, model));
  // Nearly every point of a sweep that is in its place meets a surface: what met none counts against a pose as well.
  const auto worth = [&clusters](const FoundPose& f) {
    return f.share * std::sqrt(static_cast<double>(f.info.rows) / static_cast<double>(std::max<std::size_t>(1, clusters.size())));
  };
  const auto best = std::ranges::max_element(found, {}, worth);
  // The right place may lie beyond a grid that had to be cut: then a place within has to explain all of the sweep.
  if (best == found.end() || (grid.is_whole ? best->share : worth(*best)) < least_share) return std::nullopt;
  for (const FoundPose& other : found) {
    if (!are_alike(other.x.pose(), best->x.pose(), same_place, same_heading) && worth(other) > (1 - clearly) * worth(*best))
      return std::nullopt;
  }
  return *best;
}

Information<6> information_at(const FoundPose& found, const State& x) {
  Information<6> info = found.info;
  Eigen::Matrix<double, 6, 1> off;
  off << (found.x.R.inverse() * x.R).Log(), x.p - found.x.p;
  info.b = info.A * off;
  info.chi2 = off.dot(info.b);
  return info;
}

}  // namespace kilvo
