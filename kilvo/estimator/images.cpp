// The visual part of the sequential phase: an image updates the state at its own time; what came since is replayed.
#include <algorithm>
#include <cmath>

#include "kilvo/estimator/decimals.hpp"
#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/stopwatch.hpp"
#include "kilvo/filter/pose_error.hpp"
#include "kilvo/filter/update.hpp"
#include "kilvo/vision/colours.hpp"
#include "kilvo/vision/depth_view.hpp"
#include "kilvo/vision/new_points.hpp"

namespace kilvo {
namespace {

// A view that differs so much from those that a point has is kept as well: octaves of scale, rad.
constexpr double new_scale = 0.4, new_angle = 0.25;

// So many patches hold a pose by themselves.
constexpr int enough = 20;

// Fewer patches, or a smaller share of those that should be seen, do not carry an estimate.
bool carries(const PhotometricModel::Report& report) {
  constexpr int fewest = 10, one_in = 5;
  return report.used >= fewest && one_in * report.used >= report.tracks - report.saturated;
}

bool is_new_view(const PatchCandidate& track) {
  const double octaves = 0.5 * std::abs(std::log2(std::max(1e-6, std::abs(track.warp.A.determinant()))));
  return octaves > new_scale || track.view_angle > new_angle;
}

// What an image says of the pose goes into what it leaves behind only where the LiDAR is blind. Elsewhere its patches are kept where the
// LiDAR's map has them: else two maps would come to be, each true to itself, whose rays and planes no longer meet where the surface is.
SE3 as_the_map_has_it(const State& before, const State& after, const PoseCovariance& weak) {
  const Eigen::Matrix<double, 6, 1> change = weak * boxminus(after, before).head<6>();
  return {before.R * SO3::Exp(change.head<3>()), before.p + change.tail<3>()};
}

}  // namespace

// What makes an image no use at all; none: nothing.
std::optional<Reason> Estimator::image_fault(const CameraImage& image) {
  const Image& picture = image.image;
  if (picture.width != robot_.camera.width || picture.height != robot_.camera.height) {
    const auto size = [](int width, int height) { return std::to_string(width) + " x " + std::to_string(height); };
    if (!std::exchange(size_is_doubted_, true)) {
      report(Sensor::camera, Reason::foreign_images, 0,
             size(picture.width, picture.height) + " pixels cannot be used: camera.width and camera.height say " +
                 size(robot_.camera.width, robot_.camera.height));
    }
    return Reason::image_size;
  }
  if (picture.channels != 1 && picture.channels != 3) return Reason::image_channels;
  const std::size_t values =
      static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * static_cast<std::size_t>(picture.channels);
  if (picture.pixels.size() == values) return std::nullopt;
  return Reason::image_cut;
}

// Where the camera was when the image was taken, seen from the IMU at the time of the state that it updates. That is the image's own time,
// unless a sweep of a later time was there first: then the motion between the two is the trajectory's. None when that is too long ago.
std::optional<SE3> Estimator::camera_from_state(Time image) const {
  constexpr Duration longest = std::chrono::milliseconds(300);
  if (image >= anchor_.t) return T_CI_;
  const auto then = trajectory_.at(image), now = trajectory_.at(anchor_.t);
  if (!then || !now || anchor_.t - image > longest) return std::nullopt;
  return T_CI_ * then->inverse() * *now;
}

void Estimator::process(const CameraImage& image) {
  if (image.t < mount_doubted_until_) return drop(Sensor::camera, Reason::mount_doubted);
  const std::optional<SE3> T_CI = camera_from_state(image.t);
  if (!T_CI) return drop(Sensor::camera, Reason::before_state);
  if (replay_.is_blind(image.t, image.t)) return drop(Sensor::camera, Reason::no_imu);
  if (image.t < images_from_) return drop(Sensor::camera, Reason::before_motion);
  if (seen_W_.empty()) return drop(Sensor::camera, Reason::before_sweep);
  // Vision lives by the surfaces of the LiDAR: without it, nobody can tell what hides what, and images can only drift.
  constexpr int scans = 3;
  if (image.t - last_middle_ > from_seconds((scans + 0.5) / robot_.lidar.rate)) return drop(Sensor::camera, Reason::no_lidar);
  if (recovery_.sweeps_to_go > 0) return drop(Sensor::camera, Reason::before_rejoined);
  Stopwatch watch;
  const std::vector<GreyImage> pyramid = pyramid_of(to_grey(image.image), Patch::levels);
  const Time at = std::max(image.t, anchor_.t);
  Estimate prior = replay_.nearest(at, anchor_);
  replay_.advance(prior, at, &trajectory_);
  if (is_lost_among_patches(prior)) return drop(Sensor::camera, Reason::pose_uncertain);
  const SE3 expected = *T_CI * prior.x.pose().inverse();
  const DepthView depth(*camera_, expected, seen_W_);
  const std::vector<PatchCandidate> tracks = select_patches(visual_map_, *camera_, expected, depth, config_.vision);
  PhotometricModel model(visual_map_, *camera_, *T_CI, pyramid, tracks, prior, config_.vision);
  const Estimate prior_before_exposure = prior;
  if (const auto exposure = model.exposure_at(prior.x)) {
    // Lamps are switched and exposures jump: what it was says nothing, the image all.
    prior.x.tau = std::exp(exposure->log);
    const double unsure = exposure->sigma * prior.x.tau;
    prior.P.row(at::tau).setZero();
    prior.P.col(at::tau).setZero();
    prior.P(at::tau, at::tau) = unsure * unsure;
  }
  UpdateConfig update_config = config_.update;
  update_config.min_iterations = model.iterations();
  update_config.max_iterations = std::max(update_config.max_iterations, model.iterations() + 2);
  const bool blind = !unobservable_.isZero(0), feet_hold = blind && last_legs_ && image.t - last_used_stance_ < longest_flight;
  const auto measured = [&](const State& x, const Covariance& P) {
    Information<7> info = model(x, P);
    if (feet_hold) {
      Eigen::Matrix<double, 7, 7> common = Eigen::Matrix<double, 7, 7>::Zero();
      common.topLeftCorner<6, 6>() = doubt_of_way(model.by_frame(), x.pose());
      add_common_noise<7>(common, info);
    }
    return info;
  };
  estimate_ = tracks.empty() ? prior : update(prior, measured, update_config).posterior;
  if (!keep_finite(true)) return drop(Sensor::camera, Reason::not_finite);
  const Eigen::Vector3d omega = replay_.gyro_at(image.t).value_or(prior.x.bg) - prior.x.bg;
  if (at == image.t) check_mount(model, prior.x.R, omega);
  if (image.t < mount_doubted_until_) {
    // Its patches lie where the wrong mount put them.
    visual_map_ = VisualMap(config_.visual_map);
    estimate_ = prior_before_exposure;
    rebase(*estimate_);
    return drop(Sensor::camera, Reason::mount_doubted);
  }
  if (says_nothing(model.report())) {
    estimate_ = prior_before_exposure;
    rebase(*estimate_);
    return drop(Sensor::camera, Reason::agrees_with_nothing);
  }
  ++statistics_.sensors[static_cast<std::size_t>(Sensor::camera)].used;
  trajectory_.correct(at, estimate_->x.pose(), estimate_->x.v - prior.x.v);
  const SE3 T_WI = estimate_->x.pose();
  if (blind && !feet_hold && model.report().used >= enough) note_drift(model.by_frame(), T_WI);
  learn_from(*T_CI, model, tracks, pyramid, depth, prior, omega);
  check_camera_clock();
  rebase(*estimate_);
  last_image_p_ = estimate_->x.p;
  if (carries(model.report())) last_image_ = image.t;
  Output& seen = images_.emplace_back();
  seen.coloured = colours_of(image.image, estimate_->x.tau, *camera_, *T_CI * estimate_->x.pose().inverse(), depth);
  seen.indicators = indicators_of(model.report().used);
  seen.stages.visual_us = watch.lap_us();
}

// Standing feet measure the way along what no sweep knows by a few parts in ten thousand, images by a part in thousand, and what they are
// wrong by is the same in image after image until other patches are seen: beside feet, images only catch what feet get grossly wrong.
PoseCovariance Estimator::doubt_of_way(std::span<const PhotometricModel::FrameShare> shares, const SE3& T_WI) const {
  constexpr double wrong_share = 0.3;  // of the way from the frames
  double way = 0, weights = 0;
  for (const auto& [frame, weight] : shares) {
    way += weight * (T_WI.p - position_of(visual_map_.frame(frame))).norm();
    weights += weight;
  }
  if (!(weights > 0)) return PoseCovariance::Zero();
  way /= weights;
  constexpr double shortest_step = 0.01;  // m
  const double images = std::max(1.0, way / std::max(shortest_step, (T_WI.p - last_image_p_).norm()));
  PoseCovariance V = PoseCovariance::Zero();
  V.diagonal().tail<3>().setConstant(wrong_share * wrong_share * way * way * images);
  return unobservable_ * V * unobservable_.transpose();
}

Eigen::Vector3d Estimator::position_of(const VisualFrame& frame) const { return (frame.T_CW.inverse() * T_CI_).p; }

// Along what no sweep knows the pose is wrong by what the frames are that it was held against.
void Estimator::note_drift(std::span<const PhotometricModel::FrameShare> shares, const SE3& T_WI) {
  std::vector<MapError::View> views;
  for (const auto& [frame, weight] : shares) {
    const VisualFrame& from = visual_map_.frame(frame);
    views.push_back({from.error, (T_WI.p - position_of(from)).norm(), weight});
  }
  map_error_.seen(T_WI, views, unobservable_);
}

// Patches are found within some pixels of where they are expected. Along what the LiDAR does not see the way is the images' own: it may be
// uncertain, and new patches are begun there.
bool Estimator::is_lost_among_patches(const Estimate& prior) const {
  constexpr double reach = 8, depth = 3;  // px, m
  const PoseCovariance known = PoseCovariance::Identity() - unobservable_;
  const PoseCovariance P = known * prior.P.topLeftCorner<6, 6>() * known.transpose();
  const double turned = P.topLeftCorner<3, 3>().trace(), moved = P.bottomRightCorner<3, 3>().trace();
  return robot_.camera.fx * std::sqrt(std::max(0.0, turned + moved / (depth * depth))) > reach;
}

// An image that hardly any of many patches is found in is dark, covered, torn, or of another world: nothing is learnt from it, unless
// that goes on, for then the world has changed.
bool Estimator::says_nothing(const PhotometricModel::Report& report) {
  constexpr int one_in = 5, patient = 20;  // images
  const bool nothing = report.tracks >= enough && (report.used == 0 || one_in * report.used < report.tracks - report.saturated);
  images_in_vain_ = nothing ? images_in_vain_ + 1 : 0;
  return nothing && images_in_vain_ <= patient;
}

void Estimator::check_mount(const PhotometricModel& model, const SO3& R_WI, const Eigen::Vector3d& omega) {
  for (const PhotometricModel::Turn& turn : model.turns()) {
    const VisualFrame& frame = visual_map_.frame(turn.frame);
    const SO3 R_IW = T_CI_.R.inverse() * frame.T_CW.R;
    mount_check_.add({R_WI, omega}, {R_IW.inverse(), frame.omega}, turn.A, turn.b);
  }
  const auto psi = mount_check_.misalignment();
  if (!psi) return;
  // It is tried again, later each time: what fooled the check may have passed.
  constexpr Duration first_pause = std::chrono::seconds(10), longest_pause = std::chrono::minutes(5);
  mount_pause_ = mount_pause_ == Duration(0) ? first_pause : std::min(longest_pause, 2 * mount_pause_);
  mount_doubted_until_ = estimate_->t + mount_pause_;
  mount_check_ = MountCheck();
  const auto tenths = [](double value) { return decimals(value, 1); };
  const Eigen::Vector3d degrees = *psi * (180 / M_PI);
  report(Sensor::camera, Reason::camera_turned, degrees.norm(),
         tenths(degrees.x()) + ", " + tenths(degrees.y()) + ", " + tenths(degrees.z()));
}

void Estimator::learn_from(const SE3& T_CI, const PhotometricModel& model, std::span<const PatchCandidate> tracks,
                           std::span<const GreyImage> pyramid, const DepthView& depth, const Estimate& prior,
                           const Eigen::Vector3d& omega) {
  const PoseCovariance known = PoseCovariance::Identity() - unobservable_;
  const SE3 T_WI = as_the_map_has_it(prior.x, estimate_->x, unobservable_);
  const SE3 T_CW = T_CI * T_WI.inverse();
  VisualFrame frame;
  frame.T_CW = T_CW;
  frame.tau = estimate_->x.tau;
  frame.omega = omega;
  frame.error = map_error_.total(T_WI, estimate_->P.topLeftCorner<6, 6>());
  // Along what the LiDAR does not know, the error of this frame is that of the next ones: drift, which the epoch carries.
  const PoseCovariance own = to_origin(T_WI) * known;
  frame.noise.topLeftCorner<6, 6>() = own * prior.P.topLeftCorner<6, 6>() * own.transpose();
  frame.noise(6, 6) = estimate_->P(at::tau, at::tau);
  const std::uint32_t id = visual_map_.add_frame(frame);
  const auto view = [&](const Eigen::Vector2d& pixel) -> std::optional<Observation> {
    const Eigen::Vector2f stored = pixel.cast<float>();
    const auto patch = cut_patch(pyramid, stored.cast<double>());
    if (!patch) return std::nullopt;
    return Observation{.frame = id, .pixel = stored, .patch = *patch};
  };
  // A point is not denied by an image that agrees with few others either.
  const bool is_good = 2 * model.report().used > model.report().tracks;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const PatchCandidate& track = tracks[i];
    const PhotometricModel::Verdict& verdict = model.verdicts()[i];
    // Before a new view may take the place of the one that it was held against.
    if (verdict.used || (verdict.looked && is_good)) visual_map_.judge(track.point, track.observation, verdict.used, verdict.correlation);
    if (verdict.used) {
      VisualPoint point = visual_map_.point(track.point);
      const SE3& first = visual_map_.frame(visual_map_.observation(point.observations[0]).frame).T_CW;
      if (project_to_plane(map_, -(first.R.inverse() * first.p), point))
        visual_map_.refresh(track.point, point.p_W, point.normal_W, point.variance, point.node);
      const auto pixel = camera_->project(T_CW * point.p_W);
      if (is_new_view(track) && pixel && camera_->sees(*pixel, 20)) {
        if (const auto seen = view(*pixel)) visual_map_.observe(track.point, *seen);
      }
    }
  }
  for (const NewPoint& found : new_points(map_, *camera_, T_CW, pyramid[0], depth, tracks, config_.vision)) {
    if (const auto seen = view(found.pixel)) visual_map_.insert(found.point, *seen);
  }
  visual_map_.forget_unused_frame(id);
  visual_map_.forget(estimate_->x.p, config_.map.radius);
}

}  // namespace kilvo
