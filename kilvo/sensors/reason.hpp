// Reasons: why a message was not used, why the modality changed, what was found about a sensor. Each has an enumerator, for decisions, and
// in the same place of the table a name (in files) and a text (for people).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace kilvo {

enum class Reason : std::uint8_t {
  // of a change of modality: three for each Sensor, in their order, then the others
  start,
  imu_lost,
  imu_frozen,
  imu_back,
  legs_lost,
  legs_frozen,
  legs_back,
  lidar_lost,
  lidar_frozen,
  lidar_back,
  camera_lost,
  camera_frozen,
  camera_used,
  camera_useless,
  // of a message that is not used
  not_used,
  not_finite,
  all_zero,
  absurd_value,
  absurd_stamp,
  empty,
  duplicate,
  late,
  time_jump,
  clock_back,
  clock_forward,
  clock_ahead,
  repeated_values,
  repeated_image,
  frozen,
  before_start,
  before_state,
  before_motion,
  before_sweep,
  before_rejoined,
  no_imu,
  no_lidar,
  not_calm,
  wrong_joints,
  no_usable_point,
  fits_nowhere,
  image_size,
  image_channels,
  image_cut,
  mount_doubted,
  pose_uncertain,
  agrees_with_nothing,
  // findings
  began_anew,
  levelled,
  moving_start,
  strange_gravity,
  gap_of_imu,
  imu_clock_stepped,
  clock_offset,
  lagging,
  noisy_accel,
  froze,
  gyro_clipped,
  accel_clipped,
  feet_not_still,
  unmeasured,
  coasting,
  map_begun_anew,
  state_thrown_away,
  not_where_predicted,
  foreign_images,
  nothing_seen,
  camera_turned,
  mount_corrected,
  inconsistent,
  diverged,
};

enum class Severity : std::uint8_t { notice, warning, error };

/// `text`: "{}" is replaced by the value times `scale` with so many digits, "[]" by the detail.
struct ReasonRow {
  Reason reason;
  Severity severity;
  const char* name;
  const char* text;
  double scale = 1;
  int digits = 0;
};

