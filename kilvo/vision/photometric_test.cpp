#include "kilvo/vision/photometric.hpp"

#include <gtest/gtest.h>

#include "kilvo/filter/update.hpp"
#include "kilvo/vision/new_points.hpp"
#include "tests/helpers/tiny_scene.hpp"

namespace kilvo {
namespace photometric_test {

// A map that has seen the scene once, from the origin.
class Photometric : public testing::Test {
 protected:
  Photometric() : camera_(tiny::Scene::mount()), T_CI_(tiny::Scene::mount().T_imu_camera.inverse()), surfaces_(MapConfig{}), map_({}) {
    surfaces_.insert(scene_.groups(), 0);
    remember();
  }

  // What the wall looks like from where the world begins.
  void remember() {
    const SE3 T_CW = T_CI_;
    const auto pyramid = pyramid_of(scene_.image(camera_, {}), Patch::levels);
    VisualFrame frame;
    frame.T_CW = T_CW;
    const std::uint32_t id = map_.add_frame(frame);
    const auto points_W = scene_.points();
    for (const NewPoint& found : new_points(surfaces_, camera_, T_CW, pyramid[0], DepthView(camera_, T_CW, points_W), {}, config_)) {
      if (const auto patch = cut_patch(pyramid, found.pixel))
        map_.insert(found.point, Observation{.frame = id, .pixel = found.pixel.cast<float>(), .patch = *patch});
    }
  }

  // The estimate before an image, wrong by `error`, and as sure of itself as that.
  static Estimate prior_at(const SE3& T_WI, const Eigen::Matrix<double, 6, 1>& error) {
    Estimate e;
    ErrorVector d = ErrorVector::Zero();
    d.head<6>() = error;
    e.x.R = T_WI.R;
    e.x.p = T_WI.p;
    e.x = boxplus(e.x, d);
    e.P.diagonal().setConstant(1e-12);
    e.P.diagonal().segment<3>(at::R).setConstant(std::max(1e-10, error.head<3>().squaredNorm()));
    e.P.diagonal().segment<3>(at::p).setConstant(std::max(1e-8, error.tail<3>().squaredNorm()));
    return e;
  }

  Update see(const GreyImage& image, Estimate prior) {
    const auto pyramid = pyramid_of(image, Patch::levels);
    const SE3 T_CW = T_CI_ * prior.x.pose().inverse();
    const auto points_W = scene_.points();
    const DepthView depth(camera_, T_CW, points_W);
    tracks_ = select_patches(map_, camera_, T_CW, depth, config_);
    PhotometricModel model(map_, camera_, T_CI_, pyramid, tracks_, prior, config_);
    prior.P(at::tau, at::tau) = 0.01;
    if (const auto exposure = model.exposure_at(prior.x)) {
      prior.x.tau = std::exp(exposure->log);
      prior.P(at::tau, at::tau) = std::pow(exposure->sigma * prior.x.tau, 2);
    }
    UpdateConfig config;
    config.min_iterations = model.iterations();
    const Update out = update(prior, model, config);
    report_ = model.report();
    return out;
  }

  static Eigen::Matrix<double, 6, 1> twist(double rx, double ry, double rz, double x, double y, double z) {
    Eigen::Matrix<double, 6, 1> out;
    out << rx, ry, rz, x, y, z;
    return out;
  }

