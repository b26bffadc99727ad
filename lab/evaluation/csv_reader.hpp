// Tables as text: a line of column names, then lines of values between commas. Every file that a run writes beside the trajectories.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

/// A table that cannot be used; the message starts with `file:line:` (or `file:` when it cannot be read).
class CsvError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Goes through a table row by row. Empty lines and lines that begin with '#' are skipped, except that the line of names may begin with
/// one; a value may stand in double quotes. A row must have as many values as there are names.
class CsvReader {
 public:
  /// Reads the file. Throws CsvError when that fails or it has no line of names.
  explicit CsvReader(const std::filesystem::path& path);
  /// The same of text in memory; `name` stands in error messages.
  CsvReader(std::string text, std::string name);

  /// Where the values of this name are. Throws CsvError when there is none.
  std::size_t column(std::string_view name) const;
  std::optional<std::size_t> find_column(std::string_view name) const;
  const std::vector<std::string>& names() const { return names_; }

  /// Goes to the next row, false at the end. Throws CsvError when its number of values is wrong.
  bool next();

  /// Values of the row. Throw CsvError when they are not what they should be: a finite number, a time in seconds, 0 or 1.
  double number(std::size_t column) const;
  Time time(std::size_t column) const;
  bool flag(std::size_t column) const;
  /// A finite number, or NaN where the writer knew none ("nan", or nothing at all).
  double number_if_known(std::size_t column) const;
  const std::string& text(std::size_t column) const { return values_.at(column); }

  /// Throws CsvError about the row.
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  void read_names();
  bool next_line(std::string_view& line);
  static void split(std::string_view line, std::vector<std::string>& values);

  std::string text_, name_;
  std::size_t position_ = 0;  // in text_
  std::size_t line_ = 0;      // counted from 1
  std::vector<std::string> names_, values_;
};

}  // namespace kilvo::lab
