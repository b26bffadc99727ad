#include "kilvo/input/clock_steps.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/input/timeline.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo {
namespace {

// So many samples in a row show that the time stays where it went, when so many messages of the others say so too.
constexpr int few_witnesses = 3;
// Beyond, the robot need not be where it was: nothing is remembered for so long.
constexpr Duration longest_clock_step = std::chrono::seconds(2);
// Legs that come as often are a clock.
constexpr Duration often = std::chrono::milliseconds(5);
// The years 1933 to 2116; and steps of 36 years in all. Beyond, differences of times are no times any more.
constexpr Duration era = Duration(std::int64_t{1} << 60);

bool are_neighbours(Time a, Time b) { return b > a && to_seconds(b - a) < blind_gap; }

// Of two durations that may be too far apart for a Duration, s.
double distance(Duration a, Duration b) { return std::abs(to_seconds(a) - to_seconds(b)); }

bool is_often(const ClockModel& clock) { return clock.spacing > Duration(0) && clock.spacing <= often; }

}  // namespace

std::optional<Reason> ClockSteps::follow_imu(Time t) {
  Clock& imu = this->imu();
  const Time now = t + imu.offset;
  if (!imu.newest) return imu.note(now), std::nullopt;
  const Duration since = now - *imu.newest;
  const bool alone_ahead = since > ClockModel::stamp_jitter && has_run_ahead(now);
  // After a gap the next one goes on from there, else the stamp was wrong.
  const bool is_gap = imu.is_gap(since);
  went_on_ = is_gap && suspect_ && are_neighbours(*suspect_, now);
  suspect_ = is_gap ? std::optional(now) : std::nullopt;
  if (is_gap && !went_on_ && !alone_ahead) return Reason::time_jump;
  if (since > -ClockModel::stamp_jitter && to_seconds(since) < blind_gap && !alone_ahead) {
    if (is_gap) note_hole(now);
    if (since > Duration(0)) imu.note(now);
    legs_then_ = legs().newest;
    run_ = {};
    return std::nullopt;
  }
  if (is_late(now)) return Reason::late;
  run_.add(now);
  const bool back = since < Duration(0);
  const bool with_others = run_.with >= few_witnesses && run_.with > run_.without;
  const bool alone = run_.without >= few_witnesses && run_.without > run_.with && is_often(legs());
  const bool seconded = run_.length >= few_witnesses && (alone || (back && with_others));
  if (back && !seconded && (run_.length < clock_witnesses || !is_sure())) return Reason::clock_back;
  if (alone_ahead && !seconded && run_.length < clock_witnesses) return Reason::clock_forward;
  if (!back && !alone_ahead && run_.length < clock_witnesses) return std::nullopt;
  const Run run = std::exchange(run_, {});
  // Ahead with all the others, it is a gap, or a mistake: the timeline looks into that.
  if (!back && !(alone_ahead && seconded)) return note_hole(run.first), imu.newest = now, std::nullopt;
  // Nothing is missing: the first of them came one period after the newest before.
  last_ = *imu.newest + (now - run.first) / (run.length - 1) - run.first;
  if (back && !alone && last_ > longest_clock_step) return restart(t), std::nullopt;
  if (std::chrono::abs(imu.offset + last_) > era) return Reason::clock_back;
  ++count_;
  for (Clock& clock : clocks_) clock.may_step_until = Time::max();
  imu.offset += last_;
  imu.newest = now + last_;
  return std::nullopt;
}

void ClockSteps::restart(Time imu) {
  ClockSteps fresh;
  fresh.restarts_ = restarts_ + 1;
  fresh.count_ = count_;
  fresh.last_ = last_;
  fresh.imu().newest = imu;
  *this = fresh;
}

void ClockSteps::Run::add(Time t) {
  if (length == 0 || !are_neighbours(newest, t)) *this = {.first = t};
  ++length;
  newest = t;
}

// The others must have shown whether they went back as well; when there are none, nothing is waited for.
bool ClockSteps::is_sure() const {
  const bool alone = std::ranges::none_of(clocks_, [](const Clock& clock) { return clock.usual_lag.has_value(); });
  return alone || run_.with + run_.without > 0 || run_.newest - run_.first > clock_jump;
}

// What was missing comes late: a time that had gone back would repeat stamps that were there.
bool ClockSteps::is_late(Time now) const {
  return std::ranges::any_of(holes_, [now](const auto& hole) { return hole.first < now && now < hole.second; });
}

// The IMU's time has gone on by more than that of the legs. In a gap they go on as well.
bool ClockSteps::has_run_ahead(Time now) const {
  if (!legs().lag || !legs_then_ || !is_often(legs())) return false;
  const Time newest = *imu().newest;
  const bool legs_went_on = *legs().newest - *legs_then_ > (now - newest) / 2;
  const Time due = std::max(newest, *legs().newest + *legs().lag);
  return !legs_went_on && now - due > ClockModel::stamp_jitter + imu().spacing + legs().spacing;
}

void ClockSteps::vote(const Clock& clock, Time t) {
  if (!clock.usual_lag) return;
  const Time newest = *imu().newest;
  const Duration step = newest - run_.first;
  const Duration lag = newest + (run_.newest - run_.first) - (t + clock.offset);
  const double with_it = distance(lag, *clock.usual_lag + step), without_it = distance(lag, *clock.usual_lag);
  if (std::min(with_it, without_it) > 0.5 * std::abs(to_seconds(step))) return;  // late by something else
  ++(with_it < without_it ? run_.with : run_.without);
}

// Of the IMU's clock, or of one of its own that did not step: the messages come as long after the IMU's as ever.
void ClockSteps::follow_other(Clock& clock, Time t) {
  const Time newest = *imu().newest;
  const Duration stays = newest - (t + clock.offset), steps = newest - (t + imu().offset);
  const Duration usual = clock.usual_lag.value_or(steps);
  if (newest < clock.may_step_until) clock.may_step_until = std::min(clock.may_step_until, newest + clock_jump);
  if (newest < clock.may_step_until && distance(steps, usual) < distance(stays, usual)) clock.offset = imu().offset;
  const Duration lag = newest - (t + clock.offset);
  const double most = to_seconds(least_silence);  // one message that is late by hours is not to be followed
  clock.usual_lag = usual + from_seconds(std::clamp(to_seconds(lag) - to_seconds(usual), -most, most) / 10);
  clock.note_lag(lag, longest_clock_step);
}

std::optional<Reason> ClockSteps::follow(Measurement& m) {
  const Time t = stamp_of(m);
  if (t < Time(-era) || t > Time(4 * era)) return Reason::absurd_stamp;
  Clock& clock = clocks_[m.index()];
  std::optional<Reason> fault;
  if (std::holds_alternative<ImuSample>(m)) {
    fault = follow_imu(t);
  } else {
    if (imu().newest && run_.length == 0) follow_other(clock, t);
    if (imu().newest && run_.length > 0) vote(clock, t);
    clock.note(t + clock.offset);
  }
  if (!fault || fault == Reason::time_jump) std::visit([&](auto& x) { x.t += clock.offset; }, m);
  return fault;
}

}  // namespace kilvo
