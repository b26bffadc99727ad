// skeleton.csv: where the joints of the legs are, for drawings of the robot.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/cli/csv_file.hpp"
#include "kilvo/legs/joint_chain.hpp"
#include "kilvo/sensors/measurement.hpp"
#include "kilvo/sensors/robot.hpp"

namespace kilvo::cli {

class SkeletonFile {
 public:
  /// Nothing is written for a robot without URDF or legs by joints, and no file without leg messages.
  SkeletonFile(std::filesystem::path file, const Robot& robot);

  /// At most 20 rows per second: positions in the IMU frame, m. Throws lab::OutputError.
  void add(const Measurement& m);
  void close();

 private:
  bool look_up(const JointSample& sample);
  void write_header(const JointSample& sample);

  std::filesystem::path path_;
  SE3 T_IM_;  // the link that carries the IMU, in the IMU frame
  std::optional<std::array<JointChain, 2>> chains_;
  JointNames names_;  // of the messages that the chains' joints have been found in
  bool found_ = false;
  std::unique_ptr<CsvFile> file_;
  std::optional<Time> last_;
};

}  // namespace kilvo::cli
