// One recording under judgement. Each step judges one sense with what the steps before have settled, and mends the description in memory
// when it is wrong, so that a fault of one sense does not look like a fault of the next.
#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "kilvo/sensors/robot.hpp"
#include "lab/doctor/camera_fit.hpp"
#include "lab/doctor/finding.hpp"
#include "lab/doctor/leg_acceleration.hpp"
#include "lab/doctor/leg_path.hpp"
#include "lab/doctor/mount_regression.hpp"
#include "lab/doctor/recorded.hpp"
#include "lab/doctor/refinement.hpp"
#include "lab/doctor/scan_odometry.hpp"
#include "lab/doctor/stance_fit.hpp"
#include "lab/doctor/stepping.hpp"
#include "lab/doctor/translation_fit.hpp"
#include "lab/doctor/turns.hpp"

namespace kilvo::lab {

inline constexpr double sure = 4;  // standard deviations
/// Standard deviations beyond which the best of so many is as rarely by chance as a single one beyond `sure` (Bonferroni): the tail of a
/// normal distribution falls as exp(-x^2 / 2).
inline double sure_among(std::size_t hypotheses) { return std::sqrt(sure * sure + 2 * std::log(static_cast<double>(hypotheses) + 1)); }
/// Standard deviations by which one of two shares that are not explained is smaller, each of so many independent values (F. J. Anscombe:
/// the logarithm of a variance of n values has the variance 2 / n).
inline double smaller_by(double share, double than, double independent) {
  return independent > 0 && share > 0 && than > 0 ? std::log(than / share) * std::sqrt(independent) / 2 : 0;
}
inline constexpr double turn_interval = 0.04;  // s, of a turn of the legs
inline constexpr double pose_period = 0.009;   // s, between poses of the legs

/// How one sense's turning agrees with the gyro's.
struct SenseAgreement {
  bool present = false;
  bool turned = false;                                  // enough to be held against the gyro
  bool known = false;                                   // it turned enough, and the gyro explains it under some mount and offset
  bool agrees = false;                                  // under the mount and the clock of the configuration
  Eigen::Matrix3d error = Eigen::Matrix3d::Identity();  // in the IMU frame: measured mount = error * configured mount
  double scale = 1;                                     // of the gyro
  double offset = 0;                                    // s
  double explained = 0;                                 // under the best mount
  double as_described = 0;                              // under the configured one
  double turning = 0;                                   // rad/s, rms
  double weakest = 0;                                   // rad/s, rms of the turning about the least turned axis
};

/// What a recording has shown that is continued later: it need not be found again.
struct Earlier {
  bool point_times_are_good = false;
  std::int64_t origin = 0;        // ns, of the recording, which tells it from others
  ScanOdometry described, swung;  // the LiDAR's way with the description, and with all that the data said
};

class Examination {
 public:
  Examination(const Recorded& recorded, const Robot& robot) : recorded_(recorded), robot_(robot), original_(robot) {}
  /// Quick: begins with the description, towards which it pulls a clock by a seventh of what that is off, and continues what is known.
  Examination(const Recorded& recorded, const Robot& robot, Earlier earlier)
      : recorded_(recorded), robot_(robot), original_(robot), earlier_(std::move(earlier)), described_first_(true) {}

  /// All checks, in their order.
  Diagnosis run();

  /// After run(): the description as the data have it, for refinement.
  const Robot& robot() const { return robot_; }
  /// After run(): what the recording says about mounts, focal length and clocks, with its standard deviations.
  const std::vector<Refinement>& refinements() const { return refinements_; }
  /// After run(): for an examination of more of the same recording.
  Earlier for_later() { return std::move(earlier_); }

