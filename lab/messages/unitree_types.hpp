// What Unitree's humanoids publish of themselves (package unitree_hg), and their quadrupeds (unitree_go), field by field: unitree_sdk2,
// include/unitree/idl.
#pragma once

#include "lab/messages/wire_fields.hpp"

namespace kilvo::lab {

/// In both packages the same.
struct UnitreeImuMessage {
  static constexpr const char* name = "unitree IMUState";
  std::array<float, 4> quaternion{};     // w x y z
  std::array<float, 3> gyroscope{};      // rad/s
  std::array<float, 3> accelerometer{};  // m/s^2
  std::array<float, 3> rpy{};

  static void fields(auto& m, auto&& visit) { visit(m.quaternion, m.gyroscope, m.accelerometer, m.rpy); }
};

/// unitree_hg/IMUState: a temperature of two bytes.
struct HgImuMessage {
  static constexpr const char* name = "unitree_hg/IMUState";
  UnitreeImuMessage imu;
  std::int16_t temperature = 0;

  static void fields(auto& m, auto&& visit) { visit(m.imu, m.temperature); }
};

struct HgMotorMessage {
  std::uint8_t mode = 0;
  float q = 0, dq = 0, ddq = 0, tau_est = 0;  // rad, rad/s, rad/s^2, N m
  std::array<std::int16_t, 2> temperature{};
  float vol = 0;
  std::array<std::uint32_t, 2> sensor{};
  std::uint32_t motorstate = 0;
  std::array<std::uint32_t, 4> reserve{};

  static void fields(auto& m, auto&& visit) {
    visit(m.mode, m.q, m.dq, m.ddq, m.tau_est, m.temperature, m.vol, m.sensor, m.motorstate, m.reserve);
  }
};

struct HgLowStateMessage {
  static constexpr const char* name = "unitree_hg/LowState";
  std::array<std::uint32_t, 2> version{};
  std::uint8_t mode_pr = 0;       // 0: ankles and waist as pitch and roll; 1: as angles of their two motors
  std::uint8_t mode_machine = 0;  // which robot it is
  std::uint32_t tick = 0;         // ms
  HgImuMessage imu_state;
  std::array<HgMotorMessage, 35> motor_state{};
  std::array<std::uint8_t, 40> wireless_remote{};
  std::array<std::uint32_t, 4> reserve{};
  std::uint32_t crc = 0;

  static void fields(auto& m, auto&& visit) {
    visit(m.version, m.mode_pr, m.mode_machine, m.tick, m.imu_state, m.motor_state, m.wireless_remote, m.reserve, m.crc);
  }
};

/// unitree_go/IMUState: a temperature of one byte.
struct GoImuMessage {
  static constexpr const char* name = "unitree_go/IMUState";
  UnitreeImuMessage imu;
  std::int8_t temperature = 0;

  static void fields(auto& m, auto&& visit) { visit(m.imu, m.temperature); }
};

struct GoMotorMessage {
  std::uint8_t mode = 0;
  float q = 0, dq = 0, ddq = 0, tau_est = 0, q_raw = 0, dq_raw = 0, ddq_raw = 0;
  std::int8_t temperature = 0;
  std::uint32_t lost = 0;
  std::array<std::uint32_t, 2> reserve{};

  static void fields(auto& m, auto&& visit) {
    visit(m.mode, m.q, m.dq, m.ddq, m.tau_est, m.q_raw, m.dq_raw, m.ddq_raw, m.temperature, m.lost, m.reserve);
  }
};

struct GoBatteryMessage {
  std::uint8_t version_high = 0, version_low = 0, status = 0, soc = 0;
  std::int32_t current = 0;
  std::uint16_t cycle = 0;
  std::array<std::int8_t, 2> bq_ntc{}, mcu_ntc{};
  std::array<std::uint16_t, 15> cell_vol{};

  static void fields(auto& m, auto&& visit) {
    visit(m.version_high, m.version_low, m.status, m.soc, m.current, m.cycle, m.bq_ntc, m.mcu_ntc, m.cell_vol);
  }
};

struct GoLowStateMessage {
  static constexpr const char* name = "unitree_go/LowState";
  std::array<std::uint8_t, 2> head{};
  std::uint8_t level_flag = 0, frame_reserve = 0;
  std::array<std::uint32_t, 2> sn{}, version{};
  std::uint16_t bandwidth = 0;
  GoImuMessage imu_state;
  std::array<GoMotorMessage, 20> motor_state{};
  GoBatteryMessage bms_state;
  std::array<std::int16_t, 4> foot_force{}, foot_force_est{};
  std::uint32_t tick = 0;  // ms
  std::array<std::uint8_t, 40> wireless_remote{};
  std::uint8_t bit_flag = 0;
  float adc_reel = 0;
  std::int8_t temperature_ntc1 = 0, temperature_ntc2 = 0;
  float power_v = 0, power_a = 0;
  std::array<std::uint16_t, 4> fan_frequency{};
  std::uint32_t reserve = 0;
  std::uint32_t crc = 0;

  static void fields(auto& m, auto&& visit) {
    visit(m.head, m.level_flag, m.frame_reserve, m.sn, m.version, m.bandwidth, m.imu_state, m.motor_state, m.bms_state, m.foot_force,
          m.foot_force_est, m.tick, m.wireless_remote, m.bit_flag, m.adc_reel, m.temperature_ntc1, m.temperature_ntc2, m.power_v, m.power_a,
          m.fan_frequency, m.reserve, m.crc);
  }
};

}  // namespace kilvo::lab
