// Wrong descriptions of a simulated robot: the culprit is named, and nobody else is.
#include "lab/doctor/examination.hpp"

#include <fmt/core.h>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "lab/doctor/description_watch.hpp"
#include "tests/helpers/walked.hpp"

namespace kilvo::lab {
namespace examination_test {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

using test_walk::causes;
using test_walk::walked;

void change_points(Recorded& recorded, const std::function<void(Eigen::Vector3f&)>& change) {
  for (Sweep& sweep : recorded.sweeps) {
    std::vector<TimedPoint> points = *sweep.points;
    for (TimedPoint& point : points) change(point.p);
    sweep.points = std::make_shared<const std::vector<TimedPoint>>(std::move(points));
  }
}

SO3 turned(const Eigen::Vector3d& by_degrees) { return SO3::Exp(by_degrees / 57.29577951308232); }

TEST(Doctor, ARightDescriptionIsNotAccused) {
  const Diagnosis diagnosis = Examination(walked().recorded, walked().robot).run();
  EXPECT_TRUE(diagnosis.good()) << diagnosis.findings.front().text;
  EXPECT_FALSE(diagnosis.unknown());
}

TEST(Doctor, ALidarThatIsTurnedIsNamedWithItsMount) {
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(180, 0, 0), Eigen::Vector3d(0, 0, 90), Eigen::Vector3d(0, 3, 0)}) {
    Robot robot = walked().robot;
    const SO3 right = robot.lidar.T_imu_lidar.R;
    robot.lidar.T_imu_lidar.R = right * turned(turn);
    Examination examination(walked().recorded, robot);
    const Diagnosis diagnosis = examination.run();
    ASSERT_EQ(diagnosis.findings.size(), 1U) << turn.transpose();
    EXPECT_EQ(diagnosis.findings.front().cause, "lidar_rotation");
    EXPECT_LT(degrees((right.inverse() * examination.robot().lidar.T_imu_lidar.R).Log().norm()), 0.6) << turn.transpose();
  }
}

// A mount that hardly turns may be off by what its inverse is; its place says that it is not inverted.
TEST(Doctor, AMountThatIsOffByItsInverseIsTurnedAndNotInverted) {
  const SO3 Q = turned({0.6, 0, 0});
  Recorded recorded = walked().recorded;
  change_points(recorded, [&Q](Eigen::Vector3f& p) { p = (Q.matrix() * p.cast<double>()).cast<float>(); });
  Robot robot = walked().robot;
  ASSERT_TRUE(robot.lidar.T_imu_lidar.R.matrix().isIdentity(1e-9)) << "so that Q is right";
  robot.lidar.T_imu_lidar.R = Q;
  const Diagnosis diagnosis = Examination(recorded, robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1u);
  EXPECT_EQ(diagnosis.findings[0].cause, "lidar_rotation");
  EXPECT_EQ(diagnosis.findings[0].changes.size(), 1u) << "of the rotation alone";
}

TEST(Doctor, ClocksAreNamed) {
  for (const double offset : {0.01, -0.1, 0.7}) {
    Recorded recorded = walked().recorded;
    for (Sweep& s : recorded.sweeps) s.t += offset, s.begin += offset, s.end += offset;
    EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("lidar_clock")) << offset;
  }
  Recorded recorded = walked().recorded;
  for (LegSample& s : recorded.legs) s.t += 0.05;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("legs_clock"));
}

Recorded late(double by) {
  Recorded recorded = walked().recorded;
  for (Sweep& s : recorded.sweeps) s.t += by, s.begin += by, s.end += by;
  for (LegSample& s : recorded.legs) s.t += by;
  return recorded;
}

TEST(Doctor, SensorsThatAreAllLateByAMessagesDelayAreNamedAndNotTheImu) {
  EXPECT_THAT(causes(late(0.006), walked().robot), ElementsAre("lidar_clock", "legs_clock"));
  EXPECT_THAT(causes(late(-0.006), walked().robot), ElementsAre("imu_clock"));
  EXPECT_THAT(causes(late(0.03), walked().robot), ElementsAre("imu_clock"));
}

