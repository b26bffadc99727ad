// Corners that are followed from one image to the next, in pixels: what a camera says without its calibration.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "kilvo/vision/pyramid.hpp"

namespace kilvo::lab {

struct Track {
  Eigen::Vector2f from, to;  // px
};

/// The tracks between two images.
struct TrackedPair {
  double from = 0, to = 0;  // s
  std::vector<Track> tracks;
};

class FeatureTracker {
 public:
  /// The tracks from the image before to this one, none for the first.
  std::optional<TrackedPair> push(double t, const Image& image);

 private:
  double last_t_ = 0;
  std::vector<GreyImage> last_;
};

}  // namespace kilvo::lab
