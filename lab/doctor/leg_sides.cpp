#include "lab/doctor/leg_sides.hpp"

#include <algorithm>
#include <regex>

namespace kilvo::lab {

LegSides::LegSides(const LinkTree& tree, const Robot& robot) {
  const auto joints_to = [&](const std::string& link) { return tree.chain(tree.root(), link).names; };
  const std::vector<std::string> first = joints_to(robot.feet[0].link), second = joints_to(robot.feet[1].link);
  const auto parted = static_cast<std::size_t>(std::ranges::mismatch(first, second).in1 - first.begin());
  if (parted >= first.size() || parted >= second.size()) return;
  for (const std::string& link : link_names(robot.urdf)) {
    if (!tree.has(link)) continue;
    const std::vector<std::string> joints = joints_to(link);
    if (joints.size() <= parted) continue;
    for (std::size_t leg = 0; leg < 2; ++leg) {
      if (joints[parted] != (leg == 0 ? first : second)[parted]) continue;
      links_[leg].push_back({joints.size() - parted, link});
      for (std::size_t i = parted; i < joints.size(); ++i) {
        if (leg_of(joints_, joints[i]) != leg) joints_[leg].push_back({i + 1 - parted, joints[i]});
      }
    }
  }
  for (Parts* parts : {&joints_, &links_}) {
    for (auto& leg : *parts) std::ranges::stable_sort(leg, {}, &Part::depth);
  }
}

std::optional<std::size_t> LegSides::leg_of(const Parts& parts, const std::string& name) {
  for (std::size_t leg = 0; leg < 2; ++leg) {
    if (std::ranges::find(parts[leg], name, &Part::name) != parts[leg].end()) return leg;
  }
  return std::nullopt;
}

std::optional<std::size_t> LegSides::leg_of_joint(const std::string& name) const { return leg_of(joints_, name); }
std::optional<std::size_t> LegSides::leg_of_link(const std::string& name) const { return leg_of(links_, name); }

std::string LegSides::other(const Parts& parts, const std::string& name) {
  const auto leg = leg_of(parts, name);
  if (!leg) return name;
  const auto &own = parts[*leg], &theirs = parts[1 - *leg];
  const auto at = std::ranges::find(own, name, &Part::name);
  const auto same_depth = [&](const std::vector<Part>& all) { return std::ranges::find(all, at->depth, &Part::depth); };
  // Of several as deep, the one that is written in the same order.
  auto twin = same_depth(theirs);
  for (auto before = same_depth(own); before != at && twin != theirs.end(); ++before) ++twin;
  return twin != theirs.end() && twin->depth == at->depth ? twin->name : name;
}

std::vector<std::string> LegSides::joints_of(std::size_t leg) const {
  std::vector<std::string> out;
  for (const Part& part : joints_.at(leg)) out.push_back(part.name);
  return out;
}

std::vector<std::string> link_names(const std::string& urdf) {
  constexpr std::size_t most = 200;  // no robot has more, and each is tried
  std::vector<std::string> out;
  const std::regex pattern("<link\\s+name\\s*=\\s*\"([^\"]+)\"");
  for (std::sregex_iterator it(urdf.begin(), urdf.end(), pattern), end; it != end && out.size() < most; ++it) out.push_back((*it)[1]);
  return out;
}

}  // namespace kilvo::lab
