// kilvo run with a description that the data contradict: no trajectory is left that it has spoilt.
#include <cmath>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace wrong_description_test {

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

  // m
  double error() const {
    const Finished eval = kilvo({"eval", out_ + "/sweeps.tum", walk_ + "/gt.tum", "--json"});
    EXPECT_EQ(eval.code, 0) << eval.err;
    return eval.code == 0 ? nlohmann::json::parse(eval.out).at("ate_rmse_m").get<double>() : INFINITY;
  }
  nlohmann::json events() const { return nlohmann::json::parse(result("summary.json")).at("events"); }
  static std::string pitched_by(double degrees) {
    const double a = degrees * 0.01745329251994;
    return fmt::format("lidar.T_imu_lidar.R=[{0}, 0, {1}, 0, 1, 0, -{1}, 0, {0}]", std::cos(a), std::sin(a));
  }
  std::string turned(const std::vector<std::string>& joints, const std::string& xyz) const {
    write_text(folder_ / "turned.urdf", with_axis(read_text(walk_ + "/robot.urdf"), joints, xyz));
    return folder_ / "turned.urdf";
  }
  std::string with_knee_turned_round() const { return turned({"left_knee_joint"}, "0 -1 0"); }
  std::string with_knees_that_bend_sideways() const { return turned({"left_knee_joint", "right_knee_joint"}, "1 0 0"); }

  /// The URDF of a robot that is 1.6 times as large.
  std::string of_larger_robot() const {
    const std::string urdf = read_text(walk_ + "/robot.urdf"), begin = "<origin xyz=\"";
    std::string out;
    std::size_t from = 0;
    for (std::size_t at = urdf.find(begin); at != std::string::npos; at = urdf.find(begin, from)) {
      at += begin.size();
      out += urdf.substr(from, at - from);
      from = urdf.find('"', at);
      std::istringstream numbers(urdf.substr(at, from - at));
      for (double x = 0; numbers >> x;) out += fmt::format("{} ", 1.6 * x);
    }
    std::ofstream(folder_ / "larger.urdf") << out + urdf.substr(from);
    return folder_ / "larger.urdf";
  }

  TemporaryFolder folder_;
  std::string walk_ = folder_ / "walk", out_ = folder_ / "out";
};

TEST_F(WrongDescription, OfTheLidarIsMended) {
  const Finished f = run("imu,legs,lidar", pitched_by(20));
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err,
              AllOf(HasSubstr("the LiDAR is turned against its description by"), HasSubstr("; the results are with lidar.T_imu_lidar.R"),
                    HasSubstr("warning: restarted with lidar.T_imu_lidar.R: [")));
  EXPECT_THAT(result("events.csv"), HasSubstr(",lidar,description_wrong,"));
  EXPECT_LT(error(), 0.0013);
}

