// What the legs say about the motion of the link that carries the IMU, under a hypothesis about their description.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "kilvo/legs/joint_chain.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "lab/doctor/leg_sides.hpp"
#include "lab/doctor/recorded.hpp"
#include "lab/doctor/turns.hpp"

namespace kilvo::lab {

/// A change of the description or of the messages that might mend the legs.
struct LegHypothesis {
  std::string name;     // for a person
  std::string setting;  // that mends it
  std::string cause;    // one word
  Sensor culprit = Sensor::legs;
  std::size_t parts = 1;                                              // that it changes
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

/// The legs of a recording, under any description: a URDF is read once.
class RecordedLegs {
 public:
  explicit RecordedLegs(const Recorded& recorded) : recorded_(recorded) {}
  const Recorded& recorded() const { return recorded_; }

  /// Empty, with the reason in `why`, when the description cannot be used with these messages. Thinned to `period` (s).
  std::vector<LegPose> path(const Robot& robot, const LegHypothesis* hypothesis, double period, std::string* why);
  /// The joints that move a foot when they turn, by their place in the messages.
  std::vector<std::size_t> joints_that_matter(const Robot& robot);
  /// The joints between the IMU's link and the feet, with their names in the messages.
  std::map<std::string, std::string> names_of_joints(const Robot& robot);
  /// None when the URDF cannot be used.
  LegSides sides(const Robot& robot);

 private:
  const LinkTree& tree(const Robot& robot);
  LegKinematics kinematics(const Robot& robot);

  const Recorded& recorded_;
  std::map<std::tuple<std::string, std::vector<std::string>, std::map<std::string, JointReading>>, LinkTree> trees_;
};

/// The link's turning while either foot stands.
std::vector<Turn> leg_turns(const std::vector<LegPose>& path, double interval);

}  // namespace kilvo::lab
