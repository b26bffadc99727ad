#include "kilvo/estimator/history.hpp"

#include <algorithm>

#include "kilvo/filter/gap.hpp"
#include "kilvo/math/stopwatch.hpp"

namespace kilvo {
namespace {

// Undistortion never looks farther back than this.
constexpr Duration trajectory_length = std::chrono::milliseconds(500);
// A discarded interval is at least this long, s.
constexpr double least_gap = 0.02;

// What the IMU gets wrong in the second half of a sweep also moved the points taken then: the share of the process noise until the end
// that a sweep's correction of the middle has taken off. Half of it goes with the points' mean, G = 1 - P+ P^-1 of that into the pose:
// P(end) = P+ + Q - G Q / 4 - Q G' / 4.
template <int part>
double shared_with_sweep(const Estimate& prior, const Estimate& posterior) {
  const Eigen::Matrix3d left = posterior.P.block<3, 3>(part, part) * prior.P.block<3, 3>(part, part).inverse();
  return 0.5 * std::clamp(1 - left.trace() / 3, 0.0, 1.0);
}

}  // namespace

History::History(const EstimatorConfig& config) : replay_(config), trajectory_(trajectory_length) {}

void History::begin(const Estimate& first, std::optional<Time> rest_until) {
  base_ = closed_ = now_ = good_ = first;
  replay_.began_at_rest(rest_until);
  trajectory_.push(first.t, first.x.pose(), first.x.v);
  begun_ = true;
}

Estimate History::record_from(const Estimate& e, Time until) {
  Estimate ahead = replay_.nearest(until, e);
  replay_.advance(ahead, until, &trajectory_);
  return ahead;
}

std::optional<History> History::doubted(Time end, const std::optional<Eigen::Vector3d>& rate) const {
  if (to_seconds(end - base_.t) > longest_doubt) return std::nullopt;
  std::optional<History> out(*this);
  out->replay_.doubt_samples(base_, rate);
  out->correct_trajectory(base_, Eigen::Vector3d::Zero());  // nothing after it
  return out;
}

History History::moved(const SE3& by, double turned, double moved) const {
  History out(*this);
  State& x = out.base_.x;
  x.R = by.R * x.R;
  x.p = by * x.p;
  x.v = by.R * x.v;
  Covariance with = Covariance::Identity();
  for (const int part : {at::p, at::v, at::pcl, at::pcr}) with.block<3, 3>(part, part) = by.R.matrix();
  Covariance& P = out.base_.P = with * base_.P * with.transpose();
  Eigen::Matrix<double, at::size, 6> off = Eigen::Matrix<double, at::size, 6>::Zero();
  off.block<3, 3>(at::R, 0).diagonal().setConstant(turned);
  off.block<3, 3>(at::p, 3).diagonal().setConstant(moved);
  off.block<3, 3>(at::v, 0) = -turned * x.R.matrix() * skew(x.R.inverse() * x.v);
  for (const std::size_t side : {0, 1}) {
    const int pc = at::pcl + 3 * static_cast<int>(side);
    if (P.block<3, 3>(pc, pc).isZero(0)) continue;  // it does not stand
    x.pc[side] = by * x.pc[side];
    off.block<3, 3>(pc, 0) = -turned * x.R.matrix() * skew(x.R.inverse() * (x.pc[side] - x.p));
    off.block<3, 3>(pc, 3).diagonal().setConstant(moved);
  }
  P += off * off.transpose();
  out.replay_.forget_estimates();
  out.correct_trajectory(out.base_, Eigen::Vector3d::Zero());
  return out;
}

std::optional<History> History::loosened(Time middle, double turned, double moved, bool biases) const {
  // It may have begun before the base, if that is an image: since the last sweep.
  const double before = swept_ ? std::max(0.0, to_seconds(base_.t - *swept_)) : 0;
  constexpr double shortest = 0.01, noticed = 0.1;  // s; between sweeps, and how soon a bias is found
  const double told = before + to_seconds(middle - base_.t), since = std::max(told, shortest);
  if (!(told > 0) || told > longest_doubt) return std::nullopt;
  std::optional<History> out(*this);
  Covariance& P = out->base_.P;
  const double velocity = moved / since;
  Eigen::Matrix<double, at::size, 3> pushed = velocity * Covariance::Identity().middleCols<3>(at::v);
  pushed.middleRows<3>(at::p).diagonal().setConstant(velocity * before);
  P += pushed * pushed.transpose();
  const auto inflate = [&P](int part, double sigma) { P.diagonal().segment<3>(part).array() += sigma * sigma; };
  inflate(at::R, turned);
  const double lasted = std::max(since, noticed);
  if (biases) inflate(at::bg, turned / lasted);
  if (biases) inflate(at::ba, moved / (lasted * lasted));
  out->replay_.forget_estimates();
  return out;
}

std::optional<History::Motion> History::motion_since(Time t) const {
  if (t >= base_.t) return Motion{};
  const auto then = trajectory_.at(t), at_base = trajectory_.at(base_.t);
  if (!then || !at_base || base_.t - t > longest_correction) return std::nullopt;
  return Motion{*then, *at_base};
}

void History::close(Time t) {
  Stopwatch watch;
  replay_.remember(closed_);
  replay_.close(closed_, now_, t, record());
  now_ = closed_;
  closing_us_ += watch.lap_us();
}

void History::settle_leg_update() {
  if (now_.t == base_.t) base_ = now_;
  if (now_.t == closed_.t) closed_ = now_;
}

void History::end_stances(Time t) {
  LegStep step;
  step.t = std::max(t, now_.t);
  for (Stance& foot : step.foot) foot.ends = true;
  replay_.add(step);
  for (Estimate* e : {&now_, &closed_}) {
    for (std::size_t side = 0; side < 2; ++side) end_stance(*e, side);
  }
}

void History::rebase(const Estimate& e) {
  base_ = closed_ = now_ = e;
  replay_.forget_before(base_.t);
}

void History::rebase_to_closed() {
  base_ = closed_;
  replay_.forget_before(base_.t);
}

void History::correlate_with_sweep(Time end, const Estimate& prior, const Estimate& posterior, bool without_legs, bool open) {
  swept_ = posterior.t;
  replay_.correlate_with_sweep(end, shared_with_sweep<at::R>(prior, posterior), shared_with_sweep<at::p>(prior, posterior));
  const double expected = (prior.P.diagonal() - posterior.P.diagonal()).segment<3>(at::v).sum();
  if (expected > 0) replay_.learn_accel_noise(without_legs ? (posterior.x.v - prior.x.v).squaredNorm() / expected : 0, open);
}

void History::inflate_velocity(double sigma) {
  for (Estimate* e : {&now_, &closed_}) e->P.diagonal().segment<3>(at::v).array() += sigma * sigma;
  rebase_to_closed();
}

double History::roll_back() {
  // The motion since is unknown: the robot is assumed to have kept its velocity.
  const Time t = std::max(now_.t, good_.t);
  const double lost = to_seconds(t - good_.t);
  const double thrown = now_.x.v.allFinite() ? std::min(absurd_speed, (now_.x.v - good_.x.v).norm()) : absurd_speed;
  good_.x.p += lost * good_.x.v;
  inflate_covariance_over_gap(good_, good_.t, t, std::max(lost, least_gap));
  good_.t = t;
  // What made the velocity absurd may have begun before.
  good_.P.diagonal().segment<3>(at::v).array() += thrown * thrown;
  for (std::size_t side = 0; side < 2; ++side) end_stance(good_, side);
  base_ = closed_ = now_ = good_;
  replay_.clear_steps();
  trajectory_.clear();
  trajectory_.push(t, now_.x.pose(), now_.x.v);
  return lost;
}

void History::fork_from(const History& other) {
  closed_ = other.closed_;
  now_ = other.now_;
  replay_.copy_since(closed_.t, other.replay_);
  begun_ = is_fork_ = true;
}

void History::close_fork(Time until, std::optional<Time> legs) {
  const Time newest = replay_.newest_imu_by(until);
  if (newest <= closed_.t) return;
  replay_.close(closed_, now_, newest, nullptr);
  now_ = closed_;
  replay_.forget_before(closed_.t);
  // A sample of the IMU that came after leg samples of later stamps.
  if (legs && *legs > now_.t) replay_.advance(now_, *legs, nullptr);
}

}  // namespace kilvo
