#include "kilvo/estimator/map_error.hpp"

#include <gtest/gtest.h>

namespace kilvo {
namespace map_error_test {

const SE3 somewhere = {SO3::Exp({0.1, -0.2, 2.0}), {3, -2, 0.5}};

PoseCovariance diagonal(double rotation, double position) {
  PoseCovariance P = PoseCovariance::Zero();
  P.diagonal() << rotation, rotation, rotation, position, position, position;
  return P;
}

TEST(MapError, IsZeroBeforeAnythingWasRegistered) { EXPECT_EQ(MapError().at(somewhere), PoseCovariance::Zero()); }

TEST(MapError, ASweepAgainstPlanesOfOneEpochHasTheirError) {
  MapError error;
  const PoseCovariance inserted = diagonal(1e-6, 1e-2);
  const std::uint32_t epoch = error.epoch_now(somewhere, inserted);
  error.registered(somewhere, std::vector<EpochInformation>{{epoch, diagonal(1e7, 1e6)}}, PoseCovariance::Zero(), PoseCovariance::Zero());
  EXPECT_LT((error.at(somewhere) - inserted).norm(), 1e-4 * inserted.norm());
}

TEST(MapError, TurnsOverTheDistanceToWhereThePlanesWereMade) {
  MapError error;
  const std::uint32_t epoch = error.epoch_now({}, diagonal(1e-4, 1e-12));
  const SE3 away = {SO3(), {10, 0, 0}};
  error.registered(away, std::vector<EpochInformation>{{epoch, diagonal(1e7, 1e6)}}, PoseCovariance::Zero(), PoseCovariance::Zero());
  EXPECT_NEAR(error.at(away)(4, 4), 100 * 1e-4, 1e-5) << "0.01 rad at 10 m";
  EXPECT_NEAR(error.at(away)(3, 3), 0, 1e-5);
}

TEST(MapError, OldPlanesBringBackTheirSmallError) {
  MapError error;
  const std::uint32_t old = error.epoch_now(somewhere, diagonal(1e-8, 1e-6));
  const std::uint32_t late = error.epoch_now(somewhere, diagonal(1e-8, 1.0));
  ASSERT_NE(old, late);
  error.registered(somewhere, std::vector<EpochInformation>{{late, diagonal(1e7, 1e6)}}, PoseCovariance::Zero(), PoseCovariance::Zero());
  EXPECT_NEAR(error.at(somewhere)(3, 3), 1.0, 1e-2);
  error.registered(somewhere, std::vector<EpochInformation>{{old, diagonal(1e7, 1e6)}}, PoseCovariance::Zero(), PoseCovariance::Zero());
  EXPECT_LT(error.at(somewhere)(3, 3), 2e-6);
}

TEST(MapError, KeepsItsErrorAlongADirectionThatASweepDoesNotKnow) {
  MapError error;
  const std::uint32_t late = error.epoch_now({}, diagonal(1e-8, 1.0));
  error.registered({}, std::vector<EpochInformation>{{late, diagonal(1e7, 1e6)}}, PoseCovariance::Zero(), PoseCovariance::Zero());
  PoseCovariance weak = PoseCovariance::Zero();
  weak(3, 3) = 1;
  PoseCovariance blind_along_x = diagonal(1e7, 1e6);
  blind_along_x(3, 3) = 0;
  MapError fresh = error;
  const std::uint32_t old = fresh.epoch_now({}, diagonal(1e-8, 1e-6));
  fresh.registered({}, std::vector<EpochInformation>{{old, blind_along_x}}, PoseCovariance::Zero(), weak);
  EXPECT_NEAR(fresh.at({})(3, 3), 1.0, 1e-2);
}

// What an update takes from planes along a weak direction comes with their error: of planes that are as uncertain as the pose nothing is
// learnt, of certain ones it is.
TEST(MapError, WhatIsTakenFromThePlanesAlongAWeakDirectionHasTheirError) {
  PoseCovariance weak = PoseCovariance::Zero(), blind_along_x = diagonal(1e7, 1e6);
  weak(3, 3) = 1;
  blind_along_x(3, 3) = 0;
  const double taken = 0.2;
  for (const bool is_old : {false, true}) {
    MapError error;
    const std::uint32_t old = error.epoch_now({}, diagonal(1e-8, 1e-6));
    double P = 0.25, total = 0;  // m^2, along x
    for (int k = 0; k < 40; ++k) {
      total = P + error.at({})(3, 3);
      const std::uint32_t now = error.epoch_now({}, diagonal(1e-8, P));
      error.registered({}, std::vector<EpochInformation>{{is_old ? old : now, blind_along_x, taken * weak}}, PoseCovariance::Zero(), weak);
      P *= 1 - taken;
    }
    if (is_old) {
      EXPECT_LT(std::sqrt(total), 0.02);
    } else {
      EXPECT_GT(std::sqrt(total), 0.4);
      EXPECT_LT(std::sqrt(total), 0.7);
    }
  }
}

TEST(MapError, AnEpochLastsWhileTheUncertaintyDoes) {
  MapError error;
  const std::uint32_t first = error.epoch_now(somewhere, diagonal(1e-6, 1e-4));
  EXPECT_EQ(error.epoch_now(somewhere, diagonal(1.1e-6, 1.1e-4)), first);
  EXPECT_NE(error.epoch_now(somewhere, diagonal(1e-6, 2e-4)), first);
}

}  // namespace map_error_test
}  // namespace kilvo
