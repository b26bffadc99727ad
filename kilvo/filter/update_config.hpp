// Settings of the Kalman update.
#pragma once

#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo {

struct UpdateConfig {
  int max_iterations = 5;
  double rotation_step = 5e-5;  // rad
  double position_step = 2e-4;  // m
  int min_iterations = 1;       // of a model that is coarse at first; no setting

  static constexpr auto fields() {
    return std::tuple{Field{"max_iterations", &UpdateConfig::max_iterations, "-", "iterations of one update at most"},
                      Field{"rotation_step", &UpdateConfig::rotation_step, "rad", "an update has converged when its step turns by less"},
                      Field{"position_step", &UpdateConfig::position_step, "m", "and moves by less"}};
  }
};

}  // namespace kilvo
