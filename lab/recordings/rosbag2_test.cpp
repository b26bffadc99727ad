// The .db3 files and folders of rosbag2, as they are written here and as they may have suffered; several recordings as one; conversion.
#include <gmock/gmock.h>
#include <random>
#include <set>
#include <zstd.h>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/convert.hpp"
#include "lab/recordings/db3_reader.hpp"
#include "lab/recordings/output_recording.hpp"
#include "lab/recordings/recording_file.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace rosbag2_test {

namespace fs = std::filesystem;
using testing::HasSubstr;
using Content = std::vector<std::uint8_t>;
using Storage = OutputFormat::Storage;
using Compression = OutputFormat::Compression;

/// The tiny walk as a bag, and what else it is converted to.
class Rosbag2 : public testing::Test {
 protected:
  void SetUp() override { write_bag(folder / "walk.bag", tiny_walk()); }

  fs::path convert(const std::string& name, const OutputFormat& format, const std::string& from = "walk.bag") const {
    const auto reader = open_recording(folder / from);
    const auto writer = create_recording(folder / name, format);
    ConvertOptions options;
    options.encoding = format.encoding();
    const ConvertReport report = convert_recording(*reader, *writer, options);
    writer->close();
    EXPECT_THAT(report.warnings, testing::IsEmpty());
    EXPECT_EQ(report.messages, tiny_walk().size());
    return folder / name;
  }

  static std::vector<Measurement> measurements(const std::vector<fs::path>& paths, bool* damaged = nullptr) {
    RecordingOptions options;
    for (std::size_t i = 0; i < sensor_count; ++i) options.sensors[i] = {true, tiny_topics[i], 0, 0};
    RecordingSource source(paths, options);
    std::vector<Measurement> all;
    while (auto m = source.next()) all.push_back(*std::move(m));
    if (damaged != nullptr) *damaged = source.input_damaged();
    return all;
  }

  void expect_the_walk(const std::vector<fs::path>& paths) const {
    bool damaged = true;
    const auto found = measurements(paths, &damaged), expected = tiny_walk();
    EXPECT_FALSE(damaged);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(encode(found[i], ""), encode(expected[i], "")) << i;
  }

  const TemporaryFolder folder;
};

TEST_F(Rosbag2, EveryFormatGivesTheSameMeasurementsInTheSameOrder) {
  expect_the_walk({convert("a.mcap", {Storage::mcap, Compression::zstd})});
  expect_the_walk({convert("b.mcap", {Storage::mcap, Compression::none})});
  expect_the_walk({convert("c.db3", {Storage::db3, Compression::none})});
  expect_the_walk({convert("d.db3", {Storage::db3, Compression::message})});
  expect_the_walk({convert("split_db3", {Storage::db3, Compression::none, true, 0.1})});
  EXPECT_GT(std::distance(fs::directory_iterator(folder / "split_db3"), {}), 5);
  expect_the_walk({convert("split_mcap", {Storage::mcap, Compression::lz4, true, 0.2})});
}

TEST_F(Rosbag2, ABagComesBackFromEach) {
  convert("a.mcap", {Storage::mcap, Compression::zstd});
  convert("c.db3", {Storage::db3, Compression::message});
  convert("split", {Storage::db3, Compression::none, true, 0.1});
  for (const std::string from : {"a.mcap", "c.db3", "split"}) {
    const fs::path back = convert(from + ".bag", {Storage::bag, Compression::none}, from);
    const auto original = open_recording(folder / "walk.bag"), again = open_recording(back);
    while (const auto m = original->next()) {
      const auto n = again->next();
      ASSERT_TRUE(n);
      EXPECT_EQ(n->time, m->time);
      EXPECT_EQ(n->connection->type, m->connection->type);
      EXPECT_EQ(n->connection->md5sum, m->connection->md5sum);
      EXPECT_EQ(Content(n->bytes.begin(), n->bytes.end()), Content(m->bytes.begin(), m->bytes.end()));
    }
  }
}

TEST_F(Rosbag2, AFolderNeedsNoMetadataAndMissesFilesThatItNames) {
  const fs::path split = convert("split", {Storage::db3, Compression::none, true, 0.1});
  fs::remove(split / "split_2.db3");
  bool damaged = false;
  EXPECT_LT(measurements({split}, &damaged).size(), tiny_walk().size());
  EXPECT_TRUE(damaged) << "metadata.yaml names a file that is gone";
  fs::remove(split / "metadata.yaml");
  measurements({split}, &damaged);
  EXPECT_FALSE(damaged);
}

TEST_F(Rosbag2, FilesMayBeCompressedAsAWhole) {
  convert("plain.db3", {Storage::db3, Compression::none});
  const Content content = file_content(folder / "plain.db3");
  Content frame(ZSTD_compressBound(content.size()));
  frame.resize(ZSTD_compress(frame.data(), frame.size(), content.data(), content.size(), 3));
  set_file_content(folder / "packed.db3.zstd", frame);
  expect_the_walk({folder / "packed.db3.zstd"});
  frame.resize(frame.size() / 2);
  set_file_content(folder / "packed.db3.zstd", frame);
  bool damaged = false;
  try {
    measurements({folder / "packed.db3.zstd"}, &damaged);
    EXPECT_TRUE(damaged);
  } catch (const InputError&) {
    // So little is left that it is no recording.
  }
}

