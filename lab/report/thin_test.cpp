#include "lab/report/thin.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace thin_test {

using testing::Contains;
using testing::ElementsAre;
using testing::SizeIs;

TEST(Thin, KeepsTheFirstTheLastAndEachExtremeOfEachPart) {
  const std::vector<std::vector<double>> columns{{0, 5, 1, 1, 2, 2, -3, 2}};
  // Parts 0..3 and 4..7: firsts 0 and 4, least 0 and 6, greatest 1 and 4, last 7.
  EXPECT_THAT(thin(columns, 2), ElementsAre(0, 1, 4, 6, 7));
}

TEST(Thin, ASpikeInAnyColumnSurvives) {
  std::vector<std::vector<double>> columns(3, std::vector<double>(10000, 1));
  columns[0][1234] = 9;
  columns[2][8765] = -9;
  columns[1][5000] = NAN;
  const auto kept = thin(columns, 10);
  EXPECT_THAT(kept, Contains(1234));
  EXPECT_THAT(kept, Contains(8765));
  EXPECT_LE(kept.size(), 10 * 10 + 1);
}

TEST(Thin, AHoleStaysAHoleAndHidesNoExtreme) {
  const std::vector<std::vector<double>> columns{{1, 9, NAN, NAN, 2, 0, 3, 4}};
  EXPECT_THAT(thin(columns, 1), ElementsAre(0, 1, 2, 5, 7));
}

TEST(Thin, ShortOrEmptyColumnsStayWhole) {
  EXPECT_THAT(thin(std::vector<std::vector<double>>{{3, 1, 2}}, 100), ElementsAre(0, 1, 2));
  EXPECT_THAT(thin(std::vector<std::vector<double>>{{7}}, 0), ElementsAre(0));
  EXPECT_THAT(thin(std::vector<std::vector<double>>{{}}, 5), SizeIs(0));
  EXPECT_THAT(thin({}, 5), SizeIs(0));
}

TEST(ThinPoints, FewerThanTheLimitAllStayButThoseThatAreNowhere) {
  const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {NAN, 0, 0}, {1, 1, 1}, {INFINITY, 0, 0}, {1, 1, 1}};
  EXPECT_THAT(thin_points(points, 10), ElementsAre(0, 2, 4));
}

TEST(ThinPoints, AreSpreadEvenlyOverASurface) {
  std::vector<Eigen::Vector3f> points;
  for (int x = 0; x < 200; ++x)
    for (int y = 0; y < 200; ++y) points.emplace_back(0.05F * static_cast<float>(x), 0.05F * static_cast<float>(y), 1.0F);
  const auto kept = thin_points(points, 5000);
  EXPECT_LE(kept.size(), 5000);
  EXPECT_GE(kept.size(), 2500);
  std::size_t quarter = 0;  // of the surface
  for (const std::size_t i : kept) quarter += points[i].x() < 5 && points[i].y() < 5 ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(quarter) / static_cast<double>(kept.size()), 0.25, 0.03);
}

TEST(ThinPoints, ManyInOnePlaceAreCut) { EXPECT_THAT(thin_points(std::vector<Eigen::Vector3f>(1000, {1, 2, 3}), 10), SizeIs(10)); }

}  // namespace thin_test
}  // namespace kilvo::lab
