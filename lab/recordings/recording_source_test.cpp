#include "lab/recordings/recording_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/messages/input_error.hpp"
#include "lab/messages/tiny_cloud.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace recording_source_test {

RecordingOptions use(std::initializer_list<Sensor> sensors) {
  RecordingOptions options;
  for (const Sensor sensor : sensors) options[sensor] = {true, tiny_topics[static_cast<std::size_t>(sensor)], 0, 0};
  return options;
}

RecordingOptions use_all() { return use({Sensor::imu, Sensor::legs, Sensor::lidar, Sensor::camera}); }

std::vector<Measurement> drain(RecordingSource& source) {
  std::vector<Measurement> all;
  while (auto m = source.next()) all.push_back(*std::move(m));
  return all;
}

std::string error_of(const std::filesystem::path& path, const RecordingOptions& options) {
  try {
    RecordingSource source(path, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// A recording of clouds only, all alike.
void write_clouds(const std::filesystem::path& path, int count, TinyCloud cloud) {
  Rosbag1Writer writer(path);
  const auto id = writer.add_connection("/points", written_type(Sensor::lidar));
  for (int i = 0; i < count; ++i, cloud.stamp += std::chrono::milliseconds(100)) writer.write(id, cloud.stamp, cloud.bytes());
  writer.close();
}

TEST(RecordingSource, GivesTheMeasurementsBackInOrder) {
  const TemporaryFolder folder;
  const auto walk = tiny_walk();
  write_bag(folder / "walk.bag", walk);
  RecordingSource source(folder / "walk.bag", use_all());
  EXPECT_EQ(source.begin(), tiny_begin);
  EXPECT_EQ(source.duration(), std::chrono::milliseconds(495));
  EXPECT_EQ(source.point_time().text(), "timestamp (float64): nanoseconds, absolute");
  const auto read = drain(source);
  ASSERT_EQ(read.size(), walk.size());
  for (std::size_t i = 0; i < walk.size(); ++i) {
    ASSERT_EQ(sensor_of(read[i]), sensor_of(walk[i]));
    EXPECT_EQ(encode(read[i], ""), encode(walk[i], ""));
  }
  EXPECT_EQ(source.counts(Sensor::imu).used, 50U);
  EXPECT_EQ(source.counts(Sensor::legs).used, 100U);
  EXPECT_EQ(source.counts(Sensor::lidar).used, 5U);
  EXPECT_EQ(source.counts(Sensor::camera).used, 5U);
  EXPECT_EQ(source.progress(), 1);
  EXPECT_FALSE(source.input_damaged());
  EXPECT_THAT(source.warnings(), ::testing::IsEmpty());
}

TEST(RecordingSource, ReadsOnlyTheSensorsInUse) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  RecordingSource source(folder / "walk.bag", use({Sensor::imu}));
  for (const auto& m : drain(source)) EXPECT_EQ(sensor_of(m), Sensor::imu);
  EXPECT_EQ(source.counts(Sensor::imu).used, 50U);
  EXPECT_EQ(source.topic(Sensor::imu), "/imu");
  EXPECT_EQ(source.topic(Sensor::camera), "");
}

TEST(RecordingSource, StartAndDurationCutAPartOut) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  auto options = use({Sensor::imu});
  options.start = 0.1;
  options.duration = 0.2;
  RecordingSource source(folder / "walk.bag", options);
  const auto read = drain(source);
  ASSERT_EQ(read.size(), 20U);
  EXPECT_EQ(stamp_of(read.front()), tiny_begin + std::chrono::milliseconds(100));
  EXPECT_EQ(stamp_of(read.back()), tiny_begin + std::chrono::milliseconds(290));
  EXPECT_TRUE(source.counts(Sensor::imu).dropped.empty()) << "what was not asked for is not dropped";
}

TEST(RecordingSource, TimeOffsetsMoveTheStamps) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  auto options = use({Sensor::imu, Sensor::lidar});
  options[Sensor::imu].time_offset = -0.001;
  options[Sensor::lidar].time_offset = 0.25;
  RecordingSource source(folder / "walk.bag", options);
  bool first_imu = true, first_scan = true;
  for (const auto& m : drain(source)) {
    bool& first = sensor_of(m) == Sensor::imu ? first_imu : first_scan;
    if (!std::exchange(first, false)) continue;
    EXPECT_EQ(stamp_of(m) - tiny_begin, sensor_of(m) == Sensor::imu ? Duration(-1'000'000) : Duration(250'000'000));
  }
  EXPECT_FALSE(first_imu || first_scan);
}

TEST(RecordingSource, TheGyrosScaleMultipliesItsRates) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  auto options = use({Sensor::imu});
  RecordingSource as_written(folder / "walk.bag", options);
  options[Sensor::imu].gyro_scale = {2, 1, 0.5};
  RecordingSource scaled(folder / "walk.bag", options);
  const auto before = drain(as_written), after = drain(scaled);
  ASSERT_EQ(before.size(), after.size());
  ASSERT_FALSE(before.empty());
  double turning = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto &raw = std::get<ImuSample>(before[i]), &used = std::get<ImuSample>(after[i]);
    EXPECT_EQ(used.gyro, raw.gyro.cwiseProduct(Eigen::Vector3d(2, 1, 0.5)));
    EXPECT_EQ(used.accel, raw.accel);
    turning += raw.gyro.norm();
  }
  EXPECT_GT(turning, 0);
}

