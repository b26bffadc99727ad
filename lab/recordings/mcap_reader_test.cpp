// MCAP as McapWriter writes it, and as others may: without an index, without chunks, cut, damaged.
#include "lab/recordings/mcap_reader.hpp"

#include <gtest/gtest.h>
#include <random>
#include <set>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/mcap_writer.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace mcap_reader_test {

using Content = std::vector<std::uint8_t>;
using Compression = McapWriter::Compression;

/// The tiny walk in CDR, in chunks of some kB.
Content tiny_mcap(Compression compression, int milliseconds = 500) {
  const TemporaryFolder folder;
  McapWriter writer(folder / "walk.mcap", compression, "ros2", 4096);
  std::map<Sensor, std::uint32_t> ids;
  for (const Measurement& m : tiny_walk(milliseconds)) {
    const Sensor sensor = sensor_of(m);
    const auto& type = written_type(sensor);
    if (!ids.contains(sensor))
      ids[sensor] = writer.add_channel({0, tiny_topics[static_cast<std::size_t>(sensor)], std::string(type.name), {}, {}, Encoding::cdr});
    writer.write(ids[sensor], stamp_of(m), encode(m, name_of(sensor), Encoding::cdr));
  }
  writer.close();
  return file_content(folder / "walk.mcap");
}

std::vector<KeptMessage> messages_of(const Content& content, bool* damaged = nullptr) {
  McapReader reader{FileBytes(content)};
  auto messages = read_all(reader);
  if (damaged != nullptr) *damaged = reader.damage().has_value();
  return messages;
}

/// The same file without chunks and index: header, the records of each chunk, end.
Content unchunked(const Content& content) {
  const FileBytes file(content);
  const McapLayout layout = read_mcap_layout(file);
  Content out(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(layout.chunks.front().offset));
  for (const McapChunk& chunk : layout.chunks) {
    const auto begin = content.begin() + static_cast<std::ptrdiff_t>(chunk.data_offset);
    out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(chunk.data_size));
  }
  ByteWriter end;
  end.put(std::uint8_t{15}).put(std::uint64_t{4}).put(std::uint32_t{0});                                // data end
  end.put(std::uint8_t{2}).put(std::uint64_t{20}).put(std::uint64_t{0}).put(std::uint64_t{0}).put(0U);  // footer
  end.append(mcap_magic.data(), mcap_magic.size());
  out.insert(out.end(), end.bytes().begin(), end.bytes().end());
  return out;
}

class Mcap : public ::testing::TestWithParam<Compression> {};

TEST_P(Mcap, ComesBackWhole) {
  const Content content = tiny_mcap(GetParam());
  McapReader reader{FileBytes(content)};
  EXPECT_GT(reader.chunks().size(), 5U);
  EXPECT_EQ(reader.connections().size(), 4U);
  EXPECT_EQ(reader.begin(), tiny_begin);
  EXPECT_EQ(reader.end(), tiny_begin + std::chrono::milliseconds(495));
  std::uint64_t counted = 0;
  for (const auto& [id, times] : reader.times()) counted += times.count;
  EXPECT_EQ(counted, tiny_walk().size());
  const auto walk = tiny_walk();
  std::size_t i = 0;
  while (const auto m = reader.next()) {
    ASSERT_LT(i, walk.size());
    EXPECT_EQ(m->time, stamp_of(walk[i]));
    EXPECT_EQ(m->connection->encoding, Encoding::cdr);
    const Sensor sensor = sensor_of(walk[i]);
    EXPECT_EQ(m->connection->type, written_type(sensor).name);
    EXPECT_EQ(Content(m->bytes.begin(), m->bytes.end()), encode(walk[i++], name_of(sensor), Encoding::cdr));
  }
  EXPECT_EQ(i, walk.size());
  EXPECT_FALSE(reader.damage()) << reader.damage()->reason;
}

TEST_P(Mcap, ATimeRangeReadsNoMore) {
  McapReader reader{FileBytes(tiny_mcap(GetParam()))};
  const auto is_imu = [](const Channel& c) { return c.topic == "/imu"; };
  reader.select(is_imu, tiny_begin + std::chrono::milliseconds(100), tiny_begin + std::chrono::milliseconds(200));
  EXPECT_EQ(read_all(reader).size(), 10U);
  EXPECT_LE(reader.progress(), 1.0);
}

TEST_P(Mcap, CutAnywhereEverythingBeforeTheCutIsDelivered) {
  const Content content = tiny_mcap(GetParam(), 300);
  const auto all = messages_of(content);
  const FileBytes whole(content);
  const McapLayout layout = read_mcap_layout(whole);
  const std::multiset<KeptMessage> originals(all.begin(), all.end());
  std::mt19937 random{1};
  for (int i = 0; i < 1000; ++i) {
    const std::size_t cut = mcap_magic.size() + random() % (content.size() - mcap_magic.size());
    bool damaged = false;
    const auto messages = messages_of(Content(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(cut)), &damaged);
    EXPECT_TRUE(damaged) << cut;
    for (const auto& message : messages) ASSERT_TRUE(originals.contains(message)) << "half a message is none; cut at " << cut;
    std::size_t whole_chunks = 0;
    for (const McapChunk& chunk : layout.chunks) whole_chunks += chunk.data_offset + chunk.data_size <= cut ? 1 : 0;
    EXPECT_GE(messages.size() + 2, whole_chunks) << cut;
    if (whole_chunks == layout.chunks.size()) {
      EXPECT_EQ(messages.size(), all.size()) << cut;
    }
  }
}

