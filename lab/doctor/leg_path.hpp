// What the legs say about the motion of the link that carries the IMU, under a hypothesis about their description.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/legs/leg_kinematics.hpp"
#include "lab/doctor/recorded.hpp"
#include "lab/doctor/turns.hpp"

namespace kilvo::lab {

/// A change of the description or of the messages that might mend the legs.
struct LegHypothesis {
  std::string name;     // for a person
  std::string setting;  // that mends it
  std::string cause;    // one word
  Sensor culprit = Sensor::legs;
  std::vector<std::pair<std::string, std::string>> changes;           // settings and values that mend it
  std::function<void(Robot&)> robot;                                  // may be empty
  std::function<void(std::vector<std::string>&)> names;               // may be empty
  std::function<void(std::size_t joint, double& position)> position;  // may be empty
};

/// Both feet as the link sees them.
struct LegPose {
  double t = 0;
  std::array<FootPose, 2> foot;  // in the link's frame: R_IF and p are of the link, not of the IMU
};

/// Empty, with the reason in `why`, when the description cannot be used with these messages. Thinned to `period` (s).
std::vector<LegPose> leg_path(const Recorded& recorded, const Robot& robot, const LegHypothesis* hypothesis, double period,
                              std::string* why);

/// The link's turning while either foot stands.
std::vector<Turn> leg_turns(const std::vector<LegPose>& path, double interval);

}  // namespace kilvo::lab
