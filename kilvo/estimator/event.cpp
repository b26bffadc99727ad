#include "kilvo/estimator/event.hpp"

#include <algorithm>

#include "kilvo/math/decimals.hpp"

namespace kilvo {
namespace {

void replace(std::string& text, const char* placeholder, const std::string& by) {
  const std::size_t place = text.find(placeholder);
  if (place != std::string::npos) text.replace(place, 2, by);
}

}  // namespace

std::string text_of(const Event& event) {
  const ReasonRow& row = row_of(event.reason);
  std::string text = row.text;
  replace(text, "{}", decimals(row.scale * event.value, row.digits));
  replace(text, "[]", event.detail);
  if (is_of_message(event.reason)) {
    const std::string cause = event.reason == Reason::clock_ahead
                                  ? "its clock is " + decimals(1e3 * event.value, 0) + " ms ahead of the IMU's"
                              : event.detail.empty() ? text
                                                     : event.detail;
    text = std::to_string(event.count) + " messages could not be used: " + cause;
  } else if (event.count > 1) {
    text += " (" + std::to_string(event.count) + " times)";
  }
  // Those of modalities name the sensor themselves.
  return event.sensor && !is_of_modality(event.reason) ? std::string(name_of(*event.sensor)) + ": " + text : text;
}

Event* EventLog::find(const Event& event) {
  const auto same = [&event](const Event& e) { return e.sensor == event.sensor && e.reason == event.reason; };
  const auto known = std::ranges::find_if(all_, same);
  return known == all_.end() ? nullptr : &*known;
}

void EventLog::raise(Event event) {
  const Event* known = find(event);
  event.count = known == nullptr ? 1 : known->count + 1;
  state(std::move(event));
}

void EventLog::state(Event event) {
  constexpr std::uint64_t each = 8;  // so many go out one by one
  Event* known = find(event);
  if (known == nullptr) {
    all_.push_back(event);
    went_out_.push_back(event.count);
    news_.push_back(std::move(event));
    return;
  }
  *known = event;
  std::uint64_t& last = went_out_[static_cast<std::size_t>(known - all_.data())];
  if (event.count <= last || (event.count > each && event.count < 2 * last)) return;
  last = event.count;
  news_.push_back(std::move(event));
}

}  // namespace kilvo
