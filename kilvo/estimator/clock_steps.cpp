#include "kilvo/estimator/clock_steps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilvo {
namespace {

// What goes back by less has come late.
constexpr Duration least_step = std::chrono::milliseconds(15);
// So many samples in a row show that the time stays where it went; fewer, when so many messages of the others say so too.
constexpr int witnesses = 10, few_witnesses = 3, votes = 3;
// Samples that follow each other are no farther apart.
constexpr Duration longest_interval = std::chrono::milliseconds(100);
// For so long nobody else need speak for a step to be believed; so long after it the others show whether they went with it.
constexpr Duration patience = std::chrono::seconds(1);
// The years 1933 to 2116; and steps of 36 years in all. Beyond, differences of times are no times any more.
constexpr Time earliest = time_from_ns(-(std::int64_t{1} << 60)), latest = time_from_ns(std::int64_t{1} << 62);
constexpr Duration largest_offset = Duration(std::int64_t{1} << 60);

double distance(Duration a, Duration b) { return std::abs(to_seconds(a) - to_seconds(b)); }

}  // namespace

const char* ClockSteps::follow_imu(Time t) {
  Duration& offset = offset_[static_cast<std::size_t>(Sensor::imu)];
  const Time now = t + offset;
  if (!imu_ || (now > *imu_ - least_step && now < *imu_ + longest_interval)) {
    elsewhere_ = 0;
    imu_ = std::max(imu_.value_or(now), now);
    return nullptr;
  }
  const bool goes_on = elsewhere_ > 0 && now > newest_there_ && now - newest_there_ < longest_interval;
  if (!goes_on) {
    first_there_ = now;
    for_ = against_ = 0;
  }
  elsewhere_ = goes_on ? elsewhere_ + 1 : 1;
  newest_there_ = now;
  const bool back = now < *imu_;  // ahead, it may be a mistake: the timeline looks into that
  const bool seconded = back && elsewhere_ >= few_witnesses && for_ >= votes && for_ > against_;
  if (!seconded && (elsewhere_ < witnesses || (back && !is_sure()))) return back ? "its clock went back" : nullptr;
  const int there = std::exchange(elsewhere_, 0);
  if (!back) return imu_ = now, nullptr;
  // Nothing is missing: the first of them came one period after the newest before.
  const Duration period = (now - first_there_) / (there - 1);
  last_ = *imu_ + period - first_there_;
  if (offset + last_ > largest_offset) return "its clock went back";
  ++count_;
  open_until_.fill(std::nullopt);
  open_.fill(true);
  offset += last_;
  imu_ = now + last_;
  return nullptr;
}

// The IMU alone may just be late: the others must have gone back as well. When nobody else speaks, nobody is contradicted.
bool ClockSteps::is_sure() const {
  const bool alone = std::ranges::none_of(lag_, [](const auto& lag) { return lag.has_value(); });
  return alone || for_ > against_ || (for_ + against_ == 0 && newest_there_ - first_there_ > patience);
}

void ClockSteps::vote(std::size_t s, Time t) {
  if (!lag_[s]) return;
  const Duration step = *imu_ - first_there_;
  const Duration stays = *imu_ + (newest_there_ - first_there_) - (t + offset_[s]);
  ++(distance(stays, *lag_[s] + step) < distance(stays, *lag_[s]) ? for_ : against_);
}

const char* ClockSteps::follow(Measurement& m) {
  const Sensor sensor = sensor_of(m);
  const auto s = static_cast<std::size_t>(sensor);
  const Time t = stamp_of(m);
  if (t < earliest || t > latest) return "absurd stamp";
  if (sensor == Sensor::imu) {
    if (const char* fault = follow_imu(t)) return fault;
  } else if (imu_ && elsewhere_ == 0) {
    // Of the IMU's clock, or of one of its own that did not step: the messages come as long after the IMU's as ever.
    const Duration imu_offset = offset_[static_cast<std::size_t>(Sensor::imu)];
    const Duration stays = *imu_ - (t + offset_[s]), steps = *imu_ - (t + imu_offset);
    const Duration usual = lag_[s].value_or(steps);
    if (open_[s] && !open_until_[s]) open_until_[s] = *imu_ + patience;
    open_[s] = open_[s] && *imu_ < *open_until_[s];
    if (open_[s] && distance(steps, usual) < distance(stays, usual)) offset_[s] = imu_offset;
    const Duration lag = *imu_ - (t + offset_[s]);
    constexpr double most = 0.05;  // s; one message that is late by hours is not to be followed
    lag_[s] = usual + from_seconds(std::clamp(to_seconds(lag) - to_seconds(usual), -most, most) / 10);
  } else if (imu_) {
    vote(s, t);
  }
  std::visit([&](auto& x) { x.t += offset_[s]; }, m);
  return nullptr;
}

}  // namespace kilvo
