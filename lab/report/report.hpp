// A run as one page with pictures: one file that needs nothing else, and no network.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace kilvo::lab {

/// A folder that a report cannot be made of; the message names the file.
class ReportError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ReportOptions {
  std::filesystem::path folder;                        // what `kilvo run` wrote
  std::optional<std::filesystem::path> truth;          // TUM, of the same body
  std::optional<std::filesystem::path> true_contacts;  // CSV with t, left, right
};

struct Report {
  std::string html;
  std::vector<std::string> left_out;  // files that are not there, whose figures are therefore not either
};

/// Reads the folder and makes the page. Only odometry.tum has to be there. Throws ReportError, TrajectoryError, CsvError or
/// EvaluationError, each with the name of the file.
Report make_report(const ReportOptions& options);

}  // namespace kilvo::lab
