// Which sensors are used, and how they come back: all decisions on modality are here.
#include <algorithm>
#include <cmath>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/silence.hpp"
#include "kilvo/filter/update.hpp"

namespace kilvo {
namespace {

// After an outage so many sweeps in a row must agree with what was expected before the map grows again.
constexpr int consistent_sweeps = 3;
// Sweeps that fitted nowhere for so long: the robot is where the map is not.
constexpr Duration longest_refusal = std::chrono::seconds(2);

// A scan that was undistorted with a velocity that is not known: its ends are out of place, at the worst all on one side.
PoseCovariance noise_of_velocity(const Covariance& P) {
  constexpr double half_scan = 0.05, on_one_side = 0.5, per_metre = 0.3;  // s, -, rad/m
  const double smear = half_scan * half_scan * P.diagonal().segment<3>(at::v).maxCoeff();
  PoseCovariance out = PoseCovariance::Zero();
  out.diagonal().head<3>().setConstant(per_metre * per_metre * smear);
  out.diagonal().tail<3>().setConstant(on_one_side * on_one_side * smear);
  return out;
}

// Of sound sweeps nine tenths of what meets a surface lies on it, in a crowd as well.
bool contradicts_map(const RegistrationReport& report) {
  constexpr double known_share = 0.2, agreeing_share = 0.4;
  const int met = report.matched + report.rejected;
  return met > known_share * report.clusters && report.matched < agreeing_share * met;
}

}  // namespace

void Estimator::choose_modality(Time t) {
  const bool lidar = uses(Sensor::lidar) && t - last_sweep_ <= silence(robot_.lidar.rate, 3, std::chrono::milliseconds(300));
  const bool legs = last_legs_.has_value();
  // Vision needs the surfaces that the LiDAR sees.
  const bool camera = lidar && last_image_ && t - *last_image_ <= silence(robot_.camera.rate, 3, std::chrono::milliseconds(300));
  const Modality with_legs = lidar ? (camera ? Modality::kilv : Modality::kil) : Modality::ki;
  const Modality now = legs ? with_legs : without_legs(with_legs);
  const bool after_outage = cause_ == Reason::imu_lost || cause_ == Reason::imu_frozen;
  if (after_outage) cause_ = Reason::imu_back;
  if (now == modality_) {
    if (after_outage) report({}, cause_);
    return;
  }
  const bool first = modality_ == Modality::coast && cause_ == Reason::start;
  change_modality(now, after_outage || first ? cause_ : cause_of_change(t, now));
  if (now == Modality::coast && pending_.empty()) inflate_velocity_covariance();
}

Reason Estimator::cause_of_change(Time t, Modality now) const {
  if (has_lidar(now) != has_lidar(modality_))
    return has_lidar(now) ? Reason::lidar_back : health_.is_frozen(Sensor::lidar) ? Reason::lidar_frozen : Reason::lidar_lost;
  if (has_legs(now) != has_legs(modality_))
    return has_legs(now) ? Reason::legs_back : health_.is_frozen(Sensor::legs) ? Reason::legs_frozen : Reason::legs_lost;
  if (has_camera(now)) return Reason::camera_used;
  const auto heard = health_.heard(Sensor::camera);
  const bool silent = !heard || t - *heard > silence(robot_.camera.rate, 3, std::chrono::milliseconds(300));
  return health_.is_frozen(Sensor::camera) ? Reason::camera_frozen : silent ? Reason::camera_lost : Reason::camera_useless;
}

// What has failed may have been wrong before it was missed, and nothing will tell.
void Estimator::inflate_velocity_covariance() {
  constexpr double sigma = 0.003;  // m/s
  for (Estimate* e : {&*estimate_, &closed_}) e->P.diagonal().segment<3>(at::v).array() += sigma * sigma;
  rebase(closed_);
}

// Said at once, on the last output's heels; from then on there is no pose.
void Estimator::lose_imu(std::vector<Output>& out) {
  if (!estimate_ || recovery_.imu_lost) return;
  recovery_.imu_lost = true;
  ++statistics_.imu_outages;
  change_modality(Modality::coast, health_.is_frozen(Sensor::imu) ? Reason::imu_frozen : Reason::imu_lost);
  const Estimate kept = *estimate_;
  inflate_covariance_over_gap(*estimate_, kept.t, kept.t + from_seconds(blind_gap), blind_gap);
  estimate_->t = std::max(kept.t, last_output_.value_or(kept.t) + Duration(1000));
  emit(out);
  estimate_ = kept;
}

// The IMU is back. Feet may have been lifted and set down in between; the velocity is anything that a walking robot's may be.
void Estimator::bridge(Time silent_since, std::vector<Output>& out) {
  lose_imu(out);
  recovery_.imu_lost = false;
  recovery_.sweeps_to_go = consistent_sweeps;
  stationarity_.restart();
  if (last_legs_) lose_legs(silent_since);
}

void Estimator::lose_legs(Time t) {
  LegStep step;
  step.t = std::max(t, estimate_->t);
  for (Stance& foot : step.foot) foot.ends = true;
  replay_.add(step);
  for (Estimate* e : {&*estimate_, &closed_}) {
    for (std::size_t side = 0; side < 2; ++side) end_stance(*e, side);
  }
  stances_.restart();
  contacts_.restart();
  recovery_.legs_were_there = statistics_.sensors[static_cast<std::size_t>(Sensor::legs)].used > 0;
  recovery_.legs_waiting.reset();
  last_legs_.reset();
}

// Legs that come again in the middle of an impact would start with wrong contacts (paper, Section IV-E). Which foot stands is told by what
// is still: that needs a velocity.
bool Estimator::legs_may_return(Time t) {
  if (last_legs_ || !recovery_.legs_were_there) return true;
  constexpr Duration longest_wait = std::chrono::seconds(1), calm = std::chrono::milliseconds(20);
  if (!recovery_.legs_waiting) recovery_.legs_waiting = t;
  const double sigma_v = std::sqrt(std::max(0.0, estimate_->P.block<3, 3>(at::v, at::v).trace() / 3));
  if (health_.is_frozen(Sensor::legs)) return false;
  // Sweeps, if there are any, tell the velocity soon.
  const auto heard = health_.heard(Sensor::lidar);
  const bool sweeps = heard && t - *heard < silence(robot_.lidar.rate, 4, std::chrono::milliseconds(300));
  const bool ready = stationarity_.is_usual(t, calm) && (sigma_v < known_velocity || !sweeps);
  if (!ready && t - *recovery_.legs_waiting < longest_wait) return false;
  recovery_.legs_waiting.reset();
  last_stance_ = t;
  return true;
}

// Nothing else measures, and the IMU looks like that of a robot at rest: it does not move, and up is where the accelerometer says.
void Estimator::zero_velocity_update(const ImuSample& s) {
  constexpr Duration period = std::chrono::milliseconds(100);
  constexpr double velocity_sigma = 0.01, accel_sigma = 0.2;  // m/s, m/s^2
  if (modality_ != Modality::coast || !stationarity_.stands() || !pending_.empty()) return;
  if (recovery_.last_standing && s.t - *recovery_.last_standing < period) return;
  recovery_.last_standing = s.t;
  const auto at_rest = [&s](const State& x, const Covariance&) {
    const Eigen::Vector3d down_I = x.R.inverse() * x.g;
    Rows<6> rows;
    rows.r.resize(6);
    rows.r << x.v, x.ba - down_I - s.accel;
    rows.H.setZero(6, at::size);
    rows.H.block<3, 3>(0, at::v).setIdentity();
    rows.H.block<3, 3>(3, at::R) = -skew(down_I);
    rows.H.block<3, 3>(3, at::ba).setIdentity();
    rows.H.block<3, 3>(3, at::g) = -x.R.matrix().transpose();
    rows.R.setZero(6, 6);
    rows.R.diagonal().head<3>().array() = velocity_sigma * velocity_sigma;
    rows.R.diagonal().tail<3>().array() = accel_sigma * accel_sigma;
    return rows;
  };
  closed_ = update(closed_, at_rest, config_.update).posterior;
  estimate_ = closed_;
  if (keep_finite()) rebase(closed_);
}

// False: the sweep fits nowhere, and says nothing of the state.
bool Estimator::register_sweep(const Estimate& prior, LidarModel& model, const std::vector<PointCluster>& clusters,
                               const UndistortionNoise& within_scan) {
  estimate_ = prior;
  if (map_.empty()) return true;
  if (!needs_search(prior.P, PoseCovariance::Identity() - unobservable_)) {
    UpdateConfig patient = config_.update;
    if (recovery_.sweeps_to_go > 0) patient.max_iterations *= 3;
    const PoseCovariance noise = recovery_.sweeps_to_go > 0 ? within_scan.V + noise_of_velocity(prior.P) : within_scan.V;
    const auto measured = [&](const State& x, const Covariance& P) {
      Information<6> info = model(x, P);
      add_common_noise(noise, info);
      return info;
    };
    // A prior that has lost the trace of that noise, by legs or images since, shares less of it.
    PoseCovariance shared = within_scan.with_prediction;
    shared.diagonal() = shared.diagonal().cwiseMax(-0.25 * prior.P.diagonal().head<6>());
    estimate_ = update(prior, measured, patient, &shared).posterior;
    if (!contradicts_map(model.report())) return true;
    estimate_ = prior;
    return false;
  }
  ++statistics_.searches;
  const auto found = find_pose(map_, clusters, robot_.lidar.T_imu_lidar.p, prior, config_.lidar, workers_);
  if (!found) return false;
  ++statistics_.found;
  recovery_.sweeps_to_go = consistent_sweeps;
  constexpr double found_rotation = 0.006, found_position = 0.005;  // rad, m
  PoseCovariance guessed = within_scan.V + noise_of_velocity(prior.P);
  guessed.diagonal().head<3>().array() += found_rotation * found_rotation;
  guessed.diagonal().tail<3>().array() += found_position * found_position;
  const auto measured = [&](const State& x, const Covariance&) {
    Information<6> info = information_at(*found, x);
    add_common_noise(guessed, info);
    return info;
  };
  estimate_ = update(prior, measured, config_.update).posterior;
  model(estimate_->x, estimate_->P);
  return true;
}

// A sweep that fits nowhere is not used; when that has lasted, the robot is taken to be outside of the map: it begins anew around it.
void Estimator::refuse_sweep(Time t) {
  drop(Sensor::lidar, Reason::fits_nowhere);
  if (!recovery_.refused_since) recovery_.refused_since = t;
  recovery_.sweeps_to_go = consistent_sweeps;
  if (map_is_given_ || t - *recovery_.refused_since < longest_refusal) return;
  map_ = VoxelMap(config_.map);
  visual_map_ = VisualMap(config_.visual_map);
  unobservable_.setZero();
  // It is farther away than a search would have looked, and nothing told how far.
  constexpr double moved = 5.0, climbed = 1.0, turned = 0.5;  // m, m, rad
  PoseCovariance unknown = PoseCovariance::Zero();
  const Eigen::Vector3d up_I = estimate_->x.R.matrix().transpose() * -estimate_->x.g.normalized();
  unknown.topLeftCorner<3, 3>() = turned * turned * up_I * up_I.transpose();
  unknown.diagonal().tail<3>() << moved * moved, moved * moved, climbed * climbed;
  map_error_.lost(estimate_->x.pose(), unknown);
  recovery_.refused_since.reset();
  recovery_.sweeps_to_go = 0;
  ++statistics_.maps_begun_anew;
  report(Sensor::lidar, Reason::map_begun_anew);
  contradict(Reason::diverged, Sensor::lidar, witness_against(Sensor::lidar), 2,
             "for 2 s no sweep fitted the map where it should have been");
}

// After an outage the map is re-joined, not smeared: it grows again when sweeps have agreed with the prediction some times, or where it has
// not been before.
bool Estimator::may_learn(const Estimate& prior, const RegistrationReport& report) {
  recovery_.refused_since.reset();
  if (recovery_.sweeps_to_go == 0) return true;
  constexpr double known_share = 0.2, agreeing_share = 0.6, six_at_99_9 = 22.46;
  const int met = report.matched + report.rejected;
  if (met < known_share * report.clusters) return true;
  PoseCovariance P = prior.P.topLeftCorner<6, 6>() + map_error_.at(prior.x.pose());
  P.diagonal().array() += 1e-6;
  const Eigen::Matrix<double, 6, 1> change = boxminus(estimate_->x, prior.x).head<6>();
  const bool consistent = report.matched > agreeing_share * met && change.dot(P.ldlt().solve(change)) < six_at_99_9;
  recovery_.sweeps_to_go = consistent ? recovery_.sweeps_to_go - 1 : consistent_sweeps;
  return recovery_.sweeps_to_go == 0;
}

void Estimator::note_outage(Time sweep_begin) {
  constexpr int periods = 4;
  if (last_middle_ != Time{} && sweep_begin - last_sweep_ > from_seconds(periods / robot_.lidar.rate))
    recovery_.sweeps_to_go = std::max(recovery_.sweeps_to_go, consistent_sweeps);
}

}  // namespace kilvo
