#include "lab/report/run_files.hpp"

#include <fstream>
#include <limits>

#include "lab/evaluation/csv_reader.hpp"
#include "lab/report/report.hpp"

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

std::array<std::size_t, 3> columns(const CsvReader& csv, const std::string& prefix) {
  return {csv.column(prefix + "x"), csv.column(prefix + "y"), csv.column(prefix + "z")};
}

Eigen::Vector3d vector(const CsvReader& csv, const std::array<std::size_t, 3>& at) {
  return {csv.number(at[0]), csv.number(at[1]), csv.number(at[2])};
}

/// Calls row(csv) for each row and makes sure that the rows' times, which row() returns, do not go back.
template <class F>
void for_each_row(CsvReader& csv, F&& row) {
  std::optional<Time> last;
  while (csv.next()) {
    const Time t = row(csv);
    if (last && t < *last) csv.fail("time goes backwards");
    last = t;
  }
}

std::vector<StateRow> read_states(const fs::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t");
  const auto v = columns(csv, "v"), bg = columns(csv, "bg"), ba = columns(csv, "ba");
  const bool with_sigma = csv.find_column("spx") && csv.find_column("srx");
  const auto sp = with_sigma ? columns(csv, "sp") : v, sr = with_sigma ? columns(csv, "sr") : v;
  std::vector<StateRow> rows;
  for_each_row(csv, [&](const CsvReader& row) {
    const Eigen::Vector3d none = Eigen::Vector3d::Constant(unknown);
    rows.push_back({row.time(t), vector(row, v), vector(row, bg), vector(row, ba), with_sigma ? vector(row, sp) : none,
                    with_sigma ? vector(row, sr) : none});
    return rows.back().t;
  });
  return rows;
}

std::vector<ContactRow> read_contact_rows(const fs::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t"), left = csv.column("left"), right = csv.column("right");
  const auto clearance_left = csv.find_column("clearance_left"), clearance_right = csv.find_column("clearance_right");
  std::vector<ContactRow> rows;
  for_each_row(csv, [&](const CsvReader& row) {
    rows.push_back({{row.time(t), {row.flag(left), row.flag(right)}},
                    {clearance_left ? row.number_if_known(*clearance_left) : unknown,
                     clearance_right ? row.number_if_known(*clearance_right) : unknown}});
    return rows.back().sample.t;
  });
  return rows;
}

std::vector<ModalityRow> read_modality(const fs::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t"), modality = csv.column("modality"), cause = csv.column("cause");
  std::vector<ModalityRow> rows;
  for_each_row(csv, [&](const CsvReader& row) {
    rows.push_back({row.time(t), row.text(modality), row.text(cause)});
    return rows.back().t;
  });
  return rows;
}

std::vector<StageRow> read_timing(const fs::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t"), stage = csv.column("stage"), microseconds = csv.column("microseconds");
  std::vector<StageRow> rows;
  // Not held to the order of time: two threads may write, each in its own order.
  while (csv.next()) rows.push_back({csv.time(t), csv.text(stage), csv.number(microseconds)});
  return rows;
}

std::vector<SkeletonRow> read_skeleton(const fs::path& path) {
  CsvReader csv(path);
  const std::size_t t = csv.column("t");
  std::array<std::vector<std::array<std::size_t, 3>>, 2> at;
  for (const std::size_t side : {0U, 1U}) {
    for (std::size_t i = 0;; ++i) {
      const std::string prefix = (side == 0 ? "left_" : "right_") + std::to_string(i) + "_";
      if (!csv.find_column(prefix + "x")) break;
      at[side].push_back(columns(csv, prefix));
    }
  }
  std::vector<SkeletonRow> rows;
  for_each_row(csv, [&](const CsvReader& row) {
    rows.push_back({row.time(t), {}});
    for (const std::size_t side : {0U, 1U}) {
      for (const auto& place : at[side]) rows.back().legs[side].push_back(vector(row, place));
    }
    return rows.back().t;
  });
  return rows;
}

Cloud read_map(const fs::path& path) {
  try {
    return read_cloud(path);
  } catch (const PlyError& e) {
    throw ReportError(e.what());
  }
}

nlohmann::ordered_json read_summary(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(in, nullptr, false);
  if (!json.is_object()) throw ReportError(path.string() + ": is not a JSON object");
  return json;
}

}  // namespace

RunFiles read_run_files(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw ReportError(folder.string() + ": there is no such folder");
  if (!fs::exists(folder / "odometry.tum", error)) {
    throw ReportError((folder / "odometry.tum").string() + ": is missing; is this a folder that `kilvo run` wrote?");
  }
  RunFiles run;
  const fs::path full = fs::weakly_canonical(folder, error);
  run.name = (full.has_filename() ? full.filename() : full.parent_path().filename()).string();
  run.odometry = read_tum(folder / "odometry.tum");
  if (run.odometry.empty()) run.missing.emplace_back("odometry.tum (no pose in it)");
  run.summary = nlohmann::ordered_json::object();
  const auto read = [&](const char* name, auto& into, auto&& reader) {
    if (fs::exists(folder / name, error))
      into = reader(folder / name);
    else
      run.missing.emplace_back(name);
  };
  read("sweeps.tum", run.sweeps, read_tum);
  read("states.csv", run.states, read_states);
  read("contacts.csv", run.contacts, read_contact_rows);
  read("modality.csv", run.modality, read_modality);
  read("timing.csv", run.timing, read_timing);
  if (fs::exists(folder / "skeleton.csv", error)) run.skeleton = read_skeleton(folder / "skeleton.csv");
  read("map.ply", run.map, read_map);
  read("summary.json", run.summary, read_summary);
  return run;
}

}  // namespace kilvo::lab
