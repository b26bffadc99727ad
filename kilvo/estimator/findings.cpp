// What is reported beside the states: events, as they become true.
#include <algorithm>
#include <string>

#include "kilvo/estimator/estimator.hpp"

namespace kilvo {
namespace {

// The streams are looked at so often, and over so long what was used of them.
constexpr Duration streams_period = std::chrono::seconds(1), use_period = std::chrono::seconds(10);
// Fewer messages than these say nothing of a sensor.
constexpr std::uint64_t few = 20;

// What every start has, and what the user asked for.
bool is_usual(Reason r) {
  return r == Reason::not_used || r == Reason::before_start || r == Reason::before_motion || r == Reason::before_sweep;
}

}  // namespace

std::vector<std::string> warnings_of(const Statistics& statistics) {
  std::vector<std::string> out;
  for (const Event& event : statistics.events) {
    if (row_of(event.reason).severity != Severity::notice) out.push_back(text_of(event));
  }
  return out;
}

Time Estimator::now() const { return estimate_ ? estimate_->t : health_.heard(Sensor::imu).value_or(Time{}); }

void Estimator::report(std::optional<Sensor> sensor, Reason reason, double value, std::string detail) {
  events_.raise({now(), sensor, reason, value, 1, std::move(detail)});
  statistics_.events = events_.all();
}

void Estimator::drop(Sensor sensor, Reason reason, const std::string& text) {
  const auto s = static_cast<std::size_t>(sensor);
  ++statistics_.sensors[s].dropped[text.empty() ? text_of(reason) : text];
  ++drops_[s][static_cast<std::size_t>(reason)];
}

void Estimator::change_modality(Modality modality, Reason cause) {
  modality_ = modality;
  cause_ = cause;
  report({}, cause);
}

void Estimator::look_at_streams(Time t) {
  if (t - streams_looked_at_ < streams_period) return;
  streams_looked_at_ = t;
  report_streams();
  look_at_agreement(t);
  if (t - use_looked_at_ < use_period) return;
  use_looked_at_ = t;
  report_use(used_before_);
  for (std::size_t s = 0; s < sensor_count; ++s) used_before_.used[s] = statistics_.sensors[s].used;
  used_before_.dropped = drops_;
  used_before_.unsupported = statistics_.unsupported;
}

void Estimator::note_clipping(ImuSample& s) {
  clipping_.mark(s);
  if (!s.gyro_clipped && !s.accel_clipped) return;
  const std::uint64_t count = health_.count_clipped();
  const double value = s.gyro_clipped ? s.gyro.cwiseAbs().maxCoeff() : s.accel.cwiseAbs().maxCoeff();
  events_.state({now(), Sensor::imu, s.gyro_clipped ? Reason::gyro_clipped : Reason::accel_clipped, value, count, {}});
}

// What the streams themselves showed.
void Estimator::report_streams() {
  statistics_.health = health_.streams();
  for (std::size_t s = 0; s < sensor_count; ++s) {
    const StreamHealth& stream = statistics_.health[s];
    const auto sensor = static_cast<Sensor>(s);
    constexpr double late = 0.25;  // s
    if (stream.off_clock > 4) events_.state({now(), sensor, Reason::clock_ahead, stream.clock_offset, stream.off_clock, {}});
    if (stream.messages > few && stream.mean_lag > late) events_.state({now(), sensor, Reason::lagging, stream.mean_lag, 1, {}});
    if (stream.frozen > 0) events_.state({now(), sensor, Reason::froze, 0, stream.frozen, {}});
  }
  constexpr double far_more = 10;
  if (const double noise = replay_.accel_noise(); noise > far_more * config_.noise.accel)
    events_.state({now(), Sensor::imu, Reason::noisy_accel, noise, 1, {}});
  if (events_.all() != statistics_.events) statistics_.events = events_.all();
}

// A sensor that was there and of little use since `before` is what the user must know of first.
void Estimator::report_use(const Use& before) {
  const std::uint64_t legs = statistics_.sensors[static_cast<std::size_t>(Sensor::legs)].used;
  const std::uint64_t unsupported = statistics_.unsupported - before.unsupported;
  // Even who runs has a foot on the ground for more than half of the time.
  if (unsupported > few && 2 * unsupported > legs - before.used[static_cast<std::size_t>(Sensor::legs)]) {
    const double share = static_cast<double>(statistics_.unsupported) / static_cast<double>(legs);
    events_.state({now(), Sensor::legs, Reason::feet_not_still, share, 1, {}});
  }
  for (std::size_t s = 0; s < sensor_count; ++s) {
    const std::uint64_t used = statistics_.sensors[s].used;
    for (std::size_t r = 0; r < reason_count; ++r) {
      const auto reason = static_cast<Reason>(r);
      const std::uint64_t dropped = drops_[s][r] - before.dropped[s][r];
      if (is_usual(reason) || dropped < few || 10 * dropped < used - before.used[s]) continue;
      const double ahead = reason == Reason::clock_ahead ? statistics_.health[s].clock_offset : 0;
      events_.state({now(), static_cast<Sensor>(s), reason, ahead, drops_[s][r], {}});
    }
  }
  const auto lidar = static_cast<std::size_t>(Sensor::lidar), nowhere = static_cast<std::size_t>(Reason::fits_nowhere);
  const std::uint64_t refused = drops_[lidar][nowhere] - before.dropped[lidar][nowhere];
  if (!statistics_.diverged && refused > few && refused > statistics_.sensors[lidar].used - before.used[lidar]) {
    contradict(Reason::diverged, Sensor::lidar, witness_against(Sensor::lidar), static_cast<double>(refused),
               "most sweeps did not fit the map where they should have been");
  }
  if (events_.all() != statistics_.events) statistics_.events = events_.all();
}

}  // namespace kilvo