TEST(RecordingSource, AWantedSensorWithoutATopicIsAnErrorThatNamesTheFileAndTheNearest) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  auto options = use({Sensor::imu});
  options[Sensor::imu].topic = "/imo";
  EXPECT_EQ(error_of(folder / "walk.bag", options),
            (folder / "walk.bag").string() + ": no topic /imo for the sensor imu; the nearest is /imu (sensor_msgs/Imu)");
  options[Sensor::imu].topic = "/joints";
  EXPECT_EQ(error_of(folder / "walk.bag", options),
            (folder / "walk.bag").string() +
                ": topic /joints is of type sensor_msgs/JointState, but the sensor imu needs sensor_msgs/Imu or unitree_hg/LowState or "
                "unitree_hg/IMUState or unitree_go/LowState");
}

TEST(RecordingSource, CloudsWithoutPointTimesAreAnErrorUnlessDeskewingIsOff) {
  const TemporaryFolder folder;
  write_clouds(folder / "absent.bag", 6, TinyCloud::line(101));
  auto equal = TinyCloud::line(101);
  equal.with_times<float>("time", ScalarType::float32, [](std::size_t) { return 0.5; });
  write_clouds(folder / "equal.bag", 6, equal);
  auto options = use({Sensor::lidar});
  EXPECT_EQ(error_of(folder / "absent.bag", options),
            "/points: the clouds have no point times (fields: x y z intensity); --no-deskew takes each cloud at its stamp");
  EXPECT_EQ(error_of(folder / "equal.bag", options),
            "/points: the point times are all equal (field time; fields: x y z intensity time); --no-deskew takes each cloud at its stamp");
  options.no_deskew = true;
  for (const char* name : {"absent.bag", "equal.bag"}) {
    RecordingSource source(folder / name, options);
    const auto scans = drain(source);
    ASSERT_EQ(scans.size(), 6U);
    for (const auto& p : std::get<LidarScan>(scans[3]).points) EXPECT_EQ(p.offset_ns, 0);
  }
}

TEST(RecordingSource, SmallCloudsBeforeTheFirstFullOnesDoNotDecide) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "slow.bag");
    const auto id = writer.add_connection("/points", written_type(Sensor::lidar));
    Time t = tiny_begin;
    for (int i = 0; i < 12; ++i, t += std::chrono::milliseconds(100)) {
      auto cloud = TinyCloud::line(i < 8 ? 3 : 150);  // something stands before the sensor at first
      cloud.stamp = t;
      cloud.with_times<float>("time", ScalarType::float32, [&](std::size_t k) { return i < 8 ? 0 : 0.0006 * static_cast<double>(k); });
      writer.write(id, t, cloud.bytes());
    }
    writer.close();
  }
  RecordingSource source(folder / "slow.bag", use({Sensor::lidar}));
  EXPECT_EQ(source.point_time().text(), "time (float32): seconds, from the scan's start");
  EXPECT_EQ(drain(source).size(), 12U);
}

TEST(RecordingSource, UndecodableMessagesAreDroppedCountedAndExplained) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "bad.bag");
    const auto id = writer.add_connection("/imu", written_type(Sensor::imu));
    writer.write(id, tiny_begin, encode(ImuSample{tiny_begin, {}, {}}, "imu"));
    for (int i = 0; i < 3; ++i) writer.write(id, tiny_begin, std::vector<std::uint8_t>(10));
    writer.close();
  }
  RecordingSource source(folder / "bad.bag", use({Sensor::imu}));
  EXPECT_EQ(drain(source).size(), 1U);
  EXPECT_EQ(source.counts(Sensor::imu).used, 1U);
  EXPECT_EQ(source.counts(Sensor::imu).dropped.at("undecodable"), 3U);
  EXPECT_THAT(source.warnings(),
              ::testing::ElementsAre("/imu: 3 messages not decodable; the first: sensor_msgs/Imu: a field at byte 8 does not "
                                     "fit the message's 10 bytes"));
}

TEST(RecordingSource, AMessageOfMoreThan64MegabytesIsDroppedUnread) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "huge.bag");
    const auto id = writer.add_connection("/camera/image_raw", written_type(Sensor::camera));
    writer.write(id, tiny_begin, std::vector<std::uint8_t>(most_message_bytes + 1));
    writer.close();
  }
  RecordingSource source(folder / "huge.bag", use({Sensor::camera}));
  EXPECT_TRUE(drain(source).empty());
  EXPECT_EQ(source.counts(Sensor::camera).dropped, (std::map<std::string, std::uint64_t>{{"too_large", 1}}));
  EXPECT_THAT(source.warnings(), ::testing::ElementsAre("/camera/image_raw: 1 message of more than 64 MB not read"));
}