 private:
  // imu_examination.cpp, gyro_scale.cpp
  void examine_rates();
  void examine_acceleration_unit();
  void agree_with_gyro();
  void try_gyro_in_degrees();
  void accuse_gyro_in_degrees(const std::string& evidence);
  void settle_axes();
  void examine_gyro_scale(const std::vector<Turn>& turns, const MountFit& fit);
  void refine_gyro_scale(const MountFit& fit);
  void examine_gyro_axes(const Eigen::Vector3d& change, const Eigen::Vector3d& sigma);
  void examine_frozen_axes(Eigen::Vector3d InertialSample::*half);
  double walked_between(double a, double b) const;
  void accuse_imu_axes(const Eigen::Matrix3d& gyro, const Eigen::Matrix3d& accel, const std::string& evidence);
  /// `only_calm`: none when what the accelerometer measures does not average to gravity.
  std::optional<double> tilt_under(const SO3& R_link_imu, bool only_calm) const;
  Eigen::Vector3d up_by_legs() const;
  void examine_upright();
  void blame_imu_for_all();
  // sweep_examination.cpp
  void register_sweeps();
  void turn_with(std::vector<SweepPose> way);
  void examine_point_times();
  void deskew_first(Deskew& deskew);
  // point_times.cpp
  double right_point_times(Deskew deskew);
  double median_duration() const;  // s, of the sweeps by their points
  void find_point_times(double times, const Deskew& deskew, const std::string& evidence);
  // lidar_examination.cpp
  void examine_lidar();
  /// Of rotation, clock and gyro bias at once.
  MountFit examine_lidar_rotation();
  bool lidar_is_nearer(const Eigen::Vector3d& p, const Eigen::Vector3d& other, const SO3& R_IL) const;
  void examine_lidar_clock(const MountFit& fit);
  void examine_lidar_position();
  void examine_lidar_range();
  bool lidar_scale_contradicts() const;
  bool settle_lidar_scale_by_slow_motion(const SO3& R_IL);
  bool examine_lidar_scale();
  void accuse_lidar_scale(double factor, const std::string& evidence);
  // leg_examination.cpp
  void examine_legs();
  /// Of the legs' turning: a sole rolls one way for half of a quick step.
  double independent_turns() const { return 3 * stepping_.seconds() / 0.25; }
  bool examine_leg_names();
  void examine_length_units();
  bool examine_joint_values();
  void find_joint_slip();
  bool joints_jump();
  bool find_other_names(const std::string& evidence);
  void examine_locked_joints();
  bool examine_fixed_joints();
  void suspect_locked_joints();
  /// Legs that hardly turn show how they bend, not how they are mounted.
  bool legs_turned() const;
  bool feet_stand() const;
  bool find_leg_start();
  std::vector<SO3> upright_mounts() const;
  /// Only those that stand longer than so many seconds.
  bool try_standing_hypotheses(double longer_than = 0);
  struct LegScore {
    double explained = 0, flatness = 0;  // share; degrees
    double offset = 0;
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    double cost() const;
  };
  LegScore score_legs(const std::vector<LegPose>& path, double offset, bool any_mount) const;
  std::vector<LegPose> legs_under(const LegHypothesis* hypothesis, double period = pose_period) const;
  bool try_leg_hypotheses();
  /// So much of the legs' turning is the gyro's at another time, or with one or two joints as another hypothesis has them.
  bool legs_explain_turning(double share);
  /// The legs are judged under `h` from now on, which the finding's settings have done to them.
  void find_on_legs(Finding finding, const LegHypothesis& h);
  // leg_accelerating.cpp
  LegAcceleration leg_acceleration(const LegHypothesis* hypothesis, const SO3& R_link_imu, double offset) const;
  LegAcceleration leg_acceleration(const std::vector<LegPose>& path, const MeasuredForce& force, const SO3& R_link_imu,
                                   double offset) const;
  bool try_acceleration_hypotheses();
  void examine_leg_size();
  bool accelerates_as_it_turns(const MountFit& by_turning, const SO3& R_link_imu) const;
  bool examine_leg_shape();
  void examine_joint_speeds();
  /// Positions that are wrong contradict their velocities: one finding, and what mends it does without those.
  void settle_joint_speeds();
  // accelerated_mount.cpp
  std::pair<SO3, LegAcceleration> accelerated_mount(const std::vector<LegPose>& path, const MeasuredForce& force, SO3 R,
                                                    LegAcceleration fit) const;
  bool find_accelerated_mount(const std::vector<LegPose>& path, const MeasuredForce& force, const LegAcceleration& described);
  bool acceleration_contradicts_legs(const std::string& evidence);
  // leg_mount.cpp, leg_zeros.cpp
  MountFit measure_leg_mount() const;
  StanceFit standing_by(Robot& start, const MountFit& by_turning, double method) const;
  void examine_leg_rotation();
  std::pair<double, double> vertical_bias(const MountFit& fit) const;
  bool find_inclined_imu(const MountFit& fit, double method);
  void examine_leg_clock(const MountFit& fit, double method, double tolerance);
  bool turns_with_link(const LegHypothesis& other) const;
  void refine_zeros(const StanceFit& stances);
  void examine_feet_apart(const Robot& start);
  bool find_wrong_zero(const StanceFit& stances, const Robot& start);
  void settle_imu_link(const SO3& measured);
  void find_turned_imu(const SO3& measured, const std::string& evidence);
  struct LegWay {
    double scale = 1, sigma = 0;  // way by the legs through way by the LiDAR
    std::size_t windows = 0;
    std::optional<double> height;  // m, of the LiDAR: by the legs less by its points
    std::optional<double> uneven;  // m: how much lower the left sole is than the right one where the robot stands
  };
  LegWay measure_leg_way(const LegHypothesis* hypothesis) const;
  void measure_leg_size(LegWay& way) const;
  bool accuse_exchanged_legs(double scale, const std::string& evidence);
  void examine_leg_lengths();
  bool accuse_lidar_instead(double scale, const std::string& evidence);
  void accuse_leg_lengths(double scale, double height);
  void accuse_imu_place(double height);
  void accuse_leg_joints(const std::string& evidence);
  static bool is_no_way_of_legs(double scale, double sigma);
  bool way_contradicts_legs(const std::string& evidence);
  void accuse_uneven_legs(double uneven);
  std::optional<double> soles_above_ankles() const;
  std::string link_at_height(double height) const;
  // camera_hypotheses.cpp
  bool try_camera_hypotheses(const CameraTracks& tracks);
  // camera_examination.cpp
  void examine_camera();
  void examine_camera_fit(const CameraTracks& tracks);
  void accuse_camera_rotation(const SO3& R_IC, const std::string& evidence);
  bool examine_camera_position(const CameraTracks& tracks, const CameraFit& fit, const CameraFit& placed);
  // camera_lens.cpp
  bool examine_lens(const CameraTracks& tracks, double otherwise, double share);