TEST(Doctor, TheImuIsNamedWhenAllOthersDisagreeWithIt) {
  const Eigen::Matrix3d quarter = turned({0, 0, 90}).matrix();
  Recorded recorded = walked().recorded;
  for (InertialSample& s : recorded.imu) s.gyro = quarter * s.gyro, s.accel = quarter * s.accel;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("imu_rotated"));
  recorded = walked().recorded;
  for (InertialSample& s : recorded.imu) s.gyro.y() *= -1, s.accel.y() *= -1;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("imu_axes"));
  recorded = walked().recorded;
  for (InertialSample& s : recorded.imu) s.gyro *= 57.29577951308232;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("gyro_unit"));
}

TEST(Doctor, AGyroThatIsATenthTooFastIsNamed) {
  for (const double factor : {1.1, 0.9}) {
    Recorded recorded = walked().recorded;
    for (InertialSample& s : recorded.imu) s.gyro *= factor;
    EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("gyro_unit")) << factor;
  }
}

TEST(Doctor, TheScaleOfAnAxisOfTheGyroIsMeasured) {
  const auto scale_of_gyro = [](double about_z) {
    Recorded recorded = walked().recorded;
    for (InertialSample& s : recorded.imu) s.gyro.z() *= about_z;
    Robot robot = walked().robot;
    robot.imu.gyro_scale = {1, 1, 0.5};  // with which it was recorded
    Examination examination(recorded, robot);
    EXPECT_TRUE(examination.run().good());
    for (const Refinement& r : examination.refinements())
      if (r.what == "scale of the gyro's axes") return r;
    return Refinement{};
  };
  const Refinement wrong = scale_of_gyro(1.02);
  ASSERT_EQ(wrong.change.size(), 3U);
  EXPECT_NEAR(wrong.change[2], 1 / 1.02 - 1, 3 * wrong.sigma[2]);
  EXPECT_NEAR(wrong.taken[2], wrong.change[2], 0.004);
  EXPECT_LT(wrong.sigma[2], 0.002);
  ASSERT_EQ(wrong.changes.size(), 1U);
  EXPECT_EQ(wrong.changes[0].key, "imu.gyro_scale");
  EXPECT_NE(wrong.changes[0].value.find(fmt::format(", {:.5f}]", 0.5 * (1 + wrong.taken[2]))), std::string::npos) << wrong.changes[0].value;
  EXPECT_FALSE(scale_of_gyro(1).is_taken());
}

TEST(Doctor, AnAxisOfTheGyroThatIsFrozenOrOfAnotherScaleIsNamed) {
  Recorded scaled = walked().recorded;
  for (InertialSample& s : scaled.imu) s.gyro.z() *= 0.95;
  const Diagnosis diagnosis = Examination(scaled, walked().robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].cause, "gyro_unit");
  ASSERT_EQ(diagnosis.findings[0].changes.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].changes[0].key, "imu.gyro_scale");
  EXPECT_NEAR(diagnosis.findings[0].size, 0.95, 0.01);
  Recorded frozen = walked().recorded;
  frozen.sweeps.clear();
  for (InertialSample& s : frozen.imu) s.gyro.setZero();
  EXPECT_THAT(causes(frozen, walked().robot), Contains("gyro_frozen"));
  // On the way, and without a LiDAR.
  Recorded failed = walked().recorded;
  failed.sweeps.clear();
  const std::size_t half = failed.imu.size() / 2;
  for (std::size_t k = half; k < failed.imu.size(); ++k) failed.imu[k].gyro.z() = failed.imu[half].gyro.z();
  EXPECT_THAT(causes(failed, walked().robot), Contains("gyro_frozen"));
}

TEST(Doctor, AnAxisOfTheAccelerometerThatNeverChangesIsNamed) {
  Recorded frozen = walked().recorded;
  frozen.sweeps.clear();
  for (InertialSample& s : frozen.imu) s.accel.x() = 0;
  EXPECT_THAT(causes(frozen, walked().robot), Contains("accel_frozen"));
  Recorded failed = walked().recorded;
  const std::size_t half = failed.imu.size() / 2;
  for (std::size_t k = half; k < failed.imu.size(); ++k) failed.imu[k].accel.z() = 0;
  EXPECT_THAT(causes(failed, walked().robot), Contains("accel_frozen"));
}

TEST(Doctor, AGyroInDegreesIsNamedByTheLidarAlone) {
  Recorded recorded = walked().recorded;
  recorded.legs.clear();
  for (InertialSample& s : recorded.imu) s.gyro *= 57.29577951308232;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("gyro_unit"));
}

