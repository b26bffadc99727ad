// Trajectory files in TUM format: one pose per line, `t x y z qx qy qz qw`, seconds and metres, `#` starts a comment.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "kilvo/math/se3.hpp"
#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

struct StampedPose {
  Time t{};
  SE3 T;  // body in world; which body is the writer's business (KILVO: the IMU)
};

/// A trajectory file that cannot be used; the message starts with `file:line:` (or `file:` when it cannot be read).
class TrajectoryError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A trajectory file that cannot be written; the message names the path.
class TrajectoryOutputError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The poses of a file in the order of time (equal stamps are allowed: an estimator may correct a pose at its own time). Times are
/// exact to the nanosecond; quaternions are normalised. Throws TrajectoryError when the file cannot be read and at the first line that
/// has not exactly 8 finite numbers, has a quaternion whose norm is off 1 by more than 5 % (so also zero) or goes back in time.
/// A file without poses gives none.
std::vector<StampedPose> read_tum(const std::filesystem::path& path);

/// The same of text in memory; `name` stands in error messages.
std::vector<StampedPose> parse_tum(std::string_view text, std::string_view name);

/// Appends one line of a TUM file: time from integer nanoseconds, everything with 9 decimals.
void append_tum_line(std::string& out, const StampedPose& pose);

/// Writes poses as they come: about 0.2 us each, flushed every 64 KiB and at the end.
class TumWriter {
 public:
  /// Creates or empties the file. Throws TrajectoryOutputError.
  explicit TumWriter(const std::filesystem::path& path);
  TumWriter(TumWriter&&) = default;
  TumWriter& operator=(TumWriter&&) = delete;
  /// Closes the file; what could not be written is lost silently: call close() to hear of it.
  ~TumWriter();

  /// Throws TrajectoryOutputError when the disk is full.
  void write(const StampedPose& pose);
  /// Writes what is left. Throws TrajectoryOutputError. Nothing can be written afterwards.
  void close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void flush();

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::string buffer_;
};

/// Writes a whole trajectory. Throws TrajectoryOutputError.
void write_tum(const std::filesystem::path& path, std::span<const StampedPose> poses);

}  // namespace kilvo::lab
