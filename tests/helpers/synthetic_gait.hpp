// A walk from formulas: two feet of four corners each under a body that moves on evenly. Impact at touchdown, a foot that is quickly fast
// when it leaves. What an ideal robot's kinematics would say of it, and when each foot truly stood.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "kilvo/legs/leg_kinematics.hpp"
#include "tests/helpers/random.hpp"

namespace kilvo::test {

inline const Time gait_begin = time_from_ns(1'700'000'000'000'000'000);
inline constexpr double sole_back = -0.05, sole_front = 0.12, sole_half_width = 0.03;  // m

/// A sole in the world, level or turned about y.
struct SoleMotion {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
  double pitch = 0, pitch_rate = 0;
};

/// The state of a body at `p` that moves with `v` and does not turn.
inline State body_at(const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
  State x;
  x.p = p;
  x.v = v;
  return x;
}

inline FootPose seen_from(const State& x, const SoleMotion& sole) {
  FootPose out;
  out.corners = 4;
  const SO3 R = SO3::Exp({0, sole.pitch, 0});
  out.R_IF = x.R.inverse() * R;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d arm = R * Eigen::Vector3d(k < 2 ? sole_back : sole_front, k % 2 == 0 ? sole_half_width : -sole_half_width, 0);
    out.p[k] = x.R.inverse() * (sole.p + arm - x.p);
    out.v[k] = x.R.inverse() * (sole.v + Eigen::Vector3d(0, sole.pitch_rate, 0).cross(arm) - x.v);  // the body does not turn
  }
  return out;
}

struct Gait {
  double stance = 0.5, swing = 0.35;  // s
  double step = 0.5, lift = 0.05;     // m: from one place of a foot to its next, and the height between
  double leg = 0.75;                  // m
  double first = 1.0;                 // s, standing before; the left foot swings first

  double cycle() const { return stance + swing; }
  double speed() const { return step / cycle(); }

  /// How far into its swing a foot is, s; negative while it stands. `count`: of the swings before.
  double swinging(std::size_t side, double s, double* count = nullptr) const {
    const double since = s - first - (side == 0 ? 0.0 : 0.5 * cycle());
    const double n = std::floor(since / cycle());
    const double within = since - n * cycle();
    if (count != nullptr) *count = since < 0 ? 0 : n + (within < swing ? 0 : 1);
    return since < 0 || within >= swing ? -1 : within;
  }
  bool stands(std::size_t side, double s) const { return swinging(side, s) < 0; }

  SoleMotion sole(std::size_t side, double s) const {
    constexpr double pi = std::numbers::pi;
    double count = 0;
    const double within = swinging(side, s, &count);
    SoleMotion out;
    out.p = {count * step, side == 0 ? 0.1 : -0.1, 0};
    if (within < 0) return out;
    const double u = within / swing;
    out.p.x() += step * (1 - std::cos(pi * u)) / 2;
    out.v.x() = step * pi / (2 * swing) * std::sin(pi * u);
    out.p.z() = 6.75 * lift * u * u * (1 - u);
    out.v.z() = 6.75 * lift * (2 * u - 3 * u * u) / swing;
    return out;
  }

  State body(double s) const {
    const double walked = std::max(0.0, s - first);
    return body_at({walked * speed(), 0, leg}, {s < first ? 0.0 : speed(), 0, 0});
  }

  Feet feet(double s) const {
    Feet out;
    out.t = gait_begin + from_seconds(s);
    for (std::size_t side = 0; side < 2; ++side) out.foot[side] = seen_from(body(s), sole(side, s));
    return out;
  }
};

}  // namespace kilvo::test
