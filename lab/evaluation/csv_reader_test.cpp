#include "lab/evaluation/csv_reader.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kilvo::lab {
namespace csv_reader_test {

using testing::ElementsAre;
using testing::StartsWith;

CsvReader table(const std::string& text) { return {text, "x.csv"}; }

template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const CsvError& e) {
    return e.what();
  }
  return "no error";
}

TEST(CsvReader, FindsColumnsByNameWhateverTheirOrder) {
  CsvReader csv = table("right, t,left\n1,1700010000.000000001,0\n");
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.time(csv.column("t")), time_from_ns(1700010000000000001));
  EXPECT_TRUE(csv.flag(csv.column("right")));
  EXPECT_FALSE(csv.flag(csv.column("left")));
  EXPECT_FALSE(csv.find_column("fz"));
  EXPECT_FALSE(csv.next());
  EXPECT_EQ(error_of([&] { csv.column("fz"); }), "x.csv:1: there is no column 'fz' among right, t, left");
}

TEST(CsvReader, NamesMayStandBehindAHashAndBeforeARemark) {
  CsvReader csv = table("\n# t,lx  # metres\r\n\r\n# 0,0\n1,2\r\n");
  EXPECT_THAT(csv.names(), ElementsAre("t", "lx"));
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.number(1), 2);
  EXPECT_FALSE(csv.next());
}

TEST(CsvReader, QuotesHoldCommasAndQuotesTogether) {
  CsvReader csv = table("t,cause,n\n1, \"a, \"\"b\"\" c \",3\n2,,4\n");
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.text(1), "a, \"b\" c ");
  EXPECT_EQ(csv.number(2), 3);
  ASSERT_TRUE(csv.next());
  EXPECT_EQ(csv.text(1), "");
}

TEST(CsvReader, WrongValuesAreNamedWithTheirLine) {
  CsvReader csv = table("t,x\n1,nan\n2,2z\n3,2\n,1\n4\n");
  csv.next();
  EXPECT_EQ(error_of([&] { csv.number(1); }), "x.csv:2: 'nan' is not finite (column x)");
  EXPECT_TRUE(std::isnan(csv.number_if_known(1)));
  csv.next();
  EXPECT_EQ(error_of([&] { csv.number_if_known(1); }), "x.csv:3: '2z' is not a number (column x)");
  csv.next();
  EXPECT_EQ(error_of([&] { csv.flag(1); }), "x.csv:4: '2' is neither 0 nor 1 (column x)");
  csv.next();
  EXPECT_EQ(error_of([&] { csv.time(0); }), "x.csv:5: '' is not a time in seconds (column t)");
  EXPECT_EQ(error_of([&] { csv.next(); }), "x.csv:6: expected 2 values, found 1");
}

TEST(CsvReader, AFileThatIsMissingEmptyOrAFolderIsAnError) {
  EXPECT_THAT(error_of([] { table("\n\n"); }), StartsWith("x.csv: is empty"));
  EXPECT_THAT(error_of([] { CsvReader(std::filesystem::path("/no/such/file.csv")); }), StartsWith("/no/such/file.csv: cannot be read: "));
  EXPECT_THAT(error_of([] { CsvReader(std::filesystem::path("/tmp")); }), StartsWith("/tmp: cannot be read: "));
}

}  // namespace csv_reader_test
}  // namespace kilvo::lab
