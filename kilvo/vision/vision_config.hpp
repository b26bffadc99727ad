// Settings of the camera's measurement.
#pragma once

#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo {

struct VisionConfig {
  int cell = 32;              // px
  double read_noise = 1.5;    // grey
  double shot_noise = 0.015;  // grey
  double pixel_error = 0.05;  // px
  double bias_share = 0.01;
  double min_corner = 4.0;  // grey^2/px^2
  double min_correlation = 0.8;
  double gate = 4.0;  // sigma
  bool adapt_exposure = true;
  bool new_views = true;

  static constexpr auto fields() {
    return std::tuple{
        Field{"cell", &VisionConfig::cell, "px", "one patch is used in each cell of this size of the image"},
        Field{"read_noise", &VisionConfig::read_noise, "-", "standard deviation of a dark pixel, grey levels of 255"},
        Field{"shot_noise", &VisionConfig::shot_noise, "-", "variance of a pixel that comes with each grey level"},
        Field{"pixel_error", &VisionConfig::pixel_error, "px", "what calibration and interpolation do to where a patch is found"},
        Field{"bias_share", &VisionConfig::bias_share, "-", "how much the brightness of one patch may change by itself, as a share"},
        Field{"min_corner", &VisionConfig::min_corner, "-", "smaller eigenvalue of the gradient's scatter, per pixel, of a patch to keep"},
        Field{"min_correlation", &VisionConfig::min_correlation, "-", "patches that correlate less are not the same surface"},
        Field{"gate", &VisionConfig::gate, "sigma", "patches found farther than this from where they are expected are not used"},
        Field{"adapt_exposure", &VisionConfig::adapt_exposure, "-", "exposures may jump; false: they only walk (camera.exposure_walk)"},
        Field{"new_views", &VisionConfig::new_views, "-", "points keep views that differ much from their first as well; false: only that"}};
  }
};

}  // namespace kilvo
