// The newest elements of a sequence in time order. Unlike std::deque it allocates nothing once it is as long as it will get.
#pragma once

#include <cstddef>
#include <vector>

namespace kilvo {

template <class T>
class Recent {
 public:
  void push_back(const T& x) {
    // Room is made by moving what is left to the front, at most once for as many elements as are left.
    if (all_.size() == all_.capacity() && 2 * first_ >= all_.size()) compact();
    all_.push_back(x);
  }
  void pop_front() { ++first_; }
  void clear() {
    all_.clear();
    first_ = 0;
  }

  bool empty() const { return first_ == all_.size(); }
  std::size_t size() const { return all_.size() - first_; }
  const T& back() const { return all_.back(); }
  const T& operator[](std::size_t i) const { return all_[first_ + i]; }
  auto begin() { return all_.begin() + static_cast<std::ptrdiff_t>(first_); }
  auto end() { return all_.end(); }
  auto begin() const { return all_.begin() + static_cast<std::ptrdiff_t>(first_); }
  auto end() const { return all_.end(); }

 private:
  void compact() {
    all_.erase(all_.begin(), begin());
    first_ = 0;
  }

  std::vector<T> all_;
  std::size_t first_ = 0;
};

}  // namespace kilvo
