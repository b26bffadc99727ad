#include "kilvo/vision/photometric.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/vision/brightness.hpp"

namespace kilvo {
namespace {

// An expected error of so many pixels is within reach of the finest level; twice that of the next.
constexpr double reach = 0.7;

// The plane may have been found to lie elsewhere since the observation was made: its patch shows what lies on its own ray.
Eigen::Vector3d on_own_ray(const Camera& camera, const Observation& o, const VisualFrame& frame, const VisualPoint& point) {
  const auto ray = camera.unproject(o.pixel.cast<double>());
  if (!ray) return point.p_W;
  const SE3 T_WR = frame.T_CW.inverse();
  const Eigen::Vector3d d = T_WR.R * *ray, n = point.normal_W.cast<double>();
  const double slope = n.dot(d);
  constexpr double near = 0.1;  // m
  if (std::abs(slope) < grazing * d.norm()) return point.p_W;
  const Eigen::Vector3d p_W = T_WR.p + d * (n.dot(point.p_W - T_WR.p) / slope);
  return (p_W - point.p_W).norm() < near ? p_W : point.p_W;
}

}  // namespace

std::optional<PatchView> view_of(const Camera& camera, const SE3& T_CI, const SE3& T_WI, const Eigen::Vector3d& p_W) {
  const Eigen::Matrix3d R_IW = T_WI.R.matrix().transpose();
  const Eigen::Vector3d p_I = R_IW * (p_W - T_WI.p);
  const auto seen = camera.project_with_jacobian(T_CI * p_I);
  if (!seen) return std::nullopt;
  PatchView out;
  out.pixel = seen->pixel;
  const Eigen::Matrix<double, 2, 3> J_I = seen->J * T_CI.R.matrix();
  out.J_point = J_I * R_IW;
  out.J.leftCols<3>() = J_I * skew(p_I);
  out.J.rightCols<3>() = -out.J_point;
  return out;
}

PhotometricModel::PhotometricModel(const VisualMap& map, const Camera& camera, const SE3& T_CI, std::span<const GreyImage> pyramid,
                                   std::span<const PatchCandidate> tracks, const Estimate& prior, const VisionConfig& config)
    : map_(map),
      camera_(camera),
      at_{T_CI, prior.x.pose()},
      pyramid_(pyramid),
      tracks_(tracks),
      config_(config),
      prepared_(tracks.size()),
      verdicts_(tracks.size()) {
  std::map<std::uint32_t, int> patches_of_node;
  for (const PatchCandidate& t : tracks) ++patches_of_node[map.point(t.point).node];
  const PoseCovariance P = prior.P.topLeftCorner<6, 6>();
  std::vector<double> spread2;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const VisualPoint& point = map.point(tracks[i].point);
    const Observation& o = map.observation(tracks[i].observation);
    const VisualFrame& frame = map.frame(o.frame);
    Prepared& p = prepared_[i];
    p.p_W = tracks[i].observation == point.observations[0] ? point.p_W : on_own_ray(camera, o, frame, point);
    p.tau = frame.tau;
    p.frame = o.frame;
    p.plain = tracks[i].plain;
    if (!p.plain) ++report_.tracks;
    p.depth_variance = static_cast<double>(point.variance) * patches_of_node[point.node];
    const Eigen::Vector3d ray = point.p_W + frame.T_CW.R.inverse() * frame.T_CW.p;
    p.slide_W = ray / point.normal_W.cast<double>().dot(ray);
    p.first_view = view_of(camera, T_CI, at_.prior, p.p_W);
    if (p.first_view) spread2.push_back((p.first_view->J * P * p.first_view->J.transpose()).trace());
  }
  const double spread = spread2.empty() ? 0 : std::sqrt(median_of(std::move(spread2)));
  int coarsest = 0;
  while (coarsest + 1 < std::min<int>(Patch::levels, static_cast<int>(pyramid.size())) && spread > reach * (1 << coarsest)) ++coarsest;
  for (int level = coarsest; level >= 0; --level) schedule_.push_back(level);
  prepare(schedule_.front());
}

void PhotometricModel::prepare(int level) {
  if (level == level_) return;
  level_ = level;
  for (std::size_t i = 0; i < tracks_.size(); ++i)
    prepared_[i].patch = warp(map_.observation(tracks_[i].observation), tracks_[i].warp, level);
}

