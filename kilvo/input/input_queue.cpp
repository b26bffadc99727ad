#include "kilvo/input/input_queue.hpp"

#include <algorithm>
#include <iterator>

namespace kilvo {

InputQueue::InputQueue(const Robot& robot, std::array<bool, sensor_count> used, Duration max_wait, bool wait_for_images)
    : robot_(robot),
      used_(used),
      max_wait_(max_wait),
      wait_for_images_(wait_for_images),
      health_(robot),
      timeline_(used, max_wait, wait_for_images) {}

void InputQueue::push(Measurement m) {
  const Sensor s = sensor_of(m);
  if (!uses(s)) return refuse(s, Reason::not_used);
  const std::uint64_t restarts = clock_steps_.restarts();
  const auto off_clock = clock_steps_.follow(m);  // whatever it says, it has a time
  if (clock_steps_.restarts() > restarts) {
    first_of_next_ = Held{std::move(m), off_clock};
    return;
  }
  if (s == Sensor::imu) settle_doubted();
  if (off_clock == Reason::time_jump) {
    doubted_ = std::move(m);
  } else {
    admit(std::move(m), off_clock);
  }
}

// What the newest sample of the IMU says of the one before.
void InputQueue::settle_doubted() {
  if (auto before = std::exchange(doubted_, std::nullopt))
    admit(std::move(*before), clock_steps_.went_on() ? std::nullopt : std::optional(Reason::time_jump));
}

void InputQueue::admit(Measurement m, std::optional<Reason> off_clock) {
  const Sensor s = sensor_of(m);
  if (const auto fault = fault_of(m)) return refuse(s, *fault);
  if (off_clock) return refuse(s, *off_clock);
  if (auto* scan = std::get_if<LidarScan>(&m)) scan->offsets = offsets_of(*scan);
  if (const auto fault = health_.judge(m)) return refuse(s, *fault);
  std::visit([by = shift_[index_of(s)]](auto& what) { what.t += by; }, m);
  timeline_.push(std::move(m));
  std::ranges::copy(timeline_.take_refused(), std::back_inserter(refused_));
}

double InputQueue::shift_by(Sensor s, double by) {
  const double longest = to_seconds(max_wait_);  // later ones could not wait for those of their time
  Duration& shift = shift_[index_of(s)];
  const double total = std::clamp(to_seconds(shift) + by, -longest, longest);
  shift = from_seconds(total);
  return total;
}

void InputQueue::end() {
  if (doubted_) admit(*std::exchange(doubted_, std::nullopt), Reason::time_jump);
  timeline_.end();
  std::ranges::copy(timeline_.take_refused(), std::back_inserter(refused_));
}

InputQueue InputQueue::next_epoch() {
  InputQueue next(robot_, used_, max_wait_, wait_for_images_);
  next.clock_steps_ = clock_steps_;
  if (auto held = std::exchange(first_of_next_, std::nullopt)) next.admit(std::move(held->measurement), held->off_clock);
  return next;
}

}  // namespace kilvo