TEST_F(Rosbag2, SeveralRecordingsAreOne) {
  auto first = tiny_walk(), second = tiny_walk();
  std::erase_if(first, [](const Measurement& m) { return sensor_of(m) == Sensor::imu; });
  std::erase_if(second, [](const Measurement& m) { return sensor_of(m) != Sensor::imu; });
  write_bag(folder / "others.bag", first);
  write_bag(folder / "imu.bag", second);
  const auto found = measurements({folder / "imu.bag", folder / "others.bag"});
  EXPECT_EQ(found.size(), tiny_walk().size());
  EXPECT_TRUE(std::ranges::is_sorted(found, {}, [](const Measurement& m) { return stamp_of(m); }));
}

TEST_F(Rosbag2, ConversionTakesTopicsAndAPartOfTheTime) {
  const auto reader = open_recording(folder / "walk.bag");
  const auto writer = create_recording(folder / "part.mcap", {Storage::mcap, Compression::none});
  ConvertOptions options{{"imu", "/nothing"}, 0.1, 0.2, Encoding::cdr, false};
  const ConvertReport report = convert_recording(*reader, *writer, options);
  writer->close();
  EXPECT_EQ(report.messages, 20U);
  EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("no topic /nothing")));
  EXPECT_EQ(open_recording(folder / "part.mcap")->connections().size(), 1U);
}

TEST_F(Rosbag2, ConversionTakesTopicsOfAFolder) {
  const auto reader = open_recording(convert("split", {Storage::db3, Compression::none, true, 0.1}));
  for (const std::string& topic : tiny_topics) {
    const auto writer = create_recording(folder / "one.mcap", {Storage::mcap, Compression::none});
    const ConvertReport report = convert_recording(*reader, *writer, {{topic}, 0, 1e9, Encoding::cdr, false});
    writer->close();
    const auto expected = std::ranges::count(tiny_walk(), std::string(topic), [](const Measurement& m) {
      return std::string(tiny_topics[static_cast<std::size_t>(sensor_of(m))]);
    });
    EXPECT_EQ(report.messages, static_cast<std::uint64_t>(expected)) << topic;
  }
}

TEST_F(Rosbag2, WhatABagCannotHoldIsLeftOutWithAReason) {
  const auto writer = create_recording(folder / "x.db3", {Storage::db3, Compression::none});
  const auto id = writer->add_channel({0, "/odd", "made_up/Type", {}, {}, Encoding::cdr});
  writer->write(id, tiny_begin, Content{0, 1, 0, 0, 7});
  writer->close();
  const auto reader = open_recording(folder / "x.db3");
  const auto bag = create_recording(folder / "x.bag", {});
  ConvertOptions options;
  options.encoding = Encoding::ros1;
  const ConvertReport report = convert_recording(*reader, *bag, options);
  EXPECT_EQ(report.messages, 0U);
  EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("/odd (made_up/Type, cdr) left out")));
}

class DamagedDb3 : public Rosbag2 {};

TEST_F(DamagedDb3, CutAnywhereWhatIsThereIsRight) {
  const Content content = file_content(convert("walk.db3", {Storage::db3, Compression::none}));
  Db3Reader whole{FileBytes(content)};
  const auto all = read_all(whole);
  const std::multiset<KeptMessage> originals(all.begin(), all.end());
  std::mt19937 random{3};
  std::size_t read = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::size_t cut = random() % content.size();
    try {
      Db3Reader reader{FileBytes(Content(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(cut)))};
      for (const auto& message : read_all(reader)) {
        EXPECT_TRUE(originals.contains(message)) << cut;
        ++read;
      }
      EXPECT_TRUE(reader.damage()) << cut;
    } catch (const InputError&) {
      EXPECT_LT(cut, 40'000U) << "the tables are at the beginning";
    }
  }
  EXPECT_GT(read, all.size());
}

TEST_F(DamagedDb3, FlippedBitsDoNoHarm) {
  const Content content = file_content(convert("walk.db3", {Storage::db3, Compression::message}));
  std::mt19937 random{4};
  for (int i = 0; i < 1000; ++i) {
    Content flipped = content;
    flipped[random() % content.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    try {
      Db3Reader reader{FileBytes(flipped)};
      EXPECT_LE(read_all(reader).size(), 2 * tiny_walk().size());
    } catch (const InputError&) {
      // No database any more.
    }
  }
}

TEST_F(DamagedDb3, AnotherDatabaseIsRefused) {
  convert("walk.db3", {Storage::db3, Compression::none});
  EXPECT_THROW(Db3Reader{FileBytes(Content{'S', 'Q', 'L'})}, InputError);
}

}  // namespace rosbag2_test
}  // namespace kilvo::lab
