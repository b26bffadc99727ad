// What may be wrong with the description of legs or with their messages: changes that a recording can be tried with.
#pragma once

#include "lab/doctor/finding.hpp"
#include "lab/doctor/leg_path.hpp"

namespace kilvo::lab {

/// Names that are exchanged or shifted, joints that turn the other way.
std::vector<LegHypothesis> leg_hypotheses(RecordedLegs& legs, const Robot& robot);

/// Zeros that are off by a quarter of a turn, joints of one leg that are exchanged, several signs: many, for legs that make no sense
/// otherwise.
std::vector<LegHypothesis> gross_leg_hypotheses(RecordedLegs& legs, const Robot& robot);

/// Joint positions are in degrees.
LegHypothesis degrees_hypothesis();

/// Both, the first one first.
LegHypothesis joined(const LegHypothesis& a, const LegHypothesis& b);

/// robot.joints that does to the messages what the hypothesis does; nothing when it leaves them alone, or is about their unit.
std::vector<Change> changes_of(RecordedLegs& legs, const Robot& robot, const LegHypothesis& h);
Change change_of(const std::map<std::string, JointReading>& readings);
/// As robot.feet has it.
std::string feet_text(const std::array<Foot, 2>& feet);

/// A robot of another size: all distances between its joints by one factor, 0.4 to 2.5.
std::vector<LegHypothesis> size_hypotheses();

/// The soles on other links of both legs.
std::vector<LegHypothesis> foot_link_hypotheses(RecordedLegs& legs, const Robot& robot);

}  // namespace kilvo::lab
