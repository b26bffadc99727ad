#include "kilvo/vision/visual_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/filter/pose_error.hpp"
#include "kilvo/filter/update.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/vision/depth_view.hpp"
#include "kilvo/vision/new_points.hpp"
#include "kilvo/vision/photometric.hpp"
#include "kilvo/vision/select_patches.hpp"

namespace kilvo {
namespace {

// So many patches hold a pose by themselves; of those that should be seen, one in so many is found.
constexpr int enough = 20, one_in = 5;
constexpr double usual_depth = 3;  // m, of patches

// Fewer patches, or a smaller share of those that should be seen, may fit anywhere.
bool measures_pose(const PhotometricModel::Report& report) {
  constexpr int fewest = 10;
  return report.used >= fewest && one_in * report.used >= report.tracks - report.saturated;
}

// A camera of which most patches are missed is described wrongly, or sees another world.
bool finds_most(const PhotometricModel::Report& report) { return 2 * report.used >= report.tracks - report.saturated; }

bool is_new_view(const PatchCandidate& track) {
  const double octaves = 0.5 * std::abs(std::log2(std::max(1e-6, std::abs(track.warp.A.determinant()))));
  return octaves > alike_scale || track.view_angle > alike_angle;
}

// The visual correction of the pose is applied to new patches only along directions that the LiDAR does not measure. Elsewhere patches are
// kept where the LiDAR's map has them: else two maps would come to be, each true to itself, whose rays and planes no longer meet.
SE3 as_the_map_has_it(const State& before, const State& after, const PoseCovariance& weak) {
  const Eigen::Matrix<double, 6, 1> change = weak * boxminus(after, before).head<6>();
  return {before.R * SO3::Exp(change.head<3>()), before.p + change.tail<3>()};
}

}  // namespace

// Of one image, from measure() to learn(). The model keeps references to the others.
struct VisualPipeline::Work {
  Work(const VisualPipeline& p, const CameraImage& of, const ImageContext& in)
      : image(of),
        context(in),
        T_CI(in.prior.t == of.t ? p.errors_.T_CI() : p.errors_.T_CI() * in.T_image.inverse() * in.T_prior),
        pyramid(pyramid_of(to_grey(of.image), Patch::levels)),
        depth(p.camera_, T_CI * in.prior.x.pose().inverse(), p.seen_W_),
        tracks(select_patches(p.map_, p.camera_, T_CI * in.prior.x.pose().inverse(), depth, p.config_)),
        model(p.map_, p.camera_, T_CI, pyramid, tracks, p.errors_.with_turn(in.prior), p.config_),
        prior(in.prior),
        omega(in.gyro - in.prior.x.bg) {}

