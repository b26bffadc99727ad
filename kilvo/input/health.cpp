#include "kilvo/input/health.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/input/timeline.hpp"

namespace kilvo {
namespace {

// A measurement cannot have been taken so much later than the newest of the IMU, which arrives at once, s.
constexpr double most_ahead = 0.25, witnessed_ahead = 0.12;
// The clocks are compared over so long, s.
constexpr double clock_window = 0.05;
// So many messages without a repetition show that a sensor is alive and noisy: only then does sameness mean anything.
constexpr int alive = 20;
// Sameness that makes a sensor frozen: samples, s, scans, images.
constexpr int imu_same = 10, scans_same = 2, images_same = 4;
constexpr double legs_same = 0.03;
// Legs of a robot that stands may say the same for long; rates that vary by more than this are motion, rad/s.
constexpr double moving = 0.05;
constexpr double still_memory = 0.3;  // s

// Of some bytes spread over a block: two pictures of a noisy sensor never agree in all of them.
std::uint64_t fingerprint(const void* data, std::size_t bytes) {
  const auto* p = static_cast<const unsigned char*>(data);
  std::uint64_t h = 1469598103934665603ULL ^ bytes;
  const std::size_t stride = std::max<std::size_t>(1, bytes / 4096);
  for (std::size_t i = 0; i < bytes; i += stride) h = (h ^ p[i]) * 1099511628211ULL;
  return h;
}

// So many points of a sweep, spread over it, are compared with those of the sweep before; so many returns are not the same by chance
// (ranges in steps of millimetres repeat one in ten of a noisy sensor).
constexpr std::size_t compared_points = 256, telling_returns = 8;

std::optional<Reason> when(bool wrong, Reason r) { return wrong ? std::optional(r) : std::nullopt; }

bool is_return(const Eigen::Vector3f& p) { return p.allFinite() && !p.isZero(0); }

}  // namespace

std::optional<Reason> fault_of(const ImuSample& s) {
  constexpr double absurd_gyro = 300, absurd_accel = 5000;  // rad/s, m/s^2 (or g): beyond any IMU's range
  if (!s.gyro.allFinite() || !s.accel.allFinite()) return Reason::not_finite;
  if (s.gyro.isZero(0) && s.accel.isZero(0)) return Reason::all_zero;
  return when(s.gyro.norm() > absurd_gyro || s.accel.norm() > absurd_accel, Reason::absurd_value);
}

std::optional<Reason> fault_of(const JointSample& s) {
  constexpr double absurd = 100;  // rad or m, rad/s or m/s: no joint goes so far, or so fast
  const auto beyond = [](const std::vector<double>& values) {
    return std::ranges::any_of(values, [](double v) { return std::isfinite(v) && std::abs(v) > absurd; });
  };
  if (s.position.empty()) return Reason::empty;
  return when(beyond(s.position) || beyond(s.velocity), Reason::absurd_value);
}

std::optional<Reason> fault_of(const Measurement& m) {
  if (const auto* scan = std::get_if<LidarScan>(&m)) return when(scan->points.empty(), Reason::empty);
  if (const auto* image = std::get_if<CameraImage>(&m)) return when(image->image.empty(), Reason::empty);
  if (const auto* joints = std::get_if<JointSample>(&m)) return fault_of(*joints);
  const auto* imu = std::get_if<ImuSample>(&m);
  return imu == nullptr ? std::nullopt : fault_of(*imu);
}

Health::Health(const Robot& robot) : rates_(rates_of(robot)) {}

void Health::time(StreamHealth& stream, Tracker& tracker, Time t) {
  ++stream.messages;
  if (tracker.stamp && t > *tracker.stamp) {
    const double dt = to_seconds(t - *tracker.stamp);
    const double n = static_cast<double>(stream.messages - 1);
    const double off = dt - stream.mean_interval;
    stream.mean_interval += off / n;
    tracker.interval_squares += off * (dt - stream.mean_interval);
    stream.jitter = std::sqrt(tracker.interval_squares / n);
    stream.longest_gap = std::max(stream.longest_gap, dt);
  }
  tracker.stamp = t;
}

// A sensor that measures does not return all of its points twice to the last bit; a frozen one does, whichever of them are blank (NaN, 0).
bool Health::repeats(const LidarScan& scan) {
  const std::size_t stride = std::max<std::size_t>(1, scan.points.size() / compared_points) | 1;
  const bool comparable = std::exchange(cloud_size_, scan.points.size()) == scan.points.size();
  cloud_.resize((scan.points.size() + stride - 1) / stride, Eigen::Vector3f::Zero());
  std::size_t returns = 0, equal = 0;
  for (std::size_t i = 0; i < cloud_.size(); ++i) {
    const LidarPoint& p = scan.points[i * stride];
    const Eigen::Vector3f before = std::exchange(cloud_[i], {p.x, p.y, p.z});
    if (!is_return(before) || !is_return(cloud_[i])) continue;
    ++returns;
    equal += before == cloud_[i] ? 1 : 0;
  }
  return comparable && returns >= telling_returns && equal == returns;
}

bool Health::repeats(const Measurement& m) {
  if (const auto* imu = std::get_if<ImuSample>(&m)) return imu->gyro == imu_.gyro && imu->accel == imu_.accel;
  if (const auto* legs = std::get_if<JointSample>(&m)) {
    const bool same = legs->position == position_ && legs->velocity == velocity_;
    if (!same) position_.assign(legs->position.begin(), legs->position.end());
    if (!same) velocity_.assign(legs->velocity.begin(), legs->velocity.end());
    return same;
  }
  if (const auto* scan = std::get_if<LidarScan>(&m)) return repeats(*scan);
  const auto* image = std::get_if<CameraImage>(&m);
  if (image == nullptr) return false;
  const std::uint64_t print = fingerprint(image->image.pixels.data(), image->image.pixels.size());
  return std::exchange(picture_, print) == print;
}

// Either half may be frozen while the other goes on. At rest a half of few steps or with a dead band repeats itself: an acceleration that
// stays the same to the last bit while the robot turns does not, nor a rate that is no rest.
bool Health::half_is_frozen(const ImuSample& imu) {
  const auto is_frozen = [](Half& half, bool same) {
    half.same = same ? half.same + 1 : 0;
    if (!same || half.different < alive) half.different = same ? 0 : std::min(alive, half.different + 1);
    return half.different == alive && half.same >= imu_same;
  };
  const bool accel = is_frozen(accel_, imu.accel == imu_.accel), gyro = is_frozen(gyro_, imu.gyro == imu_.gyro);
  return (accel && imu_motion_ > moving) || (gyro && imu.gyro.norm() > moving);
}

// Repeated values carry nothing new. Of a sensor that never repeats itself they are not used, and enough of them mean that it is frozen.
std::optional<Reason> Health::judge_repeats(const Measurement& m, StreamHealth& stream, Tracker& tracker) {
  const Time t = stamp_of(m);
  const auto* imu = std::get_if<ImuSample>(&m);
  const bool half_frozen = imu != nullptr && half_is_frozen(*imu);
  if (!repeats(m)) {
    stream.repeated += half_frozen ? 1 : 0;
    if (half_frozen && !std::exchange(tracker.frozen, true)) ++stream.frozen;
    if (half_frozen) return Reason::frozen;
    tracker.same = 0;
    tracker.frozen = false;
    tracker.different = std::min(alive, tracker.different + 1);
    return std::nullopt;
  }
  ++stream.repeated;
  if (tracker.same++ == 0) tracker.same_since = t;
  const Sensor s = sensor_of(m);
  if (s == Sensor::imu && tracker.different < alive) return tracker.different = 0, std::nullopt;
  if (s == Sensor::legs && imu_motion_ < moving && !tracker.frozen) return tracker.same = 0, std::nullopt;
  const int many = s == Sensor::imu ? imu_same : s == Sensor::lidar ? scans_same : images_same;
  const bool frozen = s == Sensor::legs ? to_seconds(t - tracker.same_since) > legs_same : tracker.same >= many;
  if (frozen && !std::exchange(tracker.frozen, true)) ++stream.frozen;
  if (tracker.frozen) return Reason::frozen;
  // A pair of equal IMU samples may be a driver's; leg messages may come faster than the encoders are read.
  const bool may_be = s == Sensor::legs || (s == Sensor::imu && tracker.same < 2);
  if (may_be) return std::nullopt;
  return s == Sensor::camera ? Reason::repeated_image : Reason::repeated_values;
}

// The IMU is the clock. A stamp may lie ahead of it because the IMU is silent or late, with all others; or because that clock is wrong:
// then the IMU's messages have kept coming between those of the sensor.
bool Health::is_ahead(Sensor s, Time t, StreamHealth& stream, Tracker& tracker) {
  const auto& imu = trackers_[index_of(Sensor::imu)].stamp;
  const double rate = rates_[index_of(s)];
  const auto window = static_cast<std::uint64_t>(std::max(1.0, clock_window * rate));
  const std::uint64_t heard = streams_[index_of(Sensor::imu)].messages;
  ++tracker.since;
  const double expected = 0.5 * static_cast<double>(tracker.since + tracker.before) * rates_[0] / rate;
  const bool imu_speaks = static_cast<double>(heard - tracker.imu_before) >= expected && heard > tracker.imu_before;
  if (tracker.since >= window) {
    tracker.imu_before = tracker.imu_then;
    tracker.imu_then = heard;
    tracker.before = std::exchange(tracker.since, 0);
  }
  if (!imu || !imu_speaks) return false;
  const double offset = to_seconds(t - *imu);
  if (std::abs(offset) < 1.0) stream.mean_lag += (-offset - stream.mean_lag) / static_cast<double>(stream.messages + 1);
  // Beyond a second it is a jump, which the timeline looks into.
  if (offset < witnessed_ahead || offset > 1.0) return false;
  // All others ahead alike: it is the IMU that comes late. If none is, they are witnesses.
  int others = 0, ahead = 0;
  for (std::size_t k = 1; k < sensor_count; ++k) {
    if (k == index_of(s) || !trackers_[k].stamp) continue;
    ++others;
    ahead += to_seconds(*trackers_[k].stamp - *imu) > 0.5 * witnessed_ahead ? 1 : 0;
  }
  if (others > 0 && ahead == others) return false;
  if (offset < most_ahead && (others == 0 || ahead > 0)) return false;
  stream.clock_offset += (offset - stream.clock_offset) / static_cast<double>(++stream.off_clock);
  return true;
}

void Health::watch_imu(const Measurement& m) {
  if (const auto* imu = std::get_if<ImuSample>(&m)) {
    imu_ = *imu;
    imu_silence_ = 0;
    for (Tracker& tracker : trackers_) tracker.heard_since_imu.reset();
    const double share = std::min(1.0, 1.0 / (still_memory * rates_[0]));
    const Eigen::Vector3d off = imu->gyro - gyro_mean_;
    gyro_mean_ += share * off;
    imu_motion_ += share * (off.norm() - imu_motion_);
    return;
  }
  Tracker& tracker = trackers_[m.index()];
  if (!tracker.heard_since_imu) tracker.heard_since_imu = tracker.stamp;
  // What is older than the newest IMU sample has come late, unless its clock is another.
  Time since = *tracker.heard_since_imu;
  const auto& imu = trackers_[index_of(Sensor::imu)].stamp;
  if (imu && *imu > since && *imu - since < clock_jump) since = *imu;
  imu_silence_ = std::max(imu_silence_, std::min(1.0, to_seconds(*tracker.stamp - since)));
}

std::optional<Reason> Health::judge(const Measurement& m) {
  const Sensor s = sensor_of(m);
  StreamHealth& stream = streams_[m.index()];
  Tracker& tracker = trackers_[m.index()];
  const Time t = completion_of(m);
  // Duplicates and what comes late, between newer ones, are the timeline's business.
  if (tracker.stamp && t <= *tracker.stamp && *tracker.stamp - t < clock_jump) return std::nullopt;
  auto refused = judge_repeats(m, stream, tracker);
  if (!refused && s != Sensor::imu && is_ahead(s, t, stream, tracker)) refused = Reason::clock_ahead;
  if (refused) {
    ++stream.messages;
    return refused;
  }
  time(stream, tracker, t);
  watch_imu(m);
  return std::nullopt;
}

}  // namespace kilvo
