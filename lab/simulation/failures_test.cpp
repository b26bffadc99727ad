#include "lab/simulation/failures.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace failures_test {

constexpr Time begin = time_from_ns(1'000'000'000);

Time at(double seconds) { return begin + from_seconds(seconds); }

/// IMU and joints at 100 Hz, scans and images at 10 Hz, for one second; what they say grows with time.
class TinySource : public MeasurementSource {
 public:
  TinySource() {
    for (int i = 0; i < 100; ++i) {
      const Time t = at(0.01 * i);
      all_.emplace_back(ImuSample{t, {i + 1.0, 0, 0}, {0, 0, 9.8}});
      all_.emplace_back(JointSample{t, {"knee"}, {i + 1.0}, {0.0}, {}});
      if (i % 10 != 0) continue;
      all_.emplace_back(LidarScan{t, {{1, 0, 0, 1, 0}, {0, 1, 0, 2, 1000}, {-1, 0, 0, 3, 2000}, {1, 0.1F, 5, 4, 3000}}});
      all_.emplace_back(CameraImage{t, {2, 1, 1, {100, 200}}});
    }
  }
  std::optional<Measurement> next() override { return i_ < all_.size() ? std::optional(all_[i_++]) : std::nullopt; }

 private:
  std::vector<Measurement> all_;
  std::size_t i_ = 0;
};

template <class T>
std::vector<T> with(const Failure& failure) {
  TinySource source;
  FailingSource failing(source, {failure}, begin);
  std::vector<T> out;
  while (const auto m = failing.next()) {
    if (const T* x = std::get_if<T>(&*m)) out.push_back(*x);
  }
  return out;
}

TEST(Failures, WithoutFailuresNothingChanges) {
  TinySource source, again;
  FailingSource failing(source, {}, begin);
  std::size_t n = 0;
  while (const auto m = failing.next()) {
    EXPECT_EQ(stamp_of(*m), stamp_of(*again.next()));
    ++n;
  }
  EXPECT_EQ(n, 220U);
}

TEST(Failures, DroppedMessagesAreGoneAndCountedTheOthersStay) {
  TinySource source;
  FailingSource failing(source, {{FailureKind::drop, Sensor::imu, 0.1, 0.2}, {FailureKind::drop, Sensor::legs, 0.4}}, begin);
  std::size_t imu = 0, legs = 0, others = 0;
  while (const auto m = failing.next()) {
    const Time t = stamp_of(*m);
    if (sensor_of(*m) == Sensor::imu) {
      ++imu;
      EXPECT_TRUE(t < at(0.1) || t >= at(0.2));
    } else if (sensor_of(*m) == Sensor::legs) {
      ++legs;
      EXPECT_LT(t, at(0.4));
    } else {
      ++others;
    }
  }
  EXPECT_EQ(imu, 90U);
  EXPECT_EQ(legs, 40U);
  EXPECT_EQ(others, 20U);
  EXPECT_EQ(failing.dropped(Sensor::imu), 10U);
  EXPECT_EQ(failing.dropped(Sensor::legs), 60U);
  EXPECT_EQ(failing.dropped(Sensor::lidar), 0U);
}

TEST(Failures, ThatNoMessageMeetsAreKnown) {
  TinySource source;
  FailingSource failing(source, {{FailureKind::drop, Sensor::imu, 0.1, 0.2}, {FailureKind::drop, Sensor::camera, 50, 60}}, begin);
  while (failing.next()) {
  }
  ASSERT_EQ(failing.without_effect().size(), 1u);
  EXPECT_EQ(failing.without_effect()[0]->sensor, Sensor::camera);
}

TEST(Failures, TheTimesAreThoseOfArrival) {
  TinySource source;
  int given = 0;
  // Every message arrives 10 ms after the one before.
  FailingSource failing(source, {{FailureKind::drop, Sensor::imu, 0, 0.5}}, begin, [&] { return at(0.01 * given++); });
  while (failing.next()) {
  }
  EXPECT_NEAR(static_cast<double>(failing.dropped(Sensor::imu)), 50 / 2.2, 2);
}

TEST(Failures, AFrozenSensorRepeatsItselfInTime) {
  const auto imu = with<ImuSample>({FailureKind::freeze, Sensor::imu, 0.5, 0.7});
  ASSERT_EQ(imu.size(), 100U);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    EXPECT_EQ(imu[i].t, at(0.01 * static_cast<double>(i)));
    EXPECT_EQ(imu[i].gyro.x(), i >= 50 && i < 70 ? 50.0 : static_cast<double>(i) + 1);
  }
}

