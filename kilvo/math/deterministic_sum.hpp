// Work on many items by several threads with a result that does not depend on how many there are: items go in blocks of a fixed size,
// and what the blocks return is added in their order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <vector>

namespace kilvo {

class Workers {
 public:
  /// `threads` at most at once; 0: as many as the machine has.
  explicit Workers(int threads = 1) {
    constexpr int all = tbb::task_arena::automatic;
    if (threads != 1) arena_ = std::make_unique<tbb::task_arena>(threads > 0 ? threads : all);
  }

  /// Sum over the blocks of f(first, last), in order. `Sum` is a value with operator+=; f must not touch what another block writes.
  template <class Sum, class F>
  Sum sum(std::size_t items, std::size_t block, Sum zero, F&& f) const {
    const std::size_t blocks = (items + block - 1) / block;
    const auto run = [&](std::size_t b) { return f(b * block, std::min(items, (b + 1) * block)); };
    if (arena_ == nullptr || blocks < 2) {
      for (std::size_t b = 0; b < blocks; ++b) zero += run(b);
      return zero;
    }
    std::vector<Sum> parts(blocks, zero);
    arena_->execute([&] { tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) { parts[b] = run(b); }); });
    for (const Sum& part : parts) zero += part;
    return zero;
  }

 private:
  std::unique_ptr<tbb::task_arena> arena_;
};

}  // namespace kilvo
