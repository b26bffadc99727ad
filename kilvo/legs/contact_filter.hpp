// Which feet carry: a Bayes filter over the four states of a biped (both feet, the left one, the right one, none). What each cue looks like
// in each state is learnt from this robot while it walks; see docs/decisions/contact.md.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "kilvo/math/running_statistics.hpp"

namespace kilvo {

/// The contact cues of one leg sample, without units: lengths as shares of the leg's length l (height of the IMU over the lower
/// sole), speeds as shares of sqrt(g l), the forces as shares of the weight.
struct ContactCues {
  double dt = 0;                                // since the sample before, s
  std::array<double, 2> speed = {0, 0};         // of the point on which the foot would stand
  double known_velocity = 1;                    // 0 to 1: weight of the speeds, by how well the velocity of the body is known
  double height = 0;                            // of the left sole over the right one, along the normal of the ground
  double force_side = 0.5;                      // where the line of the specific force meets the ground: 0 at the right foot, 1 at the left
  double load = 1;                              // specific force
  std::array<bool, 2> impact = {false, false};  // the foot has just been stopped
};

class ContactFilter {
 public:
  enum State : std::size_t { both, left, right, none, states };
  /// From a state that is as probable as this its cues are learnt.
  static constexpr double sure_of_state = 0.8;
  static bool is_probable(double probability) { return probability > 0.5; }

  ContactFilter();

  void update(const ContactCues& cues);

  /// Of each state; they add up to 1.
  const std::array<double, states>& probabilities() const { return pi_; }
  /// That this foot carries: 0 left, 1 right.
  double carries(std::size_t side) const { return pi_[both] + pi_[side == 0 ? left : right]; }

  /// Speeds without unit, as learnt: of a supporting foot (median), of a swinging one, and what lies between.
  double stance_speed() const;
  double swing_speed() const;
  double threshold_speed() const;
  /// A supporting foot is slower than this for five samples out of six.
  double fast_stance() const;

  /// Of the weight, on the left foot while both stand: where the line of force lies between where it usually is on either.
  double share_of_left(double force_side) const;

  /// Forgets which feet stand, not what has been learnt.
  void restart();

 private:
  using Likelihood = std::array<double, states>;
  /// How long the supports of this robot last, and which foot lifts off next.
  class SupportTimes {
   public:
    void restart();
    /// One foot carried alone a moment ago.
    bool walks() const;
    /// Rate at which this state ends within the next dt (s, above zero), 1/s: by chance, or because the gait has come so far.
    double rate_of_leaving(State state, double dt) const;
    /// That it is the left foot which carries alone after both.
    double left_next() const;
    /// After each sample.
    void update(const std::array<double, states>& pi, double dt);

   private:
    void enter(State next);

    RunningStatistics double_{std::log(0.1), 0.7, 3, 10}, single_{std::log(0.4), 0.7, 3, 10};  // ln of s; the weights are steps
    State now_ = both, last_single_ = none;  // the last state that was sure, and the last foot that carried alone
    double in_now_ = 0, in_single_ = 0;      // s since now_ began, s that the single support before it took
    double since_single_ = 1e9;              // s
    double other_ = 0, same_ = 0;            // how often the other foot lifted off next, or the same one again
  };

  void add_speed(const ContactCues& cues, Likelihood& log) const;
  void add_height(double height, Likelihood& log) const;
  void add_force_side(double side, Likelihood& log) const;
  void add_impacts(const ContactCues& cues, Likelihood& log);
  void transit(double dt);
  void learn(const ContactCues& cues);
  double worth_of_impact() const;

  std::array<double, states> pi_;
  RunningStatistics stance_, swing_;                // ln of the speed
  RunningStatistics lifted_, level_;                // height of a swinging foot over the other; of two that stand
  RunningStatistics on_left_, on_right_, on_both_;  // where the line of force meets the ground
  SupportTimes times_;
  // How well impacts indicate touchdowns on this robot.
  struct Landing {
    bool stood = true, seen = false;  // seen: an impact has counted in this swing
    double since_impact = 1e9, since_touchdown = 1e9;
  };
  std::array<Landing, 2> landing_;
  double hits_ = 0, touchdowns_ = 0, false_impacts_ = 0, swing_time_ = 0;
};

}  // namespace kilvo