TEST(Doctor, PointsOfAnotherUnitAreNamed) {
  for (const float factor : {3.28F, 100.0F}) {
    Recorder recorder;
    for (Measurement measurement : walked().measurements) {
      if (auto* scan = std::get_if<LidarScan>(&measurement)) {
        for (LidarPoint& p : scan->points) p.x *= factor, p.y *= factor, p.z *= factor;
      }
      recorder.push(measurement);
    }
    EXPECT_THAT(causes(recorder.finish(), walked().robot), ElementsAre("lidar_unit")) << factor;
  }
}

// As the sweeps of a runner make it seem for some seconds.
TEST(Doctor, AGyroWhoseScaleIsRightForHalfOfTheTurningIsNotAccused) {
  Recorded recorded = walked().recorded;
  const double end = recorded.imu.back().t;
  for (InertialSample& s : recorded.imu) {
    if (s.t > end - 5) s.gyro *= 1.6;
  }
  EXPECT_THAT(causes(recorded, walked().robot), Not(Contains("gyro_unit")));
}

TEST(Doctor, OnTheLegsAloneOnlyAGyroOfTheOtherHandIsAccused) {
  Recorded recorded = walked().recorded;
  recorded.sweeps.clear();
  for (const std::string& cause : causes(recorded, walked().robot)) EXPECT_FALSE(cause.starts_with("imu")) << cause;
  for (InertialSample& s : recorded.imu) s.gyro.y() *= -1;
  EXPECT_THAT(causes(recorded, walked().robot), Contains("imu_axes"));
}

TEST(Doctor, LegsAreNamedWithTheJoint) {
  Recorded recorded = walked().recorded;
  const auto knee = static_cast<std::size_t>(std::ranges::find(recorded.joint_names, "left_knee_joint") - recorded.joint_names.begin());
  ASSERT_LT(knee, recorded.joint_names.size());
  for (LegSample& s : recorded.legs) s.position[knee] *= -1;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("joint_sign"));
  Robot robot = walked().robot;
  std::swap(robot.feet[0].link, robot.feet[1].link);
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("feet_swapped"));
}

std::size_t place_of(const std::string& joint) {
  const std::vector<std::string>& names = walked().recorded.joint_names;
  return static_cast<std::size_t>(std::ranges::find(names, joint) - names.begin());
}

// Yaws of the other direction turn the legs as a gyro of the other hand would.
TEST(Doctor, OnTheLegsAloneJointsAreAccusedBeforeTheGyro) {
  Recorded recorded = walked().recorded;
  recorded.sweeps.clear();
  for (LegSample& s : recorded.legs) {
    for (const char* joint : {"left_hip_yaw_joint", "right_hip_yaw_joint"}) s.position.at(place_of(joint)) *= -1;
  }
  const std::vector<std::string> found = causes(recorded, walked().robot);
  EXPECT_THAT(found, Contains("joint_sign"));
  for (const std::string& cause : found) EXPECT_FALSE(cause.starts_with("imu")) << cause;
}

TEST(Doctor, JointsThatAreExchangedAreNamed) {
  const std::array<std::array<const char*, 2>, 4> exchanged{{{"left_knee_joint", "right_knee_joint"},
                                                             {"left_hip_yaw_joint", "right_hip_yaw_joint"},
                                                             {"left_ankle_pitch_joint", "right_ankle_pitch_joint"},
                                                             {"left_hip_roll_joint", "right_hip_roll_joint"}}};
  for (const auto& [a, b] : exchanged) {
    Recorded recorded = walked().recorded;
    for (LegSample& s : recorded.legs) std::swap(s.position.at(place_of(a)), s.position.at(place_of(b)));
    EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("joints_exchanged")) << a;
  }
}

TEST(Doctor, LegsThatMakeNoSenseUnderAnyChangeAreNamed) {
  // Knees that bend to the side.
  Robot robot = walked().robot;
  for (const char* knee : {"\"left_knee_joint\"", "\"right_knee_joint\""}) {
    const std::size_t axis = robot.urdf.find("<axis xyz=\"", robot.urdf.find(knee));
    ASSERT_LT(axis, robot.urdf.size());
    const std::size_t begin = robot.urdf.find('"', axis) + 1, end = robot.urdf.find('"', begin);
    robot.urdf.replace(begin, end - begin, "1 0 0");
  }
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("leg_joints"));
}

