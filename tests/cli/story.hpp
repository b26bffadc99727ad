// What the stories have in common.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "lab/evaluation/evaluate.hpp"
#include "tests/cli/program.hpp"
#include "tests/cli/small_recording.hpp"

namespace kilvo::stories {

/// A URDF with another axis of these joints, which turn about y.
inline std::string with_axis(std::string urdf, const std::vector<std::string>& joints, const std::string& xyz) {
  for (const std::string& name : joints) {
    const std::size_t joint = urdf.find("<joint name=\"" + name), axis = urdf.find("xyz=\"0 1 0\"", urdf.find("<axis", joint));
    if (joint == std::string::npos || axis == std::string::npos) {
      ADD_FAILURE() << "no joint " << name;
      return "";
    }
    urdf.replace(axis, 11, "xyz=\"" + xyz + "\"");
  }
  return urdf;
}

/// A folder with a good configuration and, once made, a recording.
class Story : public testing::Test {
 protected:
  void SetUp() override { write_text(config(), small_config()); }

  std::string recording() const { return folder / "recording.bag"; }
  std::string config() const { return folder / "robot.yaml"; }
  std::string out() const { return folder / "out"; }

  void record(const std::vector<Measurement>& measurements) const { write_recording(recording(), measurements); }

  /// kilvo run recording.bag --config robot.yaml --out out ...
  Finished run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"run", recording(), "--config", config(), "--out", out()};
    words.insert(words.end(), more.begin(), more.end());
    return kilvo(words);
  }

  nlohmann::json summary() const { return nlohmann::json::parse(read_text(folder / "out/summary.json"), nullptr, false); }

  /// Of the file in the results.
  lab::Evaluation errors(const std::vector<lab::StampedPose>& truth, const std::string& file = "sweeps.tum") const {
    return lab::evaluate(lab::read_tum(folder / ("out/" + file)), truth, lab::Alignment::se3);
  }

  TemporaryFolder folder;
};

}  // namespace kilvo::stories
