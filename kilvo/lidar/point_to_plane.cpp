#include "kilvo/lidar/point_to_plane.hpp"

#include <array>
#include <cmath>

#include "kilvo/lidar/outer_sum.hpp"

namespace kilvo {
namespace {

// A cluster thicker than its noise explains lies on two surfaces: its mean lies on neither.
constexpr double thickness_sigmas2 = 6.0;

// By how much such weights make the variance of a Gaussian's mean exceed the inverse of their sum (Huber 1964: E[psi^2] E[w] / E[psi']^2).
constexpr double robust_cost = 1.0094;

// The thickness test needs a few points to say anything.
constexpr float thickness_min_count = 4;

// m/s, of what moves, along its normal: people who walk.
constexpr double moving_speed = 0.5;

// Points looked up at once.
constexpr std::size_t at_once = 256;

// The row of a plane through q_W with the normal n_W = R n_I under the point p_I, which is x_W in the world.
inline PointToPlaneRow row_of(const Eigen::Vector3d& p_I, const Eigen::Vector3d& x_W, const Eigen::Vector3d& n_I,
                              const Eigen::Vector3d& n_W, const Eigen::Vector3d& q_W) {
  PointToPlaneRow row;
  row.r = n_W.dot(x_W - q_W);
  row.J.head<3>() = p_I.cross(n_I);
  row.J.tail<3>() = n_W;
  return row;
}

}  // namespace

PointToPlaneRow point_to_plane(const SE3& T_WI, const Eigen::Vector3d& p_I, const Eigen::Vector3d& n_W, const Eigen::Vector3d& q_W) {
  return row_of(p_I, T_WI * p_I, T_WI.R.matrix().transpose() * n_W, n_W, q_W);
}

LidarModel::LidarModel(const VoxelMap& map, std::span<const PointCluster> clusters, const Eigen::Vector3d& p_IL,
                       const PoseCovariance& common_error, const LidarConfig& config, const Workers& workers, const BlindDirections* blind)
    : map_(map),
      clusters_(clusters),
      p_IL_(p_IL),
      common_error_(common_error),
      config_(config),
      workers_(workers),
      places_(clusters.size()),
      associations_(clusters.size()),
      plane_of_node_(map.node_capacity(), no_index),
      blind_(blind) {
  rows_of_plane_.reserve(clusters.size());
}

// The LiDAR is behind the surface, by more than what may be wrong.
bool LidarModel::is_behind(const VoxelMap::Match& match, const Iterate& at) const {
  if (!match.one_sided) return false;
  const Plane& plane = *match.plane;
  if (plane.distance(at.lidar_W) >= 0) return false;
  const PointToPlaneRow row = point_to_plane(at.T_WI, p_IL_, plane.normal.cast<double>(), plane.centre);
  return row.r * row.r > config_.gate * config_.gate * (plane.variance_at(at.lidar_W) + row.J.dot(at.P * row.J));
}

// How far a surface has moved since the mean of its points was measured: it is less likely to move the longer it has been in one leaf.
void LidarModel::doubt_new_surfaces(double interval) {
  if (!(interval > 0 && map_.moving_share() > 0)) return;
  const double in_leaf = map_.leaf_size() / moving_speed, longest = 30 * in_leaf;  // s
  moved_variance_.reserve(static_cast<std::size_t>(longest / interval) + 1);
  for (double age = interval; age < longest; age += interval) {
    const double moved = 0.5 * moving_speed * age * std::exp(-0.5 * age / in_leaf);
    moved_variance_.push_back(map_.moving_share() * moved * moved);
  }
}

bool LidarModel::accept(const VoxelMap::Match& match, const PointCluster& cluster, const Iterate& at, Association& out) const {
  const Plane& plane = *match.plane;
  const Eigen::Vector3d p_I = cluster.mean.cast<double>();
  const Eigen::Vector3d x_W = at.T_WI * p_I;
  const Eigen::Vector3d n_W = plane.normal.cast<double>();
  const Eigen::Vector3d n_I = at.T_WI.R.matrix().transpose() * n_W;
  const PointToPlaneRow row = row_of(p_I, x_W, n_I, n_W, plane.centre);
  const double sensor = point_noise_along(n_I, p_I - p_IL_, config_);
  const double rough = static_cast<double>(plane.roughness_variance);
  const double variance = sensor / static_cast<double>(cluster.count) + rough;
  const double plane_variance = plane.variance_at(x_W);
  const double gate2 = config_.gate * config_.gate, r2 = row.r * row.r;
  // The pose's uncertainty only widens the gate: it is worked out for the few rows that need it.
  if (r2 > gate2 * (variance + plane_variance) && r2 > gate2 * (variance + plane_variance + row.J.dot(at.P * row.J))) return false;
  if (cluster.count >= thickness_min_count) {
    const Eigen::Vector3f n = n_I.cast<float>();
    const double thickness = static_cast<double>(n.dot(cluster.scatter_matrix() * n) / cluster.count);
    if (thickness > thickness_sigmas2 * (sensor + rough)) return false;
  }
  out.plane = &plane;
  out.node = match.node;
  out.epoch = match.epoch;
  out.variance = variance;
  out.plane_variance = plane_variance;
  out.moved_variance = match.age - 1 < moved_variance_.size() ? moved_variance_[match.age - 1] : 0;
  out.row = row;
  out.n_I = n_I;
  return true;
}

// A cluster that is still in the leaf where the last iterate put it finds the same there.
void LidarModel::look_up_planes(std::size_t first, std::size_t last, const SE3& T_WI) {
  std::array<Eigen::Vector3d, at_once> points;
  std::array<std::size_t, at_once> wanted;
  std::array<VoxelMap::Match, at_once> found;
  std::size_t count = 0;
  for (std::size_t i = first; i < last; ++i) {
    const Eigen::Vector3d x = T_WI * clusters_[i].mean.cast<double>();
    const VoxelKey leaf = map_.leaf_key(x);
    if (!first_ && leaf == places_[i].leaf) continue;
    places_[i].leaf = leaf;
    points[count] = x;
    wanted[count++] = i;
  }
  map_.first_planes({points.data(), count}, {found.data(), count});
  for (std::size_t k = 0; k < count; ++k) places_[wanted[k]].plane = found[k];
}

// False for a cluster that met a surface which it does not lie on. `out` has no plane unless it lies on one.
bool LidarModel::associate(std::size_t i, const Iterate& at, Association& out) const {
  const PointCluster& cluster = clusters_[i];
  out.plane = nullptr;
  const VoxelMap::Match& place = places_[i].plane;
  if (place.plane != nullptr && !is_behind(place, at) && accept(place, cluster, at, out)) return true;
  bool seen = false;
  const auto try_at = [&](const Eigen::Vector3d& x) {
    return map_.visit_planes(x, [&](const VoxelMap::Match& m) {
      if (is_behind(m, at)) return false;
      seen = true;
      return accept(m, cluster, at, out);
    });
  };
  const Eigen::Vector3d x = at.T_WI * cluster.mean.cast<double>();
  // Its own voxels hold a surface. If it is another one, at every depth, it is no business of the neighbours.
  if (place.plane != nullptr && (try_at(x) || seen)) return out.plane != nullptr;
  // Nothing known here yet, or not from this side: the nearest neighbour leaf, across the face that the point is closest to.
  const double leaf = map_.leaf_size();
  Eigen::Vector3d offset;
  for (int k = 0; k < 3; ++k) offset[k] = x[k] - (static_cast<double>(fast_floor(x[k] / leaf)) + 0.5) * leaf;
  int axis = 0;
  offset.cwiseAbs().maxCoeff(&axis);
  Eigen::Vector3d beside = x;
  beside[axis] += offset[axis] > 0 ? leaf : -leaf;
  return try_at(beside) || !seen;
}

void LidarModel::count_rows_of_planes() {
  rows_of_plane_.clear();
  for (Association& a : associations_) {
    if (a.plane == nullptr) continue;
    std::uint32_t& place = plane_of_node_[a.node];
    if (place == no_index) {
      place = static_cast<std::uint32_t>(rows_of_plane_.size());
      rows_of_plane_.push_back(0);
    }
    a.shared = place;
    ++rows_of_plane_[place];
  }
  for (const Association& a : associations_) {
    if (a.plane != nullptr) plane_of_node_[a.node] = no_index;
  }
}

struct LidarModel::Sums {
  PoseCovariance A = PoseCovariance::Zero();  // lower triangles
  PoseCovariance fake = PoseCovariance::Zero();
  PoseCovariance doubted = PoseCovariance::Zero();  // of A, what is not there if new surfaces may move
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  double chi2 = 0;
  int rows = 0;