  tiny::Scene scene_;
  Camera camera_;
  SE3 T_CI_;
  VisionConfig config_;
  VoxelMap surfaces_;
  VisualMap map_;
  std::vector<PatchCandidate> tracks_;
  PhotometricModel::Report report_;
};

// Root mean square of how far points of the wall are seen from where they really are, px: what an image can know. (That the camera turned
// and that it stepped aside look nearly alike on a wall.)
double pixels_off(const Camera& camera, const SE3& T_CI, const State& x, const SE3& truth) {
  double sum = 0;
  int count = 0;
  for (double y = -1; y <= 1; y += 0.25) {
    for (double z = -0.8; z <= 0.8; z += 0.2, ++count) {
      const Eigen::Vector3d p_W(3, y, z);
      sum += (view_of(camera, T_CI, x.pose(), p_W)->pixel - view_of(camera, T_CI, truth, p_W)->pixel).squaredNorm();
    }
  }
  return std::sqrt(sum / count);
}

const SE3 moved = {SO3::Exp({0.02, -0.03, 0.04}), {0.15, 0.10, -0.08}};

ErrorVector error_of(const Update& u, const SE3& truth) {
  State x = u.posterior.x;
  x.R = truth.R;
  x.p = truth.p;
  return boxminus(u.posterior.x, x);
}

TEST_F(Photometric, BeforeABlankWallTheExposureIsFollowedAndThePoseLeftAlone) {
  scene_.contrast = 0;
  map_ = VisualMap({});
  remember();
  EXPECT_GT(map_.size(), 8U);
  EXPECT_LT(map_.size(), 30U);
  const Estimate prior = prior_at(moved, twist(0.002, -0.001, 0.002, 0.004, 0.003, -0.002));
  for (const double brightness : {0.6, 1.0, 1.6}) {
    const Update u = see(scene_.image(camera_, moved, brightness, 1.5), prior);
    EXPECT_NEAR(u.posterior.x.tau * brightness, 1, 0.01);
    EXPECT_EQ(u.rows, 0);
    EXPECT_EQ(report_.tracks, 0) << "a patch without corners is none that could have agreed";
    EXPECT_EQ((u.posterior.x.p - prior.x.p).norm(), 0);
  }
}

TEST_F(Photometric, TheMapIsOnTheWallAndSpreadOverTheImage) {
  EXPECT_GT(map_.size(), 40U);
  for (std::uint32_t i = 0; i < map_.size(); ++i) EXPECT_NEAR(map_.point(i).p_W.x(), scene_.wall, 1e-4);
}

TEST_F(Photometric, WhereAPointIsSeenMovesWithThePoseAsTheJacobianSays) {
  constexpr double h = 1e-6;
  for (const Eigen::Vector3d& p_W : {Eigen::Vector3d(3, 0.4, -0.3), Eigen::Vector3d(3, -0.8, 0.5), Eigen::Vector3d(2, 0.1, 0.7)}) {
    const auto view = view_of(camera_, T_CI_, moved, p_W);
    ASSERT_TRUE(view);
    State x;
    x.R = moved.R;
    x.p = moved.p;
    for (int k = 0; k < 6; ++k) {
      ErrorVector d = ErrorVector::Zero();
      d[k] = h;
      const Eigen::Vector2d ahead = view_of(camera_, T_CI_, boxplus(x, d).pose(), p_W)->pixel;
      const Eigen::Vector2d behind = view_of(camera_, T_CI_, boxplus(x, -d).pose(), p_W)->pixel;
      EXPECT_LT((view->J.col(k) - (ahead - behind) / (2 * h)).norm(), 1e-4 * std::max(1.0, view->J.col(k).norm())) << k;
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(k);
      const Eigen::Vector2d difference =
          view_of(camera_, T_CI_, moved, p_W + step)->pixel - view_of(camera_, T_CI_, moved, p_W - step)->pixel;
      EXPECT_LT((view->J_point.col(k) - difference / (2 * h)).norm(), 1e-4 * std::max(1.0, view->J_point.col(k).norm())) << k;
    }
  }
}

TEST_F(Photometric, AnImageCorrectsThePoseToAFractionOfAPixel) {
  const Update u = see(scene_.image(camera_, moved), prior_at(moved, twist(2e-3, -1e-3, 1e-3, 0.004, -0.003, 0.003)));
  EXPECT_GT(report_.used, 30);
  EXPECT_LT(pixels_off(camera_, T_CI_, u.posterior.x, moved), 0.03);
  EXPECT_LT(error_of(u, moved).segment<3>(at::p).norm(), 1e-3);
  EXPECT_NEAR(u.posterior.x.tau, 1, 0.01);
}

TEST_F(Photometric, AnErrorOfSeveralPixelsIsFoundByTheCoarserLevels) {
  const Update u = see(scene_.image(camera_, moved), prior_at(moved, twist(0, 8e-3, -8e-3, 0.01, 0.01, -0.01)));
  EXPECT_GT(report_.used, 30);
  EXPECT_LT(pixels_off(camera_, T_CI_, u.posterior.x, moved), 0.04);
}

TEST_F(Photometric, TheExposureIsFollowedThroughAFactorOfTwo) {
  for (const double brightness : {0.5, 0.7, 1.0, 1.25}) {
    const Update u = see(scene_.image(camera_, moved, brightness), prior_at(moved, twist(1e-3, 0, 0, 0.002, 0, 0)));
    EXPECT_NEAR(u.posterior.x.tau * brightness, 1, 0.01) << brightness;
    EXPECT_LT(error_of(u, moved).segment<3>(at::p).norm(), 1e-3) << brightness;
  }
}

TEST_F(Photometric, AnImageThatIsSaturatedInPartIsNotTakenForADarkerOne) {
  for (const double brightness : {1.7, 1.9, 2.1}) {
    const Update u = see(scene_.image(camera_, moved, brightness, 1.5), prior_at(moved, twist(1e-3, 0, 0, 0.002, 0, 0)));
    EXPECT_GT(5 * report_.saturated, 2 * report_.tracks) << brightness;
    EXPECT_NEAR(u.posterior.x.tau * brightness, 1, 0.01) << brightness;
  }
}

TEST_F(Photometric, TheCovarianceIsHonest) {
  double nees = 0;
  constexpr int runs = 30;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  for (int run = 0; run < runs; ++run) {
    Eigen::Matrix<double, 6, 1> error;
    for (int k = 0; k < 6; ++k) error[k] = (k < 3 ? 1e-3 : 3e-3) * normal(random);
    Estimate prior = prior_at(moved, error);
    prior.P.diagonal().segment<3>(at::R).setConstant(1e-6);
    prior.P.diagonal().segment<3>(at::p).setConstant(9e-6);
    const Update u = see(scene_.image(camera_, moved, 1, 2, static_cast<unsigned>(run)), prior);
    const Eigen::Matrix<double, 6, 1> e = error_of(u, moved).head<6>();
    const PoseCovariance P = u.posterior.P.topLeftCorner<6, 6>();
    nees += e.dot(P.ldlt().solve(e)) / runs;
  }
  // 6 if it were exact; the configured share of a pixel that calibration may be off is not in these images.
  EXPECT_LT(nees, 7.5);
  EXPECT_GT(nees, 0.5);
}

TEST_F(Photometric, BlackAndWhiteImagesSayNothing) {
  for (const int grey : {0, 255}) {
    GreyImage image{camera_.width(), camera_.height(), {}};
    image.pixels.assign(static_cast<std::size_t>(camera_.width() * camera_.height()), static_cast<std::uint8_t>(grey));
    const Estimate prior = prior_at(moved, twist(1e-3, 0, 0, 0.002, 0, 0));
    const Update u = see(image, prior);
    EXPECT_EQ(report_.used, 0);
    EXPECT_TRUE((u.posterior.x.p - prior.x.p).isZero(0));
  }
}

TEST_F(Photometric, HalfAnImageOfAnotherTimeDoesNotPull) {
  GreyImage torn = scene_.image(camera_, moved);
  const GreyImage old = scene_.image(camera_, {SO3::Exp({0, 0.02, 0.02}), {0, 0, 0}});
  std::copy(old.pixels.begin(), old.pixels.begin() + static_cast<std::ptrdiff_t>(old.pixels.size() / 2), torn.pixels.begin());
  const Update u = see(torn, prior_at(moved, twist(5e-4, 0, 5e-4, 0.001, 0.001, 0)));
  const ErrorVector e = error_of(u, moved);
  EXPECT_LT(e.segment<3>(at::p).norm(), 2e-3);
  EXPECT_LT(e.segment<3>(at::R).norm(), 1e-3);
}

TEST_F(Photometric, WhatStandsInFrontHidesWhatIsBehind) {
  std::vector<Eigen::Vector4f> points_W = scene_.points();
  for (float y = -1; y < 0; y += 0.02F) {
    for (float z = -0.7F; z < 0.7F; z += 0.02F) points_W.emplace_back(1.5F, y / 2, z / 2, 10.0F);
  }
  const DepthView depth(camera_, T_CI_, points_W);
  const auto all = select_patches(map_, camera_, T_CI_, DepthView(camera_, T_CI_, scene_.points()), config_);
  const auto some = select_patches(map_, camera_, T_CI_, depth, config_);
  EXPECT_LT(some.size(), all.size() * 4 / 5);
  EXPECT_GT(some.size(), all.size() / 4);
  for (const PatchCandidate& t : some) {
    const Eigen::Vector3d& p = map_.point(t.point).p_W;
    const double y_at_screen = p.y() / 2 + 0.01, z_at_screen = p.z() / 2;
    EXPECT_FALSE(y_at_screen > -0.45 && y_at_screen < -0.05 && std::abs(z_at_screen) < 0.3) << p.transpose();
  }
}

}  // namespace photometric_test
}  // namespace kilvo
