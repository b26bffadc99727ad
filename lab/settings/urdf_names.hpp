// The names in a URDF document, so that a configuration with a mistyped link or joint is refused with the nearest valid one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kilvo::lab {

struct UrdfNames {
  std::vector<std::string> links, joints;
};

/// Names of all <link name="..."> and <joint name="..."> outside comments. Not an XML parser: a broken document gives what can be found.
UrdfNames find_urdf_names(std::string_view urdf);

}  // namespace kilvo::lab
