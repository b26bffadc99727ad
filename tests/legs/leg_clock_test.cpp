#include "lab/clocks/leg_clock.hpp"

#include <algorithm>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <optional>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace leg_clock_test {

using lab::DeviceClock;
using lab::LegClock;
using lab::LegClockConfig;
using lab::LowLevel;
using lab::TickCounter;

// What is wrong with the clocks of a robot. The IMU's stamps are right.
struct Fault {
  double late = 0;           // s, the legs' messages come so much later than the IMU's
  double offset = 0;         // s, the computer's clock is behind the IMU's by this
  double drift = 0;          // of the tick against the computer's clock
  double jitter = 0;         // s, sigma of the arrival
  double frozen_from = 1e9;  // s, from when on the tick stands still
  bool with_gyro = true;
};

Robot robot_of(const lab::SimulatorConfig& config) {
  Robot robot;
  std::ifstream file(KILVO_SOURCE_DIR "/config/robots/sim.urdf");
  robot.urdf.assign(std::istreambuf_iterator<char>(file), {});
  robot.imu.link = "torso_link";
  robot.imu.T_link_imu = config.shape.T_torso_imu();
  robot.legs.rate = config.joints.delivery.rate;
  const auto sole = config.shape.sole();
  robot.feet[0] = {"left", "left_ankle_roll_link", {sole.begin(), sole.end()}};
  robot.feet[1] = {"right", "right_ankle_roll_link", {sole.begin(), sole.end()}};
  return robot;
}

struct Event {
  Time arrived;
  Measurement m;
  LowLevel low_level;
  Time truth{};  // on the IMU's clock
};

// A walk as a robot's computer receives it.
class Walk {
 public:
  explicit Walk(double duration, const char* scenario = "room") : config_(test::only({Sensor::imu, Sensor::legs}, duration)) {
    config_.joints.delivery.rate = 500;
    lab::Simulator simulator(test::scenario(scenario), config_);
    start_ = simulator.start();
    walk_.emplace(simulator.walk());
    while (auto m = simulator.next()) {
      if (std::holds_alternative<ImuSample>(*m)) truth_.push_back(simulator.imu_truth());
      measured_.push_back({simulator.measured(), *std::move(m)});
    }
  }
  const lab::SimulatorConfig& config() const { return config_; }
  Time start() const { return start_; }
  SE3 pose_at(double seconds) const { return walk_->imu(seconds); }

  std::vector<Event> with(const Fault& fault) const {
    lab::Random random(7, 1);
    lab::LinkKinematics pelvis(robot_of(config_), "pelvis");
    std::vector<Event> out;
    std::array<Time, 2> last{};  // messages of one topic do not overtake each other
    for (const auto& [t, m] : measured_) {
      const bool is_legs = std::holds_alternative<JointSample>(m);
      const double delay = 0.003 + std::max(0.0, is_legs ? fault.late : -fault.late) + fault.jitter * std::abs(random.gaussian());
      Time& arrived = last[is_legs ? 1 : 0];
      arrived = std::max(arrived + Duration(1), t - from_seconds(fault.offset) + from_seconds(delay));
      Event event{arrived, m, {}, t};
      if (const auto* joints = std::get_if<JointSample>(&m)) {
        const double since = to_seconds(t - start_);
        event.low_level.tick = static_cast<std::uint32_t>(
            4294960000U + static_cast<std::uint64_t>(std::llround(1e3 * (1 + fault.drift) * std::min(since, fault.frozen_from))));
        const auto motion = pelvis.at(*joints);
        if (fault.with_gyro && motion)
          event.low_level.gyro = Eigen::Vector3d(motion->T_IL.R.inverse() * (rate_at(t) + motion->omega)) +
                                 0.005 * Eigen::Vector3d(random.gaussian(), random.gaussian(), random.gaussian());
        std::get<JointSample>(event.m).t = Time{};
      }
      out.push_back(std::move(event));
    }
    std::ranges::stable_sort(out, {}, &Event::arrived);
    return out;
  }

 private:
  Eigen::Vector3d rate_at(Time t) const {
    const auto after = std::ranges::lower_bound(truth_, t, {}, &lab::ImuTruth::t);
    if (after == truth_.begin() || after == truth_.end()) return truth_.front().gyro;
    const auto before = after - 1;
    const double share = to_seconds(t - before->t) / to_seconds(after->t - before->t);
    return before->gyro + share * (after->gyro - before->gyro);
  }

