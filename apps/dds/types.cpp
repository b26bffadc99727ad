#include "apps/dds/types.hpp"

#include <algorithm>
#include <array>
#include <ros2.h>
#include <unitree.h>

namespace kilvo::dds {
namespace {

// The hashes are computed from idl/ros2.idl by tests/dds/type_hashes.py, and held against it by a test.
const std::array<DdsType, 14> types{{
    {"sensor_msgs/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b", &sensor_msgs_msg_dds__Imu__desc},
    {"sensor_msgs/JointState", "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e", &sensor_msgs_msg_dds__JointState__desc},
    {"sensor_msgs/PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
     &sensor_msgs_msg_dds__PointCloud2__desc},
    {"sensor_msgs/Image", "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47", &sensor_msgs_msg_dds__Image__desc},
    {"sensor_msgs/CompressedImage", "15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
     &sensor_msgs_msg_dds__CompressedImage__desc},
    {"livox_ros_driver2/CustomMsg", "2eb17e5e35bf5a2d6cd079f3c57f33abf95e5bf7d71b42cddc05daace73d815a",
     &livox_ros_driver2_msg_dds__CustomMsg__desc},
    {"unitree_hg/LowState", "", &unitree_hg_msg_dds__LowState__desc},
    {"unitree_hg/IMUState", "", &unitree_hg_msg_dds__IMUState__desc},
    {"nav_msgs/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0", &nav_msgs_msg_dds__Odometry__desc},
    {"nav_msgs/Path", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b", &nav_msgs_msg_dds__Path__desc},
    {"tf2_msgs/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087", &tf2_msgs_msg_dds__TFMessage__desc},
    {"geometry_msgs/PoseArray", "af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0",
     &geometry_msgs_msg_dds__PoseArray__desc},
    {"diagnostic_msgs/DiagnosticArray", "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
     &diagnostic_msgs_msg_dds__DiagnosticArray__desc},
    {"std_msgs/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18", &std_msgs_msg_dds__String__desc},
}};

}  // namespace

std::span<const DdsType> all_types() { return types; }

const DdsType* find_type(std::string_view plain_name) {
  const auto* found = std::ranges::find(types, plain_name, &DdsType::name);
  return found == types.end() ? nullptr : found;
}

std::string dds_type_name(const DdsType& type) { return type.layout->m_typename; }

std::string dds_topic(std::string_view configured) {
  if (configured.starts_with("rt/")) return std::string(configured);
  if (configured.starts_with('/')) configured.remove_prefix(1);
  return "rt/" + std::string(configured);
}

}  // namespace kilvo::dds
