#include "lab/contacts/simple_contacts.hpp"

#include <gtest/gtest.h>

#include "tests/helpers/synthetic_gait.hpp"

namespace kilvo::lab {
namespace simple_contacts_test {

const test::Gait gait{.first = 1.0};

Feet carried(double s, double left, double right) {
  Feet feet = gait.feet(s);
  feet.force_I = {Eigen::Vector3d(0, 0, left), Eigen::Vector3d(0, 0, right)};
  return feet;
}

TEST(ForceContacts, AFifthOfTheWeightIsAContact) {
  ForceContacts contacts;
  for (int i = 0; i < 600; ++i)
    contacts.update(carried(1e-3 * i, 150, 150), gait.body(0), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  contacts.update(carried(0.6, 230, 70), gait.body(0), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  EXPECT_TRUE(contacts.contacts().on[0] && contacts.contacts().on[1]);
  contacts.update(carried(0.601, 250, 50), gait.body(0), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  EXPECT_TRUE(contacts.contacts().on[0]);
  EXPECT_FALSE(contacts.contacts().on[1]);
  EXPECT_DOUBLE_EQ(contacts.contacts().phase(1), 0);
}

TEST(ForceContacts, WithoutEffortsBothStand) {
  ForceContacts contacts;
  for (int i = 0; i < 3000; ++i)
    contacts.update(gait.feet(1e-3 * i), gait.body(1e-3 * i), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  EXPECT_TRUE(contacts.contacts().on[0] && contacts.contacts().on[1]);
}

// Each jolt is a touchdown of the foot that was high, and the other one leaves with it: that is all this way can see.
TEST(VarianceContacts, AJoltIsTheTouchdownOfTheFootThatWasHigh) {
  VarianceContacts contacts;
  int landed = 0, right = 0;
  const auto jolts_at = [](double s) {
    return (!gait.stands(0, s - 0.012) && gait.stands(0, s)) || (!gait.stands(1, s - 0.012) && gait.stands(1, s));
  };
  for (int i = 0; i < 6000; ++i) {
    const double s = 1e-3 * i;
    const auto before = contacts.contacts().on;
    contacts.update(gait.feet(s), gait.body(s), Eigen::Vector3d::Zero(), {0, 0, standard_gravity + (jolts_at(s) ? 12.0 : 0.0)});
    for (std::size_t side = 0; side < 2; ++side) {
      if (s < 2 || before[side] || !contacts.contacts().on[side]) continue;
      ++landed;
      right += gait.stands(side, s) && !gait.stands(side, s - 0.05) ? 1 : 0;
    }
  }
  EXPECT_NEAR(landed, 2 * 4.0 / gait.cycle(), 2);
  EXPECT_EQ(right, landed);
}

}  // namespace simple_contacts_test
}  // namespace kilvo::lab
