#include "kilvo/math/deterministic_sum.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace kilvo {

struct Workers::Pool {
  explicit Pool(int threads) : arena(threads) {}
  tbb::task_arena arena;
};

Workers::Workers(int threads) {
  if (threads != 1) pool_ = std::make_unique<Pool>(threads > 0 ? threads : +tbb::task_arena::automatic);
}

Workers::~Workers() = default;
Workers::Workers(Workers&&) noexcept = default;
Workers& Workers::operator=(Workers&&) noexcept = default;

void Workers::for_each_block(std::size_t blocks, void* task, void (*call)(void*, std::size_t)) const {
  pool_->arena.execute([&] { tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t b) { call(task, b); }); });
}

}  // namespace kilvo
