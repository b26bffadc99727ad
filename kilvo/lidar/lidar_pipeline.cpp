#include "kilvo/lidar/lidar_pipeline.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "kilvo/filter/gap.hpp"
#include "kilvo/filter/innovation.hpp"
#include "kilvo/filter/update.hpp"
#include "kilvo/lidar/relocate.hpp"

namespace kilvo {
namespace {

// Sweeps that fitted nowhere for so long: the robot is where the map is not.
constexpr Duration longest_refusal = std::chrono::seconds(2);
// Less than this share of a sweep's clusters on known surfaces: it says little of whether the map is the right one.
constexpr double known_share = 0.2;
// Fewer rows, or more directions than these that they do not hold: not worth the name of a registration.
constexpr int fewest_rows = 30, most_weak = 3;

// A row is linear in the position, and in the rotation but for its square: after a step below these another evaluation would meet the same
// planes and move the pose by hundredths of a millimetre.
constexpr double negligible_turn = 5e-4, negligible_step = 3e-3;  // rad, m

bool says_enough(const RegistrationReport& report) { return report.matched >= fewest_rows && report.degeneracy.weak_count <= most_weak; }

// A scan that was undistorted with a velocity that is not known: its ends are out of place, at the worst all on one side.
PoseCovariance noise_of_velocity(const Covariance& P, double rate) {
  constexpr double on_one_side = 0.5, per_metre = 0.3;  // -, rad/m
  const double half_scan = 0.5 / rate;                  // s
  const double smear = half_scan * half_scan * P.diagonal().segment<3>(at::v).maxCoeff();
  PoseCovariance out = PoseCovariance::Zero();
  out.diagonal().head<3>().setConstant(per_metre * per_metre * smear);
  out.diagonal().tail<3>().setConstant(on_one_side * on_one_side * smear);
  return out;
}

// Of sound sweeps nine tenths of what meets a surface lies on it, in a crowd as well.
bool contradicts_map(const RegistrationReport& report) {
  constexpr double agreeing_share = 0.4;
  const int met = report.matched + report.rejected;
  return met > known_share * report.clusters && report.matched < agreeing_share * met;
}

}  // namespace

LidarPipeline::LidarPipeline(const LidarMount& mount, const LidarConfig& config, const UpdateConfig& update, int threads)
    : mount_(mount), config_(config), update_(update), workers_(threads), own_body_(mount.own_body) {}

void LidarPipeline::note_silence(Duration silence) {
  if (is_silence(silence, mount_.rate)) sweeps_to_go_ = std::max(sweeps_to_go_, consistent_sweeps);
}

PoseCovariance LidarPipeline::release(Estimate& prior, const PoseCovariance& map_error, double reach) const {
  const PoseCovariance& weak = blind_.part();
  // A sweep that knew nothing at all showed no planes either.
  if (weak.isIdentity(0) || needs_search(prior.P, PoseCovariance::Identity() - unknowable_)) return PoseCovariance::Zero();
  const auto along_weak = [&weak](const auto& P) { return PoseCovariance(weak * P * weak.transpose()); };
  const auto sigma_of = [](const PoseCovariance& P) { return std::sqrt(std::max(0.0, P.bottomRightCorner<3, 3>().trace())); };
  const PoseCovariance along = along_weak(prior.P.topLeftCorner<6, 6>());
  const double sigma = sigma_of(along), of_map = sigma_of(along_weak(map_error)), beyond = sigma - reach;
  if (!(beyond > 0)) return PoseCovariance::Zero();
  Covariance keep = Covariance::Identity();
  keep.topLeftCorner<6, 6>() -= beyond / sigma * weak;
  prior.P = (keep * prior.P * keep.transpose()).eval();
  // It is the same velocity that was wrong before, so that standard deviations add; the sum of both variances never falls.
  return along / (sigma * sigma) * (2 * std::max(of_map, reach) + beyond) * beyond;
}

Registration LidarPipeline::measure(const LidarScan& scan, const Context& context, const VoxelMap& map, PointDrops& drops) {
  const Estimate& prior = context.prior;
  Registration out;
  out.posterior = prior;
  out.considered = context.considered;
  own_body_.begin_sweep();
  out.points = undistort(scan, context.trajectory, prior.t, mount_, drops, &own_body_);
  if (out.points.empty()) {
    out.refused = Reason::no_usable_point;
    return out;
  }
  out.clusters = downsample(out.points, prior.x.pose(), config_.voxel_size, config_.reach());
  // A sweep that is measured again from another prior shows no more of it.
  if (std::exchange(noise_seen_until_, context.end) != context.end) range_noise_.add(out.clusters, mount_.T_imu_lidar.p, config_);
  out.range_noise = range_noise_.sigma(config_.range_noise);
  LidarConfig config = config_;
  config.range_noise = out.range_noise;
  // With hysteresis: each change of mind would hand what was drifted since to the map.
  constexpr double to_leave = 3.0;
  if (is_blind_somewhere()) config.weak_share *= to_leave;
  LidarModel model(map, out.clusters, mount_.T_imu_lidar.p, context.map_error + out.considered, config, workers_, &blind_);
  if (context.without_legs) model.keep_weak();
  // Sweeps whose points have no times, or times that span little, still come once in a period.
  model.doubt_new_surfaces(std::clamp(2 * to_seconds(context.end - prior.t), 0.5 / mount_.rate, 2 / mount_.rate));
  if (map.empty()) {
    out.carries = true;
  } else {
    const UndistortionNoise within_scan = undistortion_noise(context.noise, context.end - prior.t);
    out.searched = needs_search(prior.P, PoseCovariance::Identity() - unknowable_);
    if (out.searched) {
      search(map, prior, model, within_scan, out);
    } else {
      track(prior, model, within_scan, out);
    }
    // What holds less than three directions is no registration: it would carry the estimate while the modality says that legs do.
    out.carries = !out.refused && says_enough(model.report());
    if (!out.carries) out.posterior = prior;
  }
  out.report = model.report();
  if (!out.carries) return out;
  out.by_epoch = model.by_epoch();
  // What was found takes nothing along weak directions.
  if (out.searched) std::ranges::for_each(out.by_epoch, [](EpochInformation& e) { e.kept.setZero(); });
  out.systematic = model.systematic();
  return out;
}

// From planes that are the nearest at the prior.
void LidarPipeline::track(const Estimate& prior, LidarModel& model, const UndistortionNoise& within_scan, Registration& out) const {
  UpdateConfig patient = update_;
  patient.rotation_step = std::max(patient.rotation_step, negligible_turn);
  patient.position_step = std::max(patient.position_step, negligible_step);
  if (is_rejoining()) patient.max_iterations *= 3;
  const PoseCovariance noise = is_rejoining() ? within_scan.V + noise_of_velocity(prior.P, mount_.rate) : within_scan.V;
  const auto measured = [&](const State& x, const Covariance& P) {
    Information<6> info = model(x, P);
    add_common_noise(noise, info);
    return info;
  };
  // A prior that has lost the trace of that noise, by legs or images since, shares less of it.
  PoseCovariance shared = within_scan.with_prediction;
  shared.diagonal() = shared.diagonal().cwiseMax(-0.25 * prior.P.diagonal().head<6>());
  out.posterior = update(prior, measured, patient, &shared).posterior;
  if (contradicts_map(model.report())) out.refused = Reason::fits_nowhere;
}

void LidarPipeline::search(const VoxelMap& map, const Estimate& prior, LidarModel& model, const UndistortionNoise& within_scan,
                           Registration& out) const {
  const auto found = find_pose(map, out.clusters, mount_.T_imu_lidar.p, prior, config_, workers_);
  if (!found) {
    out.refused = Reason::fits_nowhere;
    return;
  }
  constexpr double found_rotation = 0.006, found_position = 0.005;  // rad, m
  PoseCovariance guessed = within_scan.V + noise_of_velocity(prior.P, mount_.rate);
  guessed.diagonal().head<3>().array() += found_rotation * found_rotation;
  guessed.diagonal().tail<3>().array() += found_position * found_position;
  const auto measured = [&](const State& x, const Covariance&) {
    Information<6> info = information_at(*found, x);
    add_common_noise(guessed, info);
    return info;
  };
  out.posterior = update(prior, measured, update_).posterior;
  model(out.posterior.x, out.posterior.P);
}

void LidarPipeline::accept(const Registration& sweep) {
  if (sweep.carries) {
    own_body_.learn(sweep.posterior.x.pose());
    blind_.see(sweep.report.information, sweep.report.degeneracy);
  } else {
    blind_.see_nothing();
  }
  if (!sweep.searched) searched_since_.reset();
  if (sweep.searched && !searched_since_) searched_since_ = sweep.posterior.t;
  // What a sweep does not hold that had to be found may be for its smear: it is searched for again, for a while.
  if (!searched_since_ || sweep.posterior.t - *searched_since_ > longest_refusal) unknowable_ = blind_.part();
  refused_since_.reset();
}

double LidarPipeline::squared_change(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error) {
  PoseCovariance P = prior.P.topLeftCorner<6, 6>() + map_error + sweep.considered;
  P.diagonal().array() += 1e-6;
  const Eigen::Matrix<double, 6, 1> change = boxminus(sweep.posterior.x, prior.x).head<6>();
  return change.dot(P.ldlt().solve(change));
}

bool LidarPipeline::may_learn(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error) {
  if (!is_rejoining()) return true;
  constexpr double agreeing_share = 0.6;
  const int met = sweep.report.matched + sweep.report.rejected;
  if (met < known_share * sweep.report.clusters) return true;
  const bool consistent = sweep.report.matched > agreeing_share * met && squared_change(prior, sweep, map_error) < agreeing_change;
  sweeps_to_go_ = consistent ? sweeps_to_go_ - 1 : consistent_sweeps;
  return !is_rejoining();
}

bool LidarPipeline::refuse(Time t, bool map_is_given) {
  if (!refused_since_) refused_since_ = t;
  rejoin();
  if (map_is_given || t - *refused_since_ < longest_refusal) return false;
  blind_ = {};
  unknowable_.setZero();
  refused_since_.reset();
  sweeps_to_go_ = 0;
  return true;
}

LidarPipeline::ClockEvidence LidarPipeline::compare_turns(const Estimate& prior, const Estimate& posterior, const Trajectory& trajectory,
                                                          Time begin, Time end) {
  const auto first = trajectory.at(begin), last = trajectory.at(end);
  if (!first || !last || end <= begin || is_blind_somewhere() || is_rejoining()) {
    mount_error_.restart();
    return {};
  }
  if (config_.mount_error) mount_error_.add(prior.t, posterior.x.R, trajectory);
  const Eigen::Vector3d rate = (first->R.inverse() * last->R).Log() / to_seconds(end - begin);
  time_offset_.add((prior.x.R.inverse() * posterior.x.R).Log(), rate);
  const ClockEvidence out = {time_offset_.is_doubtful(), time_offset_.offset(least_clock_offset)};
  if (out.offset) time_offset_.restart();
  return out;
}

}  // namespace kilvo
