// Points of the robot itself: arms, hands, what it carries. In the map they would be surfaces that go along with the robot, which say that
// it stands still, and where nothing else is measured (along a corridor) they would be believed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

/// What stays where it is in the LiDAR's frame while the robot moves through the world is the robot. Learnt from the near points of the
/// sweeps, cell by cell; no model of the body is needed. Boxes of the description are the robot from the beginning.
class OwnBody {
 public:
  /// x, y, z of the least corner, then of the greatest, box by box, in the LiDAR's frame, m.
  explicit OwnBody(std::vector<double> boxes = {});

  /// Farther than that from the LiDAR there is none of it, m.
  float reach() const { return reach_; }

  void begin_sweep();
  /// Whether a point of the sweep, not farther than reach(), is of the robot.
  bool meets(const LidarPoint& p);
  /// The sweep was registered at this pose T_WI.
  void learn(const SE3& T_WI);

 private:
  static constexpr int side = 16;              // cells
  static constexpr float learnt_reach = 0.8F;  // m: of arms, and of what hands hold

  bool is_in_a_box(const LidarPoint& p) const;

  std::vector<double> boxes_;
  float reach_ = learnt_reach;
  int sweeps_ = 0;                                                                  // that were learnt from
  std::array<std::optional<SE3>, 2> last_;                                          // where the last two of them were
  std::vector<std::uint8_t> hit_ = std::vector<std::uint8_t>(side * side * side);   // by the current sweep
  std::vector<float> share_ = std::vector<float>(side * side * side);               // of the sweeps lately that hit a cell
  std::vector<std::uint8_t> body_ = std::vector<std::uint8_t>(side * side * side);  // and its neighbours
};

}  // namespace kilvo
