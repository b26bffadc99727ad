#include "kilvo/vision/camera_errors.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "tests/helpers/tiny_scene.hpp"

namespace kilvo {
namespace camera_errors_test {

const double degree = std::acos(-1) / 180;

// What a camera shows to a robot that looks about, whose turn about the IMU's axes against the description is not known.
class LooksAbout {
 public:
  explicit LooksAbout(const Eigen::Vector3d& turn)
      : errors_(described()), R_true_(SO3::Exp(turn) * described().R), map_(VisualMapConfig{}) {
    for (int i = 0; i < 5; ++i) {
      VisualFrame frame;
      frame.T_CW = errors_.T_CI() * SE3{somewhere(), {}}.inverse();
      frames_.push_back(map_.add_frame(frame));
    }
  }

  std::optional<CameraErrors::Turned> look() {
    const SO3 R_WI = somewhere();
    // By how much the camera is turned still, which turns the patches of the frames as well.
    const Eigen::Vector3d left = (R_true_ * errors_.T_CI().R).Log();
    std::vector<ImageTurn> turns;
    for (const std::uint32_t frame : frames_) {
      const SO3 R_frame = (errors_.T_CI().R.inverse() * map_.frame(frame).T_CW.R).inverse();
      const Eigen::Vector3d turn = left - (R_WI.inverse() * R_frame).matrix() * left + noise * some();
      turns.push_back({frame, Eigen::Matrix3d::Identity() / (noise * noise), turn / (noise * noise)});
    }
    errors_.add_turns({R_WI, Eigen::Vector3d::Zero()}, map_, turns, 1e-10);
    return errors_.judge(Time{std::chrono::milliseconds(100 * ++images_)});
  }
  const CameraErrors& errors() const { return errors_; }
  double off() const { return (R_true_ * errors_.T_CI().R).Log().norm(); }

 private:
  static constexpr double noise = 3e-4;  // rad
  static SE3 described() { return tiny::Scene::mount().T_imu_camera; }
  Eigen::Vector3d some() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  SO3 somewhere() { return SO3::Exp(Eigen::Vector3d(0.05, 0.05, 0.2).cwiseProduct(some())); }

  CameraErrors errors_;
  SO3 R_true_;
  VisualMap map_;
  std::vector<std::uint32_t> frames_;
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_{0, 1};
  int images_ = 0;
};

TEST(CameraErrors, ACameraThatIsTurnedTurnsItsImagesUntilItIsCorrected) {
  LooksAbout camera({0.01, -0.006, 0.008});
  double before = 0;
  int corrections = 0;
  for (int i = 0; i < 600; ++i) {
    const auto turned = camera.look();
    if (!turned) {
      if (corrections == 0) before = camera.errors().turn_variance();
      continue;
    }
    ++corrections;
    EXPECT_TRUE(turned->corrected) << i;
  }
  EXPECT_GT(std::sqrt(before), 0.001);
  EXPECT_GE(corrections, 1);
  EXPECT_LT(corrections, 4);
  EXPECT_LT(camera.off(), 0.1 * degree);
  EXPECT_LT(std::sqrt(camera.errors().turn_variance()), 0.3 * std::sqrt(before)) << "what was corrected is forgotten";
}

TEST(CameraErrors, ARightCameraTurnsNothing) {
  LooksAbout camera(Eigen::Vector3d::Zero());
  for (int i = 0; i < 600; ++i) ASSERT_FALSE(camera.look()) << i;
  EXPECT_LT(std::sqrt(camera.errors().turn_variance()), 1e-4);
}

TEST(CameraErrors, ACameraThatIsTurnedByFarIsNotCorrectedButNotUsedForSomeTime) {
  LooksAbout camera({0.05, 0, 0.03});
  int i = 0;
  std::optional<CameraErrors::Turned> turned;
  while (!turned && ++i < 300) turned = camera.look();
  ASSERT_TRUE(turned);
  EXPECT_FALSE(turned->corrected);
  const Time now{std::chrono::milliseconds(100 * i)};
  EXPECT_TRUE(camera.errors().refuses(now + std::chrono::seconds(9)));
  EXPECT_FALSE(camera.errors().refuses(now + std::chrono::seconds(11)));
}

TEST(CameraErrors, TheShareOfTheWayThatImagesGetWrongIsLearnt) {
  for (const double share : {0.0, 0.01}) {
    CameraErrors errors(tiny::Scene::mount().T_imu_camera);
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0, 1);
    constexpr double noise = 0.001, way = 0.4;  // m
    for (int i = 0; i < 300; ++i) errors.add_shift(noise * normal(random) + share * way * normal(random), noise * noise, way);
    EXPECT_NEAR(std::sqrt(errors.way_variance()), share, 0.002);
    // Nothing is known of an image without a way.
    errors.add_shift(0.1, noise * noise, 0);
    EXPECT_NEAR(std::sqrt(errors.way_variance()), share, 0.002);
  }
}

// Images along the way against a prior that is as certain as they are, at an iterate between the two: what is learnt is the images' share.
TEST(CameraErrors, TheShareIsThatOfTheImageWhereverTheIterateIs) {
  for (const double share : {0.0, 0.02}) {
    CameraErrors errors(tiny::Scene::mount().T_imu_camera);
    std::mt19937 random(13);
    std::normal_distribution<double> normal(0, 1);
    constexpr double sigma = 0.001;  // m, of the image and of the prior
    const Eigen::Vector3d way(0.4, 0, 0);
    for (int i = 0; i < 300; ++i) {
      Estimate prior;
      prior.x.p = {sigma * normal(random), 0, 0};
      prior.P.diagonal().setConstant(1e-14);
      prior.P(at::p, at::p) = sigma * sigma;
      const double seen = sigma * normal(random) + share * way.x() * normal(random);
      State x = prior.x;
      x.p.x() = 0.5 * (prior.x.p.x() + seen);
      Information<7> info;
      info.A.setIdentity();
      info.A /= sigma * sigma;
      info.b.setZero();
      info.b[3] = (x.p.x() - seen) / (sigma * sigma);
      errors.add_way(info, x, prior, way);
    }
    EXPECT_NEAR(std::sqrt(errors.way_variance()), share, 0.003);
  }
}

}  // namespace camera_errors_test
}  // namespace kilvo
