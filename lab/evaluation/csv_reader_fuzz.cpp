// Any text is a table or an error; never a crash, and never a number that is not finite.
#include <cmath>
#include <cstdlib>

#include "lab/evaluation/csv_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  try {
    CsvReader csv(std::string(reinterpret_cast<const char*>(data), size), "fuzz");
    const std::size_t t = csv.column("t");
    const auto x = csv.find_column("x");
    while (csv.next()) {
      csv.time(t);
      if (x && !std::isfinite(csv.number(*x))) std::abort();
    }
  } catch (const CsvError&) {
  }
  return 0;
}
