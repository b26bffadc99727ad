// Bags cut short and bags with wrong bytes in them: nothing crashes or hangs, and what is intact is delivered.
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/tiny_bag.hpp"

namespace kilvo::lab {
namespace rosbag1_damage_test {

using Content = std::vector<std::uint8_t>;

/// A message, and where it is in the file.
struct PlacedMessage {
  KeptMessage message;
  std::uint64_t chunk_begin = 0, chunk_end = 0;  // the chunk's record, without its index
  std::uint64_t end = 0;                         // of the message in an uncompressed chunk; else of the chunk
};

std::vector<PlacedMessage> place_messages(const Content& content) {
  const FileBytes file(content);
  std::vector<PlacedMessage> placed;
  for (const BagChunk& chunk : read_bag_layout(file).chunks) {
    BagChunkReader reader(file, chunk);
    const std::uint64_t chunk_end = chunk.data_offset + chunk.data_size;
    while (const auto entry = reader.scan()) {
      const Bytes bytes = *reader.message(*entry);
      const std::uint64_t end = chunk.compression == "none" ? chunk.data_offset + entry->offset + entry->size : chunk_end;
      placed.push_back({{entry->connection, entry->time, {bytes.begin(), bytes.end()}}, chunk.offset, chunk_end, end});
    }
  }
  return placed;
}

/// What a reader makes of the content; nothing when it is not recognised as a bag any more.
std::optional<std::multiset<KeptMessage>> read_content(const Content& content, bool* damaged = nullptr) {
  try {
    Rosbag1Reader reader{FileBytes(content)};
    const auto messages = read_all(reader);
    if (damaged != nullptr) *damaged = reader.damage().has_value();
    return std::multiset<KeptMessage>(messages.begin(), messages.end());
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// How many of the messages that `keeps` approves were not delivered.
template <class Keeps>
int missing(const std::vector<PlacedMessage>& placed, const std::multiset<KeptMessage>& delivered, Keeps keeps) {
  int count = 0;
  for (const auto& m : placed) count += keeps(m) && !delivered.contains(m.message) ? 1 : 0;
  return count;
}

Content tiny_bag_content(const std::string& compression) {
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk(300));
  if (compression == "none") return file_content(folder / "walk.bag");
  const std::string script = KILVO_SOURCE_DIR "/lab/recordings/rosbag_oracle.py copy ";
  const std::string files = (folder / "walk.bag").string() + " " + (folder / "packed.bag").string() + " ";
  EXPECT_EQ(std::system(("/usr/bin/python3 " + script + files + compression).c_str()), 0) << "apt install python3-rosbag";
  return file_content(folder / "packed.bag");
}

class DamagedBag : public ::testing::TestWithParam<const char*> {
 protected:
  const Content content = tiny_bag_content(GetParam());
  const std::vector<PlacedMessage> placed = place_messages(content);
  std::mt19937 random{20240607};

  void SetUp() override { ASSERT_GT(placed.size(), 90U); }
};

TEST_P(DamagedBag, CutAnywhereEverythingBeforeTheCutIsDelivered) {
  std::multiset<KeptMessage> originals;
  for (const auto& m : placed) originals.insert(m.message);
  for (int i = 0; i < 1000; ++i) {
    const std::size_t cut = bag_magic.size() + random() % (content.size() - bag_magic.size());
    bool damaged = false;
    const auto delivered = read_content(Content(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(cut)), &damaged);
    ASSERT_TRUE(delivered);
    EXPECT_TRUE(damaged) << cut;
    EXPECT_EQ(missing(placed, *delivered, [&](const PlacedMessage& m) { return m.end <= cut; }), 0) << "cut at " << cut;
    for (const auto& message : *delivered) EXPECT_TRUE(originals.contains(message)) << "half a message is none; cut at " << cut;
  }
}

TEST_P(DamagedBag, AFlippedByteCostsAtMostTheRestOfItsChunk) {
  for (int i = 0; i < 1000; ++i) {
    const std::size_t at = random() % content.size();
    Content flipped = content;
    flipped[at] = static_cast<std::uint8_t>(flipped[at] ^ (1 + random() % 255));
    const auto delivered = read_content(flipped);
    if (!delivered) {
      EXPECT_LT(at, 4200U) << "only the bag's first bytes can make it no bag";
      continue;
    }
    const auto untouched = [&](const PlacedMessage& m) { return m.end <= at || at < m.chunk_begin || at >= m.chunk_end; };
    EXPECT_EQ(missing(placed, *delivered, untouched), 0) << "byte " << at << " is " << int{flipped[at]} << ", was " << int{content[at]};
    EXPECT_LE(delivered->size(), placed.size() + 1);
  }
}

TEST_P(DamagedBag, AHoleIsNoticedAndSkipped) {
  for (int i = 0; i < 50; ++i) {
    const std::size_t begin = 4200 + random() % (content.size() - 9000), end = begin + 1 + random() % 5000;
    Content holed = content;
    std::fill(holed.begin() + static_cast<std::ptrdiff_t>(begin), holed.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0xA5});
    const auto delivered = read_content(holed);
    ASSERT_TRUE(delivered);
    const auto untouched = [&](const PlacedMessage& m) { return m.end <= begin || end <= m.chunk_begin || begin >= m.chunk_end; };
    EXPECT_EQ(missing(placed, *delivered, untouched), 0) << begin << " to " << end;
  }
}

TEST_P(DamagedBag, RandomBytesInPlaceOfEverythingEndInNothing) {
  for (int i = 0; i < 20; ++i) {
    Content noise = content;
    for (std::size_t k = bag_magic.size(); k < noise.size(); ++k) noise[k] = static_cast<std::uint8_t>(random());
    bool damaged = false;
    const auto delivered = read_content(noise, &damaged);
    ASSERT_TRUE(delivered);
    EXPECT_TRUE(delivered->empty());
    EXPECT_TRUE(damaged);
  }
}

INSTANTIATE_TEST_SUITE_P(Compressions, DamagedBag, ::testing::Values("none", "bz2", "lz4"),
                         [](const auto& param) { return std::string(param.param); });

TEST(DamagedChunk, DamageInCompressedDataIsReportedAtItsChunk) {
  for (const std::string compression : {"bz2", "lz4"}) {
    Content content = tiny_bag_content(compression);
    const auto chunks = read_bag_layout(FileBytes(content)).chunks;
    ASSERT_GT(chunks.size(), 4U);
    content[chunks[2].data_offset + chunks[2].data_size / 2] ^= 0x40;
    Rosbag1Reader reader{FileBytes(content)};
    EXPECT_FALSE(read_all(reader).empty());
    ASSERT_TRUE(reader.damage()) << compression;
    EXPECT_EQ(reader.damage()->offset, chunks[2].offset);
    EXPECT_NE(reader.damage()->reason.find(compression), std::string::npos) << reader.damage()->reason;
    EXPECT_EQ(reader.damages().size(), 1U);
  }
}

TEST(DamagedChunk, AHeaderAtTheVeryEndIsNotFoundAgainAndAgain) {
  // Found by fuzzing: a chunk that seems to go on, and behind it the header of another chunk without the length of its data.
  const TemporaryFolder folder;
  write_bag(folder / "walk.bag", tiny_walk(20));
  Content content = file_content(folder / "walk.bag");
  const auto chunk = read_bag_layout(FileBytes(content)).chunks.at(0);
  const Content header(content.begin() + static_cast<std::ptrdiff_t>(chunk.offset),
                       content.begin() + static_cast<std::ptrdiff_t>(chunk.data_offset) - 4);
  content.resize(chunk.data_offset + chunk.data_size);
  content.insert(content.end(), {1, 2, 3});
  content.insert(content.end(), header.begin(), header.end());
  bool damaged = false;
  ASSERT_TRUE(read_content(content, &damaged));
  EXPECT_TRUE(damaged);
}

TEST(DamagedChunk, TopicsOfADamagedFirstChunkAreKnownEvenWhenTheEndOfTheBagIsMissing) {
  Content content = tiny_bag_content("lz4");
  const auto chunks = read_bag_layout(FileBytes(content)).chunks;
  content.resize(chunks[5].offset);
  content[chunks[0].data_offset + chunks[0].data_size - 1] ^= 0x40;  // the checksum over the content
  Rosbag1Reader reader{FileBytes(content)};
  EXPECT_EQ(reader.connections().size(), 4U);
  const auto messages = read_all(reader);
  EXPECT_GT(messages.size(), 20U);
  const auto intact = place_messages(content);
  EXPECT_EQ(messages.size(), intact.size()) << "of the damaged chunk itself nothing is believed";
}

TEST(DamagedChunk, ACutBetweenTheIndexRecordsOfAChunkLosesNoTopic) {
  const Content content = tiny_bag_content("none");
  const auto chunks = read_bag_layout(FileBytes(content)).chunks;
  ASSERT_TRUE(chunks.at(1).new_connections) << "the first image is in the second chunk";
  const std::size_t index = chunks[1].data_offset + chunks[1].data_size;
  ByteReader first_index(Bytes(content).subspan(index));
  first_index.array();  // header
  first_index.array();  // data: of a topic that the first chunk has too
  const auto end = content.begin() + static_cast<std::ptrdiff_t>(index + first_index.position());
  const Rosbag1Reader bag{FileBytes(Content(content.begin(), end))};
  EXPECT_EQ(bag.connections().size(), 4U);
}

TEST(DamagedChunk, AChunkThatIsNotSaidToBeOneIsNotLostSilently) {
  const Content content = tiny_bag_content("none");
  const auto placed = place_messages(content);
  const auto chunk = read_bag_layout(FileBytes(content)).chunks.at(2);
  const std::string op = "op=";
  const auto at = static_cast<std::size_t>(
      std::search(content.begin() + static_cast<std::ptrdiff_t>(chunk.offset), content.end(), op.begin(), op.end()) - content.begin());
  for (const int other : {0, 1, 2, 3, 4, 6, 7, 8, 255}) {
    Content lying = content;
    ASSERT_EQ(lying[at + 3], 5);
    lying[at + 3] = static_cast<std::uint8_t>(other);
    bool damaged = false;
    const auto delivered = read_content(lying, &damaged);
    ASSERT_TRUE(delivered);
    EXPECT_TRUE(damaged) << other;
    EXPECT_EQ(missing(placed, *delivered, [&](const PlacedMessage& m) { return m.chunk_begin != chunk.offset; }), 0) << other;
  }
}

TEST(DamagedChunk, AFalseLengthIsOneDamageAndNoLoss) {
  const Content content = tiny_bag_content("none");
  const auto placed = place_messages(content);
  const auto chunk = read_bag_layout(FileBytes(content)).chunks.at(2);
  for (const std::uint64_t length : {chunk.data_size + 1, chunk.data_size + 5000, std::uint64_t{0xFFFFFFFF}}) {
    Content lying = content;
    const auto claimed = static_cast<std::uint32_t>(length);
    std::memcpy(lying.data() + chunk.data_offset - 4, &claimed, 4);
    Rosbag1Reader reader{FileBytes(lying)};
    EXPECT_EQ(read_all(reader).size(), placed.size()) << length;
    EXPECT_EQ(reader.damages().size(), 1U) << length;
  }
}

TEST(DamagedChunk, AFalseInflatedSizeCostsNoMemory) {
  for (const std::string compression : {"bz2", "lz4"}) {
    const Content content = tiny_bag_content(compression);
    const std::string size_field = "size=";
    for (const std::uint32_t claimed : {0xFFFFFFFFU, 200U << 20, 100U, 0U}) {
      Content lying = content;
      const auto at = std::search(lying.begin() + 4096, lying.end(), size_field.begin(), size_field.end());
      ASSERT_NE(at, lying.end());
      std::memcpy(&*at + size_field.size(), &claimed, sizeof claimed);
      Rosbag1Reader reader{FileBytes(lying)};
      read_all(reader);
      EXPECT_TRUE(reader.damage()) << compression << " " << claimed;
    }
  }
}

}  // namespace rosbag1_damage_test
}  // namespace kilvo::lab