  Sums& operator+=(const Sums& o) {
    A += o.A;
    fake += o.fake;
    doubted += o.doubted;
    b += o.b;
    chi2 += o.chi2;
    rows += o.rows;
    return *this;
  }
};

// Rows of a block on their way into the sums.
struct LidarModel::Waiting {
  std::array<OuterRow, at_once> rows, doubted;
  std::array<OuterRow, 2 * at_once> fake;
  std::size_t row_count = 0, doubted_count = 0, fake_count = 0;

  Sums added_up() const {
    const auto sum_of = [](const auto& some, std::size_t count) {
      OuterSum sum;
      sum.add(some.data(), count);
      return sum.lower();
    };
    Sums out{sum_of(rows, row_count), sum_of(fake, fake_count), sum_of(doubted, doubted_count)};
    for (const OuterRow& row : std::span(rows).first(row_count)) {
      for (std::size_t k = 0; k < 6; ++k) out.b[static_cast<Eigen::Index>(k)] += row.w * row.r * row.g[k];
      out.chi2 += row.w * row.r * row.r;
    }
    out.rows = static_cast<int>(row_count);
    return out;
  }
};

void LidarModel::add_row(std::size_t i, const SE3& T_WI, Waiting& waiting) {
  Association& a = associations_[i];
  if (a.plane == nullptr) return;
  // k rows of one plane share its error: each carries k times its variance, so that together they average it not at all.
  const double in_common = rows_of_plane_[a.shared];
  const auto weight_with = [&](double plane_variance) {
    const double z = std::abs(a.row.r) / std::sqrt(a.variance + plane_variance);
    return (z > robust_sigmas ? robust_sigmas / z : 1.0) / (robust_cost * (a.variance + in_common * plane_variance));
  };
  a.weight = weight_with(a.plane_variance + (report_.doubts_new ? a.moved_variance : 0));
  waiting.rows[waiting.row_count++] = {a.row.J, a.weight, a.row.r};
  if (!first_) return;
  const double sure = a.moved_variance > 0 ? weight_with(a.plane_variance + a.moved_variance) : a.weight;
  if (sure < a.weight) waiting.doubted[waiting.doubted_count++] = {a.row.J, a.weight - sure};
  const Eigen::Vector3d p_I = clusters_[i].mean.cast<double>();
  const Eigen::Vector3f other_axis = a.plane->normal.cross(a.plane->axis);
  for (const auto& [axis, tilt] : {std::pair(a.plane->axis, a.plane->tilt_variance_1), std::pair(other_axis, a.plane->tilt_variance_2)}) {
    Eigen::Matrix<double, 6, 1> g;
    g.tail<3>() = axis.cast<double>();
    g.head<3>() = p_I.cross(T_WI.R.matrix().transpose() * g.tail<3>());
    waiting.fake[waiting.fake_count++] = {g, sure * static_cast<double>(tilt)};
  }
}

// Whether new surfaces measure much of the direction that the settled ones measure least, and not as much of all directions.
bool LidarModel::only_new_measures_one(const Sums& sums) {
  constexpr double much = 0.3;
  const Eigen::Matrix3d all = PoseCovariance(sums.A.selfadjointView<Eigen::Lower>()).bottomRightCorner<3, 3>(),
                        fresh = PoseCovariance(sums.doubted.selfadjointView<Eigen::Lower>()).bottomRightCorner<3, 3>();
  const Eigen::Vector3d u = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(Eigen::Matrix3d(all - fresh)).eigenvectors().col(0);
  return u.dot(fresh * u) > much * u.dot(all * u) && fresh.trace() < 0.5 * all.trace();
}

LidarModel::Sums LidarModel::sum_rows(const SE3& T_WI) {
  return workers_.sum(associations_.size(), at_once, Sums{}, [&](std::size_t first, std::size_t last) {
    Waiting waiting;
    for (std::size_t i = first; i < last; ++i) add_row(i, T_WI, waiting);
    return waiting.added_up();
  });
}

Information<6> LidarModel::operator()(const State& x, const Covariance& prior) {
  const SE3 T_WI = x.pose();
  const Iterate at{T_WI, prior.topLeftCorner<6, 6>() + common_error_, T_WI * p_IL_};
  report_.clusters = static_cast<int>(clusters_.size());
  report_.rejected = workers_.sum(clusters_.size(), at_once, 0, [&](std::size_t first, std::size_t last) {
    int rejected = 0;
    look_up_planes(first, last, T_WI);
    for (std::size_t i = first; i < last; ++i) rejected += associate(i, at, associations_[i]) ? 0 : 1;
    return rejected;
  });
  count_rows_of_planes();
  Sums sums = sum_rows(T_WI);
  if (std::exchange(first_, false)) {
    report_.information = {(sums.A - sums.doubted).selfadjointView<Eigen::Lower>(), sums.fake.selfadjointView<Eigen::Lower>(),
                           static_cast<int>(rows_of_plane_.size()), T_WI.R.matrix()};
    report_.degeneracy = find_degeneracy(report_.information, config_.weak_share, blind_ != nullptr ? *blind_ : BlindDirections{});
    if (blind_ != nullptr) trust_ = std::max(trust_, blind_->confirmed_with(report_.degeneracy.smallest_share, config_.gate));
    report_.doubts_new = !sums.doubted.isZero(0) && (report_.degeneracy.weak_count > 0 || only_new_measures_one(sums));
    if (report_.doubts_new) sums = sum_rows(T_WI);
  }
  Information<6> info;
  info.columns = {at::R, at::R + 1, at::R + 2, at::p, at::p + 1, at::p + 2};
  info.A = sums.A.selfadjointView<Eigen::Lower>();
  info.b = sums.b;
  info.chi2 = sums.chi2;
  info.rows = sums.rows;
  report_.matched = info.rows;
  report_.chi2_per_row = info.rows > 0 ? info.chi2 / info.rows : 0;
  report_.degeneracy.taken = project_out(report_.degeneracy, prior.topLeftCorner<6, 6>(), trust_, info);
  return info;
}

}  // namespace kilvo
