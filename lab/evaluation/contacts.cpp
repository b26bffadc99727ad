#include "lab/evaluation/contacts.hpp"

#include <algorithm>
#include <cmath>

#include "lab/evaluation/csv_reader.hpp"
#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::lab {
namespace {

using Samples = std::span<const ContactSample>;

Duration median_period(Samples samples) {
  std::vector<Duration> periods;
  periods.reserve(samples.size());
  for (std::size_t i = 1; i < samples.size(); ++i) periods.push_back(samples[i].t - samples[i - 1].t);
  if (periods.empty()) return Duration{0};
  const auto median = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), median, periods.end());
  return *median;
}

/// How far apart two samples may be for what lies between them to be known.
Duration longest_bridge(Samples samples) { return std::max(10 * median_period(samples), Duration(std::chrono::milliseconds(100))); }

Time middle(Time a, Time b) { return a + (b - a) / 2; }

struct Window {
  Time begin{}, end{};
  bool holds(Time t) const { return begin <= t && t <= end; }
  Window widened(Duration by) const { return {begin - by, end + by}; }
};

/// Where the estimate has samples, and for how much of a window.
class Cover {
 public:
  explicit Cover(Samples samples) : samples_(samples), bridge_(longest_bridge(samples)) {}

  bool holds(Time t) const {
    const auto after = std::lower_bound(samples_.begin(), samples_.end(), t, [](const ContactSample& s, Time x) { return s.t < x; });
    if (after == samples_.end()) return false;
    return after->t == t || (after != samples_.begin() && after->t - std::prev(after)->t <= bridge_);
  }

  double share(const Window& window) const {
    Duration covered{0};
    for (std::size_t i = 1; i < samples_.size(); ++i) {
      const Time a = std::max(samples_[i - 1].t, window.begin), b = std::min(samples_[i].t, window.end);
      if (a < b && samples_[i].t - samples_[i - 1].t <= bridge_) covered += b - a;
    }
    return window.begin < window.end ? to_seconds(covered) / to_seconds(window.end - window.begin) : 0.0;
  }

 private:
  Samples samples_;
  Duration bridge_;
};

/// The walk in the truth; all of the truth when nothing is lifted and set down.
std::pair<Window, bool> window_of(Samples truth) {
  std::optional<Time> first_liftoff, last_touchdown;
  for (const Foot foot : {left_foot, right_foot}) {
    for (const Stance& stance : stances(truth, foot)) {
      if (stance.end && (!first_liftoff || *stance.end < *first_liftoff)) first_liftoff = stance.end;
      if (stance.begin && (!last_touchdown || *stance.begin > *last_touchdown)) last_touchdown = stance.begin;
    }
  }
  if (first_liftoff && last_touchdown && *first_liftoff < *last_touchdown) return {{*first_liftoff, *last_touchdown}, true};
  return {{truth.front().t, truth.back().t}, false};
}

void compare_samples(Samples estimate, Samples truth, const Window& window, Foot foot, FootEvaluation& result) {
  const Duration furthest = 2 * median_period(truth);
  std::size_t right = 0, swings = 0, false_contacts = 0, i = 0;
  for (const ContactSample& sample : estimate) {
    if (!window.holds(sample.t)) continue;
    while (i + 1 < truth.size() && std::chrono::abs(truth[i + 1].t - sample.t) <= std::chrono::abs(truth[i].t - sample.t)) ++i;
    if (std::chrono::abs(truth[i].t - sample.t) > furthest) continue;
    ++result.compared;
    right += sample.down[foot] == truth[i].down[foot] ? 1 : 0;
    swings += truth[i].down[foot] ? 0 : 1;
    false_contacts += sample.down[foot] && !truth[i].down[foot] ? 1 : 0;
  }
  if (result.compared > 0) result.accuracy = static_cast<double>(right) / static_cast<double>(result.compared);
  if (swings > 0) result.false_positive_rate = static_cast<double>(false_contacts) / static_cast<double>(swings);
}

/// An end of a stance: when, and of which stance.
struct Transition {
  Time t{};
  std::size_t stance = 0;
};

struct Match {
  std::size_t estimated = 0, truth = 0;  // indices of transitions
};

/// As many pairs as possible (the earliest with the earliest does that for sorted times), then each moved to a closer one still free.
std::vector<Match> match_transitions(const std::vector<Transition>& estimate, const std::vector<Transition>& truth) {
  std::vector<Match> matches;
  std::size_t e = 0, g = 0;
  while (e < estimate.size() && g < truth.size()) {
    const Duration late = estimate[e].t - truth[g].t;
    if (std::chrono::abs(late) <= contact_tolerance)
      matches.push_back({e++, g++});
    else
      ++(late < Duration{0} ? e : g);
  }
  const auto distance = [&](const Match& m) { return std::chrono::abs(estimate[m.estimated].t - truth[m.truth].t); };
  Match limit{estimate.size(), truth.size()};
  for (auto match = matches.rbegin(); match != matches.rend(); ++match) {
    for (Match later = *match; later.estimated < limit.estimated; ++later.estimated)
      if (distance(later) < distance(*match)) *match = later;
    for (Match later = *match; later.truth < limit.truth; ++later.truth)
      if (distance(later) < distance(*match)) *match = later;
    limit = *match;
  }
  return matches;
}

std::vector<Transition> transitions(const std::vector<Stance>& list, std::optional<Time> Stance::*side, const Window& window) {
  std::vector<Transition> found;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::optional<Time>& t = list[i].*side;
    if (t && window.holds(*t)) found.push_back({*t, i});
  }
  return found;
}

