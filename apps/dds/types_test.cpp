#include "apps/dds/types.hpp"

#include <cstdint>
#include <cstdio>
#include <dds/dds.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "apps/dds/dds_log.hpp"
#include "apps/dds/domain.hpp"

namespace kilvo::dds {
namespace types_test {

struct Known {
  const char* name;
  std::size_t object_bytes;  // of the type's description with those of the types in it
  const char* minimal_hash;  // the first bytes; f1: minimal
};

// As in the headers that Unitree's SDK ships: types are the same there and here when their descriptions are, byte for byte.
TEST(Types, AreDescribedAsUnitreesHeadersDoIt) {
  for (const Known& known : {Known{"unitree_hg/LowState", 1850, "f12f38296b52"}, Known{"unitree_hg/IMUState", 498, "f1fc68717665"},
                             Known{"sensor_msgs/Imu", 1814, "f1d4f981035a"}, Known{"sensor_msgs/PointCloud2", 1472, "f17f62a48efc"}}) {
    const DdsType* type = find_type(known.name);
    ASSERT_NE(type, nullptr);
    EXPECT_EQ(type->layout->type_mapping.sz, known.object_bytes) << known.name;
    // In the type information the minimal hash follows 20 bytes of lengths.
    std::string hash;
    for (std::size_t i = 20; i < 26; ++i) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02x", type->layout->type_information.data[i]);
      hash += digits;
    }
    EXPECT_EQ(hash, known.minimal_hash) << known.name;
  }
}

TEST(Types, HaveTheNamesOfRos2) {
  EXPECT_EQ(dds_type_name(*find_type("sensor_msgs/Imu")), "sensor_msgs::msg::dds_::Imu_");
  EXPECT_EQ(dds_type_name(*find_type("unitree_hg/LowState")), "unitree_hg::msg::dds_::LowState_");
  EXPECT_EQ(find_type("unitree_go/LowState"), nullptr);
  EXPECT_EQ(find_type("sensor_msgs/Imu")->ros_hash, "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b");
}

TEST(Types, TopicsOfRos2AreBelowRt) {
  EXPECT_EQ(dds_topic("/imu/data"), "rt/imu/data");
  EXPECT_EQ(dds_topic("imu/data"), "rt/imu/data");
  EXPECT_EQ(dds_topic("rt/lowstate"), "rt/lowstate");
}

TEST(Domain, PeersByAddressNeedNoMulticast) {
  const std::string xml = domain_xml({3, "eth0", {"192.168.123.161", "10.0.0.2"}});
  EXPECT_NE(xml.find("<NetworkInterface name=\"eth0\"/>"), std::string::npos);
  EXPECT_NE(xml.find("<AllowMulticast>false</AllowMulticast>"), std::string::npos);
  EXPECT_NE(xml.find("<Peer Address=\"192.168.123.161\"/><Peer Address=\"10.0.0.2\"/>"), std::string::npos);
  EXPECT_NE(domain_xml({0, "127.0.0.1", {}}).find("multicast=\"true\""), std::string::npos);
  EXPECT_THROW(domain_xml({0, "e\"th", {}}), DdsError);
}

TEST(DdsLog, SaysALineOfAKindOnce) {
  std::vector<std::string> said;
  DdsLog log([&said](const std::string& text) { said.push_back(text); });
  for (int i = 0; i < 100; ++i) log.take("sample #" + std::to_string(i) + " of rt/imu cannot be read\n");
  log.take("another one");
  EXPECT_EQ(said, (std::vector<std::string>{"DDS: sample #0 of rt/imu cannot be read", "DDS: another one"}));
}

}  // namespace types_test
}  // namespace kilvo::dds
