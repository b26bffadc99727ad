#include "lab/messages/joint_assembly.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilvo::lab {
namespace {

// For so long parts wait for the others, and arms for the legs: controllers that are started together all speak by then.
constexpr Duration patience = std::chrono::seconds(1);

}  // namespace

std::optional<JointSample> JointAssembly::join(JointSample message, Time arrived) {
  if (!with_velocities_) message.velocity.clear();
  if (needed_.empty() || message.names.size() != message.position.size()) return message;
  if (message.names != names_) look_up(message.names);
  if (!legs_ || arrived < *legs_ || found_ > 0) legs_ = arrived;
  if (found_ == 0) return arrived - *legs_ > patience ? std::optional(std::move(message)) : std::nullopt;
  clear_unknown_velocities(message);
  comes_whole_ = comes_whole_ || found_ == needed_.size();
  if (comes_whole_) return message;
  note(message);
  // The one that came now stands for its part.
  const auto place = std::ranges::find_if(places_, [](const auto& p) { return p.has_value(); });
  const Duration interval = joints_[static_cast<std::size_t>(place - places_.begin())].interval;
  const auto newest = std::ranges::max(joints_, {}, &Joint::t).t;
  if (newest != given_ && is_whole(*newest, interval)) {
    whole_ = arrived;
    return sample(*newest);
  }
  if (!whole_ || arrived < *whole_) whole_ = arrived;
  if (arrived - *whole_ > patience) return message;
  return std::nullopt;
}

void JointAssembly::look_up(const JointNames& names) {
  names_ = names;
  places_.assign(needed_.size(), std::nullopt);
  found_ = 0;
  for (std::size_t i = 0; i < needed_.size(); ++i) {
    const auto it = std::ranges::find(names, needed_[i]);
    if (it == names.end()) continue;
    places_[i] = static_cast<std::size_t>(it - names.begin());
    ++found_;
  }
}

void JointAssembly::clear_unknown_velocities(JointSample& message) {
  if (knows_velocities_ || message.velocity.size() != message.position.size()) return;
  bool are_finite = true, moves = false;
  for (const auto& place : places_) {
    if (!place) continue;
    are_finite = are_finite && std::isfinite(message.velocity[*place]);
    moves = moves || message.velocity[*place] != 0;
  }
  knows_velocities_ = are_finite && moves;
  const auto before = std::exchange(last_positions_, message.position);
  const bool rests = are_finite && !moves && (before.empty() || before == message.position);
  if (!knows_velocities_ && !rests) message.velocity.clear();
}

void JointAssembly::note(const JointSample& part) {
  const bool with_velocity = part.velocity.size() == part.position.size(), with_effort = part.effort.size() == part.position.size();
  bool replaces = false;
  for (std::size_t i = 0; i < needed_.size(); ++i) {
    if (!places_[i]) continue;
    const std::size_t k = *places_[i];
    Joint& joint = joints_[i];
    replaces = replaces || (joint.t && !joint.is_used);
    const Duration since = joint.t ? part.t - *joint.t : Duration(0);
    const bool goes_on = since > Duration(0) && (joint.interval == Duration(0) || since <= 2 * joint.interval);
    joint.rate = with_velocity ? part.velocity[k] : goes_on ? (part.position[k] - joint.position) / to_seconds(since) : 0;
    // What was lost, or a pause, makes no longer interval.
    if (since > Duration(0))
      joint.interval += joint.interval == Duration(0) ? since : (std::min(since, 2 * joint.interval) - joint.interval) / 8;
    joint.t = part.t;
    joint.position = part.position[k];
    joint.velocity = with_velocity ? part.velocity[k] : 0;
    joint.effort = with_effort ? part.effort[k] : 0;
    joint.has_velocity = with_velocity;
    joint.has_effort = with_effort;
    joint.is_used = false;
  }
  unused_ += replaces ? 1 : 0;
}

// Parts of one rate are all new in each sample. Joints that come less often (a waist at 50 Hz) do not hold back the others.
//
// No value is used whose successor is due: a controller that has stopped must not be taken for one that measures. Due is what would come
// within a quarter of the shorter of both intervals. Of two parts of one rate there is always one at whose coming the other is no older
// than half an interval, so that none waits for ever, and a quarter is left to jitter.
bool JointAssembly::is_whole(Time newest, Duration interval) const {
  return std::ranges::all_of(joints_, [&](const Joint& joint) {
    const bool is_slow = 2 * joint.interval > 3 * interval;
    return joint.t && (!joint.is_used || is_slow) && newest - *joint.t <= joint.interval - std::min(joint.interval, interval) / 4;
  });
}

JointSample JointAssembly::sample(Time newest) {
  given_ = newest;
  JointSample out{newest, needed_, {}, {}, {}};
  const bool with_velocity = std::ranges::all_of(joints_, &Joint::has_velocity),
             with_effort = std::ranges::all_of(joints_, &Joint::has_effort);
  for (Joint& joint : joints_) {
    // Each as it is by then.
    const double age = to_seconds(newest - *joint.t);
    out.position.push_back(age > 0 ? joint.position + joint.rate * age : joint.position);
    if (with_velocity) out.velocity.push_back(joint.velocity);
    if (with_effort) out.effort.push_back(joint.effort);
    joint.is_used = true;
  }
  return out;
}

}  // namespace kilvo::lab
