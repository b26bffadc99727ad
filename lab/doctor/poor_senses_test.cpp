// Sensors that are poor, or stamped badly: nothing else is accused for it.
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/rough.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace poor_senses_test {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

struct Walked {
  std::vector<Measurement> measurements;
  Robot robot;
};

Walked walked(const std::string& name, const SimulatorConfig& nominal, int level) {
  const RoughRobot robot = rough_robot(nominal, level, {});
  const std::vector<Scenario> all = scenarios();
  Simulator simulator(*std::ranges::find(all, name, &Scenario::name), robot.truth);
  Walked out;
  while (auto measurement = simulator.next()) out.measurements.push_back(*std::move(measurement));
  const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
  out.robot = parse_settings(simulated_config(robot.known, urdf), "simulated", ".").robot;
  out.robot.urdf = urdf_of(robot.known.shape);
  return out;
}

SimulatorConfig config_of(std::array<bool, sensor_count> use, double duration, std::uint64_t seed) {
  SimulatorConfig out;
  out.use = use;
  out.duration = duration;
  out.seed = seed;
  out.lidar.points = 8000;
  return out;
}

/// `change`: of each message of this kind; false: it is lost.
template <class Message>
Recorded recorded(const Walked& walk, const std::function<bool(Message&)>& change) {
  Recorder recorder;
  for (Measurement measurement : walk.measurements) {
    auto* message = std::get_if<Message>(&measurement);
    if (message == nullptr || change(*message)) recorder.push(measurement);
  }
  return recorder.finish();
}

std::vector<std::string> causes(const Recorded& recorded, const Robot& robot) {
  std::vector<std::string> out;
  for (const Finding& finding : Examination(recorded, robot).run().findings) out.push_back(finding.cause);
  return out;
}

const Walked& a_walk() {
  static const Walked walk = walked("room", config_of({true, false, true, false}, 20, 1), 0);
  return walk;
}

/// A low pass of first order, with a time constant in s.
std::function<bool(ImuSample&)> low_pass(double lag, double rate) {
  return [share = 1 - std::exp(-1 / (lag * rate)), last = std::optional<Eigen::Vector3d>()](ImuSample& s) mutable {
    last = last ? Eigen::Vector3d(*last + share * (s.accel - *last)) : s.accel;
    s.accel = *last;
    return true;
  };
}

TEST(PoorSenses, AnAccelerometerThatIsFilteredOrAliasesDoesNotMakeTheLidarsPointsTooNear) {
  const Robot& robot = a_walk().robot;
  for (const double lag : {0.02, 0.05}) {
    EXPECT_THAT(causes(recorded<ImuSample>(a_walk(), low_pass(lag, robot.imu.rate)), robot), testing::Not(Contains("lidar_unit")))
        << lag << " s";
  }
  Robot slow = robot;
  slow.imu.rate /= 4;
  const auto every_fourth = [n = 0](ImuSample&) mutable { return ++n % 4 == 0; };
  EXPECT_THAT(causes(recorded<ImuSample>(a_walk(), every_fourth), slow), IsEmpty());
}

// There the scale seems to be known to 4 %, 0.72 and 0.73; what half of the samples show is far from that.
TEST(PoorSenses, AShortWalkWithAnAccelerometerThatAliasesDoesNotMakeThePointsTooNear) {
  for (const std::uint64_t seed : {2, 3}) {
    SimulatorConfig config = config_of({true, false, true, false}, 9, seed);
    config.imu.delivery.rate = 50;
    config.wear.impact = 60;
    const Walked walk = walked("fast_walk", config, 0);
    EXPECT_THAT(causes(recorded<ImuSample>(walk, [](ImuSample&) { return true; }), walk.robot), testing::Not(Contains("lidar_unit")))
        << seed;
  }
}

TEST(PoorSenses, TheRateIsThatOfTheMessagesThoughTheirStampsComeInBurstsOrSomeAreLost) {
  const double period = 1 / a_walk().robot.imu.rate;
  const auto measured = [](const std::function<bool(ImuSample&)>& change) {
    return recorded<ImuSample>(a_walk(), change).stamps[static_cast<std::size_t>(Sensor::imu)].period;
  };
  const auto in_bursts = [](ImuSample& s) {
    const Duration burst = std::chrono::milliseconds(20), within = (s.t - Time{}) % burst;
    s.t += burst - within + within / 40;
    return true;
  };
  EXPECT_NEAR(measured(in_bursts), period, 0.02 * period);
  std::mt19937 random(1);
  EXPECT_NEAR(measured([&random](ImuSample&) { return random() % 10 >= 3; }), period, 0.02 * period);
}

TEST(PoorSenses, TheScaleOfTheLidarsPointsIsThatOfSlowMotion) {
  for (const float factor : {0.66F, 1.5F}) {
    const Recorded scaled = recorded<LidarScan>(a_walk(), [factor](LidarScan& scan) {
      for (LidarPoint& p : scan.points) p.x *= factor, p.y *= factor, p.z *= factor;
      return true;
    });
    const Diagnosis diagnosis = Examination(scaled, a_walk().robot).run();
    ASSERT_EQ(diagnosis.findings.size(), 1u) << factor;
    EXPECT_EQ(diagnosis.findings.front().cause, "lidar_unit");
    EXPECT_NEAR(diagnosis.findings.front().size / factor, 1, 0.02);
  }
}

// Rough encoders: by their acceleration the legs are turned by less than is sure, by their turning not at all.
TEST(PoorSenses, ALegClockThatIsFarOffIsFoundOnLegsAndImuAlone) {
  for (const std::uint64_t seed : {3, 5}) {
    const Walked walk = walked("room", config_of({true, true, false, false}, 25, seed), 2);
    for (const int late : {0, -100, 100}) {
      const Recorded legs = recorded<JointSample>(walk, [late](JointSample& s) {
        s.t += std::chrono::milliseconds(late);
        return true;
      });
      const Diagnosis diagnosis = Examination(legs, walk.robot).run();
      ASSERT_EQ(diagnosis.findings.size(), late == 0 ? 0u : 1u) << seed << ", " << late << " ms";
      if (late == 0) continue;
      EXPECT_EQ(diagnosis.findings.front().cause, "legs_clock");
      EXPECT_NEAR(std::abs(diagnosis.findings.front().size), 0.1, 0.015);
    }
  }
}

}  // namespace poor_senses_test
}  // namespace kilvo::lab
