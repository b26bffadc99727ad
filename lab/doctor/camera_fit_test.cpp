// Corners of a world that is known, followed by a camera whose mount is not.
#include "lab/doctor/camera_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "kilvo/vision/camera.hpp"

namespace kilvo::lab {
namespace camera_fit_test {

constexpr double seconds = 12, period = 0.1;

/// A robot that sways about all axes while it walks.
Eigen::Vector3d rate(double t) { return {0.3 * std::sin(5 * t), 0.25 * std::cos(6.1 * t), 0.4 * std::sin(1.3 * t)}; }

std::vector<InertialSample> gyro_samples() {
  std::vector<InertialSample> out;
  for (double t = -0.2; t < seconds + 0.2; t += 0.005) out.push_back({t, rate(t), Eigen::Vector3d(0, 0, 9.81)});
  return out;
}

CameraMount camera() {
  CameraMount out;
  out.width = 640, out.height = 480;
  out.fx = out.fy = 400, out.cx = 320, out.cy = 240;
  out.T_imu_camera.R = SO3::Exp(Eigen::Vector3d(0.2, -1.1, 1.4));
  return out;
}

/// Points 2 to 6 m away, 3 cm of way between two images, 0.2 px of noise.
std::vector<TrackedPair> tracks(const GyroPath& gyro) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> across(-0.6, 0.6), away(2, 6);
  std::normal_distribution<double> noise(0, 0.2);
  const Camera model(camera());
  const SO3 R_IC = camera().T_imu_camera.R;
  std::vector<TrackedPair> out;
  for (double t = 0; t + period < seconds; t += period) {
    TrackedPair pair{t, t + period, {}};
    const SO3 R_12 = R_IC.inverse() * SO3::from_quaternion(gyro.between(t, t + period)) * R_IC;
    const Eigen::Vector3d way = 0.03 * Eigen::Vector3d(std::sin(t), 0.3, std::cos(t));
    for (int k = 0; k < 40; ++k) {
      const double z = away(random);
      const Eigen::Vector3d first(z * across(random), z * across(random), z);
      const auto a = model.project(first), b = model.project(R_12.inverse() * (first - way));
      if (!a || !b) continue;
      const Eigen::Vector2d off(noise(random), noise(random));
      pair.tracks.push_back({a->cast<float>(), (*b + off).cast<float>()});
    }
    out.push_back(std::move(pair));
  }
  return out;
}

TEST(CameraTracks, FindTheRotationWhateverIsDescribed) {
  const GyroPath gyro(gyro_samples(), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  const std::vector<TrackedPair> seen = tracks(gyro);
  const CameraTracks cameras(seen, gyro, nullptr);
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(1, 1.2, -0.7), Eigen::Vector3d(-2, 0.4, 1.5), Eigen::Vector3d(0.3, 0, 0)}) {
    CameraMount described = camera();
    described.T_imu_camera.R = described.T_imu_camera.R * SO3::Exp(turn);
    const CameraFit fit = cameras.fit_any_rotation({described, 0});
    ASSERT_TRUE(fit.fit.good);
    EXPECT_LT((fit.R_IC.inverse() * camera().T_imu_camera.R).Log().norm(), 0.006) << turn.transpose();
  }
}

