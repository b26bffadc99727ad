// The newest value of one thread for one other: three slots, so that neither ever waits. What is not fetched before the next one is
// published is overwritten.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace kilvo::live {

template <class T>
class Handover {
 public:
  explicit Handover(const T& initial) : slots_{initial, initial, initial} {}

  /// For the writer: its own slot; publish() makes it the newest, and another one its own.
  T& back() { return slots_[back_]; }
  void publish() { back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & ~fresh; }

  /// For the reader: its own slot; fetch() makes the newest its own, if there is one that it has not had.
  T& front() { return slots_[front_]; }
  bool has_news() const { return (middle_.load(std::memory_order_acquire) & fresh) != 0; }
  bool fetch() {
    if (!has_news()) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & ~fresh;
    return true;
  }

 private:
  static constexpr std::uint32_t fresh = 4;
  std::array<T, 3> slots_;
  std::uint32_t back_ = 0, front_ = 1;
  std::atomic<std::uint32_t> middle_{2};
};

}  // namespace kilvo::live
