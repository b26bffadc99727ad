// How the clouds of the LiDAR are read.
#pragma once

#include <tuple>

#include "kilvo/math/field.hpp"

namespace kilvo::lab {

struct CloudConfig {
  bool deskew = true;

  static constexpr auto fields() {
    return std::tuple{Field{"deskew", &CloudConfig::deskew, "-",
                            "each point is taken at its own time; false: all points of a cloud at its stamp, as --no-deskew does (clouds "
                            "without point times, or that the driver has deskewed already)"}};
  }
};

}  // namespace kilvo::lab
