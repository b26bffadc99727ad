// kilvo calibrate: a description that is a little off, or much, becomes the right one.
#include <Eigen/Geometry>
#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lab/settings/settings.hpp"
#include "tests/cli/story.hpp"

namespace kilvo::stories {
namespace calibrate_test {

using testing::AllOf;
using testing::HasSubstr;

class Calibrate : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(kilvo({"simulate", "room", "--duration", "25", "--sensors", "imu,legs,lidar", "--out", walk_, "--quiet"}).code, 0);
  }

  Finished calibrate(const std::vector<std::string>& wrong) const {
    std::vector<std::string> words{"calibrate", walk_, "--config", walk_ + "/config.yaml", "--out", better_, "--report", report_};
    for (const std::string& setting : wrong) words.insert(words.end(), {"--set", setting});
    return kilvo(words);
  }
  static Eigen::Matrix3d turned_by(double degrees) {
    return Eigen::AngleAxisd(degrees * 0.01745329251994, Eigen::Vector3d::UnitY()).toRotationMatrix();
  }
  static LidarMount lidar(const std::string& config) { return lab::load_settings(config, {}).robot.lidar; }
  static Eigen::Matrix3d mount(const std::string& config) { return lidar(config).T_imu_lidar.R.matrix(); }
  std::string wrong_by(double degrees) const {
    const Eigen::Matrix3d R = turned_by(degrees) * mount(walk_ + "/config.yaml");
    std::string out = "lidar.T_imu_lidar.R=[";
    for (int i = 0; i < 9; ++i) out += fmt::format("{}{}", i > 0 ? ", " : "", R(i / 3, i % 3));
    return out + "]";
  }
  // degrees
  double left() const { return Eigen::AngleAxisd(mount(better_) * mount(walk_ + "/config.yaml").transpose()).angle() * 57.29577951308; }

  TemporaryFolder folder_;
  std::string walk_ = folder_ / "walk", better_ = folder_ / "better.yaml", report_ = folder_ / "report";
};

TEST_F(Calibrate, MeasuresWhatIsALittleOff) {
  const Finished f = calibrate({wrong_by(0.5)});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, AllOf(HasSubstr("rotation of the LiDAR on the IMU"), HasSubstr("deg, standard deviation"), HasSubstr("changed")));
  EXPECT_LT(left(), 0.15);
  const std::string page = read_text(report_ + "/calibration.html");
  EXPECT_THAT(
      page, AllOf(HasSubstr("rotation of the LiDAR on the IMU"), HasSubstr("class=\"changed\""), HasSubstr("<svg"), HasSubstr("</html>")));
  EXPECT_THAT(page, testing::Not(HasSubstr("Mended first")));
}

TEST_F(Calibrate, MendsWhatIsMuchOffFirst) {
  const Finished f = calibrate({wrong_by(20), "lidar.time_offset=0.02"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err,
              AllOf(HasSubstr("calibrate: the LiDAR is turned against its description"), HasSubstr("mended by lidar.T_imu_lidar.R: [")));
  EXPECT_LT(left(), 0.15);
  EXPECT_NEAR(lidar(better_).time_offset, 0, 0.001);
  EXPECT_THAT(read_text(report_ + "/calibration.html"), HasSubstr("Mended first"));
}

TEST_F(Calibrate, IsDoneByARunItself) {
  // m, of the sweeps
  const auto error_of = [this](const std::vector<std::string>& settings, const std::string& warning) {
    const std::string out = folder_ / "out";
    std::vector<std::string> words{"run", walk_, "--sensors", "imu,lidar", "--out", out, "--quiet", "--no-map"};
    for (const std::string& setting : settings) words.insert(words.end(), {"--set", setting});
    const Finished run = kilvo(words);
    EXPECT_EQ(run.code, 0);
    EXPECT_THAT(run.err, HasSubstr(warning));
    return nlohmann::json::parse(kilvo({"eval", out + "/sweeps.tum", walk_ + "/gt.tum", "--json"}).out).at("ate_rmse_m").get<double>();
  };
  const Eigen::Vector3d p = lidar(walk_ + "/config.yaml").T_imu_lidar.p;
  const std::string off = fmt::format("lidar.T_imu_lidar.p=[{}, {}, {}]", p.x() + 0.03, p.y() - 0.03, p.z());
  const double wrong = error_of({off, wrong_by(0.5)}, "");
  const std::string found = "warning: calibration.online: lidar.T_imu_lidar.p: [";
  EXPECT_LT(error_of({off, wrong_by(0.5), "calibration.online=true"}, found), 0.3 * wrong);
  // A clock that the estimator would correct by itself keeps nothing from being calibrated.
  EXPECT_LT(error_of({off, wrong_by(0.5), "lidar.time_offset=0.006", "calibration.online=true"}, found), 0.3 * wrong);
}

TEST_F(Calibrate, MeasuresTheScaleOfTheGyro) {
  const Finished f = calibrate({"imu.gyro_scale=[1, 1, 0.985]"});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.out, HasSubstr("scale of the gyro's axes"));
  EXPECT_NEAR(lab::load_settings(better_, {}).robot.imu.gyro_scale.z(), 1, 0.004);
}

TEST_F(Calibrate, ChangesNothingThatIsRight) {
  const Finished f = calibrate({});
  ASSERT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("better.yaml with 0 settings changed"));
}

TEST_F(Calibrate, RefusesWhatNoSettingMends) {
  // Knees that bend to the side.
  write_text(folder_ / "turned.urdf", with_axis(read_text(walk_ + "/robot.urdf"), {"left_knee_joint", "right_knee_joint"}, "1 0 0"));
  const Finished f = calibrate({"robot.urdf=" + std::string(folder_ / "turned.urdf")});
  EXPECT_EQ(f.code, 1);
  EXPECT_THAT(f.err, HasSubstr("no setting mends it"));
  EXPECT_THAT(f.out, HasSubstr("the joints of the legs do not move as the robot does"));
}

TEST_F(Calibrate, MendsTheDirectionOfAJoint) {
  write_text(folder_ / "turned.urdf", with_axis(read_text(walk_ + "/robot.urdf"), {"left_knee_joint"}, "0 -1 0"));
  const Finished f = calibrate({"robot.urdf=" + std::string(folder_ / "turned.urdf")});
  EXPECT_EQ(f.code, 0) << f.err;
  EXPECT_THAT(f.err, HasSubstr("mended by robot.joints: {\"left_knee_joint\": {\"sign\": -1}}"));
  EXPECT_EQ(lab::load_settings(better_, {}).robot.joints.at("left_knee_joint").sign, -1);
}

}  // namespace calibrate_test
}  // namespace kilvo::stories
