#include "kilvo/estimator/replay.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/filter/gap.hpp"
#include "kilvo/filter/update.hpp"
#include "kilvo/legs/unobservable.hpp"

namespace kilvo {

constexpr double correlation = 0.01;       // s, for which an IMU misses or gets wrong the same
constexpr double told_by_its_ends = 0.25;  // s: in a longer gap the samples before and after do not determine the motion between them

void Replay::add(const ImuSample& s) {
  note_usual(s);
  imu_.push_back(s);
}

// Samples are missing: they lay beside the line between those that came.
void Replay::inflate_for_missed(ImuInterval& interval, double gap) const {
  const double missed = usual_.period > 0 ? std::round(gap / usual_.period) - 1 : 0;
  if (missed < 1) return;
  // The farther the neighbours, the farther beside; and all of them on the same side.
  const double area = missed * usual_.period * 0.5 * (missed + 1), growth = area * area / gap;
  interval.more_gyro += growth * usual_.gyro_bend2;
  interval.more_accel += growth * usual_.accel_bend2;
}

// Beyond the end of its range an IMU may have seen anything of the same size. And no body turns or is pushed so much within one sample, or
// so far from what is usual: samples are wrong, or little is known of between.
void Replay::inflate_for_faults(ImuInterval& interval, const ImuSample& a, const ImuSample& b) const {
  constexpr double largest_turn = 3, missing_accel = 20, largest_push = 100;  // rad/s, m/s^2
  if (a.gyro_clipped || b.gyro_clipped) interval.more_gyro = largest_turn * largest_turn * correlation;
  if (a.accel_clipped || b.accel_clipped) interval.more_accel = missing_accel * missing_accel * correlation;
  const double turned = (b.gyro - a.gyro).norm(), pushed = std::max((b.accel - a.accel).norm(), (b.accel - usual_.accel_mean).norm());
  if (turned <= largest_turn && pushed <= largest_push) return;
  interval.more_gyro = std::max(interval.more_gyro, turned * turned * correlation);
  interval.more_accel = std::max(interval.more_accel, pushed * pushed * correlation);
}

bool Replay::is_blind(Time begin, Time end) const {
  auto next = std::upper_bound(imu_.begin(), imu_.end(), begin, [](Time t, const ImuSample& s) { return t < s.t; });
  for (; next != imu_.end(); ++next) {
    if (next != imu_.begin() && to_seconds(next->t - (next - 1)->t) > blind_gap) return true;
    if (next->t >= end) return false;
  }
  return false;
}

// The closed interval [begin, end] between two samples; with more noise when the motion in between was not measured.
ImuInterval Replay::interval_between(const ImuSample& a, const ImuSample& b, Time begin, Time end, const State& x) const {
  ImuInterval interval = ImuInterval::between(a, b, begin, end);
  const double gap = to_seconds(b.t - a.t);
  if (gap <= longest_gap()) {
    inflate_for_faults(interval, a, b);
    inflate_for_missed(interval, gap);
    return interval;
  }
  // What was missed is about what varied before, constant over the gap: as a density, times the gap.
  constexpr double least_gyro = 0.02, least_accel = 0.2;  // rad/s, m/s^2
  const double gyro2 = usual_.gyro_variance.sum() + least_gyro * least_gyro,
               accel2 = usual_.accel_variance.sum() + least_accel * least_accel;
  interval.more_gyro = gyro2 * gap;
  interval.more_accel = gap > blind_gap ? 0 : accel2 * gap;  // more is added after the prediction (inflate_covariance_over_gap)
  if (gap > told_by_its_ends) {
    // It keeps turning for a while: as it did on the whole, and as it does at either end.
    constexpr double keeps_turning = 2, at_an_end = 0.3;  // s, share
    const double kept = keeps_turning / gap * (1 - std::exp(-gap / keeps_turning));
    const Eigen::Vector3d up_I = x.R.inverse() * -x.g.normalized();
    const Eigen::Vector3d rate = (1 - 2 * at_an_end) * usual_.gyro_mean + at_an_end * (a.gyro + b.gyro) - x.bg;
    interval.more_gyro = 0;
    interval.gyro_begin = interval.gyro_end = x.bg + kept * rate.dot(up_I) * up_I;
    interval.is_blind = true;
  }
  return interval;
}

ProcessNoise Replay::noise_within(Time begin, Time end) const {
  double more = 0;
  for (std::size_t i = 1; i < imu_.size(); ++i) {
    const Time from = std::max(begin, imu_[i - 1].t), to = std::min(end, imu_[i].t);
    if (from < to) more += to_seconds(to - from) * interval_between(imu_[i - 1], imu_[i], from, to, {}).more_gyro;
  }
  ProcessNoise out = config_.noise;
  if (more > 0) out.gyro = std::sqrt(out.gyro * out.gyro + more / to_seconds(end - begin));
  return out;
}

StandingFeet Replay::standing_at(Time t) const {
  StandingFeet out{};
  const auto after = std::upper_bound(steps_.begin(), steps_.end(), t, [](Time value, const LegStep& s) { return value < s.t; });
  if (after == steps_.begin()) return out;
  for (std::size_t side = 0; side < 2; ++side) out[side] = (after - 1)->foot[side].used;
  return out;
}

void Replay::predict_to(Estimate& e, Time until, Trajectory* record) const {
  if (imu_.empty()) return;
  const StandingFeet feet = standing_at(e.t);
  const ProcessNoise noise = noise_now();
  const auto step = [&](ImuInterval interval) {
    // What was missed or clipped is in no mean.
    interval.made_biases = rest_until_ && interval.end <= *rest_until_ && interval.more_gyro == 0 && interval.more_accel == 0;
    if (interval.begin < sweep_noise_.until) {
      interval.gyro_scale *= 1 - sweep_noise_.rotation;
      interval.velocity_scale *= 1 - sweep_noise_.position;
    }
    if (interval.is_blind) {
      carry_blind(e, interval.end, interval.gyro_begin - e.x.bg, noise);
    } else {
      carry(e, interval, feet, noise);
    }
    if (record != nullptr) record->push(e.t, e.x.pose(), e.x.v);
  };
  // The first sample after e.t.
  auto next = std::upper_bound(imu_.begin(), imu_.end(), e.t, [](Time t, const ImuSample& s) { return t < s.t; });
  for (; e.t < until && next != imu_.end(); ++next) {
    const ImuSample& a = next == imu_.begin() ? *next : *(next - 1);
    const Time begin = e.t;
    const double gap = to_seconds(next->t - a.t);
    step(interval_between(a, *next, begin, std::min(until, next->t), e.x));
    if (gap > blind_gap) inflate_covariance_over_gap(e, begin, e.t, gap);
  }
  if (e.t >= until) return;
  ImuSample held = imu_.back();
  held.t = until;
  // Within a period it is held; a held sample is not a second measurement.
  const bool is_gap = to_seconds(until - imu_.back().t) > longest_gap();
  step(is_gap ? interval_between(imu_.back(), held, e.t, until, e.x) : ImuInterval::hold(held, e.t, until));
}

std::optional<Eigen::Vector3d> Replay::gyro_at(Time t) const {
  const auto next = std::lower_bound(imu_.begin(), imu_.end(), t, [](const ImuSample& s, Time value) { return s.t < value; });
  const bool is_told = next != imu_.end() && (next == imu_.begin() || next->t == t);
  if (!is_told && to_seconds((next == imu_.end() ? t : next->t) - (next - 1)->t) > longest_gap()) return std::nullopt;
  return imu_at(t).gyro;
}

ImuSample Replay::imu_at(Time t) const {
  const auto next = std::lower_bound(imu_.begin(), imu_.end(), t, [](const ImuSample& s, Time value) { return s.t < value; });
  if (next == imu_.end()) return imu_.back();
  if (next == imu_.begin() || next->t == t) return *next;
  const ImuSample& a = *(next - 1);
  const double share = to_seconds(t - a.t) / to_seconds(next->t - a.t);
  ImuSample out = a;
  out.gyro += share * (next->gyro - a.gyro);
  out.accel += share * (next->accel - a.accel);
  return out;
}

LegModel::Used Replay::apply(Estimate& e, const LegStep& step, Gain<LegModel::max_leg_rows>* kept) const {
  if (step.false_velocity) e.P.block<3, 3>(at::v, at::v) += *step.false_velocity * step.false_velocity->transpose();
  if (step.rise) {
    const Eigen::Vector3d wrong = *step.rise * e.x.g.normalized();
    e.P.block<3, 3>(at::v, at::v) += wrong * wrong.transpose();
  }
  bool any = false;
  for (std::size_t side = 0; side < 2; ++side) {
    const Stance& foot = step.foot[side];
    if (foot.ends) end_stance(e, side);
    if (foot.begins) begin_stance(e, side, foot.point, config_.legs);
    if (foot.used && !foot.begins) move_stance(e, side, foot);
    any = any || foot.used;
  }
  if (step.gyro_bias) e = with_gyro_bias(e, *step.gyro_bias);
  if (!any || imu_.empty()) return {};
  // Without a rate the velocity of a foot that is a leg away from the IMU is anything.
  const auto gyro = gyro_at(step.t);
  if (!gyro) return {{step.foot[0].used, step.foot[1].used}, {}, {step.foot[0].used, step.foot[1].used}};
  LegModel model(step, *gyro, config_.legs);
  // The rows are nearly linear: one iteration, unless the settings ask for more.
  UpdateConfig once = config_.update;
  once.max_iterations = config_.legs.iterations;
  Gain<LegModel::max_leg_rows> own;
  Gain<LegModel::max_leg_rows>& gain = kept != nullptr ? *kept : own;
  Update done = update(e, model, once, nullptr, &gain);
  if (done.rows > 0) {
    consider(e.x, gain, done.posterior);
    e = done.posterior;
  } else if (kept != nullptr) {
    *kept = {};
  }
  return model.used();
}

std::array<bool, 2> Replay::take(Estimate& e, const LegStep& step) {
  steps_.push_back(step);
  if (taken_.size() == most_taken) return apply(e, step).fits;
  Taken& taken = taken_.emplace_back();
  taken.t = step.t;
  return (taken.used = apply(e, step, &taken.gain)).fits;
}

bool Replay::retrace(Estimate& e, const Estimate& live, Time until, Trajectory* record) const {
  if (imu_.size() < 2 || imu_.back().t != until || steps_.empty() || live.t != steps_.back().t || live.t > until) return false;
  const ImuSample &a = imu_[imu_.size() - 2], &b = imu_.back();
  auto step = std::upper_bound(steps_.begin(), steps_.end(), e.t, [](Time t, const LegStep& s) { return t < s.t; });
  // No gain was made without a rate, or when it had no solution.
  const auto is_of = [](const Taken& k, const LegStep& s) { return k.t == s.t && k.gain.rows() == k.used.rows(); };
  const auto taken = std::find_if(taken_.begin(), taken_.end(), [&e](const Taken& k) { return k.t > e.t; });
  if (a.t > e.t || !std::equal(taken, taken_.end(), step, steps_.end(), is_of)) return false;
  // What is only known now that the second sample has come: a gap, a jump, the end of its range.
  const ImuInterval whole = interval_between(a, b, e.t, until, e.x);
  if (to_seconds(b.t - a.t) > longest_gap() || whole.more_gyro > 0 || whole.more_accel > 0) return false;
  if (std::any_of(step, steps_.end(), [](const LegStep& s) { return s.gyro_bias.has_value(); })) return false;
  for (auto k = taken; k != taken_.end(); ++k, ++step) {
    const ImuInterval interval = ImuInterval::between(a, b, e.t, step->t);
    e.x = predict_mean(e.x, interval);
    e.t = step->t;
    place_stances(e.x, *step);
    const auto r = LegModel::residual(*step, e.x, interval.gyro_end, k->used);
    if (r.size() > 0) e.x = boxplus(e.x, without(heading_of(e.x), k->gain.step(r)));
    if (record != nullptr) record->push(e.t, e.x.pose(), e.x.v);
  }
  e.P = live.P;
  predict_to(e, until, record);
  return true;
}

void Replay::close(Estimate& closed, const Estimate& live, Time until, Trajectory* record) {
  if (!retrace(closed, live, until, record)) advance(closed, until, record);
  taken_.clear();
}

void Replay::advance(Estimate& e, Time until, Trajectory* record) const {
  auto step = std::upper_bound(steps_.begin(), steps_.end(), e.t, [](Time t, const LegStep& s) { return t < s.t; });
  for (; step != steps_.end() && step->t <= until; ++step) {
    predict_to(e, step->t, record);
    apply(e, *step);
    if (record != nullptr) record->push(e.t, e.x.pose(), e.x.v);
  }
  predict_to(e, until, record);
}

Time Replay::newest_imu_by(Time t) const {
  const auto after = std::upper_bound(imu_.begin(), imu_.end(), t, [](Time value, const ImuSample& s) { return value < s.t; });
  return after == imu_.begin() ? Time::min() : (after - 1)->t;
}

void Replay::copy_since(Time t, const Replay& other) {
  imu_.clear();
  clear_steps();
  // What forget_before would leave.
  for (std::size_t i = 0; i < other.imu_.size(); ++i)
    if (i + 2 >= other.imu_.size() || other.imu_[i + 1].t > t) imu_.push_back(other.imu_[i]);
  for (std::size_t i = 0; i < other.steps_.size(); ++i)
    if (i + 1 >= other.steps_.size() || other.steps_[i + 1].t > t) steps_.push_back(other.steps_[i]);
  sweep_noise_ = other.sweep_noise_;
  rest_until_ = other.rest_until_;
  usual_ = other.usual_;
}

void Replay::remember(const Estimate& e) {
  constexpr Duration apart = std::chrono::milliseconds(4);
  if (remembered_.size() < most_remembered && (remembered_.empty() || e.t - remembered_.back().t >= apart)) remembered_.push_back(e);
}

const Estimate& Replay::nearest(Time t, const Estimate& oldest) const {
  const auto after = std::upper_bound(remembered_.begin(), remembered_.end(), t, [](Time value, const Estimate& e) { return value < e.t; });
  return after == remembered_.begin() ? oldest : *(after - 1);
}

void Replay::doubt_samples(const Estimate& base, const std::optional<Eigen::Vector3d>& rate) {
  forget_estimates();
  usual_.accel_density2 = usual_.accel_bend2 = 0;  // they were of what is wrong
  for (ImuSample& s : imu_) {
    if (s.t <= base.t) continue;
    s.accel = base.x.ba - base.x.R.inverse() * base.x.g;
    s.accel_clipped = true;
    if (!rate) continue;
    s.gyro = *rate;
    s.gyro_clipped = true;
  }
}

void Replay::forget_before(Time t) {
  forget_estimates();
  while (imu_.size() > 2 && imu_[1].t <= t) imu_.pop_front();
  while (steps_.size() > 1 && steps_[1].t <= t) steps_.pop_front();
}

}  // namespace kilvo