TEST(Doctor, AJointThatIsLockedAndTurnsIsNamed) {
  Robot robot = walked().robot;
  robot.locked_joints.push_back("left_knee_joint");
  const Diagnosis diagnosis = Examination(walked().recorded, robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_locked");
  EXPECT_GT(diagnosis.findings[0].size, 0.1);
}

TEST(Doctor, LimitsOfTheRangeInAnotherUnitAreNamed) {
  Robot robot = walked().robot;
  robot.lidar.min_range = 30;
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("lidar_range"));
}

TEST(Doctor, ALidarAFewCentimetresAsideIsNamedAndNotTheImu) {
  Robot robot = walked().robot;
  robot.lidar.T_imu_lidar.p += Eigen::Vector3d(0.03, 0, 0);
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("lidar_position"));
}

TEST(Doctor, ALegThatIsMirroredIsNamed) {
  Recorded recorded = walked().recorded;
  for (LegSample& s : recorded.legs) {
    for (const char* joint : {"right_hip_roll_joint", "right_hip_yaw_joint", "right_ankle_roll_joint"})
      s.position.at(place_of(joint)) *= -1;
  }
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("joint_sign"));
}

TEST(Doctor, JointsThatNeverChangeOrRepeatTheOtherLegAreNamed) {
  const std::size_t left = place_of("left_knee_joint"), right = place_of("right_knee_joint");
  Recorded frozen = walked().recorded;
  for (LegSample& s : frozen.legs) s.position.at(left) = frozen.legs.front().position.at(left);
  EXPECT_THAT(causes(frozen, walked().robot), ElementsAre("joint_frozen"));
  Recorded failed = walked().recorded;
  const std::size_t half = failed.legs.size() / 2;
  for (std::size_t k = half; k < failed.legs.size(); ++k) failed.legs[k].position.at(left) = failed.legs[half].position.at(left);
  EXPECT_THAT(causes(failed, walked().robot), ElementsAre("joint_frozen"));
  Recorded repeated = walked().recorded;
  for (LegSample& s : repeated.legs) s.position.at(left) = s.position.at(right);
  EXPECT_THAT(causes(repeated, walked().robot), ElementsAre("joints_repeated"));
  Recorded cut = walked().recorded;  // some messages have fewer positions than names
  for (std::size_t k = 0; k < cut.legs.size(); k += 7) cut.legs[k].position.resize(5);
  EXPECT_THAT(causes(cut, walked().robot), IsEmpty());
}

TEST(Doctor, SolesAboveTheirLinksAreNamed) {
  Robot robot = walked().robot;
  for (auto& foot : robot.feet) {
    for (Eigen::Vector3d& corner : foot.sole) corner.z() *= -1;
  }
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("sole_height"));
}

TEST(Doctor, LegsOfTwoLengthsAreNamed) {
  Robot robot = walked().robot;
  for (Eigen::Vector3d& corner : robot.feet[0].sole) corner.z() -= 0.04;
  EXPECT_THAT(causes(walked().recorded, robot), ElementsAre("leg_lengths"));
}

TEST(Doctor, PointsThatAreMirroredAreNoTurnedMount) {
  Recorded recorded = walked().recorded;
  change_points(recorded, [](Eigen::Vector3f& p) { p.z() *= -1; });
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("lidar_axes"));
}

TEST(Doctor, AnAccelerometerWithoutGravityIsNamed) {
  Recorded recorded = walked().recorded;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const InertialSample& s : recorded.imu) mean += s.accel / static_cast<double>(recorded.imu.size());
  for (InertialSample& s : recorded.imu) s.accel -= mean;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("accel_gravity"));
}

TEST(Doctor, AJointOfAnotherZeroIsNamed) {
  Recorded recorded = walked().recorded;
  const auto hip = static_cast<std::size_t>(std::ranges::find(recorded.joint_names, "left_hip_pitch_joint") - recorded.joint_names.begin());
  ASSERT_LT(hip, recorded.joint_names.size());
  for (LegSample& s : recorded.legs) s.position[hip] += 1.5707963;
  EXPECT_THAT(causes(recorded, walked().robot), ElementsAre("joint_offset"));
}

