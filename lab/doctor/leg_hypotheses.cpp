#include "lab/doctor/leg_hypotheses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/core.h>
#include <regex>
#include <sstream>

namespace kilvo::lab {
namespace {

LegHypothesis shifted(const std::vector<std::size_t>& joints, int by) {
  LegHypothesis h;
  h.cause = "joint_names_shifted";
  h.name = fmt::format("the joint names are shifted by one against the positions ({})",
                       by > 0 ? "each name belongs to the position after it" : "each name belongs to the position before it");
  h.setting = "the driver must publish each position under its own joint's name";
  h.names = [joints, by](std::vector<std::string>& names) {
    const std::vector<std::string> old = names;
    const auto n = static_cast<int>(joints.size());
    for (int i = 0; i < n; ++i) names[joints[static_cast<std::size_t>((i + by + n) % n)]] = old[joints[static_cast<std::size_t>(i)]];
  };
  return h;
}

// The places of all joints, by a factor.
std::string scaled(const std::string& urdf, double factor) {
  const std::regex pattern("(<origin[^>]*xyz\\s*=\\s*\")([^\"]*)\"");
  std::string out;
  auto from = urdf.cbegin();
  for (std::sregex_iterator it(urdf.begin(), urdf.end(), pattern), end; it != end; ++it) {
    out.append(from, (*it)[2].first);
    std::istringstream numbers((*it)[2].str());
    for (double x = 0; numbers >> x;) out += fmt::format("{} ", factor * x);
    from = (*it)[2].second;
  }
  return out.append(from, urdf.cend());
}

// Two joints of each leg exchanged: neighbours, or all others.
std::vector<LegHypothesis> exchanges(const LegSides& sides, bool neighbours) {
  std::vector<LegHypothesis> out;
  const std::vector<std::string> joints = sides.joints_of(0);
  for (std::size_t pair = 0; pair < joints.size() * joints.size(); ++pair) {
    const std::size_t k = pair / joints.size(), l = pair % joints.size();
    if (l <= k || (l == k + 1) != neighbours) continue;
    const std::string &a = joints[k], &b = joints[l];
    const std::string other_a = sides.other_joint(a), other_b = sides.other_joint(b);
    LegHypothesis h;
    h.cause = "joints_exchanged";
    h.name = fmt::format("the joints {} and {} are exchanged in the messages, in both legs", a, b);
    h.setting = "the driver must publish each position under its own joint's name";
    h.names = [a, b, other_a, other_b](std::vector<std::string>& all) {
      for (std::string& name : all) {
        if (name == a || name == b) {
          name = name == a ? b : a;
        } else if (name == other_a || name == other_b) {
          name = name == other_a ? other_b : other_a;
        }
      }
    };
    out.push_back(h);
  }
  return out;
}

// Several joints of one leg, or the same of both, turn the other way round: a leg that is mirrored, axes of another convention.
std::vector<LegHypothesis> sign_hypotheses(const std::vector<std::size_t>& joints, const std::vector<std::string>& names,
                                           const LegSides& sides) {
  std::array<std::vector<std::size_t>, 2> legs;
  for (const std::size_t i : joints) {
    const auto j = static_cast<std::size_t>(std::ranges::find(names, sides.other_joint(names[i])) - names.begin());
    if (j == names.size() || j == i || sides.leg_of_joint(names[i]) != 0) continue;
    legs[0].push_back(i);
    legs[1].push_back(j);
  }
  std::vector<LegHypothesis> out;
  constexpr std::size_t most = 7;  // joints of a leg
  const std::size_t n = legs[0].size();
  if (n > most) return out;
  for (unsigned set = 1; set < 1U << n; ++set) {
    for (unsigned which = 1; which <= 3; ++which) {  // the first leg, the second, both
      std::vector<std::size_t> turned;
      std::string text;
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t leg = 0; leg < 2; ++leg) {
          if ((set >> k & which >> leg & 1U) == 0) continue;
          turned.push_back(legs[leg][k]);
          text += (text.empty() ? "" : ", ") + names[turned.back()];
        }
      }
      if (turned.size() < 2) continue;  // one by itself is tried anyway
      LegHypothesis h;
      h.cause = "joint_sign";
      h.parts = turned.size();
      h.name = fmt::format("joints {} turn the other way round", text);
      h.setting = "the axes of these joints in robot.urdf, or their signs in the driver";
      h.position = [turned](std::size_t i, double& q) {
        if (std::ranges::find(turned, i) != turned.end()) q = -q;
      };
      out.push_back(h);
    }
  }
  return out;
}

}  // namespace

std::vector<LegHypothesis> gross_leg_hypotheses(RecordedLegs& legs, const Robot& robot) {
  std::vector<LegHypothesis> out;
  const std::vector<std::size_t> joints = legs.joints_that_matter(robot);
  const auto& names = legs.recorded().joint_names;
  LegHypothesis all;
  all.cause = "joint_sign";
  all.name = "all joints of the legs turn the other way round";
  all.setting = "the axes of the joints in robot.urdf, or their signs in the driver";
  all.position = [](std::size_t, double& q) { q = -q; };
  out.push_back(all);
  const LegSides sides = legs.sides(robot);
  for (LegHypothesis& h : sign_hypotheses(joints, names, sides)) out.push_back(std::move(h));
  for (LegHypothesis& h : exchanges(sides, false)) out.push_back(std::move(h));
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const std::size_t i = joints[k];
    // A joint that both legs hang on turns them as the IMU's mount does.
    if (!sides.leg_of_joint(names[i])) continue;
    for (const double turn : {90.0, -90.0, 180.0}) {
      LegHypothesis h;
      h.cause = "joint_offset";
      h.name = fmt::format("the zero of joint {} is off by {:.0f} degrees", names[i], turn);
      h.setting = fmt::format("the zero of joint {} in the driver, or its origin in robot.urdf", names[i]);
      h.position = [i, turn](std::size_t j, double& q) {
        if (j == i) q -= turn / 57.29577951308232;
      };
      out.push_back(h);
    }
    for (std::size_t l = k + 1; l < joints.size(); ++l) {
      const std::string a = names[i], b = names[joints[l]];
      if (sides.leg_of_joint(a) != sides.leg_of_joint(b) && sides.other_joint(a) != b) continue;
      LegHypothesis h;
      h.cause = "joints_exchanged";
      h.name = fmt::format("the joints {} and {} are exchanged in the messages", a, b);
      h.setting = "the driver must publish each position under its own joint's name";
      h.names = [a, b](std::vector<std::string>& every) {
        for (std::string& name : every) name = name == a ? b : name == b ? a : name;
      };
      out.push_back(h);
    }
  }
  return out;
}

