// Each kind of evidence that the senses contradict each other, alone; and that right walks are silent.
#include "kilvo/estimator/findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kilvo/sensors/robot.hpp"

namespace kilvo {
namespace findings_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A walk at 1.2 m/s on legs and LiDAR, as the estimator sees it: all sensors used at their rates, biases that wander as those of a good
/// IMU.
class Judged : public testing::Test {
 protected:
  // What else is true in each second, from `from` on.
  template <class Edit>
  void walk(double seconds, Edit&& edit, double from = 2) {
    for (const double end = s_ + seconds; s_ < end; s_ += 1) {
      estimate_.t = Time(from_seconds(s_));
      estimate_.x.v = {1.2, 0, 0};
      estimate_.x.ba = Eigen::Vector3d(0.05, -0.03, 0.02) * std::min(1.0, s_ / 20);
      estimate_.x.bg = Eigen::Vector3d(0.001, 0.002, -0.001) * std::min(1.0, s_ / 20);
      use(Sensor::imu, 200);
      use(Sensor::legs, 500);
      use(Sensor::lidar, 10);
      if (s_ >= from) edit();
      findings_.look(estimate_.t, situation());
    }
  }
  void walk(double seconds) {
    walk(seconds, [] {});
  }
  void use(Sensor sensor, int messages) {
    for (int i = 0; i < messages; ++i) findings_.use(sensor);
  }
  Findings::Situation situation() const { return {estimate_.t, estimate_, health_, modality_, 0.01, 0.01, true, estimate_.t, leg_length_}; }
  bool diverged() const { return findings_.statistics().diverged; }
  std::vector<std::string> warnings() const { return warnings_of(findings_.statistics()); }

  static constexpr double leg_length_ = 0.75;  // m
  double s_ = 1;
  Robot robot_;
  Health health_{robot_};
  Estimate estimate_;
  Modality modality_ = Modality::kil;
  Findings findings_;
};

TEST_F(Judged, RightWalksAreSilent) {
  walk(60);
  EXPECT_FALSE(diverged());
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(Judged, FastRunsAndSomeBadSweepsAreSilent) {
  // 7 m/s is the Froude number of a sprinter; one sweep in four is of a crowd; the velocity was given up once.
  walk(40, [this] {
    estimate_.x.v = {7, 0, 0};
    findings_.drop(Sensor::lidar, Reason::fits_nowhere);
    findings_.statistics().lost_stances = 1;
  });
  EXPECT_FALSE(diverged());
}

TEST_F(Judged, SweepsThatFitNowhereAreEvidence) {
  walk(11, [this] {
    for (int i = 0; i < 15; ++i) findings_.drop(Sensor::lidar, Reason::fits_nowhere);
  });
  EXPECT_TRUE(diverged());
  EXPECT_THAT(warnings(), testing::Contains(AllOf(HasSubstr("the LiDAR and the legs contradict each other"), HasSubstr("most sweeps"))));
}

TEST_F(Judged, BiasesThatWereAGuessMayChangeAndThoseThatAreKnownMayNot) {
  const auto walk_with = [this](double seconds, double sigma, const Eigen::Vector3d& ba) {
    const auto edit = [&] {
      estimate_.P.diagonal().segment<3>(at::ba).setConstant(sigma * sigma);
      estimate_.x.ba = ba;
    };
    walk(seconds, edit, 0);
  };
  walk_with(1, 0.4, {0, 0, 0.1});
  walk_with(1, 0.4, {0, 1.8, -0.7});
  for (double sigma = 0.4; sigma > 0.07; sigma /= 2) walk_with(1, sigma, {sigma, -sigma, 0.5});
  walk_with(5, 0.02, {0, 0, 0.1});
  walk_with(5, 0.15, {0.6, 0, 0.1});  // aliased noise has walked it
  walk_with(5, 0.02, {0, 0, 0.1});
  EXPECT_THAT(warnings(), IsEmpty());
  walk_with(1, 0.02, {0.45, 0, 0.1});
  EXPECT_THAT(warnings(), testing::Contains(AllOf(HasSubstr("the IMU and the LiDAR contradict each other"), HasSubstr("biases"))));
  EXPECT_FALSE(diverged());
  walk_with(1, 0.02, {0, 1.8, -0.7});
  walk_with(1, 0.02, {0.45, 0, 0.1});
  EXPECT_FALSE(diverged()) << "the shocks of a first step";
  walk_with(3, 0.02, {0, 1.8, -0.7});
  EXPECT_TRUE(diverged());
}

TEST_F(Judged, ASpeedThatNobodyWalksIsEvidence) {
  walk(3, [this] { estimate_.x.v = {8.3, 0, 0}; });
  EXPECT_TRUE(diverged());
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("the IMU and the LiDAR contradict each other"), HasSubstr("8.3 m/s"))));
}

