#include "lab/messages/sensor_intake.hpp"

#include <gtest/gtest.h>
#include <limits>

#include "lab/messages/encode.hpp"

namespace kilvo::lab {
namespace sensor_intake_test {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const Time day = time_from_ns(1'700'000'000'000'000'000);

JointSample taken(SensorIntake& intake, const JointSample& sample) {
  const auto bytes = encode(sample, "");
  auto m = intake.take(Sensor::legs, written_type(Sensor::legs).name, {bytes, Encoding::ros1}, day, {});
  EXPECT_TRUE(m);
  return m ? std::get<JointSample>(*m) : JointSample{};
}

TEST(SensorIntake, VelocitiesThatAreAllNanAreNone) {
  SensorIntake intake;
  const JointNames names(JointNames::List{"a", "b"});
  const JointSample none = taken(intake, {day, names, {0.1, 0.2}, {nan, nan}, {nan, nan}});
  EXPECT_EQ(none.position, (std::vector{0.1, 0.2}));
  EXPECT_TRUE(none.velocity.empty());
  EXPECT_TRUE(none.effort.empty());
  const JointSample some = taken(intake, {day, names, {0.1, 0.2}, {nan, 0.3}, {1, 2}});
  EXPECT_EQ(some.velocity.size(), 2);
  EXPECT_EQ(some.velocity[1], 0.3);
  EXPECT_EQ(some.effort.size(), 2);
}

}  // namespace sensor_intake_test
}  // namespace kilvo::lab
