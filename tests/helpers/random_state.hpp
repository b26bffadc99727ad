// Random states for tests.
#pragma once

#include "kilvo/filter/state.hpp"
#include "tests/helpers/random.hpp"

namespace kilvo::test {

inline State random_state(Random& random) {
  State x;
  x.R = random.rotation();
  x.p = random.vector3(5);
  x.v = random.vector3(2);
  x.bg = random.vector3(0.05);
  x.ba = random.vector3(0.2);
  x.g = standard_gravity * random.direction();
  x.pc = {random.vector3(5), random.vector3(5)};
  x.tau = random.uniform(0.5, 2);
  return x;
}

/// A small error whose gravity part keeps the length of x.g to first order.
inline ErrorVector random_error(Random& random, const State& x, double sigma) {
  ErrorVector d = random.vector<at::size>(sigma);
  const Eigen::Vector3d up = x.g.normalized();
  d.segment<3>(at::g) -= up.dot(d.segment<3>(at::g)) * up;
  return d;
}

}  // namespace kilvo::test