TEST(RecordingSource, PointsWithAbsurdTimesAreCountedAndWarnedOf) {
  const TemporaryFolder folder;
  auto cloud = TinyCloud::line(150);
  cloud.with_times<float>("time", ScalarType::float32, [](std::size_t i) { return i == 7 ? 50 : 0.0006 * static_cast<double>(i); });
  write_clouds(folder / "absurd.bag", 6, cloud);
  RecordingSource source(folder / "absurd.bag", use({Sensor::lidar}));
  for (const auto& m : drain(source)) EXPECT_EQ(std::get<LidarScan>(m).points.size(), 149U);
  EXPECT_EQ(source.counts(Sensor::lidar).absurd_point_times, 6U);
  EXPECT_THAT(source.warnings(), ::testing::ElementsAre("/points: 6 points dropped, whose time is not within 2 s of the stamp"));
}

TEST(RecordingSource, PointsThatTheCloudBeforeHeldAreUsedOnceAndWarnedOf) {
  const TemporaryFolder folder;
  std::vector<LidarPoint> points;  // of three sweeps
  for (int i = 0; i < 3000; ++i) points.push_back({1.0F + 0.001F * static_cast<float>(i), 2, 3, 0, 100'000 * i});
  std::vector<Measurement> clouds;
  for (int i = 0; i < 2; ++i) {
    const Duration later = std::chrono::milliseconds(100 * i);
    LidarScan scan{tiny_begin + later, {points.begin() + 1000 * i, points.begin() + 1000 * i + 2000}};
    for (LidarPoint& p : scan.points) p.offset_ns -= static_cast<std::int32_t>(later.count());
    clouds.emplace_back(scan);
  }
  write_bag(folder / "accumulated.bag", clouds);
  RecordingSource source(folder / "accumulated.bag", use({Sensor::lidar}));
  std::vector<std::size_t> sizes;
  for (const auto& m : drain(source)) sizes.push_back(std::get<LidarScan>(m).points.size());
  EXPECT_THAT(sizes, ::testing::ElementsAre(2000U, 1000U));
  ASSERT_EQ(source.warnings().size(), 1U);
  EXPECT_THAT(source.warnings().front(), ::testing::HasSubstr(": clouds repeat points of the one before: 1000 points used once"));
}

TEST(RecordingSource, ACutRecordingIsUsedAsFarAsItGoesAndTheOffsetIsNamed) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  const auto content = file_content(folder / "walk.bag");
  set_file_content(folder / "cut.bag", Bytes(content).first(content.size() / 2));
  RecordingSource source(folder / "cut.bag", use({Sensor::imu}));
  EXPECT_GT(drain(source).size(), 10U);
  EXPECT_TRUE(source.input_damaged());
  const std::string offset = std::to_string(content.size() / 2);
  EXPECT_THAT(source.warnings(), ::testing::ElementsAre((folder / "cut.bag").string() + ": damaged at byte " + offset +
                                                        ": the file ends in the middle of a chunk; what could be read is used"));
}

TEST(RecordingSource, ATopicWithoutMessagesIsWarnedOf) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "empty.bag");
    const auto imu = writer.add_connection("/imu", written_type(Sensor::imu));
    writer.add_connection("/points", written_type(Sensor::lidar));
    writer.write(imu, tiny_begin, encode(ImuSample{tiny_begin, {}, {}}, ""));
    writer.close();
  }
  RecordingSource source(folder / "empty.bag", use({Sensor::imu, Sensor::lidar}));
  drain(source);
  EXPECT_THAT(source.warnings(), ::testing::ElementsAre("/points: no messages"));
}

TEST(RecordingSource, MessagesWithoutAStampGetTheTimeOfTheirRecording) {
  const TemporaryFolder folder;
  {
    Rosbag1Writer writer(folder / "unstamped.bag");
    const auto id = writer.add_connection("/joints", written_type(Sensor::legs));
    for (int i = 0; i < 3; ++i)
      writer.write(id, tiny_begin + std::chrono::milliseconds(i), encode(JointSample{Time{}, {"knee"}, {1}, {}, {}}, ""));
    writer.close();
  }
  RecordingSource source(folder / "unstamped.bag", use({Sensor::legs}));
  const auto read = drain(source);
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(stamp_of(read[2]), tiny_begin + std::chrono::milliseconds(2));
  EXPECT_THAT(source.warnings(), ::testing::ElementsAre("/joints: 3 messages without a stamp: the time of recording is used"));
}

TEST(RecordingSource, TwoReadingsGiveTheSameBytes) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  RecordingSource first(folder / "walk.bag", use_all()), second(folder / "walk.bag", use_all());
  while (const auto m = first.next()) {
    const auto other = second.next();
    ASSERT_TRUE(other);
    EXPECT_EQ(encode(*m, ""), encode(*other, ""));
  }
}

}  // namespace recording_source_test
}  // namespace kilvo::lab