TEST_F(WrongDescription, IsNotJudgedWhereItIsToBeTrusted) {
  const Finished f = kilvo(
      {"run", walk_, "--sensors", "imu,legs,lidar", "--set", pitched_by(20), "--out", out_, "--quiet", "--no-map", "--trust-description"});
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

// Nobody holds the data against the description: the estimate itself does.
TEST_F(WrongDescription, ThatIsTrustedEndsInAFailureThatNamesTheSensesThatContradict) {
  for (const std::string sensors : {"imu,legs,lidar", "imu,lidar"}) {
    const Finished f =
        kilvo({"run", walk_, "--sensors", sensors, "--set", pitched_by(20), "--out", out_, "--quiet", "--no-map", "--trust-description"});
    EXPECT_EQ(f.code, 1) << sensors;
    // Which sense the LiDAR is found to contradict depends on what shows first: biases, or sweeps that fit nowhere.
    const std::string other = sensors == "imu,lidar" ? "IMU" : "(IMU|legs)";
    const std::string sentence = "diverged: the (IMU and the LiDAR|LiDAR and the " + other + ") contradict each other: ";
    EXPECT_THAT(f.err, testing::ContainsRegex("kilvo: error: " + sentence)) << sensors;
    const auto summary = nlohmann::json::parse(result("summary.json"));
    EXPECT_EQ(summary.at("diverged"), true);
    EXPECT_THAT(summary.at("failure").get<std::string>(), testing::ContainsRegex(sentence)) << sensors;
  }
}

TEST_F(WrongDescription, IsAnEventWithItsTimeReasonAndCount) {
  kilvo({"run", walk_, "--sensors", "imu,lidar", "--set", pitched_by(20), "--out", out_, "--quiet", "--no-map", "--trust-description"});
  bool found = false;
  for (const auto& event : events()) {
    for (const char* key : {"t", "sensor", "reason", "severity", "count", "value", "text"}) EXPECT_TRUE(event.contains(key)) << key;
    if (event.at("reason") != "diverged") continue;
    found = true;
    EXPECT_EQ(event.at("severity"), "error");
    EXPECT_EQ(event.at("sensor"), nullptr);
    EXPECT_EQ(event.at("count"), 1);
    EXPECT_NEAR(event.at("t").get<double>(), 1700000006, 5);
    EXPECT_THAT(event.at("text"), HasSubstr("contradict each other"));
  }
  EXPECT_TRUE(found);
}

TEST_F(WrongDescription, IsNoneWhereTheWorldWasLevelled) {
  ASSERT_EQ(kilvo({"run", walk_, "--sensors", "imu,legs,lidar", "--out", out_, "--quiet", "--no-map"}).code, 0);
  std::vector<std::string> reasons;
  for (const auto& event : events())
    reasons.push_back(event.at("severity").get<std::string>() + " " + event.at("reason").get<std::string>());
  EXPECT_THAT(reasons, testing::ElementsAre("notice start", "notice levelled")) << "and no warning";
  EXPECT_THAT(result("events.csv"), HasSubstr(",,levelled,"));
}

TEST_F(WrongDescription, OfTheOnlySenseIsMended) {
  EXPECT_EQ(run("imu,lidar", pitched_by(20)).code, 1);
  EXPECT_LT(error(), 0.0013);
}

// The estimator would find it as well: 1.8 mm, after the first walking metres.
TEST_F(WrongDescription, OfAClockByMillisecondsIsMendedFromTheStart) {
  const Finished f = run("imu,lidar", "lidar.time_offset=0.009");
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("warning: restarted with lidar.time_offset: "));
  EXPECT_LT(error(), 0.0008);
}

TEST_F(WrongDescription, ThatIsALittleOffIsMendedWithAWarning) {
  const Finished f = run("imu,lidar", pitched_by(2));
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("warning: the LiDAR is turned against its description by"));
  EXPECT_THAT(result("events.csv"), HasSubstr(",lidar,description_doubted,"));
  EXPECT_LT(error(), 0.0013);
}

TEST_F(WrongDescription, OfTheImuOnTheRobotIsMended) {
  const Finished f = run("imu,legs,lidar", "imu.T_link_imu.R=[1, 0, 0, 0, 0, -1, 0, 1, 0]");
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("; the results are with imu.T_link_imu.R"));
  EXPECT_LT(error(), 0.0013);
}

TEST_F(WrongDescription, OfAJointIsMended) {
  const Finished f = run("imu,legs,lidar", "robot.urdf=" + with_knee_turned_round());
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, AllOf(HasSubstr("joint left_knee_joint turns the other way round"),
                           HasSubstr("restarted with robot.joints: {\"left_knee_joint\": {\"sign\": -1}}")));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/contacts.csv"));
  EXPECT_LT(error(), 0.0013);
}

TEST_F(WrongDescription, AnImuByItselfIsNoOdometry) {
  const Finished f = kilvo({"run", walk_, "--sensors", "imu,legs", "--drop", "legs:0-", "--out", out_, "--quiet", "--no-map"});
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("no message of the legs could be used: the positions are integrated from the IMU alone"));
}

TEST_F(WrongDescription, ThatNoSettingMendsLeavesTheSenseOut) {
  const Finished f = run("imu,legs,lidar", "robot.urdf=" + with_knees_that_bend_sideways());
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("; the results are of imu, lidar alone"));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/contacts.csv")) << "of the round before";
  EXPECT_LT(error(), 0.0013);
}

TEST_F(WrongDescription, OfTheOnlySenseThatNoSettingMendsLeavesNoResults) {
  const Finished f = run("imu,legs", "robot.urdf=" + of_larger_robot());
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("; nothing is left to estimate with"));
  EXPECT_EQ(result("odometry.tum").find("1700000"), std::string::npos);
  EXPECT_THAT(result("summary.json"), HasSubstr("the robot's description is wrong"));
}

}  // namespace wrong_description_test
}  // namespace kilvo::stories