  lab::SimulatorConfig config_;
  Time start_;
  std::optional<lab::Walk> walk_;
  std::vector<std::pair<Time, Measurement>> measured_;
  std::vector<lab::ImuTruth> truth_;
};

const Walk& walk() {
  static const Walk once(20);
  return once;
}

struct Errors {
  double first = 1e9, last = -1e9;  // s, of the same: the smallest and the largest
  double worst_late = 0;            // s, of the leg samples in the last five seconds
  double found_at = 1e9;            // s of the walk
  std::uint64_t withheld = 0;
};

// `before`: the walk was played with this into the same clock, half an hour ago.
Errors follow(const Fault& fault, const std::string& mode = "estimated", const std::optional<Fault>& before = {}) {
  LegClockConfig config;
  config.clock = mode;
  if (fault.with_gyro) config.gyro_link = "pelvis";
  LegClock clock(config, robot_of(walk().config()));
  if (before) {
    for (Event& event : walk().with(*before)) clock.follow(event.m, event.arrived - std::chrono::minutes(30), event.low_level);
  }
  const std::uint64_t withheld = clock.withheld();
  Errors out;
  for (Event& event : walk().with(fault)) {
    const double since = to_seconds(event.truth - walk().start());
    const char* why = clock.follow(event.m, event.arrived, event.low_level);
    if (clock.offset()) out.found_at = std::min(out.found_at, since);
    if (!std::holds_alternative<JointSample>(event.m) || why != nullptr || since < 15) continue;
    const double error = to_seconds(stamp_of(event.m) - event.truth);
    out.worst_late = std::max(out.worst_late, std::abs(error));
    out.first = std::min(out.first, error);
    out.last = std::max(out.last, error);
  }
  out.withheld = clock.withheld() - withheld;
  return out;
}

TEST(LegClock, IsFoundToAMillisecondWhateverTheOffset) {
  for (const double offset : {0.0, 0.1, -0.3, 0.5}) {
    const Errors errors = follow({.late = offset, .offset = 3600, .drift = 50e-6, .jitter = 0.002});
    EXPECT_LT(errors.worst_late, 1e-3) << offset;
    EXPECT_LT(errors.found_at, 10) << offset;
    RecordProperty("worst_late_us", static_cast<int>(1e6 * errors.worst_late));
    RecordProperty("found_at_ms", static_cast<int>(1e3 * errors.found_at));
  }
}

TEST(LegClock, SurvivesATickThatStandsStill) {
  EXPECT_LT(follow({.late = 0.2, .jitter = 0.002, .frozen_from = 0}).worst_late, 1e-3);
  EXPECT_LT(follow({.late = 0.2, .jitter = 0.002, .frozen_from = 12}).worst_late, 1e-3);
}

TEST(LegClock, WithoutAGyroscopeTheStandingFootTellsTheRate) {
  const Errors errors = follow({.late = 0.3, .drift = -50e-6, .jitter = 0.002, .with_gyro = false});
  EXPECT_LT(errors.worst_late, 3e-3);
  EXPECT_LT(errors.found_at, 10);
}

TEST(LegClock, LegsThatMoveAtAnUnknownTimeAreWithheld) {
  EXPECT_GT(follow({.late = 0.3}).withheld, 0u);
  EXPECT_LT(follow({.late = 0.3}).withheld, 2500u) << "five seconds of walking";
}

TEST(LegClock, OfARecordingThatIsPlayedAgainIsFound) {
  // At first the delay was beyond what is looked for, and nothing was found.
  const Errors errors = follow({.late = 0.2, .jitter = 0.002}, "estimated", Fault{.late = 0.9, .jitter = 0.002});
  EXPECT_LT(errors.worst_late, 1e-3);
  EXPECT_LT(errors.found_at, 10);
  EXPECT_LT(errors.withheld, 2500u);
}

TEST(LegClock, OfARecordingThatIsPlayedAgainIsFollowed) {
  const Errors errors = follow({.late = 0.208, .jitter = 0.002}, "estimated", Fault{.late = 0.2, .jitter = 0.002});
  EXPECT_LT(errors.worst_late, 1e-3);
  EXPECT_EQ(errors.withheld, 0u) << "what was found is not forgotten";
}

TEST(LegClock, ArrivalLosesItsJitter) {
  const Errors errors = follow({.drift = 50e-6, .jitter = 0.002}, "arrival");
  EXPECT_LT(errors.last - errors.first, 1e-3);
  EXPECT_LT(errors.last, 0.006) << "the mean delay is in it";
}

