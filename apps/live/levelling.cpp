#include "apps/live/levelling.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/legs/level_ground.hpp"
#include "kilvo/math/decompositions.hpp"

namespace kilvo {

void Levelling::add(Output& o) {
  if (R_LW_) return;
  last_ = o.t;
  g_ = o.vertical_W ? Eigen::Vector3d(-*o.vertical_W) : o.x.g;
  is_settled_ = o.vertical_W.has_value();
  // Two directions: its length is known.
  const double scale = 1 / std::max(1.0, g_.norm());
  sigma_ = scale * std::sqrt(std::max(0.0, o.P.diagonal().segment<2>(at::g).maxCoeff()));
  least_sigma_ = scale * std::sqrt(std::max(0.0, o.P.diagonal().segment<2>(at::g).minCoeff()));
  if (!first_) {
    first_ = o.t;
    first_sigma_ = sigma_;
  }
  if (!is_settled_ && !(sigma_ < LevelGround::known_vertical) && o.t - *first_ <= longest_) return;
  if (const auto event = finish()) o.events.push_back(*event);
}

std::optional<Event> Levelling::finish() {
  if (R_LW_ || !first_) return std::nullopt;
  R_LW_ = SO3();
  if (!(g_.z() < 0)) return std::nullopt;
  const Eigen::Vector3d up = -g_.normalized();
  const SO3 turn = SO3::nearest(Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix());
  if (!is_settled_ && !(sigma_ < LevelGround::known_vertical)) {
    // Knowing one of two directions is better than none. But accelerometers err in step with the robot's steps, which their sigma does
    // not contain: what is not known well may not contradict a start at rest. A start on the move has only a guess of the vertical.
    constexpr double nearly_known = 4e-3, guessed = 1e-2, most_sigmas = 3;  // rad, rad, -
    const bool is_better = least_sigma_ < 0.5 * first_sigma_ || sigma_ < std::min(nearly_known, first_sigma_);
    const bool contradicts = first_sigma_ < guessed && turn.Log().norm() > most_sigmas * first_sigma_;
    if (!is_better || contradicts) return std::nullopt;
  }
  R_LW_ = turn;
  return Event{last_, {}, Reason::levelled, R_LW_->Log().norm(), 1, {}};
}

void Levelling::apply(const SO3& R_LW, Output& o) {
  const Eigen::Matrix3d& R = R_LW.matrix();
  o.x.R = R_LW * o.x.R;
  o.R_LW = R_LW * o.R_LW.value_or(SO3());
  for (Eigen::Vector3d* v : {&o.x.p, &o.x.v, &o.x.g, &o.x.pc[0], &o.x.pc[1]}) *v = R * *v;
  for (const int block : {at::v, at::p, at::g, at::pcl, at::pcr}) {
    if (o.P.diagonal().segment<3>(block).isZero(0)) continue;  // not in use
    o.P.middleRows<3>(block) = (R * o.P.middleRows<3>(block)).eval();
    o.P.middleCols<3>(block) = (o.P.middleCols<3>(block) * R.transpose()).eval();
  }
  if (o.vertical_W) o.vertical_W = R * *o.vertical_W;
  if (o.contacts) {
    for (Eigen::Vector3d* v : {&o.contacts->normal, &o.contacts->ground[0].normal, &o.contacts->ground[0].point,
                               &o.contacts->ground[1].normal, &o.contacts->ground[1].point})
      *v = R * *v;
  }
  const Eigen::Matrix3f Rf = R.cast<float>();
  for (PointXYZI& x : o.points_W) x.head<3>() = (Rf * x.head<3>()).eval();
  for (ColouredPoint& point : o.coloured) point.p_W = (Rf * point.p_W).eval();
}

}  // namespace kilvo
