// Once warm, the asynchronous phase takes no memory: a robot's loop of 1 kHz must not wait for the heap.
#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>
#include <new>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace {
bool counting = false;
long allocations = 0;

void* take(std::size_t size) {
  if (counting) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* take(std::size_t size, std::align_val_t alignment) {
  if (counting) ++allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return take(size); }
void* operator new[](std::size_t size) { return take(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return take(size, alignment); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return take(size, alignment); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace kilvo {
namespace {

TEST(LegPath, TakesNoMemoryOnceItIsWarm) {
  lab::SimulatorConfig config;
  config.duration = 11;
  config.use = {true, true, false, false};
  const auto& room = *std::ranges::find(lab::scenarios(), std::string("room"), &lab::Scenario::name);
  lab::Simulator simulator(room, config);
  const lab::Settings settings =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  Estimator estimator(settings.robot, settings.estimator, config.use);
  std::vector<Output> outputs;
  long samples = 0, steps = 0;
  std::array<bool, 2> before = {true, true};
  while (auto m = simulator.next()) {
    // Warm: it has walked for three seconds, and the longest time that is ever replayed has passed.
    const bool warm = simulator.seconds_of(simulator.measured()) > 7;
    outputs.clear();
    counting = warm;
    estimator.push(*std::move(m), outputs);
    counting = false;
    for (const Output& o : outputs) {
      samples += warm ? 1 : 0;
      if (warm && o.contacts && o.contacts->on != before) ++steps;
      if (o.contacts) before = o.contacts->on;
    }
  }
  EXPECT_GT(samples, 3500);
  EXPECT_GT(steps, 10) << "feet must come and go";
  EXPECT_EQ(allocations, 0) << "in " << samples << " leg samples";
}

}  // namespace
}  // namespace kilvo
