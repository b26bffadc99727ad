#include "apps/node/diagnostics.hpp"

#include <cstring>
#include <gtest/gtest.h>

#include "apps/node/clouds.hpp"

namespace kilvo::node {
namespace diagnostics_test {

using std::chrono::milliseconds;

// All four sensors at their usual rates, all well.
Condition all_is_well() {
  Condition c;
  c.now = SteadyClock::time_point(std::chrono::seconds(100));
  c.rates = {200, 1000, 10, 10};
  for (std::size_t s = 0; s < sensor_count; ++s) {
    c.inputs[s].topic = std::string("/") + name_of(static_cast<Sensor>(s));
    c.inputs[s].last = c.now - milliseconds(50);
  }
  c.estimate.emplace();
  c.estimate->modality = Modality::kilv;
  return c;
}

std::string message_of(const std::vector<DiagnosticStatus>& all, const std::string& name) {
  for (const DiagnosticStatus& status : all) {
    if (name == status.name) return status.message;
  }
  return "no status of this name";
}

TEST(Diagnostics, AreOkWhenAllIsWell) {
  const auto all = statuses(all_is_well());
  ASSERT_EQ(all.size(), 5u);
  for (const DiagnosticStatus& status : all) EXPECT_EQ(+status.level, +DiagnosticStatus::ok) << status.name << status.message;
}

TEST(Diagnostics, NameEachLostSensorWithinHalfASecond) {
  for (std::size_t s = 0; s < sensor_count; ++s) {
    Condition c = all_is_well();
    const std::string name = name_of(static_cast<Sensor>(s));
    c.inputs[s].last = c.now - milliseconds(400);
    const auto all = statuses(c);
    EXPECT_EQ(message_of(all, "kilvo: " + name), "lost: no message on /" + name + " for 0.4 s");
    EXPECT_NE(message_of(all, "kilvo: estimator").find("lost: " + name), std::string::npos);
    EXPECT_NE(essence(all), essence(statuses(all_is_well()))) << "told at once";
    EXPECT_EQ(all.front().level == DiagnosticStatus::error, name == "imu") << "without the IMU there is no estimate";
  }
}

TEST(Diagnostics, AreAtErrorWhenTheDescriptionIsWrong) {
  Condition c = all_is_well();
  lab::WrongDescription wrong;
  wrong.finding.sensor = Sensor::lidar;
  wrong.finding.text = "the LiDAR is turned";
  wrong.finding.remedy = "lidar.T_imu_lidar.R: []";
  wrong.spoils = true;
  c.wrong.push_back(wrong);
  const auto all = statuses(c);
  EXPECT_EQ(+all.front().level, +DiagnosticStatus::error);
  EXPECT_NE(all.front().message.find("the LiDAR is turned"), std::string::npos);
  EXPECT_EQ(message_of(all, "kilvo: lidar"), "not as described: the LiDAR is turned; lidar.T_imu_lidar.R: []");
  EXPECT_EQ(message_of(all, "kilvo: imu"), "ok") << "nobody else is accused";
}

// A state of 100 s with one event.
Condition with_event(const Event& event) {
  Condition c = all_is_well();
  c.estimate->t = Time(from_seconds(100));
  c.estimate->events = {event};
  return c;
}

std::string value_of(const DiagnosticStatus& status, const std::string& key) {
  for (const KeyValue& value : status.values) {
    if (value.key == key) return value.value;
  }
  return "no value of this key";
}

TEST(Diagnostics, AWarningRaisesTheLevelForAMinuteAndStaysInTheValues) {
  for (const auto& [seconds, level] :
       {std::pair(99.9, DiagnosticStatus::warn), std::pair(41.0, DiagnosticStatus::warn), std::pair(39.0, DiagnosticStatus::ok)}) {
    const DiagnosticStatus status =
        statuses(with_event({Time(from_seconds(seconds)), Sensor::imu, Reason::gyro_clipped, 35, 4, {}})).front();
    EXPECT_EQ(+status.level, +level) << seconds;
    EXPECT_EQ(status.message.find("imu: the gyroscope is at the end of its range") != std::string::npos, level == DiagnosticStatus::warn);
    EXPECT_EQ(value_of(status, "warning"), "gyro_clipped: " + std::to_string(static_cast<int>(seconds)) +
                                               (seconds == 99.9 ? ".900" : ".000") +
                                               " s, 4 times, imu: the gyroscope is at the end of its range, 35.0 rad/s (4 times)");
  }
}

TEST(Diagnostics, ANoticeIsListedAndRaisesNothing) {
  const DiagnosticStatus status = statuses(with_event({Time(from_seconds(99)), {}, Reason::levelled, 0.4 * M_PI / 180, 1, {}})).front();
  EXPECT_EQ(+status.level, +DiagnosticStatus::ok);
  EXPECT_EQ(value_of(status, "notice"), "levelled: 99.000 s, 1 times, the world was rotated by 0.40 degrees, so that its z axis is up");
}

TEST(Diagnostics, AnErrorIsNoMereWarning) {
  const DiagnosticStatus status = statuses(with_event({Time(from_seconds(99)), Sensor::lidar, Reason::map_begun_anew, 0, 1, {}})).front();
  EXPECT_EQ(+status.level, +DiagnosticStatus::error);
  EXPECT_NE(status.message.find("the map was restarted"), std::string::npos);
}

TEST(Diagnostics, NameTheEpoch) {
  Condition c = with_event({Time(from_seconds(99)), {}, Reason::began_anew, 20, 1, {}});
  EXPECT_EQ(value_of(statuses(all_is_well()).front(), "epoch"), "1");
  c.estimate->epoch = 1;
  const DiagnosticStatus status = statuses(c).front();
  EXPECT_EQ(value_of(status, "epoch"), "2");
  EXPECT_NE(status.message.find("epoch 2"), std::string::npos);
  EXPECT_NE(status.message.find("the time went back by 20.0 s"), std::string::npos);
  EXPECT_EQ(+status.level, +DiagnosticStatus::warn);
  EXPECT_NE(essence(statuses(c)), essence(statuses(all_is_well()))) << "told at once";
}

TEST(Diagnostics, SayWhyASensorIsNotUsed) {
  Condition c = all_is_well();
  c.inputs[0].last.reset();
  c.inputs[1].paused = true;
  c.inputs[2].fault = "no point times";
  auto all = statuses(c);
  EXPECT_EQ(message_of(all, "kilvo: imu"), "lost: no message on /imu yet");
  EXPECT_EQ(message_of(all, "kilvo: legs"), "lost: paused by the service pause/legs");
  EXPECT_EQ(message_of(all, "kilvo: lidar"), "lost: /lidar: no point times");
  c.inputs[1].paused = false;
  c.legs_mismatch = "no joint left_knee";
  EXPECT_EQ(message_of(statuses(c), "kilvo: legs"), "lost: no joint left_knee");
}

TEST(Diagnostics, TellWhatTheStartWaitsFor) {
  Condition c = all_is_well();
  c.estimate.reset();
  c.waiting_for = "waiting for the robot to stand still";
  EXPECT_EQ(message_of(statuses(c), "kilvo: estimator"), c.waiting_for);
  c.inputs[0].last.reset();
  EXPECT_EQ(message_of(statuses(c), "kilvo: estimator"), c.waiting_for + ", lost: imu (no message on /imu yet)");
}

TEST(Diagnostics, NameTheTopicOnWhichNothingEverCame) {
  Condition c = all_is_well();
  c.inputs[2].last.reset();
  EXPECT_NE(message_of(statuses(c), "kilvo: estimator").find("lost: lidar (no message on /lidar yet)"), std::string::npos);
  c.inputs[2].last = c.now - std::chrono::seconds(2);
  EXPECT_EQ(message_of(statuses(c), "kilvo: estimator").find("/lidar"), std::string::npos) << "its name was right";
}

TEST(Diagnostics, ASensorThatTheRobotDoesNotHaveIsNotSpokenOf) {
  Condition c = all_is_well();
  c.inputs[3] = {};
  EXPECT_EQ(message_of(statuses(c), "kilvo: camera"), "no status of this name");
  EXPECT_EQ(+statuses(c).front().level, +DiagnosticStatus::ok);
}

TEST(Clouds, ColoursArePackedAsRvizReadsThem) {
  const std::vector<ColouredPoint> points = {{{1, 2, 3}, {0x11, 0x22, 0x33}, 1}};
  const PointCloud cloud = cloud_message(points, time_from_ns(1'500'000'000), "map");
  EXPECT_EQ(to_ns(cloud.header.stamp), 1'500'000'000);
  ASSERT_EQ(cloud.data.size(), 16u);
  float z = 0;
  std::memcpy(&z, cloud.data.data() + 8, sizeof z);
  EXPECT_EQ(z, 3);
  EXPECT_EQ(cloud.data[12], 0x33);
  EXPECT_EQ(cloud.data[13], 0x22);
  EXPECT_EQ(cloud.data[14], 0x11);
}

}  // namespace diagnostics_test
}  // namespace kilvo::node
