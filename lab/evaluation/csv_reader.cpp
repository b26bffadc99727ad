#include "lab/evaluation/csv_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>

#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::lab {
namespace {

constexpr std::string_view blanks = " \t\r\v\f";

std::string_view trimmed(std::string_view s) {
  const auto begin = s.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return s.substr(begin, s.find_last_not_of(blanks) - begin + 1);
}

std::string in_marks(std::string_view word) { return std::string("'").append(word).append("'"); }

std::string read_file(const std::filesystem::path& path) {
  const auto fail = [&] { throw CsvError(path.string() + ": cannot be read: " + std::strerror(errno)); };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) fail();
  std::string text;
  std::size_t size = 0;
  do {
    text.resize(size + (std::size_t{1} << 20));
    size += std::fread(text.data() + size, 1, text.size() - size, file.get());
  } while (size == text.size());
  if (std::ferror(file.get())) fail();
  text.resize(size);
  return text;
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& path) : text_(read_file(path)), name_(path.string()) { read_names(); }

CsvReader::CsvReader(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) { read_names(); }

void CsvReader::read_names() {
  std::string_view line;
  do {
    if (!next_line(line)) throw CsvError(name_ + ": is empty; expected a line of column names");
  } while (line.empty());
  if (line.front() == '#') line.remove_prefix(1);
  split(line.substr(0, line.find('#')), names_);
}

bool CsvReader::next_line(std::string_view& line) {
  if (position_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  line = trimmed(std::string_view(text_).substr(position_, end - position_));
  position_ = end + 1;
  ++line_;
  return true;
}

void CsvReader::split(std::string_view line, std::vector<std::string>& values) {
  values.clear();
  std::string value;
  bool in_quotes = false, was_quoted = false;
  const auto take = [&] {
    values.emplace_back(was_quoted ? std::string_view(value) : trimmed(value));
    value.clear();
    was_quoted = false;
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (in_quotes && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      value += line[++i];
    } else if (c == '"' && (in_quotes || trimmed(value).empty())) {
      if (!in_quotes) value.clear();
      in_quotes = !in_quotes;
      was_quoted = true;
    } else if (c == ',' && !in_quotes) {
      take();
    } else {
      value += c;
    }
  }
  take();
}

std::optional<std::size_t> CsvReader::find_column(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

std::size_t CsvReader::column(std::string_view name) const {
  if (const auto found = find_column(name)) return *found;
  std::string list;
  for (const std::string& known : names_) list += (list.empty() ? "" : ", ") + known;
  throw CsvError(name_ + ":1: there is no column " + in_marks(name) + " among " + list.substr(0, 200));
}

bool CsvReader::next() {
  std::string_view line;
  do {
    if (!next_line(line)) return false;
  } while (line.empty() || line.front() == '#');
  split(line, values_);
  if (values_.size() != names_.size()) {
    fail("expected " + std::to_string(names_.size()) + " values, found " + std::to_string(values_.size()));
  }
  return true;
}

double CsvReader::number(std::size_t column) const {
  const std::string& word = values_.at(column);
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  double value = 0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || stop != end) fail(in_marks(word) + " is not a number (column " + names_[column] + ")");
  if (!std::isfinite(value)) fail(in_marks(word) + " is not finite (column " + names_[column] + ")");
  return value;
}

double CsvReader::number_if_known(std::size_t column) const {
  const std::string& word = values_.at(column);
  if (word.empty() || word == "nan" || word == "-nan") return std::numeric_limits<double>::quiet_NaN();
  return number(column);
}

Time CsvReader::time(std::size_t column) const {
  const auto t = parse_seconds(values_.at(column));
  if (!t) fail(in_marks(values_[column]) + " is not a time in seconds (column " + names_[column] + ")");
  return *t;
}

bool CsvReader::flag(std::size_t column) const {
  const double value = number(column);
  if (value != 0 && value != 1) fail(in_marks(values_[column]) + " is neither 0 nor 1 (column " + names_[column] + ")");
  return value == 1;
}

void CsvReader::fail(const std::string& reason) const { throw CsvError(name_ + ":" + std::to_string(line_) + ": " + reason); }

}  // namespace kilvo::lab
