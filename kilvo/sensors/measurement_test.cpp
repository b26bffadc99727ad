#include "kilvo/sensors/measurement.hpp"

#include <gtest/gtest.h>
#include <string>

namespace kilvo {
namespace measurement_test {

TEST(Measurement, KnowsItsSensorAndStamp) {
  const Time t = time_from_ns(1'700'000'000'000'000'007);
  const struct {
    Measurement m;
    Sensor sensor;
    const char* name;
  } cases[] = {{ImuSample{t}, Sensor::imu, "imu"},
               {JointSample{t, {}, {}, {}, {}}, Sensor::legs, "legs"},
               {LidarScan{t, {}}, Sensor::lidar, "lidar"},
               {CameraImage{t, {}}, Sensor::camera, "camera"}};
  for (const auto& c : cases) {
    EXPECT_EQ(sensor_of(c.m), c.sensor);
    EXPECT_EQ(stamp_of(c.m), t);
    EXPECT_EQ(std::string(name_of(c.sensor)), c.name);
  }
  EXPECT_EQ(std::size(cases), sensor_count);
}

}  // namespace measurement_test
}  // namespace kilvo
