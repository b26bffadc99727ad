#include "lab/report/base64.hpp"

#include <gtest/gtest.h>

namespace kilvo::lab {
namespace base64_test {

std::string encoded(const std::string& text) { return base64(std::vector<std::uint8_t>(text.begin(), text.end())); }

// RFC 4648, section 10.
TEST(Base64, GivesTheTextsOfTheStandard) {
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foo"), "Zm9v");
  EXPECT_EQ(encoded("foob"), "Zm9vYg==");
  EXPECT_EQ(encoded("fooba"), "Zm9vYmE=");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
  EXPECT_EQ(encoded("\xff\xfb\xbf"), "//u/");
}

}  // namespace base64_test
}  // namespace kilvo::lab
