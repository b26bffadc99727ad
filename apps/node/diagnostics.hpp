// How the sensors and the estimate are, as diagnostic_msgs for a person and for a supervisor.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/node/output_messages.hpp"
#include "apps/node/sensor_inputs.hpp"
#include "apps/node/state_publisher.hpp"
#include "lab/doctor/description_watch.hpp"

namespace kilvo::node {

/// All that is known at one moment.
struct Condition {
  SteadyClock::time_point now;
  std::array<InputState, sensor_count> inputs;
  std::array<double, sensor_count> rates{};  // Hz, nominal
  std::optional<EstimateState> estimate;
  Statistics seen;
  std::string waiting_for;
  std::string base_waits_for;  // which joints, so that there is a pose of the base
  std::string legs_mismatch;   // why the legs' messages are not of this robot
  std::uint64_t clouds_given_up = 0;
  std::vector<lab::WrongDescription> wrong;  // what the data say against the description of the robot
};

/// One status of the estimate, one for each configured sensor; those that something is wrong with say what in their message.
std::vector<DiagnosticStatus> statuses(const Condition& condition);

/// What would make a supervisor look again: levels and the words of the estimate.
std::string essence(const std::vector<DiagnosticStatus>& statuses);

/// For how long nothing has come of a sensor, when that is too long, s.
std::optional<double> silence_of(const InputState& input, double rate, SteadyClock::time_point now);

}  // namespace kilvo::node
