#include "lab/report/comparison.hpp"

#include <cmath>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "lab/evaluation/trajectory_file.hpp"

namespace kilvo::lab {
namespace comparison_test {

using testing::HasSubstr;
namespace fs = std::filesystem;

// A square of 4 m a side at 0.5 m/s; `bend` lifts it in its middle, m.
std::vector<StampedPose> square(double bend) {
  std::vector<StampedPose> out;
  for (int i = 0; i <= 320; ++i) {
    const double s = 0.05 * i, side = std::fmod(s, 4.0);
    const Eigen::Vector2d corners[] = {{side, 0}, {4, side}, {4 - side, 4}, {0, 4 - side}, {0, 0}};
    const Eigen::Vector2d p = corners[static_cast<int>(s / 4.0)];
    out.push_back({time_from_ns(100'000'000LL * i), {SO3(), {p.x(), p.y(), i % 2 == 0 ? bend : -bend}}});
  }
  return out;
}

class CompareRuns : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("kilvo_comparison_" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "good");
    fs::create_directories(folder_ / "bent");
    write_tum(folder_ / "gt.tum", square(0));
    write_tum(folder_ / "good/sweeps.tum", square(0));
    write_tum(folder_ / "bent/sweeps.tum", {});
    write_tum(folder_ / "bent/odometry.tum", square(0.01));
  }
  void TearDown() override { fs::remove_all(folder_); }

  Comparison compared() const {
    const std::vector<std::string> runs{(folder_ / "good").string(), (folder_ / "bent").string() + "/"};
    return compare_runs(runs, folder_ / "gt.tum", Alignment::yaw);
  }

  fs::path folder_;
};

TEST_F(CompareRuns, TellsTheErrorOfEachAxis) {
  const Comparison c = compared();
  ASSERT_EQ(c.runs.size(), 2);
  EXPECT_NEAR(c.runs[0].errors.ate_rmse_m, 0, 1e-9);
  EXPECT_NEAR(c.runs[1].axis_rmse_m[0], 0, 1e-3);
  EXPECT_NEAR(c.runs[1].axis_rmse_m[2], 0.01, 1e-4);
}

TEST_F(CompareRuns, TakesTheOdometryWhereThereAreNoSweeps) { EXPECT_EQ(trajectory_of_run(folder_ / "bent").size(), 321); }

TEST_F(CompareRuns, TableAndPageNameRunsAndAlignment) {
  const Comparison c = compared();
  EXPECT_THAT(to_text(c), HasSubstr("aligned by yaw"));
  EXPECT_THAT(to_text(c), HasSubstr("good"));
  EXPECT_THAT(to_json(c), HasSubstr("\"align\": \"yaw\""));
  const std::string page = to_html(c);
  EXPECT_THAT(page, HasSubstr("Aligned by yaw"));
  std::size_t lines = 0;
  for (std::size_t at = page.find("<polyline"); at != std::string::npos; at = page.find("<polyline", at + 1)) ++lines;
  EXPECT_EQ(lines, 8);  // truth and two runs from above and from the side, two errors
}

}  // namespace comparison_test
}  // namespace kilvo::lab
