#include "lab/simulation/footsteps.hpp"

#include <cmath>
#include <fmt/core.h>

#include "lab/simulation/smooth.hpp"

namespace kilvo::lab {
namespace {

class Planner {
 public:
  Planner(const BipedShape& shape, const Ground& ground, const Place& start) : shape_(shape), ground_(ground), place_(start) {
    for (const Side side : {Side::left, Side::right}) out_.prints[index_of(side)].push_back({.sole = footing(side)});
    add_frame(Side::left);
  }

  Footsteps plan(const std::vector<Stage>& stages) {
    for (const Stage& stage : stages) {
      check(stage);
      if (stage.stand > 0) close();
      now_ += stage.stand;
      for (int i = 0; i < stage.steps; ++i) step(stage.gait);
    }
    close();
    out_.end = now_;
    return std::move(out_);
  }

 private:
  static void check(const Stage& stage) {
    const Gait& g = stage.gait;
    if (!(stage.stand >= 0) || stage.steps < 0) throw PlanError("a stage of the walk has a negative stand or number of steps");
    if (!(g.period > 0.1) || !(std::abs(g.double_support) < 0.8 * g.period)) {
      throw PlanError(fmt::format("a step of {} s with {} s on both feet cannot be walked", g.period, g.double_support));
    }
  }

  SE3 footing(Side side) const {
    const double c = std::cos(place_.yaw), s = std::sin(place_.yaw), out = sign_of(side) * shape_.hip.y();
    return ground_.footing(shape_, place_.x - s * out, place_.y + c * out, place_.yaw);
  }

  void add_frame(Side side) { out_.frames.emplace_back(place_.x, place_.y, out_.prints[index_of(side)].back().sole.p.z(), place_.yaw); }

  void step(const Gait& gait) {
    const double c = std::cos(place_.yaw), s = std::sin(place_.yaw);
    place_.x += c * gait.forward - s * gait.left;
    place_.y += s * gait.forward + c * gait.left;
    place_.yaw += gait.turn;
    const Side side = out_.steps.size() % 2 == 0 ? Side::left : Side::right;
    auto& prints = out_.prints[index_of(side)];
    prints.back().lift = now_ + gait.double_support / 2;
    prints.back().toe_angle = gait.toe_off;
    Footprint print{.sole = footing(side), .touch = now_ + gait.period - gait.double_support / 2};
    const Eigen::Vector3d ahead = print.sole.R * Eigen::Vector3d::UnitX(), aside = print.sole.R * Eigen::Vector3d::UnitY();
    if (side == Side::left) print.slide = gait.slip * ahead;
    print.slide_begin = 0.3 * gait.period;
    print.slide_time = gait.slip_time;
    print.sink = gait.sink;
    print.creep = sign_of(side) * gait.creep * aside;
    print.heel_angle = gait.heel_strike;
    print.swing_lift = gait.lift;
    print.swing_leaving = gait.leaving;
    print.swing_landing = gait.landing;
    if (prints.back().lift <= prints.back().touch) throw PlanError(fmt::format("at {:.2f} s a foot would leave before it has come", now_));
    prints.push_back(print);
    add_frame(side);
    out_.steps.push_back({now_, gait.period, side, gait});
    now_ += gait.period;
    open_ = true;
  }

  // Brings the other foot beside the one that stepped last.
  void close() {
    if (!open_) return;
    Gait last = out_.steps.back().gait;
    last.forward = last.left = last.turn = last.slip = 0;
    last.double_support = std::max(last.double_support, 0.25 * last.period);
    step(last);
    open_ = false;
  }

  const BipedShape& shape_;
  const Ground& ground_;
  Place place_;
  double now_ = 0;
  bool open_ = false;
  Footsteps out_;
};

}  // namespace

Eigen::Vector3d Footprint::displacement(double t) const {
  if (!(t > 0)) return Eigen::Vector3d::Zero();
  const double stance = std::min(lift - touch, 0.6);
  const Eigen::Vector3d down = -(sole.R * Eigen::Vector3d::UnitZ());
  // Most of the sinking comes at once, the rest with the creeping.
  const double quick = smooth_step(t / std::min(0.12, stance)), slow = smooth_step(t / stance);
  return slide * smooth_step((t - slide_begin) / slide_time) + down * sink * (0.85 * quick + 0.15 * slow) + creep * slow;
}

Footsteps plan_footsteps(const BipedShape& shape, const Ground& ground, const Place& start, const std::vector<Stage>& stages) {
  return Planner(shape, ground, start).plan(stages);
}

}  // namespace kilvo::lab
