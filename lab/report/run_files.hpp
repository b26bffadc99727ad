// The files of a run, read again.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/evaluation/contacts.hpp"
#include "lab/evaluation/trajectory_file.hpp"
#include "lab/mapping/ply.hpp"

namespace kilvo::lab {

/// A row of states.csv: world frame and SI units; sigmas of position (world axes, m) and attitude (body axes, rad) relative to the start.
struct StateRow {
  Time t{};
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), bg = v, ba = v;
  Eigen::Vector3d sigma_p = v, sigma_R = v;  // NaN when the file has none
};

/// A row of contacts.csv.
struct ContactRow {
  ContactSample sample;
  std::array<double, 2> clearance{};  // m above the ground; NaN where not known
};

struct ModalityRow {
  Time t{};
  std::string modality, cause;
};

struct StageRow {
  Time t{};
  std::string stage;
  double microseconds = 0;
};

/// A row of skeleton.csv: the joints of each leg from the IMU's link to the foot, in the IMU frame, m.
struct SkeletonRow {
  Time t{};
  std::array<std::vector<Eigen::Vector3d>, 2> legs;
};

struct RunFiles {
  std::string name;                           // of the folder
  std::vector<StampedPose> odometry, sweeps;  // T_WI
  std::vector<StateRow> states;
  std::vector<ContactRow> contacts;
  std::vector<ModalityRow> modality;
  std::vector<StageRow> timing;
  std::vector<SkeletonRow> skeleton;  // empty without legs
  Cloud map;
  nlohmann::ordered_json summary;    // an object, empty when the file is not there
  std::vector<std::string> missing;  // names of files
};

/// Throws ReportError when the folder or odometry.tum is not there, and what the readers throw when a file is not as it should be.
RunFiles read_run_files(const std::filesystem::path& folder);

}  // namespace kilvo::lab
