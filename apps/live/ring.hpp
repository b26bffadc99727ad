// What one thread hands to one other, in order, through slots that are used again: no lock, and no allocation as long as what is written
// into a slot fits what was there before.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace kilvo::live {

template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : slots_(capacity) {}

  /// For the writer: the slot to write into, nullptr when all are full; then push() hands it over.
  T* vacant() {
    return head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire) < slots_.size() ? &slot(head_) : nullptr;
  }
  void push() { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// For the reader: the oldest, nullptr when there is none; then pop() gives its slot back.
  T* front() { return head_.load(std::memory_order_acquire) != tail_.load(std::memory_order_relaxed) ? &slot(tail_) : nullptr; }
  void pop() { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// For either; the other may be changing it.
  std::size_t size() const { return head_.load(std::memory_order_acquire) - tail_.load(std::memory_order_acquire); }

 private:
  T& slot(const std::atomic<std::size_t>& count) { return slots_[count.load(std::memory_order_relaxed) % slots_.size()]; }

  std::vector<T> slots_;
  // Of all that were written, of all that were read; each on its own line of the cache.
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace kilvo::live
