#include "kilvo/input/clock_steps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/input/timeline.hpp"

namespace kilvo {
namespace {

// What goes back by less has come late.
constexpr Duration least_step = std::chrono::milliseconds(15);
// So many samples in a row show that the time stays where it went, when so many messages of the others say so too.
constexpr int few_witnesses = 3, votes = 3;
// Beyond, the robot need not be where it was: nothing is remembered for so long.
constexpr Duration longest_step = std::chrono::seconds(2);
// Samples that follow each other are no farther apart.
constexpr Duration longest_interval = std::chrono::milliseconds(100);
// Legs that come as often are a clock.
constexpr Duration often = std::chrono::milliseconds(5);
// For so long nobody else need speak for a step to be believed; so long after it the others show whether they went with it.
constexpr Duration patience = std::chrono::seconds(1);
// The years 1933 to 2116; and steps of 36 years in all. Beyond, differences of times are no times any more.
constexpr Time earliest = time_from_ns(-(std::int64_t{1} << 60)), latest = time_from_ns(std::int64_t{1} << 62);
constexpr Duration largest_offset = Duration(std::int64_t{1} << 60);

double distance(Duration a, Duration b) { return std::abs(to_seconds(a) - to_seconds(b)); }

}  // namespace

std::optional<Reason> ClockSteps::follow_imu(Time t) {
  Duration& offset = offset_[index_of(Sensor::imu)];
  const Time now = t + offset;
  const bool near = !imu_ || (now > *imu_ - least_step && now < *imu_ + longest_interval);
  const bool alone_ahead = imu_ && now > *imu_ + least_step && has_run_ahead(now);
  const bool waits = must_wait(now);
  if (!alone_ahead && waits) return Reason::time_jump;
  if (near && !alone_ahead) {
    if (imu_ && now - *imu_ > 5 * period_ / 2) note_hole(now);
    if (imu_ && now > *imu_) period_ = std::min(now - *imu_, period_ + period_ / 8);
    // The most of lately: less, when the IMU comes late.
    if (legs_) legs_behind_ = std::max(now - *legs_, legs_behind_.value_or(now - *legs_) - period_ / 512);
    elsewhere_ = 0;
    legs_then_ = legs_;
    imu_ = std::max(imu_.value_or(now), now);
    return std::nullopt;
  }
  if (is_late(now)) return Reason::late;
  const bool goes_on = elsewhere_ > 0 && now > newest_there_ && now - newest_there_ < longest_interval;
  if (!goes_on) {
    first_there_ = now;
    for_ = against_ = 0;
  }
  elsewhere_ = goes_on ? elsewhere_ + 1 : 1;
  newest_there_ = now;
  const bool back = now < *imu_;
  const bool with_others = for_ >= votes && for_ > against_, alone = against_ >= votes && against_ > for_ && legs_spacing_ < often;
  const bool seconded = elsewhere_ >= few_witnesses && (alone || (back && with_others));
  if (back && !seconded && (elsewhere_ < clock_witnesses || !is_sure())) return Reason::clock_back;
  if (alone_ahead && !seconded && elsewhere_ < clock_witnesses) return Reason::clock_forward;
  if (!back && !alone_ahead && elsewhere_ < clock_witnesses) return std::nullopt;
  const int there = std::exchange(elsewhere_, 0);
  // Ahead with all the others, it is a gap, or a mistake: the timeline looks into that.
  if (!back && !(alone_ahead && seconded)) return note_hole(first_there_), imu_ = now, std::nullopt;
  // Nothing is missing: the first of them came one period after the newest before.
  const Duration period = (now - first_there_) / (there - 1);
  last_ = *imu_ + period - first_there_;
  if (back && !alone && last_ > longest_step) return restart(t), std::nullopt;
  if (offset + last_ > largest_offset || offset + last_ < -largest_offset) return Reason::clock_back;
  ++count_;
  open_until_.fill(std::nullopt);
  open_.fill(true);
  offset += last_;
  imu_ = now + last_;
  return std::nullopt;
}

void ClockSteps::restart(Time imu) {
  ClockSteps fresh;
  fresh.restarts_ = restarts_ + 1;
  fresh.count_ = count_;
  fresh.last_ = last_;
  fresh.imu_ = imu;
  *this = fresh;
}

// The others must have said whether they went back as well; when nobody else speaks, nobody is asked.
bool ClockSteps::is_sure() const {
  const bool alone = std::ranges::none_of(lag_, [](const auto& lag) { return lag.has_value(); });
  return alone || for_ + against_ > 0 || newest_there_ - first_there_ > patience;
}

// What was missing comes late: a time that had gone back would repeat stamps that were there.
bool ClockSteps::is_late(Time now) const {
  return std::ranges::any_of(holes_, [now](const auto& hole) { return hole.first < now && now < hole.second; });
}

// A stamp of the IMU lies ahead by more than a missing sample or jitter makes: after a gap the next one goes on from there, else it is
// wrong.
bool ClockSteps::must_wait(Time now) {
  constexpr Duration jitter = std::chrono::milliseconds(10);
  went_on_ = false;
  if (!imu_ || now - *imu_ <= std::max(jitter, 5 * period_ / 2)) return suspect_.reset(), false;
  went_on_ = suspect_ && now > *suspect_ && now - *suspect_ < longest_interval;
  suspect_ = now;
  return !went_on_;
}

// The IMU's time has gone on by more than that of the legs. In a gap they go on as well.
bool ClockSteps::has_run_ahead(Time now) const {
  if (!legs_behind_ || !legs_then_ || legs_spacing_ > often) return false;
  const bool legs_went_on = *legs_ - *legs_then_ > (now - *imu_) / 2;
  return !legs_went_on && now - std::max(*imu_, *legs_ + *legs_behind_) > least_step + period_;
}

void ClockSteps::vote(std::size_t s, Time t) {
  if (!lag_[s]) return;
  const Duration step = *imu_ - first_there_;
  const Duration stays = *imu_ + (newest_there_ - first_there_) - (t + offset_[s]);
  const double with_it = distance(stays, *lag_[s] + step), without_it = distance(stays, *lag_[s]);
  if (std::min(with_it, without_it) > 0.5 * std::abs(to_seconds(step))) return;  // late by something else
  ++(with_it < without_it ? for_ : against_);
}

std::optional<Reason> ClockSteps::follow(Measurement& m) {
  const Sensor sensor = sensor_of(m);
  const auto s = index_of(sensor);
  const Time t = stamp_of(m);
  if (t < earliest || t > latest) return Reason::absurd_stamp;
  std::optional<Reason> fault;
  if (sensor == Sensor::imu) fault = follow_imu(t);
  if (sensor == Sensor::legs) {
    const Time now = t + offset_[s];
    if (legs_ && now > *legs_) legs_spacing_ = std::min(now - *legs_, legs_spacing_ + legs_spacing_ / 8);
    legs_ = now;
  }
  if (sensor != Sensor::imu && imu_ && elsewhere_ == 0) {
    // Of the IMU's clock, or of one of its own that did not step: the messages come as long after the IMU's as ever.
    const Duration imu_offset = offset_[index_of(Sensor::imu)];
    const Duration stays = *imu_ - (t + offset_[s]), steps = *imu_ - (t + imu_offset);
    const Duration usual = lag_[s].value_or(steps);
    if (open_[s] && !open_until_[s]) open_until_[s] = *imu_ + patience;
    open_[s] = open_[s] && *imu_ < *open_until_[s];
    if (open_[s] && distance(steps, usual) < distance(stays, usual)) offset_[s] = imu_offset;
    const Duration lag = *imu_ - (t + offset_[s]);
    constexpr double most = 0.05;  // s; one message that is late by hours is not to be followed
    lag_[s] = usual + from_seconds(std::clamp(to_seconds(lag) - to_seconds(usual), -most, most) / 10);
    newest_[s] = std::max(newest_[s].value_or(t + offset_[s]), t + offset_[s]);
  } else if (sensor != Sensor::imu && imu_) {
    vote(s, t);
  }
  if (!fault || fault == Reason::time_jump) std::visit([&](auto& x) { x.t += offset_[s]; }, m);
  return fault;
}

}  // namespace kilvo
