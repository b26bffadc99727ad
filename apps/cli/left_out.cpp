#include "apps/cli/left_out.hpp"

#include <algorithm>
#include <string_view>

namespace kilvo::cli {
namespace {

Sensor spoiled_by(const lab::Finding& finding) {
  const std::string_view cause = finding.cause;
  return cause.starts_with("imu_mount") || cause == "imu_link" ? Sensor::legs : finding.sensor;
}

bool has(const std::vector<Sensor>& sensors, Sensor sensor) { return std::ranges::find(sensors, sensor) != sensors.end(); }

}  // namespace

std::vector<lab::WrongDescription> first_spoiling(const std::vector<lab::WrongDescription>& found) {
  const auto first = std::ranges::find(found, true, &lab::WrongDescription::spoils);
  std::vector<lab::WrongDescription> out;
  if (first == found.end()) return out;
  for (const lab::WrongDescription& w : found) {
    if (w.t <= first->t) out.push_back(w);
  }
  return out;
}

std::vector<Sensor> without_spoiled(const std::vector<Sensor>& used, const std::vector<lab::WrongDescription>& found) {
  std::vector<Sensor> out = used;
  for (const lab::WrongDescription& w : found) {
    if (w.spoils) std::erase(out, spoiled_by(w.finding));
  }
  if (!has(out, Sensor::lidar)) std::erase(out, Sensor::camera);
  if (!has(out, Sensor::imu) || !(has(out, Sensor::legs) || has(out, Sensor::lidar))) out.clear();
  return out;
}

}  // namespace kilvo::cli
