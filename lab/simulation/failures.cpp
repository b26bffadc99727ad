#include "lab/simulation/failures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace kilvo::lab {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
// Seconds beyond which a time means "for ever".
constexpr double for_ever = 1e9;

Time after(Time begin, double seconds) { return seconds < for_ever ? begin + from_seconds(seconds) : Time::max(); }

Time& stamp_in(Measurement& measurement) {
  return std::visit([](auto& m) -> Time& { return m.t; }, measurement);
}

void make_nan(Measurement& measurement) {
  if (auto* imu = std::get_if<ImuSample>(&measurement)) {
    imu->gyro.setConstant(nan);
    imu->accel.setConstant(nan);
  } else if (auto* joints = std::get_if<JointSample>(&measurement)) {
    std::ranges::fill(joints->position, nan);
    std::ranges::fill(joints->velocity, nan);
  } else if (auto* scan = std::get_if<LidarScan>(&measurement)) {
    for (std::size_t i = 0; i < scan->points.size(); i += 2) scan->points[i].x = std::numeric_limits<float>::quiet_NaN();
  }
}

void add_noise(Measurement& measurement, double sigma, Random& random) {
  if (auto* imu = std::get_if<ImuSample>(&measurement)) {
    imu->gyro += sigma * random.gaussian3();
    imu->accel += sigma * random.gaussian3();
  } else if (auto* joints = std::get_if<JointSample>(&measurement)) {
    for (double& q : joints->position) q += sigma * random.gaussian();
  } else if (auto* scan = std::get_if<LidarScan>(&measurement)) {
    for (LidarPoint& p : scan->points) {
      for (float* x : {&p.x, &p.y, &p.z}) *x += static_cast<float>(sigma * random.gaussian());
    }
  } else if (auto* camera = std::get_if<CameraImage>(&measurement)) {
    for (std::uint8_t& grey : camera->image.pixels) {
      grey = static_cast<std::uint8_t>(std::clamp(std::lround(grey + sigma * random.gaussian()), 0L, 255L));
    }
  }
}

void darken(Measurement& measurement, double factor) {
  auto* camera = std::get_if<CameraImage>(&measurement);
  if (camera == nullptr) return;
  for (std::uint8_t& grey : camera->image.pixels) grey = static_cast<std::uint8_t>(std::clamp(std::lround(grey * factor), 0L, 255L));
}

void narrow(Measurement& measurement, double sector) {
  auto* scan = std::get_if<LidarScan>(&measurement);
  if (scan != nullptr) std::erase_if(scan->points, [&](const LidarPoint& p) { return std::abs(std::atan2(p.y, p.x)) > sector / 2; });
}

void wipe(Measurement& measurement) {
  auto* camera = std::get_if<CameraImage>(&measurement);
  if (camera == nullptr || camera->image.empty()) return;
  auto& pixels = camera->image.pixels;
  const std::uint64_t sum = std::accumulate(pixels.begin(), pixels.end(), std::uint64_t{0});
  std::ranges::fill(pixels, static_cast<std::uint8_t>(sum / pixels.size()));
}

void shake(Measurement& measurement, double s, double amplitude) {
  auto* imu = std::get_if<ImuSample>(&measurement);
  if (imu == nullptr) return;
  constexpr double frequency = 173;  // Hz
  imu->accel += amplitude * std::sin(2 * std::numbers::pi * frequency * s) * Eigen::Vector3d(0.6, 0.5, 0.62);
}

// The content of `before` at the time of `measurement`.
void freeze(Measurement& measurement, const std::optional<Measurement>& before) {
  if (!before) return;
  const Time t = stamp_of(measurement);
  measurement = *before;
  stamp_in(measurement) = t;
}

void freeze_half(Measurement& measurement, const std::optional<Measurement>& before, bool gyro) {
  auto* imu = std::get_if<ImuSample>(&measurement);
  if (imu == nullptr || !before) return;
  const ImuSample& last = std::get<ImuSample>(*before);
  (gyro ? imu->gyro : imu->accel) = gyro ? last.gyro : last.accel;
}

bool keeps_the_last(const Failure& failure) { return failure.kind == FailureKind::freeze || failure.kind == FailureKind::freeze_half; }

}  // namespace

