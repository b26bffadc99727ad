#include "kilvo/estimator/sensor_status.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace sensor_status_test {

Time at(double s) { return Time(from_seconds(s)); }

constexpr std::array<bool, sensor_count> all = {true, true, true, true}, imu_alone = {true, false, false, false},
                                         legs_alone = {true, true, false, false};

TEST(Modalities, FollowFromTheSensorsThatCanBeUsed) {
  EXPECT_EQ(modality_of(true, true, true), Modality::kilv);
  EXPECT_EQ(modality_of(true, true, false), Modality::kil);
  EXPECT_EQ(modality_of(true, false, true), Modality::ki) << "vision needs the LiDAR's surfaces";
  EXPECT_EQ(modality_of(false, true, true), Modality::liv);
  EXPECT_EQ(modality_of(false, true, false), Modality::li);
  EXPECT_EQ(modality_of(false, false, true), Modality::coast);
  for (const ModalityRow& row : modalities) EXPECT_EQ(modality_of(row.legs, row.lidar, row.camera), row.modality) << row.name;
}

TEST(SensorStatus, ASilentSensorIsLeftOutWithTheReasonAndComesBack) {
  const Health health{Robot{}};
  SensorStatus status(Robot{});
  status.begin(at(0), all);
  EXPECT_EQ(status.choose(at(0.1), health), SensorStatus::Change::of_modality);
  EXPECT_EQ(status.modality(), Modality::kil);
  EXPECT_EQ(status.cause(), Reason::start);
  status.use(Sensor::camera, at(0.2));
  status.choose(at(0.2), health);
  EXPECT_EQ(status.modality(), Modality::kilv);
  EXPECT_EQ(status.cause(), Reason::camera_used);
  // Three periods of 10 Hz without a sweep.
  EXPECT_EQ(status.choose(at(0.29), health), SensorStatus::Change::none);
  status.choose(at(0.31), health);
  EXPECT_EQ(status.modality(), Modality::ki);
  EXPECT_EQ(status.cause(), Reason::lidar_lost);
  status.use(Sensor::lidar, at(0.4));
  status.choose(at(0.4), health);
  EXPECT_EQ(status.modality(), Modality::kilv);
  EXPECT_EQ(status.cause(), Reason::lidar_back);
  status.lose_legs();
  status.choose(at(0.41), health);
  EXPECT_EQ(status.modality(), Modality::liv);
  EXPECT_EQ(status.cause(), Reason::legs_lost);
}

TEST(SensorStatus, AfterAnOutageOfTheImuTheCauseIsThatItIsBack) {
  const Health health{Robot{}};
  SensorStatus status(Robot{});
  status.begin(at(0), imu_alone);
  EXPECT_EQ(status.choose(at(0.1), health), SensorStatus::Change::none);
  status.lose_imu(health);
  EXPECT_TRUE(status.imu_lost());
  EXPECT_EQ(status.cause(), Reason::imu_lost);
  status.imu_is_back();
  EXPECT_EQ(status.choose(at(1), health), SensorStatus::Change::of_cause);
  EXPECT_EQ(status.cause(), Reason::imu_back);
}

TEST(SensorStatus, LegsThatComeAgainWaitForCalmOrForASecond) {
  const Health health{Robot{}};
  SensorStatus status(Robot{});
  status.begin(at(0), legs_alone);
  EXPECT_TRUE(status.may_legs_return(at(1), false, false, health)) << "they are there";
  status.lose_legs();
  EXPECT_TRUE(status.may_legs_return(at(1), false, false, health)) << "they were never used";
  status.use(Sensor::legs, at(1));
  status.lose_legs();
  EXPECT_FALSE(status.may_legs_return(at(2), false, true, health));
  EXPECT_TRUE(status.may_legs_return(at(2.1), true, true, health));
  status.lose_legs();
  EXPECT_FALSE(status.may_legs_return(at(3), false, true, health));
  EXPECT_TRUE(status.may_legs_return(at(4.1), false, true, health));
}

}  // namespace sensor_status_test
}  // namespace kilvo
