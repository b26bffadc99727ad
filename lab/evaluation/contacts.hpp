// Estimated against true contacts of two feet: what `kilvo eval-contacts` prints.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/evaluation/align.hpp"

namespace kilvo::lab {

enum Foot : std::size_t { left_foot = 0, right_foot = 1 };
inline constexpr std::array<const char*, 2> foot_names{"left", "right"};

struct ContactSample {
  Time t{};
  std::array<bool, 2> down{};  // left, right
};

/// The columns `t`, `left` and `right` (0 or 1) of a table, whatever else it has. Throws CsvError, also when time goes backwards.
std::vector<ContactSample> read_contacts(const std::filesystem::path& path);

/// One stance of a foot: on the ground from `begin` to before `end`. A transition lies in the middle between the samples around it, so that
/// two sampling rates do not look like a delay. What was already so at the first sample, or is still so at the last, has no such end.
struct Stance {
  std::optional<Time> begin, end;
  Time first{}, last{};  // of its samples
};
std::vector<Stance> stances(std::span<const ContactSample> samples, Foot foot);

/// How far from a true transition the estimated one may be.
inline constexpr Duration contact_tolerance = std::chrono::milliseconds(100);

struct FootEvaluation {
  std::size_t compared = 0;                   // samples of the estimate
  double accuracy = 0;                        // share (0..1) of them that are as the truth
  std::optional<double> false_positive_rate;  // share (0..1) said to be in contact of those that truly are not; nothing when there are none

  // An event is a touchdown. An estimated and a true one at most 100 ms apart are matched, each with one at most.
  std::size_t true_events = 0;       // within the window, where the estimate has samples
  std::size_t estimated_events = 0;  // within the window, and those matched up to 100 ms outside
  std::size_t matched = 0;
  std::size_t gaps = 0;       // matched, but the stance is interrupted or ends in mid-contact
  std::size_t correct = 0;    // matched - gaps
  std::size_t missed = 0;     // true_events - matched
  std::size_t extra = 0;      // estimated_events - matched
  std::size_t uncovered = 0;  // true ones where the estimate has no samples (legs lost); not among true_events

  std::vector<double> touchdown_errors_ms;  // estimated minus true, of the matched: positive is late
  std::vector<double> liftoff_errors_ms;    // the same of lift-offs, matched in the same way
};

struct ContactEvaluation {
  Time begin{}, end{};  // window: from the first true lift-off of either foot to the last true touchdown of either
  bool walks = false;   // false: the truth never lifts a foot and sets it down again; then the window is all the truth
  double coverage = 0;  // share (0..1) of the window in which the estimate has samples
  std::array<FootEvaluation, 2> feet;

  double accuracy = 0;                        // mean of the feet
  std::optional<double> false_positive_rate;  // mean of the feet that have one
};

/// Each sample of the estimate is compared with the truth's sample nearest in time, if that is at most two median periods of the truth
/// away. Between samples further apart than 0.1 s and ten median periods nothing is known: no event, no coverage. Both must be in the order
/// of time. Throws EvaluationError when nothing can be compared.
ContactEvaluation evaluate_contacts(std::span<const ContactSample> estimate, std::span<const ContactSample> truth);

/// Of the transition errors: quantiles, and early and late ones apart. ms; an error of zero is neither early nor late.
struct TransitionErrors {
  std::size_t n = 0, early = 0, late = 0;
  double min = 0, p5 = 0, p50 = 0, p95 = 0, max = 0;
  double mean_early = 0, mean_late = 0;  // 0 when there are none
};
TransitionErrors distribution(std::vector<double> errors_ms);

/// One JSON object: the members' names; feet under `left` and `right`; rates not known are null.
std::string to_json(const ContactEvaluation& evaluation);
/// A few lines for people, ending with a newline.
std::string to_text(const ContactEvaluation& evaluation);

}  // namespace kilvo::lab
