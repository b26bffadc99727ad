// Several runs against one truth: a table, and a page with their paths and errors over each other.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "lab/evaluation/evaluate.hpp"

namespace kilvo::lab {

/// A run after alignment, in the truth's world.
struct ComparedRun {
  std::string name;
  Evaluation errors;
  std::array<double, 3> axis_rmse_m{};  // of the position, along the truth's x, y, z
  std::vector<double> t;                // s, from the truth's first pose
  std::vector<Eigen::Vector3d> p;       // estimate, m
  std::vector<double> error_m;          // of each
};

struct Comparison {
  std::vector<ComparedRun> runs;
  std::vector<Eigen::Vector3d> truth;  // m
};

/// The trajectory of a run: FOLDER/sweeps.tum, FOLDER/odometry.tum when that has no poses, or the file itself. Throws TrajectoryError.
std::vector<StampedPose> trajectory_of_run(const std::filesystem::path& run);

/// Throws TrajectoryError, EvaluationError.
Comparison compare_runs(std::span<const std::string> runs, const std::filesystem::path& truth, Alignment alignment);

/// A table for people, ending with a newline; the alignment is named.
std::string to_text(const Comparison& comparison);
/// {"align", "runs": [{"run", ...}]}.
std::string to_json(const Comparison& comparison);
/// One page that needs nothing else: the table, paths from above and from the side, error over time.
std::string to_html(const Comparison& comparison);

}  // namespace kilvo::lab