TEST(Doctor, AJointThatIsFixedInTheUrdfAndTurnsIsNamed) {
  Robot robot = walked().robot;
  const std::size_t knee = robot.urdf.find("\"left_knee_joint\""), type = robot.urdf.find("revolute", knee);
  ASSERT_LT(type, robot.urdf.size());
  robot.urdf.replace(type, std::string("revolute").size(), "fixed");
  const Diagnosis diagnosis = Examination(walked().recorded, robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_fixed");
  EXPECT_THAT(diagnosis.findings[0].text, testing::HasSubstr("left_knee_joint"));
  EXPECT_THAT(diagnosis.findings[0].changes, testing::IsEmpty());
}

TEST(Doctor, WhereLegsDoNotFitLockedJointsAreTheFirstSuspects) {
  Recorded recorded = walked().recorded;
  Robot robot = walked().robot;
  robot.locked_joints = {"left_knee_joint"};
  for (std::string& name : recorded.joint_names) name += name == "left_knee_joint" ? "_not_measured" : "";
  const Diagnosis diagnosis = Examination(recorded, robot).run();
  ASSERT_FALSE(diagnosis.findings.empty());
  for (const Finding& f : diagnosis.findings)
    EXPECT_THAT(f.remedy, testing::StartsWith("look first whether these move: robot.locked_joints left_knee_joint; else ")) << f.cause;
}

TEST(Doctor, JointsOfOtherNamesInTheMessagesAreNamedAndMended) {
  Recorded recorded = walked().recorded;
  for (std::string& name : recorded.joint_names) name = "robot/" + name;
  const Diagnosis diagnosis = Examination(recorded, walked().robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].cause, "joint_names");
  ASSERT_EQ(diagnosis.findings[0].changes.size(), 1U);
  EXPECT_THAT(diagnosis.findings[0].changes[0].value, testing::HasSubstr("\"left_knee_joint\": {\"from\": \"robot/left_knee_joint\"}"));
}

// Messages come more often than the encoders are read.
TEST(Doctor, EncodersThatAreReadSlowlyHaveNotSlipped) {
  Recorder recorder;
  std::optional<JointSample> read;
  for (const Measurement& m : walked().measurements) {
    const auto* joints = std::get_if<JointSample>(&m);
    if (joints != nullptr && (!read || joints->t - read->t > std::chrono::milliseconds(39))) read = *joints;
    Measurement sent = m;
    if (joints != nullptr) std::get<JointSample>(sent).position = read->position;
    recorder.push(sent);
  }
  EXPECT_THAT(causes(recorder.finish(), walked().robot), Not(Contains("joint_slip")));
}

TEST(Doctor, AnEncoderThatHasCountedATurnTooManyIsRight) {
  Recorded recorded = walked().recorded;
  for (LegSample& s : recorded.legs) s.position[1] -= 6.2831853;
  EXPECT_THAT(causes(recorded, walked().robot), testing::IsEmpty());
}

TEST(Doctor, AJointOfAZeroThatIsSomeDegreesOffIsNamedAndNoTurnedImu) {
  for (const auto& [joint, degrees] :
       {std::pair("left_knee_joint", 6.0), {"right_hip_pitch_joint", 6.0}, {"left_hip_roll_joint", -7.0}, {"left_hip_yaw_joint", 8.0}}) {
    Recorded recorded = walked().recorded;
    const auto place = static_cast<std::size_t>(std::ranges::find(recorded.joint_names, joint) - recorded.joint_names.begin());
    ASSERT_LT(place, recorded.joint_names.size());
    for (LegSample& s : recorded.legs) s.position[place] += degrees / 57.29578;
    const Diagnosis diagnosis = Examination(recorded, walked().robot).run();
    ASSERT_EQ(diagnosis.findings.size(), 1U) << joint;
    EXPECT_EQ(diagnosis.findings[0].cause, "joint_offset") << joint;
    EXPECT_THAT(diagnosis.findings[0].text, testing::HasSubstr(joint));
    EXPECT_NEAR(diagnosis.findings[0].size, degrees, 1.5) << joint;
  }
}

TEST(Doctor, PositionsInCentimetresAreNoMillimetres) {
  Robot robot = walked().robot;
  robot.lidar.T_imu_lidar.p *= 100;
  const Diagnosis diagnosis = Examination(walked().recorded, robot).run();
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings[0].cause, "lidar_unit");
  EXPECT_THAT(diagnosis.findings[0].text, testing::HasSubstr("centimetres"));
}

