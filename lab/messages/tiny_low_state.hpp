// For tests: a unitree_hg/LowState whose numbers can be told apart.
#pragma once

#include "lab/messages/unitree_types.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {

/// A G1 with 29 joints: motor i at i/16 rad, turning with -i/8 rad/s, with an effort of i/2 Nm.
inline HgLowStateMessage tiny_low_state() {
  HgLowStateMessage m;
  m.version = {1, 2};
  m.mode_machine = 5;
  m.tick = 123456;
  m.imu_state.imu = {{1, 0, 0, 0}, {0.125F, -0.25F, 0.5F}, {0.5F, -0.75F, 9.75F}, {0.1F, 0.2F, 0.3F}};
  m.imu_state.temperature = 42;
  for (std::size_t i = 0; i < m.motor_state.size(); ++i) {
    const auto k = static_cast<float>(i);
    m.motor_state[i] = {1, 0.0625F * k, -0.125F * k, 0, 0.5F * k, {30, 31}, 48.0F, {}, 0, {}};
  }
  return m;
}

}  // namespace kilvo::lab
