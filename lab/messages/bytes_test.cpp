#include "lab/messages/bytes.hpp"

#include <array>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace bytes_test {

constexpr std::array<std::uint8_t, 7> seven{2, 0, 0, 0, 'h', 'i', 9};

TEST(ByteReader, ReadsOneFieldAfterTheOther) {
  ByteReader reader(seven);
  EXPECT_EQ(reader.string(), "hi");
  EXPECT_EQ(reader.position(), 6U);
  EXPECT_EQ(reader.read<std::uint8_t>(), 9);
  EXPECT_EQ(reader.remaining(), 0U);
  EXPECT_TRUE(reader.ok());
}

TEST(ByteReader, GivesNothingBeyondTheEndAndStaysThere) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{3}, std::size_t{6}}) {
    ByteReader reader(Bytes(seven).first(size));
    EXPECT_TRUE(reader.take(size + 1).empty()) << size;
    EXPECT_FALSE(reader.ok());
    EXPECT_EQ(reader.remaining(), size);
    EXPECT_EQ(reader.read<std::uint8_t>(), 0) << "even what there is, is not given after a failure";
  }
}

TEST(ByteReader, AnArrayLongerThanTheRestIsNotGiven) {
  ByteReader fits(Bytes(seven).first(6)), too_long(Bytes(seven).first(5)), elements(seven);
  EXPECT_EQ(fits.array(1).size(), 2U);
  EXPECT_TRUE(too_long.array(1).empty());
  EXPECT_FALSE(too_long.ok());
  EXPECT_TRUE(elements.array(2).empty()) << "two elements of two bytes, but there are three";
  EXPECT_FALSE(elements.ok());
}

}  // namespace bytes_test
}  // namespace kilvo::lab
