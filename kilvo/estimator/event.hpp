// What the estimator reports beside its states.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/reason.hpp"

namespace kilvo {

/// Something that became true at `t`.
struct Event {
  Time t{};
  std::optional<Sensor> sensor;  // none: of the estimate as a whole
  Reason reason = Reason::start;
  double value = 0;         // SI units; described by the text of the reason
  std::uint64_t count = 1;  // how often it has become true until now; of messages, how many
  std::string detail;       // details beside the value

  bool operator==(const Event&) const = default;
};

/// The sentence, with the sensor, the value and the count in it.
std::string text_of(const Event& event);

/// Collects events: each goes out when it becomes true, and again when its count has doubled.
class EventLog {
 public:
  /// It became true (again) at event.t; the count is kept here.
  void raise(Event event);
  /// The same of something that goes on: event.count is the total until now.
  void state(Event event);

  /// Those that have not gone out yet.
  std::vector<Event> take() { return std::exchange(news_, {}); }
  bool has_news() const { return !news_.empty(); }
  /// One for each sensor and reason, as it was last, in the order of their first appearance.
  const std::vector<Event>& all() const { return all_; }

 private:
  Event* find(const Event& event);

  std::vector<Event> all_, news_;
  std::vector<std::uint64_t> went_out_;  // by index in all_: its count when it went out last
};

}  // namespace kilvo
