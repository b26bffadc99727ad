// When a support ends: the hazard of a log-logistic distribution of the times that supports last on this robot.
#include <algorithm>
#include <numbers>

#include "kilvo/legs/contact_filter.hpp"

namespace kilvo {
namespace {

// Besides when the gait ends it, a state ends by chance at this rate, 1/s.
constexpr double rate_by_chance = 4;
// Both feet belong to a walk for so long after one of them carried alone, s.
constexpr double within_walk = 0.5;

}  // namespace

void ContactFilter::SupportTimes::restart() {
  now_ = both;
  last_single_ = none;
  since_single_ = 1e9;
}

bool ContactFilter::SupportTimes::walks() const { return since_single_ < within_walk; }

double ContactFilter::SupportTimes::rate_of_leaving(State state, double dt) const {
  if (state != now_ || state == none || !walks()) return rate_by_chance;
  const RunningStatistics& time = state == both ? double_ : single_;
  const double shape = std::numbers::pi / std::numbers::sqrt3 / std::max(0.1, time.sigma());  // no gait is trusted to be more regular
  const double passed = in_now_ + dt;
  return rate_by_chance + shape / passed / (1 + std::pow(passed / std::exp(time.mean()), -shape));
}

double ContactFilter::SupportTimes::left_next() const {
  const double other = (other_ + 1) / (other_ + same_ + 2);
  return last_single_ == none || !walks() ? 0.5 : last_single_ == right ? other : 1 - other;
}

void ContactFilter::SupportTimes::update(const std::array<double, states>& pi, double dt) {
  if (dt <= 0) return;
  in_now_ += dt;
  since_single_ += dt;
  const auto next = static_cast<State>(std::max_element(pi.begin(), pi.end()) - pi.begin());
  if (next != now_ && pi[next] > sure_of_state) enter(next);
  if (pi[left] > sure_of_state || pi[right] > sure_of_state) since_single_ = 0;
}

// A foot that was down for a moment only has not ended its swing.
void ContactFilter::SupportTimes::enter(State next) {
  const bool known = last_single_ != none && walks(), again = known && next == last_single_, is_single = next == left || next == right;
  if (now_ == left || now_ == right) in_single_ = in_now_;
  if (is_single && known) {
    other_ = 0.9 * other_ + !again;  // of the last ten, as the times
    same_ = 0.9 * same_ + again;
    if (!again) single_.add(std::log(in_single_), 1);
    if (!again && now_ == both) double_.add(std::log(in_now_), 1);
  }
  if (is_single) last_single_ = next;
  in_now_ = again ? in_now_ + in_single_ : 0;
  now_ = next;
}

}  // namespace kilvo
