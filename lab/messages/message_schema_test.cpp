#include "lab/messages/message_schema.hpp"

#include <gmock/gmock.h>

#include "lab/messages/encode.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {
namespace message_schema_test {

using testing::HasSubstr;
using Content = std::vector<std::uint8_t>;
const Time stamp = time_from_ns(1'700'000'000'000'000'001);

MessageSchema schema_of(std::string_view type) { return *MessageSchema::parse(type, known_definition(type)); }

/// The two descriptions of a type, its definition and our fields, must lead to the same bytes.
void expect_same(std::string_view type, const Content& ros1, const Content& cdr) {
  const MessageSchema schema = schema_of(type);
  const auto forth = schema.convert({ros1, Encoding::ros1}, Encoding::cdr);
  ASSERT_TRUE(forth) << forth.reason();
  EXPECT_EQ(*forth, cdr) << type;
  const auto back = schema.convert({cdr, Encoding::cdr}, Encoding::ros1);
  ASSERT_TRUE(back) << back.reason();
  EXPECT_EQ(*back, ros1) << type;
}

TEST(MessageSchema, AgreesWithTheFieldsThatWeReadAndWrite) {
  const std::vector<Measurement> measurements{
      ImuSample{stamp, {1, 2, 3}, {4, 5, 6}}, JointSample{stamp, {"knee", "a", "ankle"}, {0.5, 1, 2}, {}, {3}},
      LidarScan{stamp, {{1, 2, 3, 4, 511}, {5, 6, 7, 8, 0}}}, CameraImage{stamp, {2, 1, 1, {7, 8}}}};
  for (const auto& m : measurements) {
    for (const std::string frame : {"", "a", "abc", "imu_link"})
      expect_same(written_type(sensor_of(m)).name, encode(m, frame), encode(m, frame, Encoding::cdr));
  }
  CompressedImageMessage image;
  image.header = {{}, stamp, "camera"};
  image.format = "jpeg";
  const Content file{1, 2, 3};
  image.data = Numbers<std::uint8_t>::of(file);
  expect_same("sensor_msgs/CompressedImage", write_message(image, Encoding::ros1), write_message(image, Encoding::cdr));
  LivoxMessage livox;
  livox.header.frame_id = "livox";
  Content points(2 * LivoxPoint::wire_bytes);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<std::uint8_t>(i);
  livox.points = {points, LivoxPoint::wire_bytes};
  expect_same("livox_ros_driver2/CustomMsg", write_message(livox, Encoding::ros1), write_message(livox, Encoding::cdr));
}

TEST(MessageSchema, SumsAreThoseOfRos) {
  for (const Sensor sensor : all_sensors) {
    const auto& type = written_type(sensor);
    EXPECT_EQ(schema_of(type.name).md5(), type.md5sum) << type.name;
  }
  EXPECT_EQ(schema_of("nav_msgs/Odometry").md5(), "cd5e73d190d741a2f92e81eda573aca7");
  EXPECT_EQ(schema_of("tf2_msgs/TFMessage").md5(), "94810edda583a504dfda3829e70d7eec");
  EXPECT_EQ(schema_of("nav_msgs/Path").md5(), "6227e2b7e9cce15051f669a5e197bbf7");
  EXPECT_EQ(schema_of("geometry_msgs/PoseArray").md5(), "916c28c5764443f268b296bb671b9d97");
  EXPECT_EQ(schema_of("diagnostic_msgs/DiagnosticArray").md5(), "60810da900de1dd6ddd437c3503511da");
  EXPECT_EQ(schema_of("sensor_msgs/CompressedImage").md5(), "8f7a12909da2c9d3332d540a0977563f");
  EXPECT_EQ(schema_of("std_msgs/String").md5(), "992ce8a1687cec8c8bd883ec73ca41d1");
}

TEST(MessageSchema, TheTextOfOneIsUnderstoodAsTheOther) {
  const MessageSchema ros1 = schema_of("sensor_msgs/Imu");
  const std::string text = ros1.text(Encoding::cdr);
  EXPECT_THAT(text, HasSubstr("std_msgs/Header header\n"));
  EXPECT_THAT(text, HasSubstr("MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"));
  const auto ros2 = MessageSchema::parse("sensor_msgs/Imu", text);
  ASSERT_TRUE(ros2) << ros2.reason();
  EXPECT_EQ(ros2->md5(), ros1.md5());
  EXPECT_EQ(ros2->text(Encoding::ros1), ros1.text(Encoding::ros1));
}

TEST(MessageSchema, MatricesOfACameraHaveSmallNamesInRos2) {
  const auto schema = MessageSchema::parse("sensor_msgs/CameraInfo", "float64[] D\nfloat64[9] K\nuint32 binning_x\n");
  ASSERT_TRUE(schema) << schema.reason();
  EXPECT_EQ(schema->text(Encoding::cdr), "float64[] d\nfloat64[9] k\nuint32 binning_x\n");
  const auto back = MessageSchema::parse("sensor_msgs/CameraInfo", schema->text(Encoding::cdr));
  EXPECT_EQ(back->md5(), schema->md5());
}

TEST(MessageSchema, UnderstandsWhatRos2MayWrite) {
  const auto schema = MessageSchema::parse("a/B",
                                           "# a comment\nstring<=10 name \"x # y\"  # another\nint32[<=3] some\nfloat64[2] two [1.0, 2.0]\n"
                                           "bool yes true\nuint8 LIMIT=3\nstring TEXT='a=b'\nC[] inner\nbuiltin_interfaces/Duration left\n"
                                           "================\nMSG: a/C\nbyte[3] b\n");
  ASSERT_TRUE(schema) << schema.reason();
  EXPECT_EQ(schema->types().front().fields.size(), 6U);
  EXPECT_EQ(schema->types().front().constants.size(), 2U);
  EXPECT_EQ(schema->text(Encoding::ros1),
            "uint8 LIMIT=3\nstring TEXT='a=b'\nstring name\nint32[] some\nfloat64[2] two\nbool yes\na/C[] inner\nduration left\n" +
                std::string(80, '=') + "\nMSG: a/C\nbyte[3] b\n");
}

TEST(MessageSchema, SaysWhatItDoesNotUnderstand) {
  EXPECT_THAT(MessageSchema::parse("a/B", "int32\n").reason(), HasSubstr("not understood: int32"));
  EXPECT_THAT(MessageSchema::parse("a/B", "Missing m\n").reason(), HasSubstr("a/Missing is missing"));
  EXPECT_THAT(MessageSchema::parse("a/B", "wstring w\n").reason(), HasSubstr("not understood"));
  EXPECT_THAT(MessageSchema::parse("a/B", "B b\n").reason(), HasSubstr("without end"));
}

TEST(MessageSchema, AMessageThatDoesNotFitItsDefinitionIsRefused) {
  const MessageSchema schema = schema_of("sensor_msgs/JointState");
  for (const Encoding encoding : {Encoding::ros1, Encoding::cdr}) {
    const Content bytes = encode(JointSample{stamp, {"knee"}, {1}, {2}, {3}}, "base", encoding);
    const Encoding other = encoding == Encoding::cdr ? Encoding::ros1 : Encoding::cdr;
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(schema.convert({Bytes(bytes).first(size), encoding}, other)) << size;
  }
}

}  // namespace message_schema_test
}  // namespace kilvo::lab
