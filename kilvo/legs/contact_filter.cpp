#include "kilvo/legs/contact_filter.hpp"

#include <algorithm>
#include <cmath>
namespace kilvo {
namespace {

constexpr double prior_time = 1.0, memory = 3.0;  // s of support, of learning
// Samples closer together than this count as one, s.
constexpr double correlation = 0.005;
// Largest log-likelihood of one cue: it may be wrong for a reason that is not modelled.
constexpr double most_of_speed = 6, most_of_others = 4;
// A robot at rest is not slower than this, in ln.
constexpr double slowest = 0.002;
// An impact counts for so long, s; without any knowledge it comes by chance so often within a swing of a second.
constexpr double impact_time = 0.05, chance = 0.02, most_of_impact = 6;
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
      on_both_(0.5, 0.4, prior_time, memory) {
  restart();
}

void ContactFilter::restart() {
  pi_ = {0.7, 0.15, 0.15, 0};
  landing_ = {};
  times_.restart();
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

void ContactFilter::transit(double dt) {
  const auto leaving = [&](State state) { return pi_[state] * std::min(0.5, times_.rate_of_leaving(state, dt) * dt); };
  const double b = leaving(both), l = leaving(left), r = leaving(right), n = leaving(none), next = times_.left_next();
  const Likelihood flight = {0.1 * b, 0.1 * l, 0.1 * r, 0};
  pi_[both] += 0.9 * (l + r + n) - b - flight[both];
  pi_[left] += next * b + 0.1 * r + 0.05 * n - l - flight[left];
  pi_[right] += (1 - next) * b + 0.1 * l + 0.05 * n - r - flight[right];
  pi_[none] += flight[both] + flight[left] + flight[right] - n;
}

void ContactFilter::update(const ContactCues& cues) {
  if (cues.dt > 0) transit(cues.dt);
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
  times_.update(pi_, cues.dt);
  learn(cues);
}

// From a foot that carries alone: what a supporting foot does while the other swings (the paper's S_sw). Standing teaches nothing.
void ContactFilter::learn(const ContactCues& cues) {
  for (std::size_t side = 0; side < 2; ++side) {
    const double p = pi_[side == 0 ? left : right];
    if (p <= sure_of_state) continue;
    const double weight = p * cues.dt;
    (side == 0 ? on_left_ : on_right_).add(cues.force_side, weight);
    lifted_.add(side == 0 ? -cues.height : cues.height, weight);
    if (cues.known_velocity < 0.5) continue;
    stance_.add(std::log(cues.speed[side] + slowest), weight);
    swing_.add(std::log(cues.speed[1 - side] + slowest), weight);
  }
  if (pi_[both] > sure_of_state && times_.walks()) {
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
