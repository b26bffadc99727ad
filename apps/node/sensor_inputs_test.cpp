#include "apps/node/sensor_inputs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/messages/encode.hpp"
#include "lab/settings/leg_joints.hpp"

namespace kilvo::node {
namespace sensor_inputs_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Time day = time_from_ns(1'700'000'000'000'000'000);

/// A robot's inputs, what comes out of them and what they say.
struct Live {
  lab::Settings settings = lab::load_settings(KILVO_SOURCE_DIR "/config/robots/sim.yaml");
  std::vector<Measurement> out;
  std::vector<std::string> said;
  SensorInputs inputs{settings, true, [this](Measurement m, Time) { out.push_back(std::move(m)); },
                      [this](const std::string& text) { said.push_back(text); }};

  void receive(const Measurement& m, Time at) {
    const auto bytes = lab::encode(m, "");
    inputs.receive(sensor_of(m), {lab::written_type(sensor_of(m)).name, {bytes, lab::Encoding::ros1}, at});
  }
  int count(Sensor s) const {
    return static_cast<int>(std::ranges::count_if(out, [s](const Measurement& m) { return sensor_of(m) == s; }));
  }
};

/// `seconds` of the IMU at 200 Hz and of each leg in a message of its own, at 500 Hz, stamped `later` than they are.
void walk(Live& live, double seconds, Duration later, bool both_legs = true) {
  const JointNames joints = lab::leg_joints(live.settings.robot);
  const auto middle = joints.begin() + static_cast<std::ptrdiff_t>(joints.size() / 2);
  const std::array<JointNames, 2> legs{JointNames(JointNames::List(joints.begin(), middle)),
                                       JointNames(JointNames::List(middle, joints.end()))};
  for (int ms = 0; ms < 1000 * seconds; ++ms) {
    const Time t = day + std::chrono::milliseconds(ms), at = t + std::chrono::milliseconds(1);
    if (ms % 5 == 0) live.receive(ImuSample{t, {0, 0, 0.1}, {0, 0, 9.81}}, at);
    if (ms % 2 != 0) continue;
    for (std::size_t i = 0; i < (both_legs ? 2U : 1U); ++i)
      live.receive(JointSample{t + later, legs[i], std::vector<double>(legs[i].size(), 0.001 * ms), {}, {}}, at);
  }
}

TEST(SensorInputs, JoinTheLegsOfTwoMessages) {
  Live live;
  walk(live, 1, Duration(0));
  EXPECT_NEAR(live.count(Sensor::legs), 500, 3);
  EXPECT_EQ(live.count(Sensor::imu), 200);
  EXPECT_THAT(live.said, IsEmpty()) << "a part is no fault";
  EXPECT_EQ(live.inputs.state(Sensor::legs).fault, "");
  EXPECT_FALSE(live.inputs.state(Sensor::legs).moved);
}

TEST(SensorInputs, HandOnOneLegThatStaysAloneSoThatTheOtherIsMissed) {
  Live live;
  walk(live, 2, Duration(0), false);
  EXPECT_NEAR(live.count(Sensor::legs), 500, 3) << "after a second of waiting";
}

TEST(SensorInputs, BringStampsOfAnotherEpochOntoTheImusAndSayItOnce) {
  Live live;
  walk(live, 3, -std::chrono::hours(100'000));
  EXPECT_THAT(live.said, ElementsAre(HasSubstr("legs.time_offset: 360000000.000000")));
  EXPECT_NEAR(live.count(Sensor::legs), 1000, 10) << "after a second of watching";
  for (const Measurement& m : live.out) EXPECT_LT(stamp_of(m), day + std::chrono::seconds(3));
  const InputState legs = live.inputs.state(Sensor::legs);
  EXPECT_NEAR(legs.moved.value_or(0), 3.6e8, 1e-6);
  EXPECT_NEAR(static_cast<double>(legs.counts.dropped.at("clock not known yet")), 500, 10);
}

TEST(SensorInputs, StampsOfAnImuThatComesInBurstsAreEvenAndThatIsReportedOnce) {
  Live live;
  constexpr Duration period = std::chrono::milliseconds(5);
  for (int k = 0; k < 2000; ++k) {
    const Time last = day + (k / 5 * 5 + 4) * period;
    live.receive(ImuSample{last, {0, 0, 1e-3 * (k % 7)}, {0, 0, 9.81}}, last + std::chrono::milliseconds(1));
  }
  EXPECT_THAT(live.said, ElementsAre(HasSubstr("samples come in bursts")));
  ASSERT_EQ(live.count(Sensor::imu), 2000);
  for (std::size_t k = 1000; k < live.out.size(); ++k) {
    EXPECT_NEAR(to_seconds(stamp_of(live.out[k]) - stamp_of(live.out[k - 1])), to_seconds(period), 2e-4);
    EXPECT_NEAR(to_seconds(stamp_of(live.out[k]) - day), 0.005 * static_cast<double>(k), 4e-3);
  }
}

TEST(SensorInputs, MessagesOfAnImuThatComeTwiceAreNoSamplesMore) {
  Live live;
  for (int k = 0; k < 400; ++k) {
    const Time t = day + k * std::chrono::milliseconds(5);
    for (int i = 0; i < 2; ++i) live.receive(ImuSample{t, {0, 0, 1e-3 * (k % 7)}, {0, 0, 9.81}}, t);
  }
  EXPECT_THAT(live.said, IsEmpty());
  for (std::size_t i = 0; i < live.out.size(); ++i)
    EXPECT_EQ(stamp_of(live.out[i]), day + static_cast<int>(i / 2) * std::chrono::milliseconds(5));
}

// As kilvo run does, by the configuration or by the option.
TEST(SensorInputs, TakeCloudsAtTheirStampWhereTheyAreNotToBeDeskewed) {
  for (const auto& [deskew, no_deskew, last] : {std::tuple{true, false, 90'000'000}, {false, false, 0}, {true, true, 0}}) {
    lab::Settings settings = lab::load_settings(KILVO_SOURCE_DIR "/config/robots/sim.yaml");
    settings.clouds.deskew = deskew;
    std::vector<LidarScan> scans;
    const auto keep = [&scans](const Measurement& m, Time) {
      if (const auto* scan = std::get_if<LidarScan>(&m)) scans.push_back(*scan);
    };
    SensorInputs inputs(settings, no_deskew, keep, [](const std::string&) {});
    const auto receive = [&inputs](const Measurement& m, Time at) {
      const auto bytes = lab::encode(m, "");
      inputs.receive(sensor_of(m), {lab::written_type(sensor_of(m)).name, {bytes, lab::Encoding::ros1}, at});
    };
    for (int ms = 0; ms < 3000; ms += 5) {
      const Time t = day + std::chrono::milliseconds(ms);
      receive(ImuSample{t, {0, 0, 0.1}, {0, 0, 9.81}}, t);
      if (ms % 100 != 95) continue;
      LidarScan scan;
      scan.t = t - std::chrono::milliseconds(95);
      for (int i = 0; i < 100; ++i) {
        LidarPoint point{};
        point.x = 3, point.y = 0.01F * static_cast<float>(i), point.offset_ns = std::min(i, 90) * 1'000'000;
        scan.points.push_back(point);
      }
      receive(scan, t);
    }
    ASSERT_GT(scans.size(), 10U);
    EXPECT_NEAR(scans.back().points.back().offset_ns, last, 1000);
  }
}

}  // namespace sensor_inputs_test
}  // namespace kilvo::node
