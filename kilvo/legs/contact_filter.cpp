#include "kilvo/legs/contact_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
namespace kilvo {
namespace {

constexpr double prior_time = 1.0, memory = 3.0;  // s of support, of learning
// Samples closer together than this count as one, s.
constexpr double correlation = 0.005;
// Both feet belong to a walk for so long after one of them carried alone, s.
constexpr double within_walk = 0.5;
// Largest log-likelihood of one cue: it may be wrong for a reason that is not modelled.
constexpr double most_of_speed = 6, most_of_others = 4;
// A robot at rest is not slower than this, in ln.
constexpr double slowest = 0.002;
// An impact counts for so long, s; without any knowledge it comes by chance so often within a swing of a second.
constexpr double impact_time = 0.05, chance = 0.02, most_of_impact = 6;
// A state ends by chance at this rate, 1/s, besides when the gait ends it.
constexpr double rate_of_change = 4;
// Times of support: counts of the prior and of what is remembered.
constexpr double prior_steps = 3, remembered_steps = 10;
// Where the line of force meets the ground on either foot is this far apart at least, of the distance of the feet.
constexpr double least_apart = 0.6;
constexpr double weightless = 0.2, half_weight = 0.5;

double square(double x) { return x * x; }
// Log-likelihood of a deviation to one side of a mean; on the other side all is equally likely.
double above(double off, const double sigma) { return -0.5 * square(std::max(0.0, off) / sigma) - std::log(sigma); }
double both_sides(double off, double sigma) { return -0.5 * square(off / sigma) - std::log(sigma); }

// The bounds of what is learnt: the order of the states must stay what it is.
struct Speeds {
  double stance, stance_sigma, swing, swing_sigma;
};
Speeds speeds_of(const RunningStatistics& stance, const RunningStatistics& swing) {
  const double s = std::clamp(stance.mean(), std::log(0.004), std::log(0.1));
  return {s, std::clamp(stance.sigma(), 0.35, 1.2), std::max(swing.mean(), s + std::log(3.0)), std::clamp(swing.sigma(), 0.35, 1.2)};
}

}  // namespace

ContactFilter::ContactFilter()
    : stance_(std::log(0.02), 0.7, prior_time, memory),
      swing_(std::log(0.15), 0.7, prior_time, memory),
      lifted_(0.03, 0.03, prior_time, memory),
      level_(0, 0.015, prior_time, memory),
      on_left_(1, 0.4, prior_time, memory),
      on_right_(0, 0.4, prior_time, memory),
      on_both_(0.5, 0.4, prior_time, memory),
      double_(std::log(0.1), 0.7, prior_steps, remembered_steps),
      single_(std::log(0.4), 0.7, prior_steps, remembered_steps) {
  restart();
}

void ContactFilter::restart() {
  pi_ = {0.7, 0.15, 0.15, 0};
  landing_ = {};
  since_support_ = 1e9;
  support_ = both;
  last_single_ = none;
}

double ContactFilter::stance_speed() const { return std::exp(speeds_of(stance_, swing_).stance); }
double ContactFilter::swing_speed() const { return std::exp(speeds_of(stance_, swing_).swing); }
double ContactFilter::threshold_speed() const { return std::sqrt(stance_speed() * swing_speed()); }
double ContactFilter::fast_stance() const {
  const Speeds s = speeds_of(stance_, swing_);
  return std::exp(s.stance + s.stance_sigma);
}

void ContactFilter::add_speed(const ContactCues& cues, Likelihood& log) const {
  const Speeds s = speeds_of(stance_, swing_);
  for (std::size_t side = 0; side < 2; ++side) {
    const double x = std::log(cues.speed[side] + slowest);
    const double stands = above(x - s.stance, s.stance_sigma), swings = above(s.swing - x, s.swing_sigma);
    double evidence = cues.known_velocity * std::clamp(stands - swings, -most_of_speed, most_of_speed);
    if (landing_[side].stood && landing_[side].seen && landing_[side].since_touchdown < impact_time) evidence = std::max(0.0, evidence);
    log[both] += evidence;
    log[side == 0 ? left : right] += evidence;
  }
}

void ContactFilter::add_height(double height, Likelihood& log) const {
  const double m = std::max(0.005, lifted_.mean()), s = std::max(0.01, lifted_.sigma()), level = std::max(0.004, level_.sigma());
  const double r = above(m - height, s), l = above(m + height, s), b = both_sides(height, level);
  const double most = std::max({r, l, b});
  log[right] += std::max(-most_of_others, r - most);
  log[left] += std::max(-most_of_others, l - most);
  log[both] += std::max(-most_of_others, b - most);
}

double ContactFilter::share_of_left(double force_side) const {
  const double apart = std::max(least_apart, on_left_.mean() - on_right_.mean());
  const double middle = 0.5 * (on_left_.mean() + on_right_.mean());
  return std::clamp(0.5 + (force_side - middle) / apart, 0.0, 1.0);
}

void ContactFilter::add_force_side(double side, Likelihood& log) const {
  constexpr double least_sigma = 0.15;
  const double middle = 0.5 * (on_left_.mean() + on_right_.mean());
  const double apart = std::max(least_apart, on_left_.mean() - on_right_.mean());
  const double l = above(middle + 0.5 * apart - side, std::max(least_sigma, on_left_.sigma()));
  const double r = above(side - (middle - 0.5 * apart), std::max(least_sigma, on_right_.sigma()));
  const double b = both_sides(side - on_both_.mean(), std::max(least_sigma, on_both_.sigma()));
  const double most = std::max({l, r, b});
  log[left] += std::max(-most_of_others, l - most);
  log[right] += std::max(-most_of_others, r - most);
  log[both] += std::max(-most_of_others, b - most);
}

// Counted on this robot: how many touchdowns began with an impact, against how often one comes within a swing.
double ContactFilter::worth_of_impact() const {
  const double of_touchdowns = (hits_ + 1) / (touchdowns_ + 2), of_swings = (false_impacts_ + 1) / (swing_time_ + 1) * chance;
  return std::clamp(std::log(of_touchdowns / of_swings), 0.0, most_of_impact);
}

// Once per swing.
void ContactFilter::add_impacts(const ContactCues& cues, Likelihood& log) {
  for (std::size_t side = 0; side < 2; ++side) {
    Landing& foot = landing_[side];
    foot.since_impact += cues.dt;
    foot.since_touchdown += cues.dt;
    if (!foot.stood && !foot.seen && cues.impact[side]) {
      foot.seen = true;
      foot.since_impact = 0;
      const double worth = worth_of_impact();
      log[both] += worth;
      log[side == 0 ? left : right] += worth;
    }
  }
}

// By chance, or because the gait has come so far: the hazard of a log-logistic distribution of the times that this robot's supports last.
double ContactFilter::rate_of_leaving(State state) const {
  if (state != support_ || state == none || since_support_ > within_walk) return rate_of_change;
  const RunningStatistics& time = state == both ? double_ : single_;
  const double shape = std::numbers::pi / std::numbers::sqrt3 / time.sigma();
  const double passed = std::pow(in_support_ / std::exp(time.mean()), shape);
  return rate_of_change + shape / std::max(correlation, in_support_) * passed / (1 + passed);
}

void ContactFilter::transit(double dt) {
  const auto share = [&](State state) { return std::min(0.5, rate_of_leaving(state) * dt); };
  const auto [b, l, r, n] = pi_;
  const double from_b = b * share(both), from_l = l * share(left), from_r = r * share(right), from_n = n * share(none);
  const double flight = 0.1 * std::min(0.5, rate_of_change * dt), other = (others_ + 1) / (others_ + same_ + 2);
  const double to_left = last_single_ == none || since_support_ > within_walk ? 0.5 : last_single_ == right ? other : 1 - other;
  pi_[both] = b * (1 - flight) - from_b + 0.9 * (from_l + from_r + from_n);
  pi_[left] = l * (1 - flight) - from_l + to_left * from_b + 0.1 * from_r + 0.05 * from_n;
  pi_[right] = r * (1 - flight) - from_r + (1 - to_left) * from_b + 0.1 * from_l + 0.05 * from_n;
  pi_[none] = n - from_n + flight * (b + l + r);
}

// How long each support lasts, and which foot lifts off after it. A foot that was down for a moment only has not ended its swing.
void ContactFilter::time_support(double dt) {
  in_support_ += dt;
  const State next = static_cast<State>(std::max_element(pi_.begin(), pi_.end()) - pi_.begin());
  if (next == support_ || pi_[next] < sure_of_state) return;
  const bool walks = last_single_ != none && since_support_ < within_walk, again = walks && next == last_single_;
  if (next == both) {
    single_time_ = in_support_;
  } else if (next != none) {
    if (walks) {
      const double kept = 1 - 1 / remembered_steps;
      others_ = kept * others_ + !again;
      same_ = kept * same_ + again;
    }
    if (walks && !again) {
      single_.add(std::log(std::max(correlation, support_ == both ? single_time_ : in_support_)), 1);
      if (support_ == both) double_.add(std::log(std::max(correlation, in_support_)), 1);
    }
    last_single_ = next;
  }
  in_support_ = again ? in_support_ + single_time_ : 0;
  support_ = next;
}

void ContactFilter::update(const ContactCues& cues) {
  transit(cues.dt);
  Likelihood log{};
  add_speed(cues, log);
  add_height(cues.height, log);
  add_force_side(cues.force_side, log);
  log[none] += -0.5 * square(cues.load / weightless) - (cues.load < half_weight ? 0 : 20);
  const double share = std::min(1.0, cues.dt / correlation);
  for (double& l : log) l *= share;
  add_impacts(cues, log);
  const double most = *std::max_element(log.begin(), log.end());
  double sum = 0;
  constexpr double floor = 1e-9;
  for (std::size_t k = 0; k < states; ++k) sum += pi_[k] = std::max(floor, pi_[k] * std::exp(log[k] - most));
  for (double& p : pi_) p /= sum;
  time_support(cues.dt);
  learn(cues);
}

// From a foot that carries alone: what a supporting foot does while the other swings (the paper's S_sw). Standing teaches nothing.
void ContactFilter::learn(const ContactCues& cues) {
  since_support_ += cues.dt;
  for (std::size_t side = 0; side < 2; ++side) {
    const double p = pi_[side == 0 ? left : right];
    if (p <= sure_of_state) continue;
    since_support_ = 0;
    const double weight = p * cues.dt;
    (side == 0 ? on_left_ : on_right_).add(cues.force_side, weight);
    lifted_.add(side == 0 ? -cues.height : cues.height, weight);
    if (cues.known_velocity < 0.5) continue;
    stance_.add(std::log(cues.speed[side] + slowest), weight);
    swing_.add(std::log(cues.speed[1 - side] + slowest), weight);
  }
  if (pi_[both] > sure_of_state && since_support_ < within_walk) {
    level_.add(cues.height, pi_[both] * cues.dt);
    on_both_.add(cues.force_side, pi_[both] * cues.dt);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    Landing& foot = landing_[side];
    const bool stands = is_probable(carries(side));
    if (!stands) swing_time_ += cues.dt;
    if (!stands && foot.stood) foot.seen = false;
    if (stands && !foot.stood) {
      foot.since_touchdown = 0;
      touchdowns_ += 1;
      if (foot.seen && foot.since_impact <= impact_time) hits_ += 1;
    }
    if (foot.seen && !stands && foot.since_impact > impact_time) {
      false_impacts_ += 1;
      foot.seen = false;
    }
    foot.stood = stands;
  }
}

}  // namespace kilvo
