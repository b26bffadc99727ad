// Which joints and links of a robot belong to which leg.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/legs/joint_chain.hpp"

namespace kilvo::lab {

/// By the tree of the URDF and the links of the two feet: names differ from maker to maker. The legs part where the ways from the root to
/// the feet do, and go on below the feet.
class LegSides {
 public:
  LegSides() = default;
  /// None when the feet are of one leg. Throws std::invalid_argument when the URDF has not the feet's links.
  LegSides(const LinkTree& tree, const Robot& robot);

  /// The same joint or link of the other leg: as many joints below the place where the legs part. The name itself when it is of no leg.
  std::string other_joint(const std::string& name) const { return other(joints_, name); }
  std::string other_link(const std::string& name) const { return other(links_, name); }
  /// 0 or 1, as in robot.feet; none of a joint that both legs hang on, or neither.
  std::optional<std::size_t> leg_of_joint(const std::string& name) const;
  std::optional<std::size_t> leg_of_link(const std::string& name) const;
  /// From the hip down.
  std::vector<std::string> joints_of(std::size_t leg) const;

 private:
  struct Part {
    std::size_t depth = 0;  // joints below the place where the legs part
    std::string name;
  };
  using Parts = std::array<std::vector<Part>, 2>;
  static std::string other(const Parts& parts, const std::string& name);
  static std::optional<std::size_t> leg_of(const Parts& parts, const std::string& name);

  Parts joints_, links_;
};

/// The links of a URDF as they are written in it.
std::vector<std::string> link_names(const std::string& urdf);

}  // namespace kilvo::lab
