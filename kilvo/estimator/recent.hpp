// The newest elements of a sequence in time order. Unlike std::deque it allocates nothing once it is as long as it will get.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace kilvo {

template <class T>
class Recent {
 public:
  void push_back(const T& x) {
    // Room is made by moving what is left to the front, at most once for as many elements as are left.
    if (all_.size() == all_.capacity() && 2 * first_ >= end() - all_.begin())
      all_.erase(all_.begin(), all_.begin() + std::exchange(first_, 0));
    all_.push_back(x);
  }
  void pop_front() { ++first_; }
  void clear() {
    all_.clear();
    first_ = 0;
  }

  bool empty() const { return begin() == end(); }
  std::size_t size() const { return static_cast<std::size_t>(end() - begin()); }
  const T& back() const { return all_.back(); }
  const T& operator[](std::size_t i) const { return begin()[static_cast<std::ptrdiff_t>(i)]; }
  auto begin() { return all_.begin() + first_; }
  auto end() { return all_.end(); }
  auto begin() const { return all_.begin() + first_; }
  auto end() const { return all_.end(); }

 private:
  std::vector<T> all_;
  std::ptrdiff_t first_ = 0;
};

}  // namespace kilvo
