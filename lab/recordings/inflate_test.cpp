#include "lab/recordings/inflate.hpp"

#include <bzlib.h>
#include <gtest/gtest.h>
#include <lz4frame.h>
#include <numeric>

namespace kilvo::lab {
namespace inflate_test {

using Data = std::vector<std::uint8_t>;

Data some_data() {
  Data data(3'000'000);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i / 1000 + i % 7);
  return data;
}

Data deflate(const std::string& compression, Data data) {
  Data packed(data.size() + 100'000);
  if (compression == "lz4") {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
    packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), data.data(), data.size(), &preferences));
  } else {
    auto size = static_cast<unsigned>(packed.size());
    auto *to = reinterpret_cast<char*>(packed.data()), *from = reinterpret_cast<char*>(data.data());
    EXPECT_EQ(BZ2_bzBuffToBuffCompress(to, &size, from, static_cast<unsigned>(data.size()), 9, 0, 0), BZ_OK);
    packed.resize(size);
  }
  return packed;
}

class InflateChunk : public ::testing::TestWithParam<const char*> {
 protected:
  const Data data = some_data();
  const Data packed = deflate(GetParam(), data);
};

TEST_P(InflateChunk, GivesTheDataBack) {
  const auto inflated = inflate_chunk(GetParam(), packed, data.size());
  EXPECT_EQ(inflated.fault, "");
  EXPECT_EQ(inflated.good, data.size());
  EXPECT_TRUE(inflated.bytes == data);
}

TEST_P(InflateChunk, GivesNoMoreThanIsClaimed) {
  for (const std::size_t claimed : {std::size_t{0}, std::size_t{1}, data.size() - 1}) {
    const auto inflated = inflate_chunk(GetParam(), packed, claimed);
    EXPECT_EQ(inflated.fault, std::string(GetParam()) + ": more data than the chunk claims");
    EXPECT_EQ(inflated.good, 0U);
    EXPECT_LE(inflated.bytes.size(), claimed);
  }
}

TEST_P(InflateChunk, AFalseClaimCostsLittleMemory) {
  const auto inflated = inflate_chunk(GetParam(), packed, most_chunk_bytes);
  EXPECT_EQ(inflated.fault, "inflates to 3000000 bytes instead of 268435456");
  EXPECT_EQ(inflated.good, data.size());
  EXPECT_LE(inflated.bytes.capacity(), 2 * std::max(data.size(), 8 * packed.size()));
  EXPECT_EQ(inflate_chunk(GetParam(), packed, most_chunk_bytes + 1).fault, "claims to inflate to 268435457 bytes");
}

TEST_P(InflateChunk, ACutChunkGivesItsBeginning) {
  const auto inflated = inflate_chunk(GetParam(), Bytes(packed).first(packed.size() / 2), data.size());
  EXPECT_NE(inflated.fault, "");
  EXPECT_GT(inflated.good, 100'000U);
  EXPECT_TRUE(std::equal(inflated.bytes.begin(), inflated.bytes.begin() + static_cast<std::ptrdiff_t>(inflated.good), data.begin()));
}

TEST_P(InflateChunk, OfADamagedChunkNothingIsGood) {
  Data damaged = packed;
  damaged[packed.size() / 2] ^= 1;
  const auto inflated = inflate_chunk(GetParam(), damaged, data.size());
  EXPECT_NE(inflated.fault, "");
  EXPECT_EQ(inflated.good, 0U);
}

INSTANTIATE_TEST_SUITE_P(Compressions, InflateChunk, ::testing::Values("lz4", "bz2"),
                         [](const auto& param) { return std::string(param.param); });

TEST(InflateAnything, RefusesWhatItDoesNotKnow) {
  const Data byte{1};
  EXPECT_EQ(inflate_chunk("xz", byte, 1).fault, "unknown compression xz");
  EXPECT_EQ(inflate_chunk("lz4", {}, 1).fault, "has no data");
}

}  // namespace inflate_test
}  // namespace kilvo::lab
