#include "kilvo/math/se3.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/random.hpp"

namespace kilvo {
namespace se3_test {

TEST(SE3, CompositionAppliesTheRightOneFirst) {
  test::Random random(1);
  for (int i = 0; i < 100; ++i) {
    const SE3 T_AB{random.rotation(), random.vector3(10)}, T_BC{random.rotation(), random.vector3(10)};
    const Eigen::Vector3d p_C = random.vector3(10);
    EXPECT_LT(((T_AB * T_BC) * p_C - T_AB * (T_BC * p_C)).norm(), 1e-13);
    EXPECT_LT((T_AB * p_C - (T_AB.R.matrix() * p_C + T_AB.p)).norm(), 1e-15);
  }
}

TEST(SE3, InverseUndoesItOnBothSides) {
  test::Random random(2);
  for (int i = 0; i < 100; ++i) {
    const SE3 T{random.rotation(), random.vector3(10)};
    for (const SE3& one : {T * T.inverse(), T.inverse() * T}) {
      EXPECT_LT((one.R.matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
      EXPECT_LT(one.p.norm(), 2e-14);
    }
  }
}

}  // namespace se3_test
}  // namespace kilvo
