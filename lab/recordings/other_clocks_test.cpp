// Recordings of robots whose sensors do not share one clock, or whose legs come in parts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/recordings/mcap_writer.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace other_clocks_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Duration years = std::chrono::hours(24 * 365 * 40);

struct Message {
  Measurement m;
  Time recorded;
};

/// Two seconds and a half of the tiny walk, each message recorded 2 ms after it was measured, in the order of arrival.
std::vector<Message> walk() {
  std::vector<Message> out;
  for (const Measurement& m : tiny_walk(2500)) {
    const auto* scan = std::get_if<LidarScan>(&m);
    out.push_back({m, (scan != nullptr ? end_of(*scan) : stamp_of(m)) + std::chrono::milliseconds(2)});
  }
  std::ranges::stable_sort(out, {}, &Message::recorded);
  return out;
}

void write(const std::filesystem::path& path, const std::vector<Message>& messages) {
  RecordingWriter writer(path, tiny_topics);
  for (const Message& m : messages) writer.write(m.m, m.recorded);
  writer.close();
}

RecordingOptions use_all() {
  RecordingOptions options;
  for (const Sensor sensor : all_sensors) options[sensor] = {true, tiny_topics[index_of(sensor)], 0, 0};
  return options;
}

void move(std::vector<Message>& messages, Sensor sensor, Duration by) {
  for (Message& m : messages) {
    if (sensor_of(m.m) == sensor) std::visit([by](auto& x) { x.t += by; }, m.m);
  }
}

/// Reads the recording; each measurement must be the one of the walk in this place, at its time by the IMU's clock.
std::vector<std::string> expect_walk(const std::filesystem::path& path, Duration imu_clock) {
  RecordingSource source(path, use_all());
  for (const Message& m : walk()) {
    const auto read = source.next();
    if (!read) {
      ADD_FAILURE() << "the recording ends too early";
      break;
    }
    EXPECT_EQ(sensor_of(*read), sensor_of(m.m));
    EXPECT_EQ(source.recorded(), m.recorded);
    EXPECT_NEAR(to_seconds(stamp_of(*read) - stamp_of(m.m) - imu_clock), 0, 1e-6);
  }
  EXPECT_FALSE(source.next());
  return source.warnings();
}

TEST(OtherClocks, OfOneEpochAllIsAsRecorded) {
  const TemporaryFolder folder;
  for (const Duration all : {Duration(0), -years}) {
    auto messages = walk();
    for (const Sensor sensor : all_sensors) move(messages, sensor, all);
    write(folder / "one.bag", messages);
    EXPECT_THAT(expect_walk(folder / "one.bag", all), IsEmpty());
  }
}

TEST(OtherClocks, OfAnotherEpochAreBroughtToTheImusFromTheFirstMessageOn) {
  const TemporaryFolder folder;
  auto messages = walk();
  move(messages, Sensor::legs, -years);
  move(messages, Sensor::camera, -years);
  write(folder / "two.bag", messages);
  EXPECT_THAT(expect_walk(folder / "two.bag", Duration(0)),
              ElementsAre(AllOf(HasSubstr("legs: its stamps are of another clock"), HasSubstr("1261440000.000000 s before the IMU's"),
                                HasSubstr("legs.time_offset: 1261440000.000000")),
                          HasSubstr("camera: its stamps are of another clock")));
}

TEST(OtherClocks, LidarAndImuMayBeTheOnesWithTheirOwn) {
  const TemporaryFolder folder;
  auto messages = walk();
  move(messages, Sensor::imu, -years);
  move(messages, Sensor::lidar, -years);
  write(folder / "two.bag", messages);
  EXPECT_THAT(expect_walk(folder / "two.bag", -years), ElementsAre(HasSubstr("legs: its stamps"), HasSubstr("camera: its stamps")));
}

// A LiDAR with its IMU that counts from its start until it finds a PTP master. Nothing is lost meanwhile.
TEST(OtherClocks, ThatAreSetOnTheWayAreFollowedFromTheFirstMessageOn) {
  const TemporaryFolder folder;
  auto messages = walk();
  for (Message& m : messages) {
    const bool is_device = sensor_of(m.m) == Sensor::imu || sensor_of(m.m) == Sensor::lidar;
    if (is_device && stamp_of(m.m) < tiny_begin + std::chrono::milliseconds(1500)) std::visit([](auto& x) { x.t -= years; }, m.m);
  }
  write(folder / "set.bag", messages);
  EXPECT_THAT(expect_walk(folder / "set.bag", -years),
              ElementsAre(HasSubstr("imu: its clock was set while it sent, 1 time"), HasSubstr("legs: its stamps"),
                          AllOf(HasSubstr("lidar: its clock was set"), HasSubstr("moved by -1261440000.000000 s")),
                          HasSubstr("camera: its stamps")));
}

TEST(OtherClocks, TimesOfRecordingThatAreAllEqualChangeNothing) {
  const TemporaryFolder folder;
  auto messages = walk();
  move(messages, Sensor::legs, years);
  for (Message& m : messages) m.recorded = tiny_begin;
  write(folder / "equal.bag", messages);
  RecordingSource source(folder / "equal.bag", use_all());
  for (const Message& m : messages) {
    const auto read = source.next();
    ASSERT_TRUE(read);
    EXPECT_EQ(stamp_of(*read), stamp_of(m.m));
  }
  EXPECT_THAT(source.warnings(), IsEmpty());
}

TEST(OtherClocks, LegsInPartsAreWholeSamplesInEveryFormat) {
  const TemporaryFolder folder;
  const std::vector<JointNames> parts{{"left_knee_joint", "left_elbow_joint"}, {"right_knee_joint"}};
  {
    Rosbag1Writer bag(folder / "parts.bag");
    McapWriter mcap(folder / "parts.mcap", McapWriter::Compression::none, "ros2");
    const auto& type = written_type(Sensor::legs);
    const auto in_bag = bag.add_connection("/joints", type);
    const auto in_mcap = mcap.add_channel({0, "/joints", std::string(type.name), {}, {}, Encoding::cdr});
    for (int i = 0; i < 100; ++i) {
      for (const JointNames& names : parts) {
        const Time t = tiny_begin + std::chrono::milliseconds(2 * i);
        const JointSample part{t, names, std::vector<double>(names.size(), 0.01 * i), {}, {}};
        bag.write(in_bag, t, encode(part, ""));
        mcap.write(in_mcap, t, encode(part, "", Encoding::cdr));
      }
    }
    bag.close();
    mcap.close();
  }
  for (const char* name : {"parts.bag", "parts.mcap"}) {
    RecordingOptions options;
    options[Sensor::legs] = {true, "/joints", 500, 0};
    options[Sensor::legs].joints = {"left_knee_joint", "right_knee_joint"};
    RecordingSource source(folder / name, options);
    int count = 0;
    while (const auto m = source.next()) {
      const auto& sample = std::get<JointSample>(*m);
      EXPECT_THAT(sample.names.list(), ElementsAre("left_knee_joint", "right_knee_joint"));
      EXPECT_THAT(sample.position, ElementsAre(0.01 * count, 0.01 * count));
      ++count;
    }
    EXPECT_EQ(count, 100) << name;
    EXPECT_THAT(source.warnings(), IsEmpty());
  }
}

}  // namespace other_clocks_test
}  // namespace kilvo::lab