inline constexpr std::array reasons = {
    ReasonRow{Reason::start, Severity::notice, "start", "start"},
    ReasonRow{Reason::imu_lost, Severity::warning, "imu_lost", "imu lost"},
    ReasonRow{Reason::imu_frozen, Severity::notice, "imu_frozen", "imu frozen"},
    ReasonRow{Reason::imu_back, Severity::notice, "imu_back", "imu is back"},
    ReasonRow{Reason::legs_lost, Severity::notice, "legs_lost", "legs lost"},
    ReasonRow{Reason::legs_frozen, Severity::notice, "legs_frozen", "legs frozen"},
    ReasonRow{Reason::legs_back, Severity::notice, "legs_back", "legs are back"},
    ReasonRow{Reason::lidar_lost, Severity::notice, "lidar_lost", "lidar lost"},
    ReasonRow{Reason::lidar_frozen, Severity::notice, "lidar_frozen", "lidar frozen"},
    ReasonRow{Reason::lidar_back, Severity::notice, "lidar_back", "lidar is back"},
    ReasonRow{Reason::camera_lost, Severity::notice, "camera_lost", "camera lost"},
    ReasonRow{Reason::camera_frozen, Severity::notice, "camera_frozen", "camera frozen"},
    ReasonRow{Reason::camera_used, Severity::notice, "camera_used", "images are used"},
    ReasonRow{Reason::camera_useless, Severity::notice, "camera_useless", "images carry no information"},
    ReasonRow{Reason::not_used, Severity::notice, "not_used", "not used"},
    ReasonRow{Reason::not_finite, Severity::warning, "not_finite", "not finite"},
    ReasonRow{Reason::all_zero, Severity::warning, "all_zero", "zeros only: it does not measure yet, or no longer"},
    ReasonRow{Reason::absurd_value, Severity::warning, "absurd_value", "absurd value"},
    ReasonRow{Reason::absurd_stamp, Severity::warning, "absurd_stamp", "absurd stamp"},
    ReasonRow{Reason::empty, Severity::warning, "empty", "empty"},
    ReasonRow{Reason::duplicate, Severity::warning, "duplicate", "duplicate"},
    ReasonRow{Reason::late, Severity::warning, "late", "late"},
    ReasonRow{Reason::time_jump, Severity::warning, "time_jump", "time jump"},
    ReasonRow{Reason::clock_back, Severity::warning, "clock_back", "its clock went back"},
    ReasonRow{Reason::clock_forward, Severity::warning, "clock_forward", "its clock went ahead"},
    ReasonRow{Reason::clock_ahead, Severity::warning, "clock_ahead", "its clock is ahead of the IMU's", 1e3, 0},
    ReasonRow{Reason::repeated_values, Severity::warning, "repeated_values", "repeated values"},
    ReasonRow{Reason::repeated_image, Severity::warning, "repeated_image", "repeated image"},
    ReasonRow{Reason::frozen, Severity::warning, "frozen", "frozen"},
    ReasonRow{Reason::before_start, Severity::notice, "before_start", "before the start"},
    ReasonRow{Reason::before_state, Severity::warning, "before_state", "before the state"},
    ReasonRow{Reason::before_motion, Severity::warning, "before_motion", "before the motion is known"},
    ReasonRow{Reason::before_sweep, Severity::warning, "before_sweep", "before the first sweep"},
    ReasonRow{Reason::before_rejoined, Severity::warning, "before_rejoined", "before the sweeps fit the map again"},
    ReasonRow{Reason::no_imu, Severity::warning, "no_imu", "no IMU"},
    ReasonRow{Reason::no_lidar, Severity::warning, "no_lidar", "no LiDAR"},
    ReasonRow{Reason::not_calm, Severity::warning, "not_calm", "acceleration still unusual"},
    ReasonRow{Reason::wrong_joints, Severity::warning, "wrong_joints", "joints do not match the robot"},
    ReasonRow{Reason::no_usable_point, Severity::warning, "no_usable_point", "no usable point"},
    ReasonRow{Reason::fits_nowhere, Severity::warning, "fits_nowhere", "fits nowhere in the map"},
    ReasonRow{Reason::image_size, Severity::warning, "image_size", "another size than configured"},
    ReasonRow{Reason::image_channels, Severity::warning, "image_channels", "neither grey nor colour"},
    ReasonRow{Reason::image_cut, Severity::warning, "image_cut", "cut short"},
    ReasonRow{Reason::mount_doubted, Severity::warning, "mount_doubted", "not mounted as configured"},
    ReasonRow{Reason::pose_uncertain, Severity::warning, "pose_uncertain", "the pose is too uncertain"},
    ReasonRow{Reason::agrees_with_nothing, Severity::warning, "agrees_with_nothing", "agrees with nothing"},
    ReasonRow{Reason::began_anew, Severity::warning, "began_anew",
              "the time went back by {} s: another recording, or the same again; the estimator restarts", 1, 1},
    ReasonRow{Reason::levelled, Severity::notice, "levelled", "the world was rotated by {} degrees, so that its z axis is up", 57.295779513,
              2},
    ReasonRow{Reason::moving_start, Severity::warning, "moving_start",
              "the robot did not stand still: started while moving, with a large covariance"},
    ReasonRow{Reason::strange_gravity, Severity::warning, "strange_gravity",
              "the accelerometer measured {} at the start: neither 9.8 m/s^2 nor 1 g", 1, 6},
    ReasonRow{Reason::gap_of_imu, Severity::warning, "gap_of_imu",
              "after {} s without it position and heading are uncertain by [], one sigma, until the robot is found in its map", 1, 1},
    ReasonRow{Reason::imu_clock_stepped, Severity::warning, "imu_clock_stepped",
              "the IMU's clock went [] by {} ms: the outputs' stamps continue without the step", 1e3, 0},
    ReasonRow{Reason::clock_offset, Severity::warning, "clock_offset",
              "its clock is {} ms behind the IMU's (negative: ahead), and is corrected from now on: set []", 1e3, 1},
    ReasonRow{Reason::lagging, Severity::warning, "lagging", "its messages come {} ms after the IMU's of the same time", 1e3, 0},
    ReasonRow{Reason::noisy_accel, Severity::warning, "noisy_accel",
              "the accelerometer's noise is far above its settings: a density of {} m/s^2/sqrt(Hz) is used", 1, 2},
    ReasonRow{Reason::froze, Severity::warning, "froze", "frozen: it repeated its values"},
    ReasonRow{Reason::gyro_clipped, Severity::warning, "gyro_clipped", "the gyroscope is at the end of its range, {} rad/s", 1, 1},
    ReasonRow{Reason::accel_clipped, Severity::warning, "accel_clipped", "the accelerometer is at the end of its range, {} m/s^2", 1, 1},
    ReasonRow{Reason::feet_not_still, Severity::warning, "feet_not_still",
              "no foot was at rest in {} % of the messages: check the mount of the IMU and the URDF", 100, 0},
    ReasonRow{
        Reason::unmeasured, Severity::warning, "unmeasured",
        "for {} s no sensor measured the motion along [] of the odometry frame: the position along it is integrated from the IMU, and "
        "drifts. Legs or a camera would measure it",
        1, 0},
    ReasonRow{
        Reason::coasting, Severity::warning, "coasting",
        "for {} s neither LiDAR nor legs measured the motion: the positions of that time are integrated from the IMU alone, and drift "
        "by metres in ten seconds",
        1, 1},
    ReasonRow{Reason::map_begun_anew, Severity::error, "map_begun_anew",
              "the map was restarted, because no sweep fitted it: poses before and after are in different frames"},
    ReasonRow{Reason::state_thrown_away, Severity::warning, "state_thrown_away",
              "an implausible state was discarded: back to that of {} s before", 1, 3},
    ReasonRow{Reason::not_where_predicted, Severity::warning, "not_where_predicted",
              "a sweep fits the map [] from where the IMU predicted it: samples of the IMU are wrong, or the robot was moved while nothing "
              "measured it. The pose jumps there"},
    ReasonRow{Reason::foreign_images, Severity::warning, "foreign_images", "images of []"},
    ReasonRow{Reason::nothing_seen, Severity::warning, "nothing_seen",
              "of {} images none showed enough to be used: too dark, blank, blurred, covered, 16 bits that are not used to the top, or a "
              "camera that "
              "is not as described (kilvo doctor)",
              1, 0},
    ReasonRow{Reason::camera_turned, Severity::warning, "camera_turned",
              "the images fit a camera that is rotated by {} degrees or more ([] about the axes of the IMU) against camera.T_imu_camera.R: "
              "check the calibration and camera.time_offset. Images are not used for some time",
              1, 1},
    ReasonRow{Reason::mount_corrected, Severity::warning, "mount_corrected",
              "its mount is off by {} degrees, and is corrected from now on: set camera.T_imu_camera.R to []", 1, 1},
    ReasonRow{Reason::inconsistent, Severity::warning, "inconsistent", "[]"},
    ReasonRow{Reason::diverged, Severity::error, "diverged", "[]"},
};
inline constexpr std::size_t reason_count = reasons.size();

static_assert([] {
  for (std::size_t i = 0; i < reason_count; ++i) {
    if (reasons[i].reason != static_cast<Reason>(i)) return false;
  }
  return true;
}());

constexpr const char* name_of(Severity s) { return std::array{"notice", "warning", "error"}[static_cast<std::size_t>(s)]; }
constexpr const ReasonRow& row_of(Reason r) { return reasons[static_cast<std::size_t>(r)]; }
constexpr const char* name_of(Reason r) { return row_of(r).name; }
constexpr const char* text_of(Reason r) { return row_of(r).text; }
/// Reasons for which a message was not used.
constexpr bool is_of_message(Reason r) { return r >= Reason::not_used && r <= Reason::agrees_with_nothing; }
/// Reasons of a change of modality.
constexpr bool is_of_modality(Reason r) { return r < Reason::not_used; }

}  // namespace kilvo