double error_ms(const Transition& estimated, const Transition& truth) { return 1e3 * to_seconds(estimated.t - truth.t); }

/// Does the estimated stance end in the middle of the true one? Its last quarter, 0.1 s at most, belongs to the lift-off.
bool ends_in_mid_contact(const Stance& estimated, const Stance& truth, const Window& window) {
  Time middle_end = window.end;
  if (truth.end) middle_end = std::min(middle_end, *truth.end - std::min(contact_tolerance, (*truth.end - *truth.begin) / 4));
  return estimated.end && *estimated.end < middle_end;
}

void compare_events(Samples estimate, Samples truth, const Window& window, Foot foot, const Cover& cover, FootEvaluation& result) {
  const std::vector<Stance> estimated_stances = stances(estimate, foot), true_stances = stances(truth, foot);
  const Window wide = window.widened(contact_tolerance);
  const auto known = [&](std::optional<Time> Stance::*side) {
    std::vector<Transition> all = transitions(true_stances, side, window);
    std::erase_if(all, [&](const Transition& transition) { return !cover.holds(transition.t); });
    return all;
  };
  const std::vector<Transition> touchdowns = transitions(estimated_stances, &Stance::begin, wide), true_touchdowns = known(&Stance::begin);
  result.true_events = true_touchdowns.size();
  result.uncovered = transitions(true_stances, &Stance::begin, window).size() - result.true_events;
  for (const Transition& touchdown : touchdowns) result.estimated_events += window.holds(touchdown.t) ? 1 : 0;
  for (const Match& match : match_transitions(touchdowns, true_touchdowns)) {
    const Transition &found = touchdowns[match.estimated], &real = true_touchdowns[match.truth];
    ++result.matched;
    if (!window.holds(found.t)) ++result.estimated_events;
    if (ends_in_mid_contact(estimated_stances[found.stance], true_stances[real.stance], window)) ++result.gaps;
    result.touchdown_errors_ms.push_back(error_ms(found, real));
  }
  result.correct = result.matched - result.gaps;
  result.missed = result.true_events - result.matched;
  result.extra = result.estimated_events - result.matched;

  const std::vector<Transition> liftoffs = transitions(estimated_stances, &Stance::end, wide), true_liftoffs = known(&Stance::end);
  for (const Match& match : match_transitions(liftoffs, true_liftoffs)) {
    result.liftoff_errors_ms.push_back(error_ms(liftoffs[match.estimated], true_liftoffs[match.truth]));
  }
}

std::string span_of(Samples samples) {
  if (samples.empty()) return "no samples";
  std::string text = std::to_string(samples.size()) + " samples from ";
  append_seconds(text, samples.front().t);
  text += " s to ";
  append_seconds(text, samples.back().t);
  return text + " s";
}

}  // namespace

std::vector<ContactSample> read_contacts(const std::filesystem::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t"), left = csv.column("left"), right = csv.column("right");
  std::vector<ContactSample> samples;
  while (csv.next()) {
    samples.push_back({csv.time(t), {csv.flag(left), csv.flag(right)}});
    if (samples.size() > 1 && samples.back().t < samples[samples.size() - 2].t) csv.fail("time goes backwards");
  }
  return samples;
}

std::vector<Stance> stances(std::span<const ContactSample> samples, Foot foot) {
  const Duration bridge = longest_bridge(samples);
  std::vector<Stance> found;
  bool down = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool connected = i > 0 && samples[i].t - samples[i - 1].t <= bridge;
    if (!connected) down = false;
    if (samples[i].down[foot] && !down) {
      found.emplace_back().first = samples[i].t;
      if (connected) found.back().begin = middle(samples[i - 1].t, samples[i].t);
    } else if (!samples[i].down[foot] && down) {
      found.back().end = middle(samples[i - 1].t, samples[i].t);
    }
    down = samples[i].down[foot];
    if (down) found.back().last = samples[i].t;
  }
  return found;
}

ContactEvaluation evaluate_contacts(std::span<const ContactSample> estimate, std::span<const ContactSample> truth) {
  const auto fail = [&](const std::string& why) {
    throw EvaluationError(why + " (estimate: " + span_of(estimate) + "; truth: " + span_of(truth) + ")");
  };
  const auto in_order = [](Samples s) {
    return std::is_sorted(s.begin(), s.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
  };
  if (!in_order(estimate) || !in_order(truth)) fail("the contacts are not in the order of time");
  if (truth.empty()) fail("there are no true contacts");
  const auto [window, walks] = window_of(truth);
  const Cover cover(estimate);
  ContactEvaluation result{window.begin, window.end, walks, cover.share(window), {}, 0, {}};
  double rates = 0;
  int feet_with_rate = 0;
  for (const Foot foot : {left_foot, right_foot}) {
    FootEvaluation& of_foot = result.feet[foot];
    compare_samples(estimate, truth, window, foot, of_foot);
    if (of_foot.compared == 0) fail("no estimated contact lies within the truth's walk");
    compare_events(estimate, truth, window, foot, cover, of_foot);
    result.accuracy += of_foot.accuracy / 2;
    if (of_foot.false_positive_rate) rates += *of_foot.false_positive_rate, ++feet_with_rate;
  }
  if (feet_with_rate > 0) result.false_positive_rate = rates / feet_with_rate;
  return result;
}

}  // namespace kilvo::lab
