// The definitions of the messages that KILVO writes: comments left out, which ROS leaves out of its sums too.
#include <array>

#include "lab/messages/encode.hpp"
#include "lab/messages/message_schema.hpp"

namespace kilvo::lab {
namespace {

constexpr MessageType imu{"sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2", R"(Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
)"};

constexpr MessageType joint_state{"sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd", R"(Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
)"};

constexpr MessageType point_cloud2{"sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181", R"(Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
)"};

constexpr MessageType image{"sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743", R"(Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
)"};

constexpr std::string_view compressed_image = R"(Header header
string format
uint8[] data
)";

constexpr std::string_view livox = R"(Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
CustomPoint[] points
================================================================================
MSG: livox_ros_driver2/CustomPoint
uint32 offset_time
float32 x
float32 y
float32 z
uint8 reflectivity
uint8 tag
uint8 line
)";

constexpr std::string_view transforms = R"(geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
)";

constexpr std::string_view path = R"(Header header
geometry_msgs/PoseStamped[] poses
================================================================================
MSG: geometry_msgs/PoseStamped
Header header
geometry_msgs/Pose pose
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
)";

constexpr std::string_view poses = R"(Header header
geometry_msgs/Pose[] poses
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
)";

constexpr std::string_view diagnostics = R"(Header header
diagnostic_msgs/DiagnosticStatus[] status
================================================================================
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values
================================================================================
MSG: diagnostic_msgs/KeyValue
string key
string value
)";

constexpr std::string_view odometry = R"(Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
================================================================================
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
================================================================================
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
)";

}  // namespace

std::string_view known_definition(std::string_view type) {
  for (const MessageType* known : {&imu, &joint_state, &point_cloud2, &image}) {
    if (known->name == type) return known->definition;
  }
  if (type == "sensor_msgs/CompressedImage") return compressed_image;
  if (type == "livox_ros_driver2/CustomMsg") return livox;
  if (type == "tf2_msgs/TFMessage") return transforms;
  if (type == "nav_msgs/Odometry") return odometry;
  if (type == "nav_msgs/Path") return path;
  if (type == "geometry_msgs/PoseArray") return poses;
  if (type == "diagnostic_msgs/DiagnosticArray") return diagnostics;
  if (type == "std_msgs/String") return "string data\n";
  return {};
}

const MessageType& written_type(Sensor sensor) {
  static constexpr std::array<const MessageType*, sensor_count> types{&imu, &joint_state, &point_cloud2, &image};
  return *types[static_cast<std::size_t>(sensor)];
}

}  // namespace kilvo::lab
