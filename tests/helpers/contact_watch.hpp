// What the contact estimator reports of a scene, against what was true.
#pragma once

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <vector>

#include "kilvo/legs/contact_estimator.hpp"
#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo::test {

struct Change {
  std::size_t side = 0;
  bool on = false;
  double s = 0;
};

// Where the soles and the body are at a time.
struct Scene {
  std::function<SoleMotion(std::size_t side, double s)> sole;
  std::function<State(double s)> body;
  double velocity_noise = 0;  // m/s, of each corner and axis
};

inline Scene walk(const Gait& gait) {
  return {[gait](std::size_t side, double s) { return gait.sole(side, s); }, [gait](double s) { return gait.body(s); }};
}

inline Scene standing() {
  return {[](std::size_t side, double) {
            return SoleMotion{{0, side == 0 ? 0.1 : -0.1, 0}};
          },
          [](double) {
            return test::body_at({0, 0, 0.75}, {0, 0, 0});
          }};
}

// Of a body that is carried without turning: from the middle of the soles that stand, m/s^2.
inline Eigen::Vector3d force_on(const State& x, const std::array<SoleMotion, 2>& soles) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double standing = 0;
  for (const SoleMotion& sole : soles) {
    if (!sole.v.isZero(1e-9)) continue;
    middle += sole.p;
    ++standing;
  }
  if (standing == 0) return {0, 0, standard_gravity};
  const Eigen::Vector3d line = x.p - middle / standing;
  return standard_gravity / std::max(0.1, line.z()) * line;
}

// What the estimator reports of a scene, in order of time.
inline std::vector<Change> watch(ContactEstimator& estimator, const Scene& scene, double from, double to, double rate = 1000) {
  test::Random random(1);
  std::vector<Change> out;
  for (int i = 0; from + i / rate < to; ++i) {
    const double s = from + i / rate;
    const State x = scene.body(s);
    Feet feet;
    feet.t = test::gait_begin + from_seconds(s);
    const std::array<SoleMotion, 2> soles = {scene.sole(0, s), scene.sole(1, s)};
    for (std::size_t side = 0; side < 2; ++side) {
      feet.foot[side] = test::seen_from(x, soles[side]);
      for (std::size_t k = 0; k < 4; ++k) feet.foot[side].v[k] += random.vector3(scene.velocity_noise);
    }
    const std::array<bool, 2> before = i == 0 ? std::array<bool, 2>{true, true} : estimator.contacts().on;
    const Contacts& now = estimator.update(feet, x, Eigen::Vector3d::Zero(), force_on(x, soles));
    EXPECT_EQ(now.t, feet.t);
    for (std::size_t side = 0; side < 2; ++side) {
      if (now.on[side] != before[side]) out.push_back({side, now.on[side], s});
    }
  }
  return out;
}

inline std::vector<Change> watch(const Scene& scene, double to, double rate = 1000) {
  ContactEstimator estimator;
  return watch(estimator, scene, 0, to, rate);
}

inline std::vector<Change> truth_of(const Gait& gait, double from, double to) {
  std::vector<Change> out;
  const auto add = [&](std::size_t side, bool on, double s) {
    if (s >= from && s < to) out.push_back({side, on, s});
  };
  for (std::size_t side = 0; side < 2; ++side) {
    for (double s = gait.first + 0.5 * gait.cycle() * static_cast<double>(side); s < to; s += gait.cycle()) {
      add(side, false, s);
      add(side, true, s + gait.swing);
    }
  }
  return out;
}

// Each true change from `from` to `to` is reported once, at most so much early or late, and nothing else is.
inline void expect_changes(const Gait& gait, const std::vector<Change>& reported, double from, double to, double early, double late) {
  const auto between = [&](const Change& c) { return c.s >= from - early && c.s < to + late; };
  const std::vector<Change> truth = truth_of(gait, from, to);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count_if(reported, between)), truth.size());
  EXPECT_GT(truth.size(), 4u);
  for (const Change& t : truth) {
    const auto matches = [&](const Change& r) { return r.side == t.side && r.on == t.on && r.s >= t.s - early && r.s <= t.s + late; };
    EXPECT_EQ(std::ranges::count_if(reported, matches), 1)
        << (t.side == 0 ? "left" : "right") << (t.on ? " touchdown" : " lift-off") << " at " << t.s;
  }
}

}  // namespace kilvo::test