FailingSource::FailingSource(MeasurementSource& source, std::vector<Failure> failures, Time begin, std::function<Time()> arrival,
                             std::uint64_t seed)
    : source_(source), failures_(std::move(failures)), met_(failures_.size()), begin_(begin), arrival_(std::move(arrival)), random_(seed) {}

bool FailingSource::is_on(const Failure& failure, Sensor sensor, Time arrived) const {
  return failure.sensor == sensor && arrived >= after(begin_, failure.from) && arrived < after(begin_, failure.until);
}

void FailingSource::spoil(const Failure& failure, Measurement& measurement) {
  switch (failure.kind) {
    case FailureKind::freeze:
      return freeze(measurement, before_[measurement.index()]);
    case FailureKind::freeze_half:
      return freeze_half(measurement, before_[measurement.index()], failure.amount > 0);
    case FailureKind::not_a_number:
      return make_nan(measurement);
    case FailureKind::noise:
      return add_noise(measurement, failure.amount, random_);
    case FailureKind::time_jump:
      stamp_in(measurement) += from_seconds(failure.amount);
      return;
    case FailureKind::darkness:
      return darken(measurement, failure.amount);
    case FailureKind::narrow_sector:
      return narrow(measurement, failure.amount);
    case FailureKind::textureless:
      return wipe(measurement);
    case FailureKind::vibration:
      return shake(measurement, to_seconds(stamp_of(measurement) - begin_), failure.amount);
    case FailureKind::drop:
    case FailureKind::random_loss:
    case FailureKind::delay:
    case FailureKind::duplicate:
      return;  // not of the content
  }
}

std::vector<const Failure*> FailingSource::without_effect() const {
  std::vector<const Failure*> out;
  for (std::size_t i = 0; i < failures_.size(); ++i) {
    if (!met_[i]) out.push_back(&failures_[i]);
  }
  return out;
}

void FailingSource::take(Measurement measurement, Time arrived) {
  const Sensor sensor = sensor_of(measurement);
  double delay = 0;
  bool twice = false, frozen = false;
  for (std::size_t i = 0; i < failures_.size(); ++i) {
    const Failure& failure = failures_[i];
    if (!is_on(failure, sensor, arrived)) continue;
    met_[i] = true;
    if (failure.kind == FailureKind::drop || (failure.kind == FailureKind::random_loss && random_.uniform() < failure.amount)) {
      ++dropped_[static_cast<std::size_t>(sensor)];
      return;
    }
    if (failure.kind == FailureKind::delay) delay += failure.amount;
    twice = twice || failure.kind == FailureKind::duplicate;
    frozen = frozen || keeps_the_last(failure);
  }
  const bool remember =
      !frozen && std::ranges::any_of(failures_, [&](const Failure& f) { return keeps_the_last(f) && f.sensor == sensor; });
  if (remember) before_[measurement.index()] = measurement;
  for (const Failure& failure : failures_) {
    if (is_on(failure, sensor, arrived)) spoil(failure, measurement);
  }
  for (int i = 0; i < (twice ? 2 : 1); ++i) {
    if (delay > 0) {
      held_.emplace(arrived + from_seconds(delay), measurement);
    } else {
      ready_.emplace_back(arrived, measurement);
    }
  }
}

std::optional<Measurement> FailingSource::next() {
  const auto arrival_of = [this](const Measurement& m) { return arrival_ ? arrival_() : stamp_of(m); };
  if (failures_.empty()) {
    auto measurement = source_.next();
    if (measurement) arrived_ = arrival_of(*measurement);
    return measurement;
  }
  while (ready_.empty()) {
    auto measurement = source_.next();
    const Time now = measurement ? arrival_of(*measurement) : Time::max();
    const auto due = held_.upper_bound(now);
    for (auto it = held_.begin(); it != due; ++it) ready_.emplace_back(it->first, std::move(it->second));
    held_.erase(held_.begin(), due);
    if (!measurement && ready_.empty()) return std::nullopt;
    if (measurement) take(*std::move(measurement), now);
  }
  arrived_ = ready_.front().first;
  Measurement out = std::move(ready_.front().second);
  ready_.pop_front();
  return out;
}

}  // namespace kilvo::lab