  GyroPath gyro() const { return {recorded_.imu, gyro_axes_, gyro_bias_}; }
  SenseAgreement agreement(const std::vector<Turn>& turns, const SO3& mount, double least_explained) const;
  std::vector<InertialSample> mended_imu() const;
  /// After examine_lidar(). Without places where the LiDAR's way is not known.
  const LidarWay& lidar_way() const { return *lidar_way_; }
  LidarWay smoothed_way() const;
  SE3 T_link_imu() const { return robot_.imu.T_link_imu; }
  void check(Sensor sensor, const std::string& what, Check::Verdict verdict, const std::string& detail);
  void find(Finding finding);
  /// Something of this sensor is off, and more data would make it sure.
  bool& seems_wrong(Sensor sensor) { return diagnosis_.seems_wrong[index_of(sensor)]; }
  void find_offset(Sensor sensor, double offset, double sigma, const std::string& evidence);
  void refine_rotation(Sensor sensor, const std::string& what, const SO3& described, const SO3& measured, const Eigen::Vector3d& sigma,
                       double method, const std::string& key);
  void refine_offset(Sensor sensor, double offset, double sigma, double method);
  void find_rotation(Finding finding, const SO3& before, const SO3& after, const std::string& key);

  const Recorded& recorded_;
  mutable RecordedLegs recorded_legs_{recorded_};  // keeps the URDFs that it has read
  Robot robot_, original_;
  Eigen::Matrix3d gyro_axes_ = Eigen::Matrix3d::Identity();  // take what was written to rad/s and m/s^2 in the IMU frame
  Eigen::Matrix3d accel_axes_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();  // rad/s, by the LiDAR
  Earlier earlier_;
  bool described_first_ = false;
  bool deskewed_ = false;                   // by the gyro as described, as which the sweeps turn
  bool point_times_are_undecided_ = false;  // whether they are right: the motion does not show it
  std::vector<SweepPose> first_, way_;      // the LiDAR's way, so or of rigid sweeps, and with all that the data say
  std::optional<LidarWay> lidar_way_;
  std::vector<Turn> lidar_turns_, leg_turns_;
  SenseAgreement lidar_, legs_;
  Stepping stepping_;
  bool speeds_contradict_ = false;  // velocities of joints the change of their positions
  std::optional<LegHypothesis> leg_mend_;
  std::optional<SO3> leg_start_;              // mount of the IMU on its link, far from the described one, from which that is looked for
  double lidar_offset_ = 0, leg_offset_ = 0;  // s: stamps plus this are on the IMU's clock
  std::optional<TranslationFit> translation_;
  WayScale lidar_scale_;  // of the LiDAR's way, by the acceleration
  std::optional<StanceFit> stances_;
  LegAcceleration leg_acceleration_;  // under the mount that was settled
  Diagnosis diagnosis_;
  std::vector<Refinement> refinements_;
};

/// Of the LiDAR on the IMU: `error` (measured less described) with its standard deviations, m, and what the method is off by besides.
inline constexpr const char* lidar_position = "position of the LiDAR on the IMU";
Refinement refined_lidar_position(const Eigen::Vector3d& described, const Eigen::Vector3d& error, const Eigen::Vector3d& sigma,
                                  double method);
/// `turned`: see expected_shift.
Refinement refined_lidar_position(const Eigen::Vector3d& described, MountMeasurement measured, const Eigen::Vector3d& turned);

/// From each sweep to the next, where both are registered.
std::vector<Turn> turns_of(const std::vector<SweepPose>& way);

std::string rotation_text(const SO3& R);  // as YAML, row by row
std::string vector_text(const Eigen::Vector3d& p);
std::string number_text(double x);
struct LengthUnit {
  const char* name;
  double metres;
};
/// Of a length that is no number of metres, and would be below `least` (m) if it was in millimetres.
inline LengthUnit unit_of(double length, double least) {
  return 1e-3 * length < least ? LengthUnit{"centimetres", 1e-2} : LengthUnit{"millimetres", 1e-3};
}
/// With what is taken of a refinement in degrees about the axes of the rotated frame.
SO3 turned_by(const SO3& described, const Refinement& r);
/// "5.0 degrees about y": the axis is named when the rotation is about one.
std::string turn_text(const SO3& turn);
inline constexpr double most_tilt = 50;  // degrees: a robot that walks is upright
inline double degrees(double radians) { return radians * 57.29577951308232; }

}  // namespace kilvo::lab
