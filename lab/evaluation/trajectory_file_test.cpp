#include "lab/evaluation/trajectory_file.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

namespace kilvo::lab {
namespace trajectory_file_test {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Folder : public ::testing::Test {
 protected:
  Folder() : path(std::filesystem::path(::testing::TempDir()) / ("kilvo_tum_" + std::to_string(std::random_device{}()))) {
    std::filesystem::create_directories(path);
  }
  ~Folder() override { std::filesystem::remove_all(path); }

  static std::string content(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  }

  std::filesystem::path path;
};
using TumFile = Folder;

std::string error_of(std::string_view text) {
  try {
    parse_tum(text, "gt.tum");
  } catch (const TrajectoryError& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(TumFile, ReadsTimesToTheNanosecondAndPosesInFull) {
  const auto poses = parse_tum(
      "# t x y z qx qy qz qw\n"
      "1700010000.123456789 1.5 -2.25 0.125 0 0 0.70710678118654752 0.70710678118654752\r\n"
      "\n"
      "  1700010000.223456789\t1e0 2 3 0 0 0 -1\n"
      "1700010000.223456789 1 2 3 1 0 0 0",
      "gt.tum");
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(to_ns(poses[0].t), 1700010000123456789);
  EXPECT_EQ(poses[0].T.p, Eigen::Vector3d(1.5, -2.25, 0.125));
  EXPECT_LT((poses[0].T.R * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT(poses[1].T.R.Log().norm(), 1e-15);
  EXPECT_LT((poses[2].T.R * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST_F(TumFile, NamesFileAndLineOfABadLine) {
  const std::string good = "# comment\n1 0 0 0 0 0 0 1\n";
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0 1\n"), "gt.tum:3: expected 8 numbers (t x y z qx qy qz qw), found 7");
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0 0 1 9\n"), "gt.tum:3: expected 8 numbers (t x y z qx qy qz qw), found 9");
  EXPECT_EQ(error_of(good + "two 0 0 0 0 0 0 1\n"), "gt.tum:3: 'two' is not a time in seconds");
  EXPECT_EQ(error_of(good + "nan 0 0 0 0 0 0 1\n"), "gt.tum:3: 'nan' is not a time in seconds");
  EXPECT_EQ(error_of(good + "2 0 1.0x 0 0 0 0 1\n"), "gt.tum:3: '1.0x' is not a number");
  EXPECT_EQ(error_of(good + "2 0 nan 0 0 0 0 1\n"), "gt.tum:3: 'nan' is not finite");
  EXPECT_EQ(error_of(good + "2 0 0 0 0 0 0 -inf\n"), "gt.tum:3: '-inf' is not finite");
  EXPECT_EQ(error_of(good + "2 0 -1e300 0 0 0 0 1\n"), "gt.tum:3: '-1e300' m is no position on Earth");
  EXPECT_THAT(error_of(good + "2 0 0 0 0 0 0 0\n"), StartsWith("gt.tum:3: the quaternion qx qy qz qw has norm 0.0"));
  EXPECT_THAT(error_of(good + "2 0 0 0 1 1 0 1\n"), HasSubstr("norm 1.73"));
  EXPECT_EQ(error_of(good + "0.9 0 0 0 0 0 0 1\n"), "gt.tum:3: time goes backwards: 0.9 comes after a later pose");
}

TEST_F(TumFile, NamesAFileThatCannotBeOpenedOrRead) {
  try {
    read_tum(path / "none.tum");
    FAIL();
  } catch (const TrajectoryError& error) {
    EXPECT_EQ(error.what(), "cannot open " + (path / "none.tum").string() + ": No such file or directory");
  }
  EXPECT_THROW(read_tum(path), TrajectoryError);  // a folder
}

TEST_F(TumFile, AnEmptyFileHasNoPoses) {
  std::ofstream(path / "empty.tum") << "# nothing\n";
  EXPECT_TRUE(read_tum(path / "empty.tum").empty());
}

TEST_F(TumFile, PrintsNineDecimalsOfIntegerNanoseconds) {
  std::string line;
  append_tum_line(line, {time_from_ns(1700010000000000001), {SO3(), {1, -0.5, 1e-9}}});
  EXPECT_EQ(line, "1700010000.000000001 1.000000000 -0.500000000 0.000000001 0.000000000 0.000000000 0.000000000 1.000000000\n");
}

TEST_F(TumFile, WritesAndReadsBackToANanometreAndTheSameBytesTwice) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<StampedPose> poses;
  poses.reserve(5000);
  for (int i = 0; i < 5000; ++i) {
    poses.push_back({time_from_ns(1700010000123456789 + i * 1000003LL),
                     {SO3::Exp(Eigen::Vector3d(normal(random), normal(random), normal(random)) * 2.0),
                      Eigen::Vector3d(normal(random), normal(random), normal(random)) * 100.0}});
  }
  write_tum(path / "a.tum", poses);
  write_tum(path / "b.tum", poses);
  EXPECT_EQ(content(path / "a.tum"), content(path / "b.tum"));
  const auto back = read_tum(path / "a.tum");
  ASSERT_EQ(back.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_EQ(back[i].t, poses[i].t);
    ASSERT_LT((back[i].T.p - poses[i].T.p).cwiseAbs().maxCoeff(), 0.6e-9);
    ASSERT_LT((back[i].T.R.inverse() * poses[i].T.R).Log().norm(), 3e-9);
  }
}

TEST_F(TumFile, AWriterThatIsNotClosedStillLeavesItsPoses) {
  { TumWriter(path / "a.tum").write({time_from_ns(5), {}}); }
  EXPECT_EQ(read_tum(path / "a.tum").size(), 1u);
}

TEST_F(TumFile, AnUnwritablePathAndAFullDiskAreErrorsThatNameThePath) {
  try {
    const TumWriter writer(path / "missing" / "a.tum");
    FAIL();
  } catch (const TrajectoryOutputError& error) {
    EXPECT_THAT(error.what(), HasSubstr((path / "missing" / "a.tum").string()));
  }
  TumWriter full("/dev/full");
  full.write({time_from_ns(5), {}});
  EXPECT_THROW(full.close(), TrajectoryOutputError);
}

}  // namespace trajectory_file_test
}  // namespace kilvo::lab
