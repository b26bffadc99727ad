#include "lab/messages/unitree.hpp"

#include <algorithm>
#include <array>

#include "lab/messages/unitree_types.hpp"
#include "lab/messages/wire_reader.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {
namespace {

constexpr std::array<const char*, 29> g1_joints{
    "left_hip_pitch_joint",     "left_hip_roll_joint",     "left_hip_yaw_joint",         "left_knee_joint",
    "left_ankle_pitch_joint",   "left_ankle_roll_joint",   "right_hip_pitch_joint",      "right_hip_roll_joint",
    "right_hip_yaw_joint",      "right_knee_joint",        "right_ankle_pitch_joint",    "right_ankle_roll_joint",
    "waist_yaw_joint",          "waist_roll_joint",        "waist_pitch_joint",          "left_shoulder_pitch_joint",
    "left_shoulder_roll_joint", "left_shoulder_yaw_joint", "left_elbow_joint",           "left_wrist_roll_joint",
    "left_wrist_pitch_joint",   "left_wrist_yaw_joint",    "right_shoulder_pitch_joint", "right_shoulder_roll_joint",
    "right_shoulder_yaw_joint", "right_elbow_joint",       "right_wrist_roll_joint",     "right_wrist_pitch_joint",
    "right_wrist_yaw_joint"};

// Places in motor_state that a G1 of fewer joints leaves empty.
constexpr std::array<std::size_t, 2> locked_waist{13, 14};
constexpr std::array<std::size_t, 6> lacking_of_23{13, 14, 20, 21, 27, 28};

std::optional<std::span<const std::size_t>> empty_places(const HgLowStateMessage& m) {
  switch (m.mode_machine) {
    case 1:
    case 4:
      return std::span<const std::size_t>(lacking_of_23);
    case 0:
    case 2:
    case 5:
      return std::span<const std::size_t>();
    case 3:
      return std::span<const std::size_t>(locked_waist);
    case 6:
      // An H1-2 has 27 motors without a gap.
      if (m.motor_state[27].q != 0 || m.motor_state[28].q != 0) return std::span<const std::size_t>(locked_waist);
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

// Those of a robot with these places empty; made once.
JointNames names_without(std::span<const std::size_t> empty) {
  const auto make = [](std::span<const std::size_t> lacking) {
    JointNames::List names;
    for (std::size_t i = 0; i < g1_joints.size(); ++i) {
      if (std::ranges::find(lacking, i) == lacking.end()) names.emplace_back(g1_joints[i]);
    }
    return JointNames(std::move(names));
  };
  static const std::array names{make({}), make(locked_waist), make(lacking_of_23)};
  return names.at(empty.empty() ? 0 : empty.size() == locked_waist.size() ? 1 : 2);
}

Decoded<JointSample> joints_of(const HgLowStateMessage& m) {
  if (m.mode_pr != 0)
    return DecodeError{"unitree_hg/LowState: mode_pr is " + std::to_string(m.mode_pr) +
                       ": ankles and waist are angles of motors, not of joints; set the robot to mode_pr 0 (PR)"};
  const auto empty = empty_places(m);
  if (!empty)
    return DecodeError{"unitree_hg/LowState: mode_machine " + std::to_string(m.mode_machine) +
                       " is no robot whose order of joints is known (G1: 1 to 6)"};
  JointSample joints;
  joints.t = time_from_ns(std::int64_t{m.tick} * 1'000'000);
  joints.names = names_without(*empty);
  for (std::vector<double>* values : {&joints.position, &joints.velocity, &joints.effort}) values->reserve(joints.names.size());
  for (std::size_t i = 0; i < g1_joints.size(); ++i) {
    if (std::ranges::find(*empty, i) != empty->end()) continue;
    const HgMotorMessage& motor = m.motor_state[i];
    joints.position.push_back(static_cast<double>(motor.q));
    joints.velocity.push_back(static_cast<double>(motor.dq));
    joints.effort.push_back(static_cast<double>(motor.tau_est));
  }
  return joints;
}

Eigen::Vector3d vector_of(const std::array<float, 3>& v) { return Eigen::Vector3f(v[0], v[1], v[2]).cast<double>(); }

ImuSample imu_of(const UnitreeImuMessage& m) { return {Time{}, vector_of(m.gyroscope), vector_of(m.accelerometer)}; }

constexpr std::uint32_t polynomial = 0x04c11db7;

constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t crc = i << 24;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x80000000U) != 0 ? polynomial : 0);
    table[i] = crc;
  }
  return table;
}

/// The struct in memory is the same as in CDR but for the temperature of the IMU, behind which a compiler leaves two bytes so that the
/// motors, which hold floats, begin at a multiple of four.
std::uint32_t crc_of(const HgLowStateMessage& m) {
  constexpr std::uint16_t padding = 0;
  WireWriter writer(Encoding::cdr);
  writer(m.version, m.mode_pr, m.mode_machine, m.tick, m.imu_state, padding, m.motor_state, m.wireless_remote, m.reserve);
  const auto bytes = writer.take();
  return unitree_crc(Bytes(bytes).subspan(4));
}

}  // namespace

std::uint32_t unitree_crc(Bytes words) {
  static constexpr auto table = crc_table();
  std::uint32_t crc = 0xFFFFFFFF;
  // Of each little-endian word the most significant byte first.
  for (std::size_t i = 0; i + 4 <= words.size(); i += 4) {
    for (std::size_t k = 4; k-- > 0;) crc = (crc << 8) ^ table[(crc >> 24) ^ words[i + k]];
  }
  return crc;
}

Decoded<std::uint32_t> hg_low_state_crc(const WireMessage& message) {
  const auto m = read_message<HgLowStateMessage>(message);
  if (!m) return DecodeError{m.reason()};
  return crc_of(*m);
}

Decoded<UnitreeSample> decode_hg_low_state(const WireMessage& message) {
  const auto m = read_message<HgLowStateMessage>(message);
  if (!m) return DecodeError{m.reason()};
  if (m->crc != 0 && m->crc != crc_of(*m)) return DecodeError{"unitree_hg/LowState: the checksum is wrong"};
  return UnitreeSample{imu_of(m->imu_state.imu), joints_of(*m), m->tick};
}

Decoded<UnitreeSample> decode_go_low_state(const WireMessage& message) {
  const auto m = read_message<GoLowStateMessage>(message);
  if (!m) return DecodeError{m.reason()};
  DecodeError four{
      "unitree_go/LowState (Go2, B2, H1): its legs are not read; what is read are those of a G1 (unitree_hg/LowState), or a JointState"};
  return UnitreeSample{imu_of(m->imu_state.imu), std::move(four), m->tick};
}

Decoded<ImuSample> decode_hg_imu_state(const WireMessage& message) {
  const auto m = read_message<HgImuMessage>(message);
  if (!m) return DecodeError{m.reason()};
  return imu_of(m->imu);
}

}  // namespace kilvo::lab