TEST_P(Mcap, AFlippedByteCostsAtMostItsChunk) {
  const Content content = tiny_mcap(GetParam(), 300);
  const auto all = messages_of(content);
  std::size_t most_in_chunk = 0;
  for (const McapChunk& chunk : read_mcap_layout(FileBytes(content)).chunks) {
    McapChannels channels;
    McapChunkReader reader(FileBytes(content), chunk, channels);
    std::size_t count = 0;
    while (reader.scan()) ++count;
    most_in_chunk = std::max(most_in_chunk, count);
  }
  std::mt19937 random{2};
  for (int i = 0; i < 1000; ++i) {
    const std::size_t at = mcap_magic.size() + random() % (content.size() - mcap_magic.size());
    Content flipped = content;
    flipped[at] = static_cast<std::uint8_t>(flipped[at] ^ (1U << random() % 8));
    const auto messages = messages_of(flipped);
    EXPECT_GE(messages.size() + most_in_chunk, all.size()) << at;
    EXPECT_LE(messages.size(), all.size() + 1) << at << ": lz4 leaves messages readable, and one may be found that way";
  }
}

INSTANTIATE_TEST_SUITE_P(Compressions, Mcap, ::testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& param) {
                           return std::string(param.param == Compression::none ? "None" : param.param == Compression::lz4 ? "Lz4" : "Zstd");
                         });

TEST(McapReader, RecordsOutsideOfChunksAreTheSame) {
  const Content content = tiny_mcap(Compression::none);
  const Content plain = unchunked(content);
  bool damaged = true;
  const auto messages = messages_of(plain, &damaged);
  EXPECT_FALSE(damaged);
  const auto expected = messages_of(content);
  ASSERT_EQ(messages.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(messages[i].bytes, expected[i].bytes);
}

TEST(McapReader, AWrongChecksumIsReportedAtItsChunk) {
  Content content = tiny_mcap(Compression::none);
  const McapLayout layout = read_mcap_layout(FileBytes(content));
  const McapChunk& chunk = layout.chunks.at(3);
  content[chunk.data_offset + chunk.data_size - 20] ^= 1;
  McapReader reader{FileBytes(content)};
  EXPECT_LT(read_all(reader).size(), tiny_walk().size());
  ASSERT_TRUE(reader.damage());
  EXPECT_EQ(reader.damage()->offset, chunk.offset);
  EXPECT_EQ(reader.damage()->reason, "the chunk has a wrong checksum");
}

TEST(McapReader, AChunkThatIsNotSaidToBeOneIsNotLostSilently) {
  const Content content = tiny_mcap(Compression::none);
  const McapChunk chunk = read_mcap_layout(FileBytes(content)).chunks.at(2);
  for (const std::uint8_t other :
       {std::uint8_t{0}, std::uint8_t{4}, std::uint8_t{5}, std::uint8_t{7}, std::uint8_t{9}, std::uint8_t{0x86}}) {
    Content lying = content;
    lying[chunk.offset] = other;
    bool damaged = false;
    messages_of(lying, &damaged);
    EXPECT_TRUE(damaged) << int{other};
  }
}

TEST(McapReader, UnknownRecordsAndFieldsBehindTheKnownAreSkipped) {
  const Content content = unchunked(tiny_mcap(Compression::none, 50));
  Content more(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(mcap_magic.size()));
  const Content unknown{0x90, 3, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3};
  more.insert(more.end(), unknown.begin(), unknown.end());
  more.insert(more.end(), content.begin() + static_cast<std::ptrdiff_t>(mcap_magic.size()), content.end());
  bool damaged = true;
  EXPECT_EQ(messages_of(more, &damaged).size(), messages_of(content).size());
  EXPECT_FALSE(damaged);
}

TEST(McapReader, WithoutASummaryTheChannelsAreThoseOfTheChunks) {
  Content content = tiny_mcap(Compression::zstd);
  const McapLayout layout = read_mcap_layout(FileBytes(content));
  const McapChunk& last = layout.chunks.back();
  content.resize(last.data_offset + last.data_size);
  McapReader reader{FileBytes(content)};
  EXPECT_EQ(reader.connections().size(), 4U);
  EXPECT_EQ(read_all(reader).size(), tiny_walk().size());
  EXPECT_EQ(reader.damage()->reason, "the file was never closed");
}

TEST(McapReader, AFalseInflatedSizeCostsNoMemory) {
  for (const Compression compression : {Compression::lz4, Compression::zstd}) {
    const Content content = tiny_mcap(compression);
    const McapChunk chunk = read_mcap_layout(FileBytes(content)).chunks.at(1);
    for (const std::uint64_t claimed : {~std::uint64_t{0}, std::uint64_t{200} << 20, std::uint64_t{100}, std::uint64_t{0}}) {
      Content lying = content;
      std::memcpy(lying.data() + chunk.offset + mcap_record_head + 16, &claimed, sizeof claimed);
      bool damaged = false;
      messages_of(lying, &damaged);
      EXPECT_TRUE(damaged) << claimed;
    }
  }
}

TEST(Crc32, IsThatOfZlib) {
  const std::string text = "123456789";
  const Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  EXPECT_EQ(crc32(bytes), 0xCBF43926U);
  EXPECT_EQ(crc32(bytes.subspan(4), crc32(bytes.first(4))), 0xCBF43926U);
}

}  // namespace mcap_reader_test
}  // namespace kilvo::lab
