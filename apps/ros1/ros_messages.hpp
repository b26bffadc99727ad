// What ROS 1 knows the messages of the node by. Its generated headers ask allocators for a member that C++20 has taken from std::allocator;
// with an allocator that still has it they compile as they are.
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseArray.h>
#include <memory>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/service_traits.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/SetBoolRequest.h>
#include <std_srvs/SetBoolResponse.h>
#include <std_srvs/TriggerRequest.h>
#include <std_srvs/TriggerResponse.h>
#include <tf2_msgs/TFMessage.h>

#include "kilvo/sensors/time.hpp"

namespace kilvo::ros1 {

template <class T>
struct Allocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = Allocator<U>;
  };
  Allocator() = default;
  template <class U>
  Allocator(const Allocator<U>&) {}  // NOLINT(google-explicit-constructor): what an allocator must be able to do
};

using RosAllocator = Allocator<void>;
using OdometryMessage = nav_msgs::Odometry_<RosAllocator>;
using PathMessage = nav_msgs::Path_<RosAllocator>;
using PosesMessage = geometry_msgs::PoseArray_<RosAllocator>;
using TransformsMessage = tf2_msgs::TFMessage_<RosAllocator>;
using CloudMessage = sensor_msgs::PointCloud2_<RosAllocator>;
using JointMessage = sensor_msgs::JointState_<RosAllocator>;
using DiagnosticsMessage = diagnostic_msgs::DiagnosticArray_<RosAllocator>;
using Trigger = std_srvs::TriggerRequest_<RosAllocator>;
using TriggerAnswer = std_srvs::TriggerResponse_<RosAllocator>;
using SetBool = std_srvs::SetBoolRequest_<RosAllocator>;
using SetBoolAnswer = std_srvs::SetBoolResponse_<RosAllocator>;

inline Time time_of(const ros::Time& t) { return time_from_ns(static_cast<std::int64_t>(t.toNSec())); }

}  // namespace kilvo::ros1

// What identifies a service is written only for the standard allocator; the sums are those of std_srvs 1.11.
namespace ros::service_traits {

template <class Message>
struct TriggerTraits {
  static const char* value() { return "937c9679a518e3a18d831e57125ea522"; }
  static const char* value(const Message&) { return value(); }
};
template <class Message>
struct SetBoolTraits {
  static const char* value() { return "09fb03525b03e7ea1fd3992bafd87e16"; }
  static const char* value(const Message&) { return value(); }
};
template <class Message>
struct TriggerName {
  static const char* value() { return "std_srvs/Trigger"; }
  static const char* value(const Message&) { return value(); }
};
template <class Message>
struct SetBoolName {
  static const char* value() { return "std_srvs/SetBool"; }
  static const char* value(const Message&) { return value(); }
};

// clang-format off
template <> struct MD5Sum<kilvo::ros1::Trigger> : TriggerTraits<kilvo::ros1::Trigger> {};
template <> struct MD5Sum<kilvo::ros1::TriggerAnswer> : TriggerTraits<kilvo::ros1::TriggerAnswer> {};
template <> struct MD5Sum<kilvo::ros1::SetBool> : SetBoolTraits<kilvo::ros1::SetBool> {};
template <> struct MD5Sum<kilvo::ros1::SetBoolAnswer> : SetBoolTraits<kilvo::ros1::SetBoolAnswer> {};
template <> struct DataType<kilvo::ros1::Trigger> : TriggerName<kilvo::ros1::Trigger> {};
template <> struct DataType<kilvo::ros1::TriggerAnswer> : TriggerName<kilvo::ros1::TriggerAnswer> {};
template <> struct DataType<kilvo::ros1::SetBool> : SetBoolName<kilvo::ros1::SetBool> {};
template <> struct DataType<kilvo::ros1::SetBoolAnswer> : SetBoolName<kilvo::ros1::SetBoolAnswer> {};
// clang-format on

}  // namespace ros::service_traits