LegHypothesis degrees_hypothesis() {
  LegHypothesis h;
  h.cause = "joint_unit";
  h.position = [](std::size_t, double& q) { q *= 0.017453292519943295; };
  return h;
}

LegHypothesis joined(const LegHypothesis& a, const LegHypothesis& b) {
  LegHypothesis out = b;
  if (a.robot) {
    out.robot = [f = a.robot, g = b.robot](Robot& r) {
      f(r);
      if (g) g(r);
    };
  }
  if (a.names) {
    out.names = [f = a.names, g = b.names](std::vector<std::string>& n) {
      f(n);
      if (g) g(n);
    };
  }
  if (a.position) {
    out.position = [f = a.position, g = b.position](std::size_t i, double& q) {
      f(i, q);
      if (g) g(i, q);
    };
  }
  return out;
}

std::vector<LegHypothesis> leg_hypotheses(RecordedLegs& legs, const Robot& robot) {
  std::vector<LegHypothesis> out;
  const std::vector<std::size_t> joints = legs.joints_that_matter(robot);
  const auto& names = legs.recorded().joint_names;
  const LegSides sides = legs.sides(robot);
  if (!sides.joints_of(0).empty()) {
    LegHypothesis h;
    h.cause = "joints_swapped";
    h.name = "the joints of the left and of the right leg are exchanged in the messages";
    h.setting = "the driver must publish each position under its own joint's name";
    h.names = [sides](std::vector<std::string>& all) {
      for (std::string& name : all) name = sides.other_joint(name);
    };
    out.push_back(h);
  }
  std::vector<std::size_t> every;
  for (std::size_t i = 0; i < names.size(); ++i) every.push_back(i);
  for (const int by : {1, -1}) {
    out.push_back(shifted(joints, by));
    if (joints.size() != every.size()) out.push_back(shifted(every, by));
  }
  for (LegHypothesis& h : exchanges(sides, true)) out.push_back(std::move(h));
  for (const std::string& link : link_names(robot.urdf)) {
    if (link == robot.imu.link || sides.leg_of_link(link)) continue;
    LegHypothesis h;
    h.cause = "imu_link";
    h.culprit = Sensor::imu;
    h.name = fmt::format("the IMU turns with link {}, not with link {}", link, robot.imu.link);
    h.setting = fmt::format("imu.T_link_imu.link: {}", link);
    h.changes = {{"imu.T_link_imu.link", link}};
    h.robot = [link](Robot& r) { r.imu.link = link; };
    out.push_back(h);
  }
  for (const std::size_t i : joints) {
    LegHypothesis h;
    h.cause = "joint_sign";
    h.name = fmt::format("joint {} turns the other way round", names[i]);
    h.setting = fmt::format("the axis of joint {} in robot.urdf, or its sign in the driver", names[i]);
    h.position = [i](std::size_t j, double& q) {
      if (j == i) q = -q;
    };
    out.push_back(h);
  }
  return out;
}

std::vector<LegHypothesis> foot_link_hypotheses(RecordedLegs& legs, const Robot& robot) {
  std::vector<LegHypothesis> out;
  const LegSides sides = legs.sides(robot);
  for (const std::string& left : link_names(robot.urdf)) {
    const std::string right = sides.other_link(left);
    // Each pair once; the feet's sides as they are described.
    if (sides.leg_of_link(left) != 0 || right == left || left == robot.feet[0].link) continue;
    LegHypothesis h;
    h.cause = "foot_link";
    h.name = fmt::format("the soles are on links {} and {}, not on {} and {}", left, right, robot.feet[0].link, robot.feet[1].link);
    h.setting = fmt::format("robot.feet: link: {} and {}", left, right);
    h.robot = [left, right](Robot& r) {
      r.feet[0].link = left;
      r.feet[1].link = right;
    };
    out.push_back(h);
  }
  return out;
}

std::vector<LegHypothesis> size_hypotheses() {
  std::vector<LegHypothesis> out;
  constexpr double step = 1.16;  // a tenth of the length still seems to stand
  for (int k = -6; k <= 6; ++k) {
    if (k == 0) continue;
    const double factor = std::pow(step, k);
    LegHypothesis h;
    h.cause = "leg_lengths";
    h.name = fmt::format("the robot of the URDF is too {}: one of {:.2f} times its size would fit", k > 0 ? "small" : "large", factor);
    h.setting = "robot.urdf: its lengths, in metres, or the URDF of this robot";
    h.robot = [factor](Robot& r) { r.urdf = scaled(r.urdf, factor); };
    out.push_back(h);
  }
  return out;
}

}  // namespace kilvo::lab
