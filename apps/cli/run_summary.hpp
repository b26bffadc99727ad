// What is to be remembered of the outputs of a run once they are written.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "apps/live/latency.hpp"
#include "kilvo/estimator/output.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo::cli {

struct Quantiles {
  double p50 = 0, p99 = 0, max = 0;
  std::size_t n = 0;
};

/// How long the stages took, in an amount of memory that does not grow: quantiles to one part in a hundred.
class StageClock {
 public:
  void add(std::string_view stage, double microseconds);
  std::map<std::string, Quantiles> quantiles() const;
  /// Over all stages, microseconds; `contact` is a part of `kinematic` and not counted again.
  double total() const;

 private:
  struct Stage {
    live::Latency latency;
    double sum = 0;  // s
  };
  std::map<std::string, Stage, std::less<>> stages_;
};

struct StampedState {
  Time t{};
  SE3 T_WI;
};

class RunSummary {
 public:
  void add(const Output& output);
  void count_sweep() { ++sweeps_; }

  StageClock stages;
  std::map<std::string, std::uint64_t> degraded;  // sweeps and images that said too little, by sense

  std::size_t outputs() const { return outputs_; }
  std::size_t sweeps() const { return sweeps_; }
  const std::optional<StampedState>& first() const { return first_; }
  const std::optional<StampedState>& last() const { return last_; }
  /// From the first output to the last.
  double seconds() const { return first_ ? to_seconds(last_->t - first_->t) : 0; }
  /// Of the way through the sweeps, or through ten poses a second where there are none: jitter in between adds nothing.
  double path_length() const { return path_length_; }
  /// Touchdowns, left and right.
  const std::array<std::uint64_t, 2>& contact_events() const { return contact_events_; }
  double start_to_end() const { return first_ ? (last_->T_WI.p - first_->T_WI.p).norm() : 0; }
  const std::map<std::string, double>& modality_seconds() const { return modality_seconds_; }
  /// While the robot moved and neither LiDAR nor legs measured that: of output_seconds().
  double unmeasured_seconds() const { return unmeasured_; }
  /// Since LiDAR or legs measured the motion last; and of these, while the robot moved.
  double coasting_seconds_at_end() const { return coasting_at_end_; }
  double unmeasured_seconds_at_end() const { return unmeasured_at_end_; }
  double output_seconds() const { return output_seconds_; }
  /// Why the trajectory cannot be right; empty when nothing speaks against it.
  const std::string& absurdity() const { return absurdity_; }

 private:
  void judge(const Output& output);
  void count_seconds(const Output& output, double dt);
  void count_touchdowns(const Contacts& contacts);

  std::size_t outputs_ = 0, sweeps_ = 0;
  std::optional<StampedState> first_, last_, last_on_path_;
  double path_length_ = 0;
  std::map<std::string, double> modality_seconds_;
  double output_seconds_ = 0, unmeasured_ = 0, unmeasured_at_end_ = 0, coasting_at_end_ = 0;  // s, without gaps of the outputs
  std::string absurdity_;
  std::array<bool, 2> on_ = {true, true};
  std::array<std::uint64_t, 2> contact_events_ = {0, 0};
};

}  // namespace kilvo::cli
