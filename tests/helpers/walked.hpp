// A simulated robot that has walked, its description, and what is found wrong with one.
#pragma once

#include <string>
#include <vector>

#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab::test_walk {

/// 16 s in a room: 3.4 s of standing, then a walk with a turn.
struct Walked {
  Recorded recorded;
  Robot robot;
  std::vector<Measurement> measurements;
};

inline const Walked& walked() {
  static const Walked walk = [] {
    SimulatorConfig config;
    config.duration = 16;
    config.use = {true, true, true, false};
    config.lidar.points = 8000;
    for (const Scenario& scenario : scenarios()) {
      if (scenario.name != "room") continue;
      Simulator simulator(scenario, config);
      Recorder recorder;
      Walked out;
      while (auto measurement = simulator.next()) {
        recorder.push(*measurement);
        out.measurements.push_back(*std::move(measurement));
      }
      out.recorded = recorder.finish();
      const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
      out.robot = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
      out.robot.urdf = urdf_of(config.shape);
      return out;
    }
    return Walked{{}, {}, {}};
  }();
  return walk;
}

inline std::vector<std::string> causes(const Recorded& recorded, const Robot& robot) {
  std::vector<std::string> out;
  for (const Finding& finding : Examination(recorded, robot).run().findings) out.push_back(finding.cause);
  return out;
}

}  // namespace kilvo::lab::test_walk
