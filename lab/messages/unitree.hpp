// The state that Unitree's robots publish of themselves over DDS: unitree_hg/LowState (G1), unitree_hg/IMUState, unitree_go/LowState.
#pragma once

#include <optional>

#include "kilvo/sensors/measurement.hpp"
#include "lab/messages/decoded.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// LowState has a counter in place of a stamp: it is the time of the joints (on a clock of its own); the time of the IMU sample is 0.
struct UnitreeSample {
  ImuSample imu;                           // of the pelvis
  Decoded<JointSample> joints;             // or why there are none: mode_pr 1, not a G1, four feet
  std::optional<std::uint32_t> tick = {};  // ms, wraps around; IMUState has none
};

/// unitree_hg/LowState. `mode_machine` says which joints there are: 1 and 4 are a G1 with 23, 2 and 5 one with 29, 3 one with a locked
/// waist; 6 is that too, or an H1-2 with its joints in another order, told apart by whether the last two motors of a G1 say anything; 0 is
/// what simulators send and is taken for 29. Joints have the names of Unitree's URDF. Fails when the checksum, unless it is 0, is wrong.
Decoded<UnitreeSample> decode_hg_low_state(const WireMessage& message);

/// unitree_go/LowState: its IMU; its legs are refused, for KILVO needs a robot with two.
Decoded<UnitreeSample> decode_go_low_state(const WireMessage& message);

/// unitree_hg/IMUState (the torso's, say).
Decoded<ImuSample> decode_hg_imu_state(const WireMessage& message);

/// The checksum of a LowState: CRC-32 with the polynomial 0x04c11db7, most significant bit first, from 0xFFFFFFFF, over 32-bit words.
std::uint32_t unitree_crc(Bytes words);

/// What `crc` of a unitree_hg/LowState should be. Computed over the struct in memory as a C compiler lays it out.
Decoded<std::uint32_t> hg_low_state_crc(const WireMessage& message);

}  // namespace kilvo::lab
