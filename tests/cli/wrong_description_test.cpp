// kilvo run with a description that the data contradict: no trajectory is left that it has spoilt.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// 12 s in a room, of which the robot walks 8.
class WrongDescription : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(kilvo({"simulate", "room", "--duration", "12", "--out", walk_, "--quiet"}).code, 0); }

  Finished run(const std::string& sensors, const std::string& setting) const {
    return kilvo({"run", walk_, "--sensors", sensors, "--set", setting, "--out", out_, "--quiet", "--no-map"});
  }
  std::string result(const std::string& name) const { return read_text(out_ + "/" + name); }

  TemporaryFolder folder_;
  std::string walk_ = folder_ / "walk", out_ = folder_ / "out";
  // By 20 degrees about y.
  std::string pitched_ = "lidar.T_imu_lidar.R=[0.9396926208, 0, 0.3420201433, 0, 1, 0, -0.3420201433, 0, 0.9396926208]";
};

TEST_F(WrongDescription, OfTheLidarLeavesTheResultsOfTheLegs) {
  const Finished f = run("imu,legs,lidar", pitched_);
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, AllOf(HasSubstr("the LiDAR is turned against its description by"), HasSubstr("; the results are of imu, legs alone")));
  EXPECT_EQ(result("sweeps.tum").find("1700000"), std::string::npos) << "a sweep was used";
  EXPECT_THAT(result("events.csv"), HasSubstr(",lidar,description_wrong,"));
  const Finished eval = kilvo({"eval", out_ + "/odometry.tum", walk_ + "/gt.tum", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_LT(nlohmann::json::parse(eval.out).at("ate_rmse_m").get<double>(), 0.003);
}

TEST_F(WrongDescription, IsNotJudgedWhereItIsToBeTrusted) {
  const Finished f =
      kilvo({"run", walk_, "--sensors", "imu,legs,lidar", "--set", pitched_, "--out", out_, "--quiet", "--no-map", "--trust-description"});
  EXPECT_THAT(f.err, testing::Not(HasSubstr("the LiDAR is turned")));
  EXPECT_THAT(result("events.csv"), testing::Not(HasSubstr("description")));
  EXPECT_THAT(result("sweeps.tum"), HasSubstr("1700000"));
  // What is right is as it is with it.
  for (const std::string trust : {"", "--trust-description"}) {
    std::vector<std::string> words{"run", walk_, "--sensors", "imu,legs,lidar", "--out", out_ + trust, "--quiet", "--no-map"};
    if (!trust.empty()) words.push_back(trust);
    ASSERT_EQ(kilvo(words).code, 0);
  }
  EXPECT_EQ(result("odometry.tum"), read_text(out_ + "--trust-description/odometry.tum"));
}

TEST_F(WrongDescription, OfTheOnlySenseLeavesNoResults) {
  const Finished f = run("imu,lidar", pitched_);
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("; nothing is left to estimate with"));
  EXPECT_EQ(result("odometry.tum").find("1700000"), std::string::npos);
  EXPECT_THAT(result("summary.json"), HasSubstr("the robot's description is wrong"));
}

TEST_F(WrongDescription, OfTheImuOnTheRobotLeavesTheResultsOfTheLidar) {
  const Finished f = run("imu,legs,lidar", "imu.T_link_imu.R=[1, 0, 0, 0, 0, -1, 0, 1, 0]");
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("; the results are of imu, lidar alone"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/contacts.csv")) << "of the run before";
  const Finished eval = kilvo({"eval", out_ + "/sweeps.tum", walk_ + "/gt.tum", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_LT(nlohmann::json::parse(eval.out).at("ate_rmse_m").get<double>(), 0.0015);
}

}  // namespace
}  // namespace kilvo::stories