TEST(Failures, HalfAnImuRepeatsItselfWhileTheOtherHalfGoesOn) {
  const auto whole = with<ImuSample>({FailureKind::drop, Sensor::legs}),
             accel = with<ImuSample>({FailureKind::freeze_half, Sensor::imu, 0.1}),
             gyro = with<ImuSample>({FailureKind::freeze_half, Sensor::imu, 0.1, 9, 1});
  ASSERT_EQ(accel.size(), whole.size());
  EXPECT_EQ(accel.back().gyro, whole.back().gyro);
  EXPECT_EQ(gyro.back().accel, whole.back().accel);
  EXPECT_EQ(accel[accel.size() - 2].accel, accel.back().accel);
  EXPECT_EQ(gyro[gyro.size() - 2].gyro, gyro.back().gyro);
}

TEST(Failures, DelayedMessagesComeLaterWithTheirOldStamps) {
  TinySource source;
  FailingSource failing(source, {{FailureKind::delay, Sensor::lidar, 0, 9, 0.25}}, begin);
  Time last_imu{};
  int scans = 0;
  while (const auto m = failing.next()) {
    if (sensor_of(*m) == Sensor::imu) last_imu = stamp_of(*m);
    if (sensor_of(*m) != Sensor::lidar) continue;
    ++scans;
    if (last_imu >= at(0.99)) continue;
    EXPECT_NEAR(to_seconds(last_imu - stamp_of(*m)), 0.245, 0.006);
  }
  EXPECT_EQ(scans, 10) << "those due after the end come at the end";
}

TEST(Failures, NotANumberReachesEverySensorThatHasNumbers) {
  for (const auto& s : with<ImuSample>({FailureKind::not_a_number, Sensor::imu})) EXPECT_TRUE(s.gyro.array().isNaN().all());
  for (const auto& s : with<JointSample>({FailureKind::not_a_number, Sensor::legs})) EXPECT_TRUE(std::isnan(s.position[0]));
  for (const auto& s : with<LidarScan>({FailureKind::not_a_number, Sensor::lidar})) {
    EXPECT_TRUE(std::isnan(s.points[0].x));
    EXPECT_FALSE(std::isnan(s.points[1].x));
  }
}

TEST(Failures, ANoiseBurstHasItsSigmaAndEndsInTime) {
  const auto imu = with<ImuSample>({FailureKind::noise, Sensor::imu, 0, 0.8, 2.0});
  double squares = 0;
  for (std::size_t i = 0; i < 80; ++i) squares += std::pow(imu[i].accel.z() - 9.8, 2);
  EXPECT_NEAR(std::sqrt(squares / 80), 2.0, 0.5);
  EXPECT_EQ(imu[90].accel.z(), 9.8);
}

TEST(Failures, StampsJumpAndMessagesComeTwice) {
  const auto scans = with<LidarScan>({FailureKind::time_jump, Sensor::lidar, 0.45, 9, -1.5});
  EXPECT_EQ(scans[4].t, at(0.4));
  EXPECT_EQ(scans[5].t, at(0.5 - 1.5));
  EXPECT_EQ(with<JointSample>({FailureKind::duplicate, Sensor::legs, 0, 0.5}).size(), 150U);
}

TEST(Failures, MessagesAreLostAtRandomAndCounted) {
  TinySource source;
  FailingSource failing(source, {{FailureKind::random_loss, Sensor::imu, 0, 1, 0.3}}, begin);
  std::size_t imu = 0, others = 0;
  while (const auto m = failing.next()) ++(sensor_of(*m) == Sensor::imu ? imu : others);
  EXPECT_EQ(others, 120U);
  EXPECT_NEAR(static_cast<double>(imu), 70, 15);
  EXPECT_EQ(failing.dropped(Sensor::imu), 100 - imu);
}

TEST(Failures, AVibrationIsInTheAccelerometerAlone) {
  const auto samples = with<ImuSample>({FailureKind::vibration, Sensor::imu, 0, 1, 5});
  double most = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].gyro.x(), static_cast<double>(i) + 1);
    most = std::max(most, (samples[i].accel - Eigen::Vector3d(0, 0, 9.8)).norm());
  }
  EXPECT_NEAR(most, 5, 0.1);
}

TEST(Failures, ImagesGoDarkOrLoseTheirTexture) {
  EXPECT_EQ(with<CameraImage>({FailureKind::darkness, Sensor::camera, 0, 9, 0.1})[3].image.pixels, (std::vector<std::uint8_t>{10, 20}));
  EXPECT_EQ(with<CameraImage>({FailureKind::textureless, Sensor::camera})[3].image.pixels, (std::vector<std::uint8_t>{150, 150}));
}

TEST(Failures, ABlockedLidarSeesANarrowSector) {
  const auto scans = with<LidarScan>({FailureKind::narrow_sector, Sensor::lidar, 0, 9, 0.5});
  ASSERT_EQ(scans[2].points.size(), 2U);
  EXPECT_EQ(scans[2].points[0].intensity, 1);
  EXPECT_EQ(scans[2].points[1].intensity, 4);
}

}  // namespace failures_test
}  // namespace kilvo::lab