PhotometricModel::Part PhotometricModel::evaluate(std::size_t i, const State& x) {
  Part out;
  const Prepared& p = prepared_[i];
  Verdict& verdict = verdicts_[i];
  verdict = {};
  if (!p.patch || p.plain) return out;
  const auto view = begins_at(x) ? p.first_view : view_of(camera_, at_.T_CI, x.pose(), p.p_W);
  if (!view) return out;
  const GreyImage& image = pyramid_[static_cast<std::size_t>(level_)];
  const Eigen::Vector2d at = at_level(view->pixel, level_);
  const double border = border_at(0);  // in pixels of this level
  if (at.x() < border || at.y() < border || at.x() > image.width - 1 - border || at.y() > image.height - 1 - border) return out;
  Values seen;
  sample_patch(image, at.cast<float>(), seen);
  verdict.correlation = correlation(seen, p.patch->value);
  const auto brightness = static_cast<double>(mean_of(p.patch->value));
  const auto pixel_variance = [&](double tau, double grey) {
    return tau * tau * (config_.read_noise * config_.read_noise + config_.shot_noise * grey);
  };
  out.expected_variance = pixel_variance(x.tau, brightness * p.tau / x.tau) + pixel_variance(p.tau, brightness);
  const double bias = config_.bias_share * p.tau * brightness + 1e-3;
  out.bias_variance = bias * bias;
  out.brightness = std::log(p.tau * std::max(1.0, brightness) / static_cast<double>(std::max(1.0F, mean_of(seen))));
  out.view = *view;
  out.sums = sums_of(*p.patch, seen, x.tau, p.tau);
  verdict.looked = !out.sums.saturated;
  out.valid = !out.sums.saturated && static_cast<double>(verdict.correlation) > config_.min_correlation;
  return out;
}

std::optional<PhotometricModel::Found> PhotometricModel::find(const Eigen::Matrix3d& M, const Eigen::Vector3d& b,
                                                              const Eigen::Matrix2d& shift) {
  if (!(M(2, 2) > 0)) return std::nullopt;
  const Eigen::Matrix2d A = M.topLeftCorner<2, 2>() - M.topRightCorner<2, 1>() * M.bottomLeftCorner<1, 2>() / M(2, 2);
  if (!(A.determinant() > 0)) return std::nullopt;
  const Eigen::Matrix2d inverse = A.inverse();
  return Found{inverse * (b.head<2>() - M.topRightCorner<2, 1>() * b[2] / M(2, 2)), inverse + shift};
}

void PhotometricModel::note_turn(std::uint32_t frame, const Part& part, const Found& found) {
  constexpr double most = 6;  // px; farther, the patch has hardly been found
  if (found.displacement.squaredNorm() > most * most) return;
  auto turn = std::ranges::find_if(turns_, [frame](const ImageTurn& t) { return t.frame == frame; });
  if (turn == turns_.end()) turn = turns_.insert(turns_.end(), ImageTurn{frame, Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero()});
  const Eigen::Matrix<double, 3, 2> JW = part.view.J.leftCols<3>().transpose() * found.variance.inverse();
  turn->A += JW * part.view.J.leftCols<3>();
  // r = I(u) - T: what the image shows at u lies `displacement` beyond its place, so the body must turn by the opposite.
  turn->b -= JW * found.displacement;
}

PhotometricModel::Group& PhotometricModel::group_of(std::uint32_t frame, const State& x, const Covariance& prior) {
  const auto known = std::ranges::find_if(groups_, [frame](const Group& g) { return g.frame == frame; });
  if (known != groups_.end()) return *known;
  Group group;
  group.frame = frame;
  const PoseCovariance G = from_origin(x.pose());
  group.P = prior.topLeftCorner<6, 6>() + G * map_.frame(frame).noise.topLeftCorner<6, 6>() * G.transpose();
  groups_.push_back(group);
  return groups_.back();
}

