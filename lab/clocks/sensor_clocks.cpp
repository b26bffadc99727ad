#include "lab/clocks/sensor_clocks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace kilvo::lab {
namespace {

// A message cannot come before what it tells. Only the IMU's own delay can make it seem so, and an IMU that comes two seconds late serves
// no robot. On the other side, what is compressed, queued and sent over a radio may come seconds late, and is late then (the estimator says
// so); no driver keeps a message for ten seconds.
constexpr Duration most_early = std::chrono::seconds(2), most_late = std::chrono::seconds(10);
// Another clock is believed after so long, and so many messages.
constexpr Duration evidence = std::chrono::seconds(1);
constexpr std::size_t fewest = 3;
// Of each stretch of time the least delay is taken.
constexpr Duration stretch = std::chrono::seconds(2);
// Sensors whose clocks seem so near to each other have one and the same: what is between them are their delays. Devices that have
// been switched on at different times differ by more.
constexpr Duration one_clock = std::chrono::milliseconds(100);
// The IMU comes often: so long shows whether its clock has stepped. One that is silent for longer tells nothing about the others.
constexpr Duration imu_evidence = std::chrono::milliseconds(50), other_evidence = std::chrono::milliseconds(300);
constexpr Duration silence = std::chrono::milliseconds(500);
// Stamps farther from the arrival are of no clock, s (beyond, differences are no times any more).
constexpr double absurd = 4.5e9;

bool is_possible(Duration later_than_imu) { return later_than_imu > -most_early && later_than_imu < most_late; }

Time completion_of(const Measurement& m) {
  const auto* scan = std::get_if<LidarScan>(&m);
  return scan == nullptr ? stamp_of(m) : end_of(*scan);
}

struct Delays {
  Duration usual, least;
};

// What had waited for the recorder comes with long delays, nine in ten at most; one wrong stamp may make a delay as short as it likes.
template <class T>
Delays summary_of(const T& of) {
  std::vector<Duration> all;
  all.reserve(of.size());
  for (const auto& x : of) all.push_back(x.delay);
  const auto low = all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size() - 1, std::max<std::size_t>(1, all.size() / 10)));
  std::ranges::nth_element(all, low);
  Delays out{*low, *low};
  for (const Duration d : all) {
    if (out.usual - d < one_clock) out.least = std::min(out.least, d);
  }
  return out;
}

}  // namespace

void SensorClocks::Stream::add(Time arrived, Duration delay) {
  // Times of arrival that go back are of another recording.
  if (!delays.empty() && arrived < delays.back().arrived) delays.clear();
  if (delays.empty()) first = arrived;
  delays.push_back({arrived, delay});
  while (delays.size() > fewest && arrived - delays.front().arrived > evidence) delays.pop_front();
}

SensorClocks::SensorClocks(const std::array<double, sensor_count>& time_offsets)
    : time_offsets_(time_offsets), imu_delays_(other_evidence) {
  forget_steps();
}

void SensorClocks::note(const Measurement& m, Time arrived) {
  const Sensor sensor = sensor_of(m);
  Stream& stream = streams_[index_of(sensor)];
  if (std::abs(to_seconds(arrived.time_since_epoch()) - to_seconds(stamp_of(m).time_since_epoch())) > absurd) return;
  follow_steps(sensor, stamp_of(m), arrived);
  if (stream.steps.pending()) return;
  const Duration correction = stream.steps.correction();
  const Time now = unset(arrived);
  if (!is_arrival_unclear_) follow_drift(stream, now, now - stamp_of(m) - correction);
  if (is_given_up_ || stream.is_judged) return;
  stream.add(now, now - completion_of(m) - correction);
  for (const Sensor other : all_sensors) {
    if (is_to_be_judged(other) && (other == sensor || sensor == Sensor::imu)) judge(other, now);
  }
}

void SensorClocks::give_up() {
  is_given_up_ = true;
  for (Stream& stream : streams_) stream.steps.interrupt();
}