  const CameraImage& image;
  ImageContext context;
  SE3 T_CI;
  std::vector<GreyImage> pyramid;
  DepthView depth;
  std::vector<PatchCandidate> tracks;
  PhotometricModel model;
  Estimate prior;  // with the exposure that the image has
  Estimate posterior;
  Information<7> info;  // of the last evaluation, and where that was
  State at;
  Eigen::Vector3d omega;  // of the body, rad/s
};

VisualPipeline::VisualPipeline(const CameraMount& mount, const VisionConfig& config, const VisualMapConfig& map, const UpdateConfig& update,
                               double map_radius)
    : mount_(mount), config_(config), update_(update), map_radius_(map_radius), camera_(mount), map_(map), errors_(mount.T_imu_camera) {}
VisualPipeline::VisualPipeline(VisualPipeline&&) noexcept = default;
VisualPipeline& VisualPipeline::operator=(VisualPipeline&&) noexcept = default;
VisualPipeline::~VisualPipeline() = default;

std::optional<VisualPipeline::Fault> VisualPipeline::fault_of(const CameraImage& image) {
  const Image& picture = image.image;
  if (picture.width != mount_.width || picture.height != mount_.height) {
    if (std::exchange(size_is_reported_, true)) return Fault{Reason::image_size, {}};
    const auto size = [](int width, int height) { return std::to_string(width) + " x " + std::to_string(height); };
    return Fault{Reason::image_size, size(picture.width, picture.height) + " pixels cannot be used: camera.width and camera.height say " +
                                         size(mount_.width, mount_.height)};
  }
  if (picture.channels != 1 && picture.channels != 3) return Fault{Reason::image_channels, {}};
  const std::size_t values =
      static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * static_cast<std::size_t>(picture.channels);
  return picture.pixels.size() == values ? std::nullopt : std::optional(Fault{Reason::image_cut, {}});
}

std::optional<Reason> VisualPipeline::refuses(Time image) const {
  if (errors_.refuses(image)) return Reason::mount_doubted;
  if (image < begins_at_) return Reason::before_motion;
  if (seen_W_.empty()) return Reason::before_sweep;
  return std::nullopt;
}

VisualRegistration VisualPipeline::measure(const CameraImage& image, const ImageContext& context) {
  VisualRegistration out;
  out.posterior = context.prior;
  work_.reset();
  if (is_lost_among_patches(context)) {
    out.refused = Reason::pose_uncertain;
    return out;
  }
  auto work = std::make_unique<Work>(*this, image, context);
  adapt_exposure(*work);
  work->posterior = update_by(*work);
  const PhotometricModel& model = work->model;
  if (!is_plausible(work->posterior) || !is_definite(work->posterior.P)) {
    out.posterior = work->posterior;
    out.refused = Reason::not_finite;
    return out;
  }
  // Along what no sweep holds an error of the position would look like one of the camera.
  const bool held = context.prior.t == image.t && context.unobservable.isZero(0);
  if (held) learn_errors(*work);
  if (const auto turned = held ? errors_.judge(image.t) : std::nullopt) {
    // Its patches lie where the wrong mount put them.
    forget_map();
    out.turned = *turned;
    out.refused = Reason::mount_doubted;
    return out;
  }
  if (says_nothing(*work)) {
    out.refused = Reason::agrees_with_nothing;
    return out;
  }
  out.used = model.report().used;
  const bool measured = measures_pose(model.report());
  if (!measured) work->posterior = work->prior;
  out.carries = measured && finds_most(model.report());
  out.posterior = work->posterior;
  out.T_WI = as_the_map_has_it(work->prior.x, out.posterior.x, context.unobservable);
  if (!context.unobservable.isZero(0) && !context.feet_hold && measured) out.drift = views_of(*work, out.posterior.x.p);
  work_ = std::move(work);
  return out;
}

// Lamps are switched and exposures jump: the exposure comes from the image alone, not from the prior.
void VisualPipeline::adapt_exposure(Work& work) const {
  Estimate& prior = work.prior;
  const auto exposure = config_.adapt_exposure ? work.model.exposure_at(prior.x) : std::nullopt;
  if (!exposure) return;
  prior.x.tau = std::exp(exposure->log);
  const double unsure = exposure->sigma * prior.x.tau;
  prior.P.row(at::tau).setZero();
  prior.P.col(at::tau).setZero();
  prior.P(at::tau, at::tau) = unsure * unsure;
}

Estimate VisualPipeline::update_by(Work& work) {
  if (work.tracks.empty()) return work.prior;
  UpdateConfig config = update_;
  config.min_iterations = work.model.iterations();
  config.max_iterations = std::max(config.max_iterations, work.model.iterations() + 2);
  auto measured = [&, first = true](const State& x, const Covariance& P) mutable {
    Information<7> info = work.model(x, errors_.with_turn({work.prior.t, x, P}).P);
    Eigen::Matrix<double, 7, 7> common = Eigen::Matrix<double, 7, 7>::Zero();
    common.topLeftCorner<3, 3>().diagonal().setConstant(errors_.turn_variance());
    if (!common.isZero(0)) add_common_noise<7>(common, info);
    if (std::exchange(first, false) && work.model.report().used >= enough) errors_.excess().add(normalised_innovation(info, P));
    work.info = info;
    work.at = x;
    info.A /= errors_.excess().variance();
    info.b /= errors_.excess().variance();
    common.setZero();
    common.topLeftCorner<6, 6>() = doubt_of_way(work, x.pose());
    if (!common.isZero(0)) add_common_noise<7>(common, info);
    return info;
  };
  return update(work.prior, measured, config).posterior;
}

// What the image shows against the prior: turns at the first evaluation, the way along its own direction at the last.
void VisualPipeline::learn_errors(const Work& work) {
  const Covariance& P = work.prior.P;
  const double turned = P.topLeftCorner<3, 3>().trace(), moved = P.block<3, 3>(at::p, at::p).trace();
  errors_.add_turns({work.prior.x.R, work.omega}, map_, work.model.turns(), 2 * (turned + moved / (usual_depth * usual_depth)));
  if (!measures_pose(work.model.report())) return;
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  for (const EarlierView& view : views_of(work, work.at.p)) way += view.weight * view.way;
  errors_.add_way(work.info, work.at, work.prior, way);
}

// Patches are found within some pixels of where they are expected. Along what the LiDAR does not measure the position is from the images:
// it may be uncertain, and new patches are begun there.
bool VisualPipeline::is_lost_among_patches(const ImageContext& context) const {
  constexpr double reach = 8;  // px
  const PoseCovariance known = PoseCovariance::Identity() - context.unobservable;
  const PoseCovariance P = known * context.prior.P.topLeftCorner<6, 6>() * known.transpose();
  const double turned = P.topLeftCorner<3, 3>().trace(), moved = P.bottomRightCorner<3, 3>().trace();
  return mount_.fx * std::sqrt(std::max(0.0, turned + moved / (usual_depth * usual_depth))) > reach;
}

// An image that hardly any of many patches is found in is dark, covered, torn, or of another world: the map learns nothing from it, unless
// that goes on, for then the world has changed.
bool VisualPipeline::says_nothing(const Work& work) {
  constexpr int patient = 20;  // images
  const PhotometricModel::Report& report = work.model.report();
  const bool nothing = report.tracks >= enough && (report.used == 0 || one_in * report.used < report.tracks - report.saturated);
  in_vain_ = nothing ? in_vain_ + 1 : 0;
  return nothing && in_vain_ <= patient;
}

// Along what no sweep measures images are wrong by a share of the distance, the same in image after image until other patches are seen.
// Stance feet measure it to a few parts in ten thousand: beside them images only catch what feet get grossly wrong.
PoseCovariance VisualPipeline::doubt_of_way(const Work& work, const SE3& T_WI) const {
  constexpr double beside_feet = 0.3;
  if (work.context.unobservable.isZero(0)) return PoseCovariance::Zero();
  double way = 0;
  for (const EarlierView& view : views_of(work, T_WI.p)) way += view.weight * view.way.norm();
  constexpr double shortest_step = 0.01;  // m
  const double images = std::max(1.0, way / std::max(shortest_step, (T_WI.p - last_p_).norm()));
  PoseCovariance V = PoseCovariance::Zero();
  const double variance = work.context.feet_hold ? beside_feet * beside_feet : errors_.way_variance();
  V.diagonal().tail<3>().setConstant(variance * way * way * images);
  return work.context.unobservable * V * work.context.unobservable.transpose();
}

// Of what the image tells of the position.
std::vector<EarlierView> VisualPipeline::views_of(const Work& work, const Eigen::Vector3d& p_W) const {
  std::vector<EarlierView> out;
  double all = 0;
  for (const auto& [frame, weight] : work.model.by_frame()) all += weight;
  if (!(all > 0)) return out;
  for (const auto& [id, weight] : work.model.by_frame()) {
    const VisualFrame& frame = map_.frame(id);
    out.push_back({frame.error, p_W - (frame.T_CW.inverse() * errors_.T_CI()).p, weight / all, errors_.way_variance()});
  }
  return out;
}

std::vector<ColouredPoint> VisualPipeline::learn(const VoxelMap& map, const PoseCovariance& error) {
  const Work& work = *work_;
  const Estimate& posterior = work.posterior;
  const PoseCovariance known = PoseCovariance::Identity() - work.context.unobservable;
  const SE3 T_WI = as_the_map_has_it(work.prior.x, posterior.x, work.context.unobservable);
  VisualFrame frame;
  frame.T_CW = work.T_CI * T_WI.inverse();
  frame.tau = posterior.x.tau;
  frame.omega = work.omega;
  frame.error = error;
  // Beside feet the error of this frame along what the LiDAR does not know is that of the next ones: drift, which the epoch carries. Images
  // alone must not make certain what was uncertain when the frame was taken.
  const PoseCovariance own = work.context.feet_hold ? PoseCovariance(to_origin(T_WI) * known) : to_origin(T_WI);
  frame.noise.topLeftCorner<6, 6>() = own * work.prior.P.topLeftCorner<6, 6>() * own.transpose();
  frame.noise(6, 6) = posterior.P(at::tau, at::tau);
  const std::uint32_t id = map_.add_frame(frame);
  judge_points(work, map, frame.T_CW, id);
  for (const NewPoint& found : new_points(map, camera_, frame.T_CW, work.pyramid[0], work.depth, work.tracks, config_)) {
    const Eigen::Vector2f pixel = found.pixel.cast<float>();
    if (const auto patch = cut_patch(work.pyramid, pixel.cast<double>()))
      map_.insert(found.point, {.frame = id, .pixel = pixel, .patch = *patch});
  }
  map_.forget_unused_frame(id);
  map_.forget(posterior.x.p, map_radius_);
  last_p_ = posterior.x.p;
  const std::unique_ptr<Work> done = std::move(work_);
  if (!work.image.colours) return {};
  return colours_of(work.image.image, posterior.x.tau, camera_, work.T_CI * posterior.x.pose().inverse(), work.depth);
}

void VisualPipeline::judge_points(const Work& work, const VoxelMap& map, const SE3& T_CW, std::uint32_t frame) {
  // A point is not denied by an image that agrees with few others either.
  const bool is_good = 2 * work.model.report().used > work.model.report().tracks;
  for (std::size_t i = 0; i < work.tracks.size(); ++i) {
    const PatchCandidate& track = work.tracks[i];
    const PhotometricModel::Verdict& verdict = work.model.verdicts()[i];
    // Before a new view may take the place of the one that it was held against.
    if (verdict.used || (verdict.looked && is_good)) map_.judge(track.point, track.observation, verdict.used, verdict.correlation);
    if (!verdict.used) continue;
    VisualPoint point = map_.point(track.point);
    const SE3& first = map_.frame(map_.observation(point.observations[0]).frame).T_CW;
    if (project_to_plane(map, -(first.R.inverse() * first.p), point))
      map_.refresh(track.point, point.p_W, point.normal_W, point.variance, point.node);
    const auto pixel = camera_.project(T_CW * point.p_W);
    if (!config_.new_views || !is_new_view(track) || !pixel || !camera_.sees(*pixel, border_at(2))) continue;
    const Eigen::Vector2f stored = pixel->cast<float>();
    if (const auto patch = cut_patch(work.pyramid, stored.cast<double>()))
      map_.observe(track.point, {.frame = frame, .pixel = stored, .patch = *patch});
  }
}

std::optional<double> VisualPipeline::clock_offset() {
  const auto offset = errors_.clock_offset();
  if (offset) forget_map();
  return offset;
}

void VisualPipeline::restart_mount_check() { errors_.restart(); }

void VisualPipeline::forget_map() { map_.clear(); }

}  // namespace kilvo
