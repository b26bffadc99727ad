// The same bags seen by Debian's python3-rosbag: it must be installed, or these tests fail.
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>
#include <set>

#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace rosbag1_oracle_test {

void run_oracle(const std::string& arguments) {
  const std::string command = "/usr/bin/python3 " KILVO_SOURCE_DIR "/lab/recordings/rosbag_oracle.py " + arguments;
  ASSERT_EQ(std::system(command.c_str()), 0) << command << "\n(apt install python3-rosbag)";
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, " %.17g", value);
  return text;
}

std::string words_of(const ImuSample& m) {
  std::string text;
  for (const double v : {m.gyro.x(), m.gyro.y(), m.gyro.z(), m.accel.x(), m.accel.y(), m.accel.z()}) text += number(v);
  return text;
}

std::string words_of(const JointSample& m) {
  std::string text;
  for (const auto& name : m.names) text += " " + name;
  for (const auto* values : {&m.position, &m.velocity, &m.effort}) {
    for (const double v : *values) text += number(v);
  }
  return text;
}

std::string words_of(const LidarScan& m) {
  const LidarPoint& last = m.points.back();
  std::string text = " 1 " + std::to_string(m.points.size()) + " x y z intensity timestamp";
  for (const float v : {last.x, last.y, last.z, last.intensity}) text += number(v);
  return text + number(static_cast<double>(to_ns(m.t) + last.offset_ns));
}

/// CRC-32 as zlib and PNG have it.
std::uint32_t crc32(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t crc = ~0U;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1)));
  }
  return ~crc;
}

std::string words_of(const CameraImage& m) {
  const std::string size = std::to_string(m.image.width) + " " + std::to_string(m.image.height) + " " + std::to_string(m.image.width);
  return " " + size + " mono8" + number(crc32(m.image.pixels));
}

/// The line that the oracle prints for a measurement.
std::string line_of(const Measurement& m) {
  const Sensor sensor = sensor_of(m);
  const std::string ns = std::to_string(to_ns(stamp_of(m)));
  const std::string words = std::visit([](const auto& x) { return words_of(x); }, m);
  return tiny_topics[static_cast<std::size_t>(sensor)] + " " + std::string(written_type(sensor).name) + " " + ns + " " + ns + " " +
         name_of(sensor) + words;
}

class RosbagOracle : public ::testing::TestWithParam<Rosbag1Writer::Compression> {};

TEST_P(RosbagOracle, PythonReadsWhatWeWrite) {
  const TemporaryFolder folder;
  const auto walk = tiny_walk();
  write_bag(folder / "ours.bag", walk, 4096, GetParam());
  run_oracle("dump " + (folder / "ours.bag").string() + " > " + (folder / "lines").string());
  std::ifstream lines(folder / "lines");
  std::multiset<std::string> expected, found;  // messages of the same time may come in any order
  for (const auto& measurement : walk) expected.insert(line_of(measurement));
  for (std::string line; std::getline(lines, line);) found.insert(line);
  EXPECT_EQ(found, expected);
}

INSTANTIATE_TEST_SUITE_P(Compressions, RosbagOracle, ::testing::Values(Rosbag1Writer::Compression::none, Rosbag1Writer::Compression::lz4),
                         [](const auto& param) { return param.param == Rosbag1Writer::Compression::none ? "None" : "Lz4"; });

class RosbagOfPython : public ::testing::TestWithParam<const char*> {};

TEST_P(RosbagOfPython, WeReadWhatPythonWrites) {
  const TemporaryFolder folder;
  write_bag(folder / "ours.bag", tiny_walk());
  run_oracle("copy " + (folder / "ours.bag").string() + " " + (folder / "pythons.bag").string() + " " + GetParam());

  Rosbag1Reader ours(folder / "ours.bag"), pythons(folder / "pythons.bag");
  const auto by_topic = [](Rosbag1Reader& reader) {
    std::multiset<std::tuple<std::string, Time, std::vector<std::uint8_t>>> messages;
    while (const auto m = reader.next()) messages.insert({m->connection->topic, m->time, {m->bytes.begin(), m->bytes.end()}});
    return messages;
  };
  const auto expected = by_topic(ours), found = by_topic(pythons);
  EXPECT_EQ(expected.size(), tiny_walk().size());
  EXPECT_TRUE(found == expected);
  EXPECT_FALSE(pythons.damage());
  EXPECT_GT(pythons.chunks().size(), 5U);
  for (const auto& chunk : pythons.chunks()) {
    EXPECT_EQ(chunk.compression, GetParam());
    EXPECT_TRUE(chunk.indexed);
  }
  ASSERT_EQ(pythons.connections().size(), 4U);
  const auto types = [](const Rosbag1Reader& reader) {
    std::set<std::tuple<std::string, std::string, std::string>> all;
    for (const auto& [id, connection] : reader.connections()) all.insert({connection.topic, connection.type, connection.md5sum});
    return all;
  };
  EXPECT_EQ(types(pythons), types(ours));
}

INSTANTIATE_TEST_SUITE_P(Compressions, RosbagOfPython, ::testing::Values("none", "bz2", "lz4"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace rosbag1_oracle_test
}  // namespace kilvo::lab
