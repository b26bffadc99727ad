#include "kilvo/estimator/prediction_check.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <initializer_list>
#include <vector>

namespace kilvo {
namespace prediction_check_test {

constexpr int met = 2000;  // clusters of a sweep that meet a surface

/// So many of them lie beside it, and the sweep moved the state by `moved` m along x and turned it by a tenth of that, rad.
Registration sweep(int beside, double moved = 0.001) {
  Registration out;
  out.carries = true;
  out.report.matched = met - beside;
  out.report.rejected = beside;
  out.posterior.x.p.x() = moved;
  out.posterior.x.R = SO3::Exp({0, 0, 0.1 * moved});
  return out;
}

const PoseCovariance exact_map = PoseCovariance::Zero();

/// Learns from one more sweep; the prior is as certain as 1 mm and 1 mrad, sweeps are 0.1 s apart.
void learn(PredictionCheck& check, const Registration& sweep, Time& t) {
  t += std::chrono::milliseconds(100);
  Registration next = sweep;
  next.posterior.t = t;
  check.learn(Estimate{}, next, exact_map);
}

struct Checked {
  PredictionCheck check;
  Time t{};
  void learn(const Registration& sweep, int times = 1) {
    for (int k = 0; k < times; ++k) prediction_check_test::learn(check, sweep, t);
  }
};

Checked after(int sweeps, int beside) {
  Checked out;
  out.learn(sweep(beside), sweeps);
  return out;
}

TEST(PredictionCheck, MoreBesideTheSurfacesThanUsualContradictsWhateverIsUsual) {
  for (const int usual : {0, 20, 100, 400}) {
    const PredictionCheck check = after(30, usual).check;
    EXPECT_FALSE(check.contradicts(sweep(usual))) << usual;
    EXPECT_FALSE(check.contradicts(sweep(usual + 100))) << usual;
    EXPECT_TRUE(check.contradicts(sweep(usual + 300))) << usual;
    EXPECT_FALSE(check.contradicts(sweep(usual / 2))) << "fewer are no contradiction";
  }
}

TEST(PredictionCheck, FewSweepsOrFewPointsSayNothing) {
  const PredictionCheck check = after(30, 100).check;
  EXPECT_FALSE(after(5, 100).check.contradicts(sweep(1000)));
  Registration few = sweep(0);
  few.report.matched = 18;
  few.report.rejected = 4;
  EXPECT_FALSE(check.contradicts(few)) << "4 of 22 may come by chance";
  few.report = {};
  EXPECT_FALSE(check.contradicts(few));
  Registration found = sweep(1000);
  found.searched = true;
  EXPECT_FALSE(check.contradicts(found));
}

TEST(PredictionCheck, APoseExplainsASweepThatThenFitsAsUsual) {
  const PredictionCheck check = after(30, 100).check;
  const Registration off = sweep(800);
  EXPECT_TRUE(check.explains(sweep(110), off));
  EXPECT_TRUE(check.explains(sweep(300), off));
  EXPECT_FALSE(check.explains(sweep(700), off)) << "a crowd";
  Registration lost = sweep(110);
  lost.refused = Reason::fits_nowhere;
  EXPECT_FALSE(check.explains(lost, off));
  Registration fewer = sweep(0);
  fewer.report.matched = 500;
  EXPECT_FALSE(check.explains(fewer, off)) << "points that now meet nothing";
}

TEST(PredictionCheck, PredictionsAreDoubtedUntilSomeSweepsAreWhereTheyWere) {
  Checked c = after(30, 100);
  EXPECT_FALSE(c.check.error());
  c.check.begin(c.t, {0.02, 0.05});
  int lasted = 0;
  for (int k = 0; k < 80; ++k) {
    c.learn(sweep(100, 0.05));
    lasted += c.check.lasts() ? 1 : 0;
  }
  EXPECT_EQ(lasted, 1) << "to be told once";
  ASSERT_TRUE(c.check.error()) << "it goes on";
  EXPECT_NEAR(c.check.error()->moved, 0.05, 1e-3);
  EXPECT_NEAR(c.check.error()->turned, 0.005, 1e-3);
  c.learn(sweep(100, 0.02), 30);
  ASSERT_TRUE(c.check.error());
  EXPECT_NEAR(c.check.error()->moved, 0.02, 1e-3) << "and is as large as the sweeps show";
  c.learn(sweep(100), 4);
  EXPECT_TRUE(c.check.error());
  c.learn(sweep(100));
  EXPECT_FALSE(c.check.error()) << "whatever was usual before";
  EXPECT_FALSE(c.check.lasts());
}

// The doubt before leaves the prior uncertain: it agrees with anything, and predictions may be off all the same.
TEST(PredictionCheck, OnlySweepsNearThePredictionAgreeWithIt) {
  Checked c = after(30, 100);
  c.check.begin(c.t, {0.02, 0.05});
  Estimate uncertain;
  uncertain.P.diagonal().head<6>().setConstant(0.1 * 0.1);
  const auto see = [&](double moved, bool searched) {
    Registration found = sweep(100, moved);
    found.searched = searched;
    c.check.learn(uncertain, found, exact_map);
  };
  for (int k = 0; k < 20; ++k) see(0.04, false);
  EXPECT_TRUE(c.check.error());
  const double before = c.check.error()->moved;
  see(0.3, true);
  EXPECT_LE(c.check.error()->moved, before) << "a search may have found another place";
  for (int k = 0; k < 5; ++k) see(0.01, true);
  EXPECT_FALSE(c.check.error());
}

TEST(PredictionCheck, WhatHasGrownOverSweepsIsNotTheErrorOfTheNext) {
  Checked c = after(30, 100);
  c.check.begin(c.t, {0.5, 0.3});
  EXPECT_NEAR(c.check.error()->turned, 0.06, 1e-9);
  EXPECT_NEAR(c.check.error()->moved, 0.16, 1e-9);
}

TEST(PredictionCheck, AnErrorThatComesAgainIsDoubtedForLonger) {
  Checked c = after(30, 100);
  EXPECT_FALSE(c.check.recurs());
  for (const int agreeing : {5, 50}) {
    c.check.begin(c.t, {0.02, 0.05});
    EXPECT_FALSE(c.check.recurs());
    c.learn(sweep(100), agreeing - 1);
    EXPECT_TRUE(c.check.error());
    c.learn(sweep(100));
    EXPECT_FALSE(c.check.error()) << agreeing;
    EXPECT_TRUE(agreeing != 5 || c.check.recurs()) << "no shock";
  }
  c.learn(sweep(100), 100);
  EXPECT_FALSE(c.check.recurs()) << "long ago";
}

TEST(PredictionCheck, ARunIsHopelessWhenEveryOtherSweepWasElsewhereForSecondsOrPredictionsFailAgainAndAgain) {
  Checked c = after(30, 100);
  c.check.begin(c.t, {0.02, 0.05});
  c.learn(sweep(100, 0.05), 49);
  EXPECT_FALSE(c.check.is_hopeless());
  Registration silent = sweep(100);
  silent.report = {};
  c.learn(silent, 100);
  EXPECT_FALSE(c.check.is_hopeless()) << "a covered LiDAR contradicts nothing";
  c.learn(sweep(100, 0.05), 5);
  EXPECT_TRUE(c.check.is_hopeless());
  Checked healed = after(30, 100);
  healed.check.begin(healed.t, {0.02, 0.05});
  for (int k = 0; k < 100; ++k) healed.learn(sweep(100, k % 4 == 0 ? 0.05 : 0.001));
  EXPECT_TRUE(healed.check.error());
  EXPECT_FALSE(healed.check.is_hopeless()) << "most sweeps are where they were predicted";
  Checked often = after(30, 100);
  for (int k = 0; k < 6; ++k) {
    EXPECT_FALSE(often.check.gives_up()) << k;
    often.check.begin(often.t, {0.02, 0.05});
    often.learn(sweep(100));
  }
  EXPECT_TRUE(often.check.gives_up());
  EXPECT_FALSE(often.check.error()) << "nothing is doubted any more";
  EXPECT_FALSE(often.check.contradicts(sweep(1000)));
}

TEST(PredictionCheck, OneUnusualSweepIsAShockTwoOrThreeAreNone) {
  using Surprise = PredictionCheck::Surprise;
  const auto asked = [](std::initializer_list<double> moved) {
    PredictionCheck check;
    std::vector<Surprise> out;
    for (const double x : moved) out.push_back(check.surprise(Estimate{}, sweep(100, x), exact_map, false));
    return out.back();
  };
  constexpr double usual = 0.001, far = 0.02;
  EXPECT_EQ(asked({usual, usual, usual, usual, usual, far}), Surprise::first);
  EXPECT_EQ(asked({usual, usual, usual, usual, usual, far, far}), Surprise::again);
  EXPECT_EQ(asked({usual, usual, usual, usual, usual, far, usual, far}), Surprise::none) << "a shock after a shock";
  EXPECT_EQ(asked({usual, usual, usual, usual, usual, far, usual, far, far, far}), Surprise::again) << "it does not end";
  PredictionCheck check;
  for (int k = 0; k < 5; ++k) check.surprise(Estimate{}, sweep(100), exact_map, false);
  EXPECT_EQ(check.surprise(Estimate{}, sweep(100, far), exact_map, true), Surprise::none) << "after an outage it may be anywhere";
  EXPECT_EQ(check.surprise(Estimate{}, sweep(100, far), exact_map, false), Surprise::none) << "and nothing was usual before";
}

TEST(PredictionCheck, WhatNoPoseNearByExplainsIsSearchedForLessAndLessOften) {
  Checked c = after(30, 100);
  std::vector<int> searched;
  for (int k = 1; k <= 16; ++k) {
    if (c.check.is_to_be_searched_for()) searched.push_back(k);
    c.learn(sweep(1900));
  }
  EXPECT_EQ(searched, (std::vector{1, 2, 4, 8, 16}));
}

TEST(PredictionCheck, ARobotThatIsNotFoundNearByMayBeFartherAwayAndTurned) {
  Checked c = after(30, 100);
  const Estimate prior;
  std::vector<double> heading, place;
  for (int k = 1; k <= 4; ++k) {
    heading.push_back(std::sqrt(c.check.lost(prior).P(at::R + 2, at::R + 2)));
    place.push_back(std::sqrt(c.check.lost(prior).P(at::p, at::p)));
    c.learn(sweep(1900));
  }
  for (const std::size_t k : {0, 1, 2}) {
    EXPECT_NEAR(heading[k], 0.09, 1e-9);
    EXPECT_NEAR(place[k], 0.24, 1e-9);
  }
  EXPECT_NEAR(3 * heading[3], M_PI, 1e-9);
  EXPECT_NEAR(3 * place[3], 2, 1e-9);
  EXPECT_TRUE(PredictionCheck::is_far({0.02, 1.9}));
  EXPECT_TRUE(PredictionCheck::is_far({1.5, 0.01}));
  EXPECT_FALSE(PredictionCheck::is_far({0.2, 0.5}));
}

TEST(PredictionCheck, WhatLiesBesideTheMapForLongIsToldOnceInARow) {
  Checked c = after(30, 100);
  for (int k = 1; k <= 14; ++k) {
    c.learn(sweep(1500));
    EXPECT_EQ(c.check.lies_beside_for_long(), k == 10) << k;
  }
  Checked crowd = after(30, 100);
  for (int k = 0; k < 100; ++k) {
    crowd.learn(sweep(k % 8 == 0 ? 100 : 800));
    EXPECT_FALSE(crowd.check.lies_beside_for_long()) << "now and then it agrees";
  }
}

}  // namespace prediction_check_test
}  // namespace kilvo
