#include "lab/recordings/rosbag1_reader.hpp"

#include <gtest/gtest.h>
#include <random>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/recording_file.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace rosbag1_reader_test {

const MessageType text_type{"std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n"};

std::string error_of(const std::filesystem::path& path) {
  try {
    open_recording(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

bool in_time_order(const std::vector<KeptMessage>& messages) { return std::ranges::is_sorted(messages, {}, &KeptMessage::time); }

TEST(Rosbag1Reader, GivesBackWhatWasWrittenInOrder) {
  const TemporaryFolder folder;
  for (const auto compression : {Rosbag1Writer::Compression::none, Rosbag1Writer::Compression::lz4}) {
    const auto walk = tiny_walk();
    write_bag(folder / "walk.bag", walk, 4096, compression);
    Rosbag1Reader reader(folder / "walk.bag");
    EXPECT_GT(reader.chunks().size(), 5U);
    EXPECT_EQ(reader.begin(), tiny_begin);
    EXPECT_EQ(reader.end(), tiny_begin + std::chrono::milliseconds(495));
    for (const auto& measurement : walk) {
      const auto message = reader.next();
      ASSERT_TRUE(message);
      EXPECT_EQ(message->time, stamp_of(measurement));
      EXPECT_EQ(message->connection->type, written_type(sensor_of(measurement)).name);
      const auto bytes = encode(measurement, name_of(sensor_of(measurement)));
      EXPECT_TRUE(std::ranges::equal(message->bytes, bytes));
    }
    EXPECT_FALSE(reader.next());
    EXPECT_FALSE(reader.next()) << "the end stays the end";
    EXPECT_FALSE(reader.damage());
    EXPECT_EQ(reader.progress(), 1);
  }
}

TEST(Rosbag1Reader, SortsMessagesAcrossOverlappingChunks) {
  const TemporaryFolder folder;
  auto walk = tiny_walk();
  // Neighbours up to three chunks away change places.
  std::mt19937 random(5);
  for (std::size_t i = 0; i + 40 < walk.size(); ++i) std::swap(walk[i], walk[i + random() % 40]);
  write_bag(folder / "shuffled.bag", walk);
  Rosbag1Reader reader(folder / "shuffled.bag");
  const auto messages = read_all(reader);
  EXPECT_EQ(messages.size(), walk.size());
  EXPECT_TRUE(in_time_order(messages));
  EXPECT_EQ(reader.late_messages(), 0U);
}

TEST(Rosbag1Reader, WhereChunksOverlapTooDeeplyItSaysThatMessagesAreLate) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> bytes(8);
  Rosbag1Writer backwards(folder / "backwards.bag", Rosbag1Writer::Compression::none, 1);  // a chunk for each message
  const auto id = backwards.add_connection("/text", text_type);
  for (int i = 0; i < 200; ++i) backwards.write(id, tiny_begin + std::chrono::seconds(200 - i), bytes);
  backwards.close();
  EXPECT_TRUE(in_time_order(read_all(folder / "backwards.bag"))) << "chunks that do not overlap are simply taken in order";

  // Every chunk has messages that are later than all other chunks' earliest ones, so that it stays open.
  Rosbag1Writer pairs(folder / "pairs.bag", Rosbag1Writer::Compression::none, 200);
  const auto pair_id = pairs.add_connection("/text", text_type);
  for (int i = 0; i < 1000; ++i) {
    pairs.write(pair_id, tiny_begin + std::chrono::seconds(i), bytes);
    pairs.write(pair_id, tiny_begin + std::chrono::seconds(100'000 - i), bytes);
  }
  pairs.close();
  Rosbag1Reader reader(folder / "pairs.bag");
  EXPECT_EQ(read_all(reader).size(), 2000U);
  EXPECT_GT(reader.late_messages(), 0U);
}

TEST(Rosbag1Reader, ReadsOnlyWhatIsSelectedAndCanStartAgain) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk());
  Rosbag1Reader reader(folder / "walk.bag");
  const auto is_imu = [](const Channel& c) { return c.topic == "/imu"; };
  reader.select(is_imu);
  EXPECT_EQ(read_all(reader).size(), 50U);
  reader.select(is_imu, tiny_begin + std::chrono::milliseconds(100), tiny_begin + std::chrono::milliseconds(200));
  const auto part = read_all(reader);
  ASSERT_EQ(part.size(), 10U);
  EXPECT_EQ(part.front().time, tiny_begin + std::chrono::milliseconds(100));
  EXPECT_EQ(part.back().time, tiny_begin + std::chrono::milliseconds(190));
  reader.select([](const Channel&) { return false; });
  EXPECT_FALSE(reader.next());
}

TEST(Rosbag1Reader, ReadsMessagesLargerThanItsBuffer) {
  const TemporaryFolder folder;
  for (const auto compression : {Rosbag1Writer::Compression::none, Rosbag1Writer::Compression::lz4}) {
    Rosbag1Writer writer(folder / "large.bag", compression);
    const auto id = writer.add_connection("/text", text_type);
    for (const std::size_t size : {3'000'000, 10, 70'000, 65'536, 0, 65'535}) {
      std::vector<std::uint8_t> bytes(size);
      for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * i % 251);
      writer.write(id, tiny_begin, bytes);
    }
    writer.close();
    const auto messages = read_all(folder / "large.bag");
    ASSERT_EQ(messages.size(), 6U);
    EXPECT_EQ(messages[0].bytes.size(), 3'000'000U);
    EXPECT_EQ(messages[0].bytes[2'999'999], 2'999'999ULL * 2'999'999 % 251);
    EXPECT_EQ(messages[3].bytes[65'535], 65'535ULL * 65'535 % 251);
    EXPECT_TRUE(messages[4].bytes.empty());
  }
}

TEST(Rosbag1Reader, AMessageOfMoreThan64MegabytesIsAnnouncedButNotRead) {
  const TemporaryFolder folder;
  Rosbag1Writer writer(folder / "huge.bag");
  const auto id = writer.add_connection("/text", text_type);
  writer.write(id, tiny_begin, std::vector<std::uint8_t>(most_message_bytes + 1));
  writer.write(id, tiny_begin, std::vector<std::uint8_t>(5));
  writer.close();
  Rosbag1Reader reader(folder / "huge.bag");
  const auto huge = reader.next();
  ASSERT_TRUE(huge);
  EXPECT_EQ(huge->size, most_message_bytes + 1);
  EXPECT_TRUE(huge->bytes.empty());
  const auto next = reader.next();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->bytes.size(), 5U);
}

TEST(Rosbag1Reader, ABagThatWasNeverClosedIsReadToItsLastChunk) {
  const TemporaryFolder folder;
  Rosbag1Writer writer(folder / "open.bag", Rosbag1Writer::Compression::none, 1000);
  const auto id = writer.add_connection("/text", text_type);
  const std::vector<std::uint8_t> bytes(100);
  for (int i = 0; i < 500; ++i) writer.write(id, tiny_begin + std::chrono::milliseconds(i), bytes);
  writer.flush();
  Rosbag1Reader reader(folder / "open.bag");
  EXPECT_EQ(read_all(reader).size(), 500U);
  ASSERT_TRUE(reader.damage());
  EXPECT_EQ(reader.damage()->reason, "the bag was never closed");
  EXPECT_EQ(reader.damage()->offset, reader.file_size());
  EXPECT_EQ(reader.connections().at(id).topic, "/text");
}

TEST(Rosbag1Reader, CountsMessagesAndGapsByTopic) {
  const TemporaryFolder folder;
  auto walk = tiny_walk();
  std::erase_if(walk, [](const Measurement& m) {
    const auto since = stamp_of(m) - tiny_begin;
    return sensor_of(m) == Sensor::imu && since >= std::chrono::milliseconds(200) && since < std::chrono::milliseconds(300);
  });
  write_bag(folder / "gap.bag", walk);
  const Rosbag1Reader reader(folder / "gap.bag");
  const auto is_imu = [](const auto& c) { return c.second.topic == "/imu"; };
  const auto& times = reader.times().at(std::ranges::find_if(reader.connections(), is_imu)->first);
  EXPECT_EQ(times.count, 40U);
  EXPECT_EQ(times.first, tiny_begin);
  EXPECT_EQ(times.last, tiny_begin + std::chrono::milliseconds(490));
  EXPECT_EQ(times.largest_gap, std::chrono::milliseconds(110));
}

TEST(OpenRecording, SaysWhatIsWrongWithAnInputAndNamesIt) {
  const TemporaryFolder folder;
  const auto path = folder / "input";
  const auto with_content = [&](std::string_view content) {
    set_file_content(path, {reinterpret_cast<const std::uint8_t*>(content.data()), content.size()});
    return error_of(path);
  };
  const std::string name = path.string();
  EXPECT_EQ(error_of(path), name + ": no such file");
  EXPECT_EQ(with_content(""), name + ": the file is empty");
  EXPECT_EQ(with_content("#ROS"), name + ": not a recording (a ROS 1 bag, MCAP, or rosbag2's .db3)");
  EXPECT_EQ(with_content("hello, world, this is no bag"), name + ": not a recording (a ROS 1 bag, MCAP, or rosbag2's .db3)");
  EXPECT_EQ(with_content("#ROSBAG V1.2\nxyz"), name + ": only ROS bags of version 2.0 are read (rosbag fix converts older ones)");
  EXPECT_NE(with_content({"SQLite format 3\0and more", 24}).find(name + ": a SQLite database, but not of rosbag2"), std::string::npos);
  EXPECT_EQ(error_of(folder.path()),
            folder.path().string() + ": the folder has no recording.bag and no recording of rosbag2 (.mcap, .db3)");
}

TEST(OpenRecording, AFolderMeansTheRecordingInIt) {
  const TemporaryFolder folder;
  write_bag(folder / "recording.bag", tiny_walk(50));
  EXPECT_EQ(open_recording(folder.path())->name(), (folder / "recording.bag").string());
  std::filesystem::remove(folder / "recording.bag");
  std::filesystem::create_directory(folder / "recording.bag");
  EXPECT_EQ(error_of(folder.path()), (folder / "recording.bag").string() + ": not a file");
}

TEST(OpenRecording, ABagOfNothingHasNoMessages) {
  Rosbag1Reader reader(FileBytes(std::vector<std::uint8_t>(bag_magic.begin(), bag_magic.end())));
  EXPECT_FALSE(reader.next());
  EXPECT_TRUE(reader.connections().empty());
  EXPECT_EQ(reader.damage()->reason, "the bag's header is missing");
}

TEST(Rosbag1Writer, SaysWhenAFileCannotBeWritten) {
  EXPECT_THROW(Rosbag1Writer("/nonexistent/folder/x.bag"), OutputError);
  EXPECT_THROW(
      {
        Rosbag1Writer full("/dev/full");
        const auto id = full.add_connection("/text", text_type);
        for (int i = 0; i < 10; ++i) full.write(id, tiny_begin, std::vector<std::uint8_t>(1 << 20));
      },
      OutputError);
}

}  // namespace rosbag1_reader_test
}  // namespace kilvo::lab