void SensorClocks::wait_no_longer() {
  if (std::ranges::any_of(all_sensors, [this](Sensor s) { return is_to_be_judged(s); })) return give_up();
  for (Stream& stream : streams_) {
    if (stream.steps.pending()) stream.steps.interrupt();
  }
}

void SensorClocks::follow_arrival(Sensor s, Time stamp, Time arrived) {
  if (imu_ && arrived - *newest_ > silence) doubt_arrival();
  newest_ = std::max(newest_.value_or(arrived), arrived);
  if (s != Sensor::imu || goes_back(stamp, arrived)) return;
  const auto before = std::exchange(imu_, Message{stamp, arrived});
  if (is_arrival_unclear_ && before) compare_arrival(stamp - before->stamp, stamp, arrived);
  if (!is_arrival_unclear_ && !streams_[index_of(s)].steps.pending()) imu_delays_.add(unset(arrived), imu_delay(stamp, arrived));
}

// One message of the IMU may be out of its order; more are of another recording, or the clock of arrival was set back.
bool SensorClocks::goes_back(Time stamp, Time arrived) {
  const bool is_back = imu_ && imu_->arrived - arrived > one_clock, is_out_of_order = is_back && stamp < imu_->stamp;
  const bool was_out_of_order = std::exchange(is_out_of_order_, is_out_of_order);
  if (!is_back) return false;
  if (is_out_of_order && !was_out_of_order) return true;
  newest_ = arrived;
  if (!is_out_of_order) {
    doubt_arrival();
    return false;
  }
  forget_steps();
  set_ahead_ = Duration(0);
  imu_delays_ = LeastDelay(other_evidence);
  is_arrival_unclear_ = false;
  imu_.reset();
  return false;
}

void SensorClocks::doubt_arrival() {
  if (is_arrival_unclear_) return;
  is_arrival_unclear_ = true;
  heard_again_.reset();
  for (Stream& stream : streams_) stream.steps.postpone();
}

// Where the IMU's messages only waited, they come in a burst and then as ever; one that is noted late comes as ever.
void SensorClocks::compare_arrival(Duration went_on, Time stamp, Time arrived) {
  const Duration delay = imu_delay(stamp, arrived), later = delay - imu_delays_.value();
  is_arrival_unclear_ = went_on > Duration(0) && went_on < silence && (later > silence / 2 || later < -one_clock / 2);
  if (!is_arrival_unclear_) return;
  if (!heard_again_) heard_again_.emplace(other_evidence);
  heard_again_->add(arrived, delay);
  if (heard_again_->observed() < other_evidence) return;
  set_ahead_ += heard_again_->value() - imu_delays_.value();
  is_arrival_unclear_ = false;
}

void SensorClocks::follow_steps(Sensor s, Time stamp, Time arrived) {
  follow_arrival(s, stamp, arrived);
  StampSteps& steps = streams_[index_of(s)].steps;
  if (!imu_ || arrived - imu_->arrived > silence) return steps.postpone();
  if (is_arrival_unclear_ || (s == Sensor::imu && is_out_of_order_)) return;
  const auto jump = steps.pending();
  const int count = steps.count();
  steps.note(stamp, unset(arrived));
  if (s == Sensor::imu && steps.count() > count && is_replay(*jump, unset(arrived))) forget_steps();
}

// All go back together, by more than a clock does that is disciplined: a recording is played again, and has its own stamps.
bool SensorClocks::is_replay(Duration imu_jump, Time now) const {
  int heard = 0, together = 0;
  for (const Sensor s : all_sensors) {
    const StampSteps& steps = streams_[index_of(s)].steps;
    if (s == Sensor::imu || !steps.heard() || now - *steps.heard() > other_evidence / 2) continue;
    ++heard;
    together += steps.pending() && std::chrono::abs(*steps.pending() - imu_jump) < one_clock ? 1 : 0;
  }
  return imu_jump < -most_early && heard > 0 && together == heard;
}

