// The message types that KILVO speaks over DDS.
#pragma once

#include <span>
#include <string>
#include <string_view>

struct dds_topic_descriptor;

namespace kilvo::dds {

struct DdsType {
  std::string_view name;               // plain: "sensor_msgs/Imu"
  std::string_view ros_hash;           // 64 hexadecimal digits, of ROS 2 (RIHS01); empty: no type of ROS
  const dds_topic_descriptor* layout;  // made by the IDL compiler
};

std::span<const DdsType> all_types();

/// nullptr: KILVO does not speak it.
const DdsType* find_type(std::string_view plain_name);

/// "sensor_msgs::msg::dds_::Imu_" for "sensor_msgs/Imu".
std::string dds_type_name(const DdsType& type);

/// The name of a topic on the wire: "rt/imu/data" for "/imu/data"; one that begins with rt/ is one already.
std::string dds_topic(std::string_view configured);

}  // namespace kilvo::dds
