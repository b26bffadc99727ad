#include "kilvo/estimator/prediction_check.hpp"

#include <functional>
#include <gtest/gtest.h>

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

PredictionCheck after(int sweeps, const std::function<int(int)>& beside) {
  PredictionCheck out;
  for (int k = 0; k < sweeps; ++k) out.learn(State{}, sweep(beside(k)));
  return out;
}

TEST(PredictionCheck, MoreBesideTheSurfacesThanUsualContradictsWhateverIsUsual) {
  for (const int usual : {0, 20, 100, 400}) {
    const PredictionCheck check = after(30, [usual](int) { return usual; });
    EXPECT_FALSE(check.contradicts(sweep(usual))) << usual;
    EXPECT_FALSE(check.contradicts(sweep(usual + 100))) << usual;
    EXPECT_TRUE(check.contradicts(sweep(usual + 300))) << usual;
    EXPECT_FALSE(check.contradicts(sweep(usual / 2))) << "fewer are no contradiction";
  }
}

TEST(PredictionCheck, FewSweepsOrFewPointsSayNothing) {
  const PredictionCheck check = after(30, [](int) { return 100; });
  EXPECT_FALSE(after(5, [](int) { return 100; }).contradicts(sweep(1000)));
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
  const PredictionCheck check = after(30, [](int) { return 100; });
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

TEST(PredictionCheck, PredictionsAreDoubtedUntilSweepsMoveTheStateAsLittleAsUsual) {
  PredictionCheck check = after(30, [](int) { return 100; });
  EXPECT_FALSE(check.error());
  check.begin({0.02, 0.05});
  int lasted = 0;
  for (int k = 0; k < 80; ++k) {
    check.learn(State{}, sweep(100, 0.05));
    lasted += check.lasts() ? 1 : 0;
  }
  EXPECT_EQ(lasted, 1) << "to be told once";
  ASSERT_TRUE(check.error()) << "it goes on";
  EXPECT_NEAR(check.error()->moved, 0.05, 1e-3);
  EXPECT_NEAR(check.error()->turned, 0.005, 1e-3);
  for (int k = 0; k < 80; ++k) check.learn(State{}, sweep(100, 0.02));
  ASSERT_TRUE(check.error());
  EXPECT_NEAR(check.error()->moved, 0.02, 1e-3) << "and is as large as the sweeps show";
  for (int k = 0; k < 80; ++k) check.learn(State{}, sweep(100));
  EXPECT_FALSE(check.error());
  EXPECT_FALSE(check.lasts());
}

}  // namespace prediction_check_test
}  // namespace kilvo
