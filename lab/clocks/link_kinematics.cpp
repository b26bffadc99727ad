#include "lab/clocks/link_kinematics.hpp"

namespace kilvo::lab {

LinkKinematics::LinkKinematics(const Robot& robot, const std::string& link)
    : chain_(LinkTree(robot).chain(robot.imu.link, link)), T_IM_(robot.imu.T_link_imu.inverse()), known_(chain_.names.empty()) {}

LinkMotion LinkKinematics::relative_to_imu(const MovingFrame& link) const {
  const SE3 T_ML{SO3::nearest(link.R), link.p};
  return {T_IM_ * T_ML, T_IM_.R * link.v, T_IM_.R * link.omega};
}

LinkMotion LinkKinematics::at_rest() const { return relative_to_imu(chain_.end({}, {})); }

std::optional<LinkMotion> LinkKinematics::at(const JointSample& s) {
  if (s.names.size() != s.position.size()) return std::nullopt;
  if (s.names != message_names_) {
    message_names_ = s.names;
    known_ = !chain_.look_up(s.names);
  }
  if (!known_) return std::nullopt;
  if (zeros_.size() != s.position.size()) zeros_.assign(s.position.size(), 0.0);
  const LinkMotion out = relative_to_imu(chain_.end(s.position, s.velocity.size() == s.position.size() ? s.velocity : zeros_));
  const bool finite = out.T_IL.p.allFinite() && out.T_IL.R.matrix().allFinite() && out.v.allFinite() && out.omega.allFinite();
  return finite ? std::optional(out) : std::nullopt;
}

}  // namespace kilvo::lab
