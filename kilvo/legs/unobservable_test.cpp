#include "kilvo/legs/unobservable.hpp"

#include <gtest/gtest.h>

#include "kilvo/math/so3.hpp"

namespace unobservable_test {

using namespace kilvo;
using Eigen::Vector3d;

constexpr double tilt = 0.05, speed = 0.1;  // sigmas, rad and m/s

// Walking, with a heading of that sigma that turns the velocity and the feet along.
Estimate with_heading(double sigma) {
  Estimate e;
  e.x.R = SO3::Exp(Vector3d(0.1, -0.2, 0.7));
  e.x.v = {0.5, -0.2, 0};
  e.x.p = {3, 1, 0.8};
  e.x.pc = {Vector3d(3.2, 1.1, 0), Vector3d(2.9, 0.9, 0)};
  e.P.diagonal().segment<3>(at::R).setConstant(tilt * tilt);
  e.P.diagonal().segment<3>(at::v).setConstant(speed * speed);
  ErrorVector heading = ErrorVector::Zero();
  heading.segment<3>(at::R) = e.x.R.inverse() * Vector3d::UnitZ();
  heading.segment<3>(at::p) = Vector3d::UnitZ().cross(e.x.p);
  heading.segment<3>(at::v) = Vector3d::UnitZ().cross(e.x.v);
  heading.segment<3>(at::pcl) = Vector3d::UnitZ().cross(e.x.pc[0]);
  heading.segment<3>(at::pcr) = Vector3d::UnitZ().cross(e.x.pc[1]);
  e.P += sigma * sigma * heading * heading.transpose();
  return e;
}

Estimate corrected(const Estimate& from) {
  Estimate e = from;
  e.x.R = e.x.R * SO3::Exp(Vector3d(0.06, -0.05, 0));
  e.x.v += Vector3d(0.3, 0.4, 0.1);
  e.x.p += Vector3d(0.02, -0.03, 0.01);
  e.x.pc[0] += Vector3d(0.01, 0.02, 0);
  return e;
}

struct Seen {
  double tilt, velocity,
      foot;  // largest sigmas of what does not depend on the heading: of the inclination, of velocity and foot in the body
};

Seen seen_in_the_body(const Estimate& e) {
  const Eigen::Matrix3d R_T = e.x.R.matrix().transpose();
  const auto largest = [&e](const Eigen::Matrix<double, 3, at::size>& H) {
    const Eigen::Matrix3d P = H * e.P * H.transpose();
    return std::sqrt(P.diagonal().maxCoeff());
  };
  Eigen::Matrix<double, 3, at::size> up = decltype(up)::Zero(), velocity = up, foot = up;
  up.middleCols<3>(at::R) = skew(R_T * Vector3d::UnitZ());
  velocity.middleCols<3>(at::R) = skew(R_T * e.x.v);
  velocity.middleCols<3>(at::v) = R_T;
  foot.middleCols<3>(at::R) = skew(R_T * (e.x.pc[0] - e.x.p));
  foot.middleCols<3>(at::p) = -R_T;
  foot.middleCols<3>(at::pcl) = R_T;
  return {largest(up), largest(velocity), largest(foot)};
}

TEST(Heading, ThatIsUnknownStaysApartFromATiltThatIsCorrected) {
  const Estimate before = with_heading(2.0);
  Estimate e = corrected(before), as_it_was = e;
  keep_heading_apart(before.x, e);
  const Seen now = seen_in_the_body(e), without = seen_in_the_body(as_it_was);
  EXPECT_GT(without.tilt, 2 * tilt);  // what it is about
  EXPECT_GT(without.velocity, 3 * speed);
  EXPECT_LT(now.tilt, 1.01 * tilt);
  EXPECT_LT(now.velocity, 1.1 * speed);
  EXPECT_GT(without.foot, 1.2 * seen_in_the_body(before).foot);
  EXPECT_LT(now.foot, 1.1 * seen_in_the_body(before).foot);
  // The heading itself is known as before.
  const Vector3d up_I = e.x.R.inverse() * Vector3d::UnitZ();
  EXPECT_NEAR(std::sqrt(up_I.dot(e.P.block<3, 3>(at::R, at::R) * up_I)), 2.0, 0.01);
  EXPECT_EQ(e.P, Covariance(e.P.transpose()));
  EXPECT_TRUE(is_definite(e.P));
}

TEST(Heading, OfASmallAngleIsLeftToTheFilter) {
  const Estimate before = with_heading(0.3);
  Estimate e = corrected(before);
  const Covariance P = e.P;
  keep_heading_apart(before.x, e);
  EXPECT_EQ(e.P, P);
}

}  // namespace unobservable_test
