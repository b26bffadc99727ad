#include "lab/evaluation/trajectory_file.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>

#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t columns = 8;
constexpr std::size_t flush_bytes = 65536;
constexpr double quaternion_norm_tolerance = 0.05;  // files with two decimals pass, swapped columns do not

using Words = std::array<std::string_view, columns>;

struct Place {
  std::string_view file;
  std::size_t line = 0;
};

[[noreturn]] void fail(const Place& place, const std::string& reason) {
  throw TrajectoryError(std::string(place.file) + ":" + std::to_string(place.line) + ": " + reason);
}

std::string quoted(std::string_view word) { return std::string("'").append(word).append("'"); }

/// Splits at blanks; returns how many words there are, which may be more than fit.
std::size_t split(std::string_view line, Words& words) {
  constexpr std::string_view blanks = " \t\r\v\f";
  std::size_t count = 0;
  for (auto begin = line.find_first_not_of(blanks); begin != std::string_view::npos; begin = line.find_first_not_of(blanks)) {
    line.remove_prefix(begin);
    const auto end = std::min(line.find_first_of(blanks), line.size());
    if (count < columns) words[count] = line.substr(0, end);
    ++count;
    line.remove_prefix(end);
  }
  return count;
}

double parse_number(std::string_view word, const Place& place) {
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) fail(place, quoted(word) + " is not a number");
  if (!std::isfinite(value)) fail(place, quoted(word) + " is not finite");
  return value;
}

/// SO3::from_quaternion without its SVD, which would cost more than reading the line.
SO3 rotation_of(const Eigen::Quaterniond& unit) {
  const double n = unit.vec().norm();
  if (n == 0) return SO3();
  return SO3::Exp(unit.vec() * (2.0 * std::atan2(n, unit.w()) / n));
}

StampedPose parse_line(const Words& words, const Place& place) {
  const auto t = parse_seconds(words[0]);
  if (!t) fail(place, quoted(words[0]) + " is not a time in seconds");
  std::array<double, columns - 1> v{};
  for (std::size_t i = 1; i < columns; ++i) v[i - 1] = parse_number(words[i], place);
  constexpr double farthest = 1e9;  // m; squares of more, summed, are soon no numbers
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(v[i]) > farthest) fail(place, quoted(words[i + 1]) + " m is no position on Earth");
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  const double norm = q.norm();
  if (!(std::abs(norm - 1.0) <= quaternion_norm_tolerance)) {
    fail(place, "the quaternion qx qy qz qw has norm " + std::to_string(norm) + " instead of 1");
  }
  return {*t, {rotation_of(Eigen::Quaterniond(q.coeffs() / norm)), {v[0], v[1], v[2]}}};
}

std::string system_error(std::string_view what, const std::filesystem::path& path) {
  return std::string(what) + " " + path.string() + ": " + std::strerror(errno);
}

}  // namespace

std::vector<StampedPose> parse_tum(std::string_view text, std::string_view name) {
  std::vector<StampedPose> poses;
  Place place{name, 0};
  while (!text.empty()) {
    ++place.line;
    const auto end = std::min(text.find('\n'), text.size());
    Words words;
    const std::size_t count = split(text.substr(0, end), words);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (count == 0 || words[0].starts_with('#')) continue;
    if (count != columns) fail(place, "expected 8 numbers (t x y z qx qy qz qw), found " + std::to_string(count));
    poses.push_back(parse_line(words, place));
    if (poses.size() > 1 && poses.back().t < poses[poses.size() - 2].t) {
      fail(place, "time goes backwards: " + std::string(words[0]) + " comes after a later pose");
    }
  }
  return poses;
}

std::vector<StampedPose> read_tum(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) throw TrajectoryError(system_error("cannot open", path));
  std::string text;
  std::size_t size = 0;
  do {
    text.resize(size + (std::size_t{4} << 20));
    size += std::fread(text.data() + size, 1, text.size() - size, file.get());
  } while (size == text.size());
  if (std::ferror(file.get())) throw TrajectoryError(system_error("cannot read", path));
  text.resize(size);
  return parse_tum(text, path.string());
}

void append_tum_line(std::string& out, const StampedPose& pose) {
  const Eigen::Quaterniond q = pose.T.R.quaternion();
  append_seconds(out, pose.t);
  for (const double x : {pose.T.p.x(), pose.T.p.y(), pose.T.p.z(), q.x(), q.y(), q.z(), q.w()}) {
    out += ' ';
    append_fixed9(out, x);
  }
  out += '\n';
}

TumWriter::TumWriter(const std::filesystem::path& path) : path_(path), file_(std::fopen(path.c_str(), "wb")) {
  if (!file_) throw TrajectoryOutputError(system_error("cannot write", path));
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);  // buffer_ is the buffer
  buffer_.reserve(flush_bytes + 512);
}

TumWriter::~TumWriter() {
  if (file_) std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get());
}

void TumWriter::write(const StampedPose& pose) {
  assert(file_ && "write after close");
  append_tum_line(buffer_, pose);
  if (buffer_.size() >= flush_bytes) flush();
}

void TumWriter::close() {
  if (!file_) return;
  flush();
  if (std::fclose(file_.release()) != 0) throw TrajectoryOutputError(system_error("cannot write", path_));
}

void TumWriter::flush() {
  const std::size_t written = std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get());
  if (written != buffer_.size()) throw TrajectoryOutputError(system_error("cannot write", path_));
  buffer_.clear();
}

void write_tum(const std::filesystem::path& path, std::span<const StampedPose> poses) {
  TumWriter writer(path);
  for (const StampedPose& pose : poses) writer.write(pose);
  writer.close();
}

}  // namespace kilvo::lab