TEST(LegClock, StampLeavesTheTimeAsItIs) {
  LegClock clock({}, robot_of(walk().config()));
  JointSample sample;
  sample.t = time_from_ns(5);
  Measurement m = sample;
  EXPECT_EQ(clock.follow(m, time_from_ns(9)), nullptr);
  EXPECT_EQ(to_ns(stamp_of(m)), 5);
}

// ---- what the legs' clock does to the odometry of encoders and IMU

struct Drift {
  double whole = 0, walked = 0;  // m: rms of the position from the start; from when every clock is found
};

// `fault`: the legs have no stamps, and a clock finds them; nothing: the true stamps.
Drift drift_of(const Walk& walk, const std::optional<Fault>& fault) {
  const lab::SimulatorConfig& config = walk.config();
  const lab::Settings settings =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  LegClockConfig clock_config;
  clock_config.clock = fault ? "estimated" : "stamp";
  clock_config.gyro_link = "pelvis";
  LegClock clock(clock_config, settings.robot);
  Estimator estimator(settings.robot, settings.estimator, config.use);
  std::vector<Output> outputs;
  for (Event& event : walk.with(fault.value_or(Fault{}))) {
    if (fault && clock.follow(event.m, event.arrived, event.low_level) != nullptr) continue;
    if (auto* joints = std::get_if<JointSample>(&event.m); joints != nullptr && !fault) joints->t = event.truth;
    estimator.push(std::move(event.m), outputs);
  }
  Drift out;
  for (const double from : {0.0, 13.4}) {
    double sum = 0, n = 0;
    std::optional<SE3> T_WR;
    for (const Output& o : outputs) {
      const double since = to_seconds(o.t - walk.start());
      if (since < from) continue;
      const SE3 truth = walk.pose_at(since);
      if (!T_WR) T_WR = o.x.pose() * truth.inverse();
      sum += ((*T_WR * truth).p - o.x.p).squaredNorm();
      ++n;
    }
    (from > 0 ? out.walked : out.whole) = std::sqrt(sum / n);
  }
  return out;
}

TEST(LegClock, CostsKiNoDriftOnceItIsFound) {
  const Fault faults[] = {{.drift = 50e-6, .jitter = 0.002},
                          {.offset = 0.1, .drift = 50e-6, .jitter = 0.002},
                          {.late = 0.1, .offset = -0.3, .drift = 50e-6, .jitter = 0.002},
                          {.offset = 0.5, .drift = 50e-6, .jitter = 0.002},
                          {.offset = 0.5, .jitter = 0.002, .frozen_from = 0},
                          {.offset = 0.5, .drift = 50e-6, .jitter = 0.002, .frozen_from = 20}};
  for (const char* name : {"room", "fwd_bwd", "square"}) {
    const Walk walk(40, name);
    const Drift right = drift_of(walk, {});
    std::printf("%-8s true stamps      : %5.1f mm, from 10 s of walking on %5.1f mm\n", name, 1e3 * right.whole, 1e3 * right.walked);
    for (const Fault& fault : faults) {
      const Drift found = drift_of(walk, fault);
      std::printf("%-8s %+.1f s, %.1f s late: %5.1f mm, from 10 s of walking on %5.1f mm\n", name, fault.offset, fault.late,
                  1e3 * found.whole, 1e3 * found.walked);
      EXPECT_LT(found.walked, 1.5 * right.walked) << name << ", offset " << fault.offset;
      EXPECT_LT(found.whole, 0.1) << "the first steps are those of the IMU alone";
    }
  }
}

TEST(DeviceClock, SamplesThatAreReceivedAtOnceAreSeveral) {
  DeviceClock clock(0.002);
  const auto ms = [](int n) { return std::chrono::milliseconds(n); };
  const Time arrived = time_from_ns(1'000'000'000), first = clock.follow(ms(2), arrived);
  EXPECT_EQ(clock.follow(ms(2), arrived), first) << "the IMU of the same message";
  EXPECT_NEAR(to_seconds(clock.follow(ms(4), arrived) - first), 0.002, 1.1e-3);
  EXPECT_NE(clock.follow(ms(4), arrived), first);
}

TEST(TickCounter, WrapsAround) {
  TickCounter counter;
  const Duration first = counter.unwrapped(0xFFFFFFFEU), later = counter.unwrapped(3);
  EXPECT_EQ(later - first, std::chrono::milliseconds(5));
}

}  // namespace leg_clock_test
}  // namespace kilvo
