// Settings that do to the messages of the legs what a hypothesis does, and whether any hypothesis explains how they turn.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "lab/doctor/examination.hpp"
#include "lab/doctor/joint_names.hpp"
#include "lab/doctor/leg_hypotheses.hpp"

namespace kilvo::lab {
namespace {

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

std::string text_of(const JointReading& read) {
  std::string out;
  const auto add = [&out](const std::string& entry) { out += (out.empty() ? "" : ", ") + entry; };
  if (!read.from.empty()) add(fmt::format(R"("from": {})", quoted(read.from)));
  if (read.sign < 0) add(fmt::format(R"("sign": {})", read.sign));
  if (read.zero != 0) add(fmt::format(R"("zero": {:.4f})", read.zero));
  return "{" + out + "}";
}

}  // namespace

std::vector<Change> changes_of(RecordedLegs& legs, const Robot& robot, const LegHypothesis& h) {
  if (!h.names && !h.position) return {};
  const std::vector<std::string> names = legs.recorded().joint_names;
  std::vector<std::string> then = names;
  if (h.names) h.names(then);
  std::map<std::string, JointReading> readings = robot.joints;
  Robot changed = robot;
  if (h.robot) h.robot(changed);
  for (const auto& [joint, read] : legs.names_of_joints(changed)) {
    const auto place = static_cast<std::size_t>(std::ranges::find(then, read) - then.begin());
    if (place >= names.size()) return {};
    JointReading& reading = readings[joint];
    reading.from = names[place] == joint ? "" : names[place];
    double zero = 0, one = 1;
    if (h.position) {
      h.position(place, zero);
      h.position(place, one);
    }
    const double direction = one - zero;
    if (std::abs(std::abs(direction) - 1) > 1e-9) return {};  // a unit is no sign
    reading.zero += reading.sign * zero;
    reading.sign *= direction > 0 ? 1 : -1;
  }
  return {change_of(readings)};
}

Change change_of(const std::map<std::string, JointReading>& readings) {
  std::string value;
  for (const auto& [joint, reading] : readings) {
    if (reading != JointReading{}) value += fmt::format("{}{}: {}", value.empty() ? "" : ", ", quoted(joint), text_of(reading));
  }
  return {"robot.joints", "{" + value + "}"};
}

std::string feet_text(const std::array<Foot, 2>& feet) {
  std::string out;
  for (const Foot& foot : feet) {
    std::string sole;
    for (const Eigen::Vector3d& p : foot.sole)
      sole += fmt::format("{}[{:.6g}, {:.6g}, {:.6g}]", sole.empty() ? "" : ", ", p.x(), p.y(), p.z());
    out +=
        fmt::format(R"({}{{"name": {}, "link": {}, "sole": [{}]}})", out.empty() ? "" : ", ", quoted(foot.name), quoted(foot.link), sole);
  }
  return "[" + out + "]";
}

bool Examination::legs_explain_turning(double share) {
  const GyroPath gyro_path = gyro();
  const Eigen::Matrix3d axes = robot_.imu.T_link_imu.R.inverse().matrix();
  const auto explains = [&](const std::vector<Turn>& turns, double offset) {
    return explained_by(turns, gyro_path, offset, axes) >= share;
  };
  const std::vector<double> offsets = likely_offsets(leg_turns_, gyro_path);
  if (std::ranges::any_of(offsets, [&](double offset) { return explains(leg_turns_, offset); })) return true;
  std::vector<LegHypothesis> all = leg_hypotheses(recorded_legs_, robot_);
  for (LegHypothesis& h : gross_leg_hypotheses(recorded_legs_, robot_)) all.push_back(std::move(h));
  return std::ranges::any_of(all, [&](const LegHypothesis& h) {
    if (h.culprit != Sensor::legs || h.parts > 2) return false;
    const std::vector<Turn> turns = leg_turns(legs_under(&h, turn_interval - 1e-4), turn_interval);
    return explains(turns, 0) || explains(turns, legs_.offset);
  });
}

void Examination::find_on_legs(Finding f, const LegHypothesis& h) {
  leg_mend_ = leg_mend_ ? joined(*leg_mend_, h) : h;
  for (const auto& [key, value] : h.changes) f.changes.push_back({key, value});
  if (h.names || h.position) {
    for (const Change& change : changes_of(recorded_legs_, robot_, *leg_mend_)) {
      f.remedy = fmt::format("{}: {}; or {}", change.key, change.value, f.remedy);
      f.changes.push_back(change);
    }
  }
  find(std::move(f));
}

// A driver that names its joints in a style of its own.
bool Examination::find_other_names(const std::string& evidence) {
  std::map<std::string, std::string> read;
  try {
    read = recorded_legs_.names_of_joints(robot_);
  } catch (const std::invalid_argument&) {
    return false;  // the URDF is none
  }
  std::map<std::string, JointReading> readings = robot_.joints;
  std::vector<std::string> wanted;
  for (const auto& [joint, name] : read) wanted.push_back(name);
  const std::map<std::string, std::string> names = matching_names(wanted, recorded_.joint_names);
  if (names.empty()) return false;
  for (const auto& [joint, name] : read) {
    if (const auto other = names.find(name); other != names.end()) readings[joint].from = other->second;
  }
  robot_.joints = readings;
  const Change change = change_of(readings);
  find({Sensor::legs,
        "joint_names",
        fmt::format("the messages name {} of the {} joints of the legs otherwise than the URDF: {} is {} there", names.size(), read.size(),
                    names.begin()->first, names.begin()->second),
        evidence,
        fmt::format("{}: {}", change.key, change.value),
        0,
        "",
        {change},
        true});
  return true;
}

}  // namespace kilvo::lab