// Their turning is not that of the gyro under any description, but the feet of a robot that walks are below it.
TEST(Doctor, AnImuUpsideDownIsNamedThoughRoughEncodersTellNoTurning) {
  Recorded recorded = walked().recorded;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.05);  // rad
  for (LegSample& s : recorded.legs) {
    for (double& q : s.position) q += noise(random);
  }
  EXPECT_THAT(causes(recorded, walked().robot), IsEmpty());
  Robot robot = walked().robot;
  robot.imu.T_link_imu.R = turned({180, 0, 0}) * robot.imu.T_link_imu.R;
  EXPECT_THAT(causes(recorded, robot), ElementsAre("imu_mount_rotation"));
}

std::vector<WrongDescription> watched(const Robot& robot, const Reading& reading, DescriptionWatch::Judging judging,
                                      const std::function<void(Measurement&)>& change) {
  DescriptionWatch watch(robot, reading, judging);
  for (Measurement measurement : walked().measurements) {
    change(measurement);
    watch.take(measurement);
  }
  return watch.finish();
}

TEST(DescriptionWatch, SaysWhatIsWrongWithinTenSecondsOfData) {
  const auto in_degrees = [](Measurement& m) {
    if (auto* imu = std::get_if<ImuSample>(&m)) imu->gyro *= 57.29577951308232;
  };
  for (const auto judging : {DescriptionWatch::Judging::here, DescriptionWatch::Judging::beside}) {
    const auto wrong = watched(walked().robot, {}, judging, in_degrees);
    ASSERT_EQ(wrong.size(), 1U);
    EXPECT_EQ(wrong.front().finding.cause, "gyro_unit");
    EXPECT_TRUE(wrong.front().spoils);
    EXPECT_LT(wrong.front().after, 10);
  }
}

TEST(DescriptionWatch, SaysNothingOfARightDescription) {
  EXPECT_TRUE(watched(walked().robot, {}, DescriptionWatch::Judging::here, [](Measurement&) {}).empty());
}

// legs.clock: estimated: the stamps jump once the clock is found, and again when it was the wrong one.
TEST(DescriptionWatch, DoesNotAccuseAClockThatTheProgramFinds) {
  const auto jumps = [](Measurement& m) {
    auto* legs = std::get_if<JointSample>(&m);
    if (legs == nullptr) return;
    const double t = to_seconds(legs->t - stamp_of(walked().measurements.front()));
    legs->t += from_seconds(t < 4 ? -0.4 : t < 6 ? 0.35 : 0.1);
  };
  EXPECT_TRUE(watched(walked().robot, {.leg_clock_is_found = true}, DescriptionWatch::Judging::here, jumps).empty());
}

TEST(Doctor, WhoStandsStillIsNotJudged) {
  Recorded recorded = walked().recorded;
  std::erase_if(recorded.imu, [](const InertialSample& s) { return s.t > 3; });
  std::erase_if(recorded.legs, [](const LegSample& s) { return s.t > 3; });
  std::erase_if(recorded.sweeps, [](const Sweep& s) { return s.t > 3; });
  Robot robot = walked().robot;
  robot.lidar.T_imu_lidar.R = robot.lidar.T_imu_lidar.R * turned({0, 0, 90});
  EXPECT_THAT(causes(recorded, robot), IsEmpty());
  EXPECT_TRUE(Examination(recorded, robot).run().unknown());
}

// What is judged after 9 s is judged again after 14 s.
TEST(ScanOdometry, ContinuesTheWayThatItHas) {
  const auto expect_equal = [](const std::vector<SweepPose>& a, const std::vector<SweepPose>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].T_WL.p, b[i].T_WL.p) << i;
      EXPECT_EQ(a[i].T_WL.R.matrix(), b[i].T_WL.R.matrix()) << i;
    }
  };
  const std::vector<Sweep> all(walked().recorded.sweeps.begin() + 30, walked().recorded.sweeps.begin() + 60);
  const std::vector<Sweep> some(all.begin(), all.begin() + 20), others(all.begin() + 1, all.end());
  ScanOdometry odometry;
  odometry.extend(some, {});
  odometry.extend(all, {});
  expect_equal(odometry.way(), scan_odometry(all, {}));
  odometry.extend(others, {});
  expect_equal(odometry.way(), scan_odometry(others, {}));
}

}  // namespace examination_test
}  // namespace kilvo::lab