TEST(CameraTracks, OfTheRightMountAreAsFarFromTheirLinesAsTheirNoise) {
  const GyroPath gyro(gyro_samples(), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  const std::vector<TrackedPair> seen = tracks(gyro);
  EXPECT_NEAR(CameraTracks(seen, gyro, nullptr).error({camera(), 0}), 0.19, 0.06);
}

// A robot that sways, nods and turns while it walks, with a LiDAR that knows its way.
TEST(CameraTracks, FindWhereTheCameraIs) {
  const GyroPath gyro(gyro_samples(), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  const auto turned = [&gyro](double t) { return SO3::from_quaternion(gyro.between(-0.2, t)); };
  const auto place = [](double t) { return Eigen::Vector3d(0.4 * t, 0.02 * std::sin(6 * t), 0.015 * std::cos(11 * t)); };
  const auto acceleration = [](double t) { return Eigen::Vector3d(0, -0.72 * std::sin(6 * t), -1.815 * std::cos(11 * t)); };
  const Eigen::Vector3d g(0, 0, -9.81);
  std::vector<InertialSample> imu = gyro_samples();
  for (InertialSample& s : imu) s.accel = turned(s.t).inverse() * (acceleration(s.t) - g);
  std::vector<SweepPose> poses;
  for (double t = -0.1; t < seconds + 0.1; t += period) {
    SweepPose p;
    p.t = p.begin = p.end = t;
    p.T_WL = {turned(t), place(t)};
    p.weakest = 0.3, p.good = true;
    poses.push_back(p);
  }
  const LidarWay way(poses, SE3(), 0, imu, gyro, g, Eigen::Vector3d::Zero());
  CameraMount mount = camera();
  mount.T_imu_camera.p = {0.12, -0.05, 0.2};
  std::mt19937 random(6);
  std::uniform_real_distribution<double> across(-0.6, 0.6), away(2, 6);
  std::normal_distribution<double> noise(0, 0.2);
  const Camera model(mount);
  std::vector<TrackedPair> seen;
  for (double t = 0; t + period < seconds; t += period) {
    TrackedPair pair{t, t + period, {}};
    const SE3 T_12 =
        (SE3{turned(t), place(t)} * mount.T_imu_camera).inverse() * SE3{turned(t + period), place(t + period)} * mount.T_imu_camera;
    for (int k = 0; k < 40; ++k) {
      const double z = away(random);
      const Eigen::Vector3d first(z * across(random), z * across(random), z);
      const auto a = model.project(first), b = model.project(T_12.inverse() * first);
      if (a && b) pair.tracks.push_back({a->cast<float>(), (*b + Eigen::Vector2d(noise(random), noise(random))).cast<float>()});
    }
    seen.push_back(std::move(pair));
  }
  const CameraTracks tracks(seen, gyro, &way);
  for (const Eigen::Vector3d& off : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(0, -0.2, 0.1)}) {
    CameraMount described = mount;
    described.T_imu_camera.p += off;
    const CameraFit fit = tracks.fit_with_position({described, 0});
    ASSERT_TRUE(fit.fit.good);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(fit.p_IC[i], mount.T_imu_camera.p[i], 0.012) << off.transpose();
      EXPECT_LT(fit.fit.sigma(5 + i), 0.01) << i;
    }
    EXPECT_NEAR(fit.focal, 1, 0.005) << off.transpose();
  }
  for (const auto& lens : {std::array{30.0, -20.0, 1.0, 0.0}, {0.0, 0.0, 1.15, 0.0}, {0.0, 0.0, 1.0, 0.25}}) {
    CameraMount described = mount;
    described.cx += lens[0], described.cy += lens[1], described.fy *= lens[2];
    described.distortion = {lens[3], 0, 0, 0};
    const CameraFit fit = tracks.fit_with_lens({described, 0});
    ASSERT_TRUE(fit.fit.good);
    EXPECT_NEAR(fit.mount.cx, mount.cx, 4) << lens[0];
    EXPECT_NEAR(fit.mount.cy, mount.cy, 4) << lens[1];
    EXPECT_NEAR(fit.mount.fy / fit.mount.fx, 1, 0.005) << lens[2];
    EXPECT_NEAR(fit.mount.distortion[0], 0, 0.02) << lens[3];
    EXPECT_LT(fit.error, 0.95 * std::min(tracks.fit({described, 0}, true, true).error, tracks.fit_with_position({described, 0}).error));
  }
  CameraMount turned_mount = mount;
  turned_mount.T_imu_camera.R = mount.T_imu_camera.R * SO3::Exp(0.04 * Eigen::Vector3d::UnitX());
  const CameraFit unturned = tracks.fit_unturned({turned_mount, 0});
  EXPECT_LT((unturned.R_IC.inverse() * turned_mount.T_imu_camera.R).Log().norm(), 1e-4);
  EXPECT_LT(tracks.fit({turned_mount, 0}, true, true).error, 0.5 * unturned.error);
  const CameraFit right = tracks.fit_unturned({mount, 0});
  EXPECT_GT(tracks.fit({mount, 0}, true, true).error, 0.95 * right.error) << "no other rotation explains more than the right one";
  CameraMount longer = mount;
  longer.fx *= 1.2, longer.fy *= 1.2;
  EXPECT_NEAR(tracks.fit_with_position({longer, 0}).focal, 1 / 1.2, 0.005);
}

}  // namespace camera_fit_test
}  // namespace kilvo::lab
