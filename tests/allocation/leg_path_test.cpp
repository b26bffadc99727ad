// Once warm, the asynchronous phase takes no memory: a robot's loop of 1 kHz must not wait for the heap.
#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>
#include <new>
#include <optional>
#include <utility>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/live_propagator.hpp"
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
namespace leg_path_test {

struct LegWalk {
  explicit LegWalk(double seconds) : config(of(seconds)), simulator(room(), config) {}
  static lab::SimulatorConfig of(double seconds) {
    lab::SimulatorConfig config;
    config.duration = seconds;
    config.use = {true, true, false, false};
    return config;
  }
  static const lab::Scenario& room() { return *std::ranges::find(lab::scenarios(), std::string("room"), &lab::Scenario::name); }

  lab::SimulatorConfig config;
  lab::Simulator simulator;
  lab::Settings settings =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
};

TEST(LegPath, TakesNoMemoryOnceItIsWarm) {
  LegWalk walk(11);
  lab::Simulator& simulator = walk.simulator;
  const lab::Settings& settings = walk.settings;
  const lab::SimulatorConfig& config = walk.config;
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
  EXPECT_EQ(std::exchange(allocations, 0), 0) << "in " << samples << " leg samples";
}

TEST(LivePropagator, TakesNoMemoryOnceItIsWarm) {
  LegWalk walk(9);
  Estimator estimator(walk.settings.robot, walk.settings.estimator, walk.config.use);
  LegKinematics kinematics(walk.settings.robot);
  LivePropagator runner(walk.settings.robot, walk.settings.estimator);
  long outputs = 0;
  bool warm = false;
  std::optional<Time> forked;
  while (auto m = walk.simulator.next()) {
    const auto* imu = std::get_if<ImuSample>(&*m);
    const auto* joints = std::get_if<JointSample>(&*m);
    warm = walk.simulator.seconds_of(walk.simulator.measured()) > 6;
    counting = warm;
    if (imu != nullptr) runner.push(*imu);
    if (joints != nullptr) {
      const auto feet = kinematics.feet(*joints);
      if (const auto* known = std::get_if<Feet>(&feet); known != nullptr && runner.push(*known))
        outputs += runner.output().t > Time{} && warm ? 1 : 0;
    }
    counting = false;
    const Time t = stamp_of(*m);
    estimator.push(*std::move(m));
    if (!forked || t - *forked > from_seconds(0.1)) {
      counting = warm;
      estimator.fork(runner);
      counting = false;
      forked = t;
    }
  }
  EXPECT_GT(outputs, 2500);
  EXPECT_EQ(allocations, 0) << "in " << outputs << " outputs";
}

}  // namespace leg_path_test
}  // namespace kilvo
