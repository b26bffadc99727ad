// Settings of the live runner (apps/live).
#pragma once

#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo::lab {

struct LiveConfig {
  double max_latency = 0.2;  // s
  int priority = -1;
  int fast_core = -1;
  int slow_core = -1;

  static constexpr auto fields() {
    return std::tuple{
        Field{"max_latency", &LiveConfig::max_latency, "s",
              "leg samples that have waited longer, because the machine is too slow, are given up"},
        Field{"priority", &LiveConfig::priority, "-",
              "real-time priority (SCHED_FIFO, 1 to 99) of the thread that answers the legs; 0: none; -1: the lowest, where the "
              "system allows it"},
        Field{"fast_core", &LiveConfig::fast_core, "-", "the core for the thread that answers the legs; -1: any"},
        Field{"slow_core", &LiveConfig::slow_core, "-", "the core for the thread that works on sweeps and images; -1: any"}};
  }
};

}  // namespace kilvo::lab
