// The list of reasons that users read.
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>

#include "kilvo/sensors/reason.hpp"

namespace kilvo {
namespace events_test {

TEST(Reasons, AreListedInTheDocuments) {
  std::ifstream file(std::string(KILVO_SOURCE_DIR) + "/docs/events.md");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const ReasonRow& row : reasons) {
    constexpr const char* severities[] = {"notice", "warning", "error"};
    const std::string line =
        std::string("| `") + row.name + "` | " + severities[static_cast<int>(row.severity)] + " | " + row.text + " |\n";
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

}  // namespace events_test
}  // namespace kilvo
