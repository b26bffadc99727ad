// Legs and IMU alone, which nothing else contradicts: what fitted the description at first and no longer does is reported.
#include "lab/doctor/description_watch.hpp"

#include <algorithm>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace description_watch_test {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double failure = 30;  // s after the start

/// Legs and IMU of 55 s of a walk round a square.
struct Walked {
  std::vector<Measurement> measurements;
  Time start{};
  Robot robot;
};

const Walked& walked() {
  static const Walked walk = [] {
    SimulatorConfig config;
    config.duration = 55;
    config.use = {true, true, false, false};
    const std::vector<Scenario> all = scenarios();
    Simulator simulator(*std::ranges::find(all, "square", &Scenario::name), config);
    Walked out;
    out.start = simulator.start();
    while (auto measurement = simulator.next()) out.measurements.push_back(*std::move(measurement));
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    out.robot = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
    out.robot.urdf = urdf_of(config.shape);
    return out;
  }();
  return walk;
}

/// `change`: of each measurement, with the seconds since the start.
std::vector<WrongDescription> watched(DescriptionWatch::Judging judging, const std::function<void(Measurement&, double)>& change) {
  DescriptionWatch watch(walked().robot, {}, judging);
  for (Measurement measurement : walked().measurements) {
    change(measurement, to_seconds(stamp_of(measurement) - walked().start));
    watch.take(measurement);
  }
  return watch.finish();
}

void freeze_gyro(Measurement& m, double t) {
  if (auto* imu = std::get_if<ImuSample>(&m); imu != nullptr && t > failure) imu->gyro.z() = 0.1;
}

void turn_knee_round(Measurement& m, double t) {
  auto* legs = std::get_if<JointSample>(&m);
  if (legs == nullptr || legs->position.empty() || t < failure) return;
  const auto knee = std::ranges::find(legs->names, "left_knee_joint");
  ASSERT_NE(knee, legs->names.end());
  const auto i = static_cast<std::size_t>(knee - legs->names.begin());
  legs->position[i] *= -1;
  if (i < legs->velocity.size()) legs->velocity[i] *= -1;
}

TEST(DescriptionWatch, HasNothingAgainstLegsAndImuThatStayRight) {
  EXPECT_THAT(watched(DescriptionWatch::Judging::here, [](Measurement&, double) {}), IsEmpty());
}

TEST(DescriptionWatch, ReportsWhatChangesOnTheWay) {
  const std::vector<std::pair<std::string, std::function<void(Measurement&, double)>>> faults{{"gyro_frozen", freeze_gyro},
                                                                                              {"joint_sign", turn_knee_round}};
  for (const auto& [cause, fault] : faults) {
    const std::vector<WrongDescription> here = watched(DescriptionWatch::Judging::here, fault);
    ASSERT_EQ(here.size(), 1U) << cause;
    EXPECT_EQ(here[0].finding.cause, cause);
    EXPECT_TRUE(here[0].has_changed && here[0].spoils);
    EXPECT_FALSE(here[0].is_mendable) << "the first half fits as described";
    EXPECT_THAT(here[0].finding.changes, IsEmpty());
    EXPECT_THAT(here[0].finding.text, HasSubstr("fit the description at first"));
    EXPECT_GT(here[0].after, failure);
    // However fast it is judged.
    const std::vector<WrongDescription> beside = watched(DescriptionWatch::Judging::beside, fault);
    ASSERT_EQ(beside.size(), 1U) << cause;
    EXPECT_EQ(beside[0].finding.text, here[0].finding.text);
    EXPECT_EQ(beside[0].t, here[0].t);
  }
}

// From the first window on it is the description that is wrong.
TEST(DescriptionWatch, TakesWhatIsWrongFromTheStartForTheDescription) {
  const std::vector<WrongDescription> wrong =
      watched(DescriptionWatch::Judging::here, [](Measurement& m, double) { turn_knee_round(m, failure + 1); });
  ASSERT_FALSE(wrong.empty());
  EXPECT_EQ(wrong[0].finding.cause, "joint_sign");
  EXPECT_FALSE(wrong[0].has_changed);
  EXPECT_TRUE(wrong[0].spoils && wrong[0].is_mendable);
}

}  // namespace description_watch_test
}  // namespace kilvo::lab
