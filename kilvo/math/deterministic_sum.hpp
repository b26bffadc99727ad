// Work on many items by several threads with a result that does not depend on how many there are: items go in blocks of a fixed size,
// and what the blocks return is added in their order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace kilvo {

class Workers {
 public:
  /// `threads` at most at once; 0: as many as the machine has.
  explicit Workers(int threads = 1);
  ~Workers();
  Workers(Workers&&) noexcept;
  Workers& operator=(Workers&&) noexcept;

  /// Sum over the blocks of f(first, last), in order. `Sum` is a value with operator+=; f must not touch what another block writes.
  template <class Sum, class F>
  Sum sum(std::size_t items, std::size_t block, Sum zero, F&& f) const {
    const std::size_t blocks = (items + block - 1) / block;
    const auto run = [&](std::size_t b) { return f(b * block, std::min(items, (b + 1) * block)); };
    if (pool_ == nullptr || blocks < 2) {
      for (std::size_t b = 0; b < blocks; ++b) zero += run(b);
      return zero;
    }
    std::vector<Sum> parts(blocks, zero);
    auto store = [&](std::size_t b) { parts[b] = run(b); };
    for_each_block(blocks, &store, [](void* task, std::size_t b) { (*static_cast<decltype(store)*>(task))(b); });
    for (const Sum& part : parts) zero += part;
    return zero;
  }

 private:
  struct Pool;  // keeps the threading library's headers out of everybody's

  /// call(task, b) for each block b, by several threads.
  void for_each_block(std::size_t blocks, void* task, void (*call)(void*, std::size_t)) const;

  std::unique_ptr<Pool> pool_;  // none: one thread
};

}  // namespace kilvo