void PhotometricModel::add(std::size_t i, const Part& part, double scale2, const State& x, const Covariance& prior) {
  const Prepared& p = prepared_[i];
  const double zoom = 1.0 / (1 << level_);
  // A patch that differs more than the others do is worse than they are.
  const double variance = std::max(scale2 * part.expected_variance, part.sums.mean_square);
  Eigen::Matrix3d M = part.sums.A / variance;
  Eigen::Vector3d b = part.sums.b / variance;
  // From pixels of the level to those of level 0.
  const Eigen::Vector3d unit(zoom, zoom, 1);
  M = (unit.asDiagonal() * M * unit.asDiagonal()).eval();
  b = unit.cwiseProduct(b).eval();
  const Eigen::Vector2d slide = part.view.J_point * p.slide_W;
  Eigen::Matrix2d shift = p.depth_variance * slide * slide.transpose();
  shift.diagonal().array() += config_.pixel_error * config_.pixel_error;
  Group& group = group_of(p.frame, x, prior);
  const auto found = find(M, b, shift);
  if (!found) return;
  if (call_ == 1) note_turn(p.frame, part, *found);
  // A patch that is found farther from its place than pose, depth and frame explain is something else that looks alike.
  const Eigen::Matrix2d S = found->variance + part.view.J * group.P * part.view.J.transpose();
  if (found->displacement.dot(S.inverse() * found->displacement) > config_.gate * config_.gate) {
    verdicts_[i].moved = true;
    ++report_.moved;
    return;
  }
  // Noise of the patch's place: (I + M V)^-1 M.
  Eigen::Matrix3d common = Eigen::Matrix3d::Identity();
  common.leftCols<2>() += M.leftCols<2>() * shift;
  const Eigen::Matrix3d inverse = common.inverse();
  M = (inverse * M).eval();
  M = (0.5 * (M + M.transpose())).eval();
  b = (inverse * b).eval();
  const double z = M.determinant() > 0 ? std::sqrt(b.dot(M.inverse() * b) / 2) : 0;
  const double weight = z > robust_sigmas ? robust_sigmas / z : 1;
  Eigen::Matrix<double, 3, 7> J = Eigen::Matrix<double, 3, 7>::Zero();
  J.topLeftCorner<2, 6>() = part.view.J;
  J(2, 6) = 1;
  const Eigen::Matrix<double, 7, 3> JM = weight * J.transpose() * M;
  group.info.A.noalias() += JM * J;
  group.info.b.noalias() += weight * J.transpose() * b;
  group.info.chi2 += weight * z * z * 2;
  ++group.info.rows;
  verdicts_[i].used = true;
}

Information<7> PhotometricModel::operator()(const State& x, const Covariance& prior) {
  prepare(schedule_[std::min(call_++, schedule_.size() - 1)]);
  report_.used = report_.moved = report_.unlike = report_.saturated = 0;
  std::vector<Part> parts(tracks_.size());
  std::vector<double> ratios, brightness;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    parts[i] = evaluate(i, x);
    if (parts[i].valid) {
      ratios.push_back(parts[i].sums.mean_square / parts[i].expected_variance);
      brightness.push_back(parts[i].brightness);
    }
    if (parts[i].sums.saturated) ++report_.saturated;
    if (!parts[i].valid && prepared_[i].patch && !prepared_[i].plain && !parts[i].sums.saturated) ++report_.unlike;
  }
  // Noise of the pixels beyond the settings, of the whole image.
  const double scale2 = ratios.empty() ? 1 : std::max(1.0, median_of(std::move(ratios)));
  report_.noise = std::sqrt(scale2);
  groups_.clear();
  const Brightness common = brightness.empty() ? Brightness{} : brightness_of(std::move(brightness));
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!parts[i].valid) continue;
    parts[i].sums.allow(common.doubt(parts[i].brightness) * parts[i].bias_variance, parts[i].expected_variance);
    add(i, parts[i], scale2, x, prior);
  }
  Information<7> total;
  total.columns = {at::R, at::R + 1, at::R + 2, at::p, at::p + 1, at::p + 2, at::tau};
  by_frame_.clear();
  Eigen::Matrix<double, 7, 7> G = Eigen::Matrix<double, 7, 7>::Identity();
  G.topLeftCorner<6, 6>() = from_origin(x.pose());
  for (Group& group : groups_) {
    const VisualFrame& frame = map_.frame(group.frame);
    // The exposure of the frame scales its measurement of this one's.
    G(6, 6) = x.tau / frame.tau;
    add_common_noise<7>(G * frame.noise * G.transpose(), group.info);
    total.A += group.info.A;
    total.b += group.info.b;
    total.chi2 += group.info.chi2;
    total.rows += group.info.rows;
    by_frame_.push_back({group.frame, group.info.A.block<3, 3>(3, 3).trace()});
  }
  report_.used = total.rows;
  return total;
}

}  // namespace kilvo