TEST_F(Judged, ASpeedThatIsNotKnownIsNone) {
  estimate_.P.diagonal().segment<3>(at::v).setConstant(9);
  walk(20, [this] { estimate_.x.v = {8.3, 0, 0}; });
  EXPECT_FALSE(diverged());
}

TEST_F(Judged, ABiasThatIsNoneOfThisSensorIsReportedOnce) {
  walk(20, [this] { estimate_.x.ba.x() += 0.45; });
  EXPECT_FALSE(diverged()) << "a poor IMU has it";
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("the IMU and the LiDAR contradict each other"), HasSubstr("check the mount"))));
}

TEST_F(Judged, ABiasThatNoSensorHasIsEvidence) {
  walk(6, [this] { estimate_.x.bg.y() += 0.12; });
  EXPECT_TRUE(diverged());
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("the IMU and the LiDAR contradict each other"), HasSubstr("rad/s"))));
}

TEST_F(Judged, LegsThatNeverStandStillAreEvidenceAgainstTheLidar) {
  walk(13, [this] { findings_.statistics().lost_stances = 4; });
  EXPECT_TRUE(diverged());
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("the legs and the LiDAR contradict each other"), HasSubstr("4 times"))));
}

TEST_F(Judged, ADirectionThatNothingMeasuresIsReportedWithItsLongestStretch) {
  const auto corridor_from = [this](double begin, double end) {
    const bool blind = s_ > begin && s_ < end;
    findings_.note_unmeasured(situation(), blind ? std::optional(Eigen::Vector3d(0.6, 0.8, 0)) : std::nullopt);
  };
  walk(10, [&] { corridor_from(3, 5); });
  EXPECT_THAT(warnings(), IsEmpty()) << "a short one";
  walk(40, [&] { corridor_from(s_ < 30 ? 12 : 31, s_ < 30 ? 25 : 37); });
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_THAT(warnings()[0], HasSubstr("for 11 s no sensor measured the motion along (0.6, 0.8, 0.0)"));
  EXPECT_THAT(warnings()[0], HasSubstr("(2 times)"));
}

TEST_F(Judged, JointsThatCannotBeUsedAreReportedWithTheirFault) {
  walk(30, [this] {
    for (int i = 0; i < 400; ++i) findings_.drop(Sensor::legs, Reason::wrong_joints, "not finite");
  });
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("legs"), HasSubstr("messages could not be used: not finite"))));
}

TEST_F(Judged, ACameraWhoseImagesNeverShowEnoughIsReported) {
  walk(30, [this] { use(Sensor::camera, 10); });
  EXPECT_THAT(warnings(), ElementsAre(AllOf(HasSubstr("camera: of "), HasSubstr("too dark"))));
}

TEST_F(Judged, ACameraThatHasCarriedTheEstimateMaySeeNothingLater) {
  findings_.camera_carries();
  walk(30, [this] { use(Sensor::camera, 10); });
  EXPECT_THAT(warnings(), IsEmpty());
}

TEST_F(Judged, AGapOfTheImuIsReportedWithWhatItLeavesUncertain) {
  estimate_.P.diagonal().segment<3>(at::p).setConstant(0.0025);
  findings_.report_gap(situation(), 0.3);
  EXPECT_THAT(warnings(), IsEmpty()) << "0.09 m";
  estimate_.P.diagonal().segment<3>(at::p) << 4, 4, 1;
  estimate_.P(at::R + 2, at::R + 2) = 0.25;
  findings_.report_gap(situation(), 2.5);
  estimate_.P(at::R + 2, at::R + 2) = 16;
  findings_.report_gap(situation(), 9);
  const auto events = findings_.take_events();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(text_of(events[0]),
            "imu: after 2.5 s without it position and heading are uncertain by 3.0 m and 29 degrees, one sigma, until "
            "the robot is found in its map");
  EXPECT_THAT(text_of(events[1]), HasSubstr("by 3.0 m and 180 degrees"));
}

TEST_F(Judged, AnEpochThatBeginsIsInnocent) {
  const auto speed = [this] { estimate_.x.v = {8.3, 0, 0}; };
  walk(3, speed);
  findings_.report_clock_offset(situation(), Sensor::lidar, 0.01, 0);
  ASSERT_TRUE(diverged());
  findings_.take_events();
  findings_ = findings_.next_epoch();
  EXPECT_FALSE(diverged());
  EXPECT_EQ(findings_.statistics().clock_shift, (std::array<double, sensor_count>{})) << "stamps are taken as they are";
  walk(20);
  EXPECT_FALSE(diverged());
  EXPECT_THAT(findings_.take_events(), IsEmpty());
  walk(3, speed);
  EXPECT_TRUE(diverged());
  EXPECT_THAT(findings_.take_events(), ElementsAre(testing::Field(&Event::reason, Reason::diverged))) << "it is told again";
}

}  // namespace findings_test
}  // namespace kilvo