void SensorClocks::forget_steps() {
  for (const Sensor s : all_sensors) streams_[index_of(s)].steps = StampSteps(s == Sensor::imu ? imu_evidence : other_evidence);
}

void SensorClocks::follow_drift(Stream& stream, Time arrived, Duration delay) {
  if (!stretch_ || arrived < *stretch_) stretch_ = arrived;
  stream.least = stream.least ? std::min(*stream.least, delay) : delay;
  if (arrived - *stretch_ < stretch) return;
  stretch_ = arrived;
  const auto of_imu = streams_[index_of(Sensor::imu)].least;
  for (Stream& s : streams_) {
    if (s.least && of_imu) s.drift.add(arrived, to_seconds(*s.least - *of_imu));
    if (s.drift.rate() != 0) s.known_drift = s.drift.rate();
    s.least.reset();
  }
}

void SensorClocks::judge(Sensor s, Time arrived) {
  Stream& stream = streams_[index_of(s)];
  const Stream& imu = streams_[index_of(Sensor::imu)];
  if (imu.delays.empty()) return;
  const Delays its = summary_of(stream.delays), of_imu = summary_of(imu.delays);
  const bool is_same = is_possible(its.usual - of_imu.usual);
  const bool is_enough =
      stream.delays.size() >= fewest && imu.delays.size() >= fewest && arrived - std::max(*stream.first, *imu.first) >= evidence;
  if (!is_same && !is_enough) return;
  stream.is_judged = true;
  stream.delays.clear();
  if (is_same) return;
  const Duration set = from_seconds(time_offsets_[index_of(s)]);
  Duration clock = its.least - of_imu.least + set;
  // The one with the shortest way tells best.
  for (const Stream& other : streams_) {
    if (other.clock && std::chrono::abs(*other.clock - clock) < one_clock) clock = std::min(clock, *other.clock);
  }
  stream.clock = clock;
  // A small setting is the user's, for what times of arrival do not tell; a large one was for other clocks.
  stream.offset = std::chrono::abs(set) < most_early ? clock : clock - set;
}

void SensorClocks::correct(Measurement& m, Time arrived) const {
  const Stream& stream = streams_[index_of(sensor_of(m))];
  const Duration step = is_arrival_unclear_ ? stream.steps.correction() : stream.steps.correction_at(unset(arrived));
  const Duration by = stream.offset.value_or(Duration(0)) + stream.drift.correction() + step;
  std::visit([by](auto& x) { x.t += by; }, m);
}

std::string SensorClocks::finding(Sensor s) const {
  if (!offset(s)) return {};
  const double by = to_seconds(*offset(s));
  const std::string name = name_of(s);
  return name + ": its stamps are of another clock than the IMU's: by the times of arrival they lie " + std::to_string(std::abs(by)) +
         " s " + (by > 0 ? "before" : "after") + " the IMU's, and are moved by that. Synchronise the clocks; for these data " + name +
         ".time_offset: " + std::to_string(time_offsets_[index_of(s)] + by) + " does the same";
}

std::string SensorClocks::step_finding(Sensor s) const {
  const StampSteps& steps = streams_[index_of(s)].steps;
  if (steps.count() == 0) return {};
  return name_of(s) + std::string(": its clock was set while it sent, ") + std::to_string(steps.count()) +
         (steps.count() == 1 ? " time" : " times") + ": by the times of arrival its stamps are moved by " +
         std::to_string(to_seconds(steps.correction())) + " s from then on. Synchronise the clocks before";
}

std::string SensorClocks::drift_finding(Sensor s) const {
  const double drift = streams_[index_of(s)].known_drift;
  if (drift == 0) return {};
  const std::string name = name_of(s);
  return name + ": its clock is " + std::to_string(static_cast<int>(std::round(1e6 * std::abs(drift)))) + " parts in a million " +
         (drift > 0 ? "faster" : "slower") +
         " than the IMU's, by the times of arrival; its stamps follow the IMU's from then on. Synchronise the clocks";
}

}  // namespace kilvo::lab
