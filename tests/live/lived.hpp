// A walk through the live runner: every message as it arrives, all threads at work. Nothing depends on how fast the machine is: after each
// message it is waited until the threads have nothing to do.
#pragma once

#include <thread>
#include <utility>
#include <vector>

#include "apps/live/live_runner.hpp"
#include "tests/faults/failing_walk.hpp"

namespace kilvo::test {

struct Lived {
  std::vector<Output> states, sweeps;
  live::LiveStatistics statistics;
  Statistics seen;

  std::vector<Event> events(Reason reason) const {
    std::vector<Event> out;
    for (const Output& o : sweeps) {
      std::ranges::copy_if(o.events, std::back_inserter(out), [reason](const Event& e) { return e.reason == reason; });
    }
    return out;
  }
};

inline void push_and_wait(live::LiveRunner& runner, Measurement m) {
  runner.push(std::move(m));
  while (!runner.is_idle()) std::this_thread::yield();
}

/// `times`: the same again, in the same runner.
inline Lived live_through(const FailingWalk& walk, const std::vector<lab::Failure>& failures, int times = 1,
                          const std::function<void(Measurement&)>& edit = {}) {
  Lived out;
  EstimatorConfig config = walk.settings().estimator;
  config.wait_for_images = false;
  Estimator estimator(walk.settings().robot, config, walk.used());
  lab::LiveConfig live;
  live.max_latency = 10;  // a slow machine gives nothing up
  live::LiveRunner runner(
      estimator, walk.settings().robot, config, walk.used(), live,
      {[&out](Output o) { out.states.push_back(std::move(o)); }, [&out](Output o) { out.sweeps.push_back(std::move(o)); }});
  for (int i = 0; i < times; ++i) {
    walk.play(failures, [&](Measurement m) {
      if (edit) edit(m);
      push_and_wait(runner, std::move(m));
    });
  }
  runner.stop();
  out.statistics = runner.statistics();
  out.seen = runner.seen();
  return out;
}

}  // namespace kilvo::test
