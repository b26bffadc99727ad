#include "apps/cli/lidar_mount.hpp"

#include <algorithm>

#include "apps/cli/make_estimator.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/mount_regression.hpp"

namespace kilvo::cli {

void refine_lidar_position(std::vector<lab::Refinement>& refined, const SO3& first, lab::Settings settings, MeasurementSource& source,
                           double seconds) {
  const auto position = std::ranges::find(refined, lab::lidar_position, &lab::Refinement::what);
  if (position == refined.end()) return;
  settings.estimator.sweep_points = false;
  settings.estimator.sweep_updates = true;
  fit_to_machine(settings, false, 2);
  const SE3 described = settings.robot.lidar.T_imu_lidar;
  lab::MountRegression regression(described);
  const auto take = [&regression](const std::vector<Output>& outputs) {
    for (const Output& o : outputs) {
      if (o.update) regression.add(o.update->from, o.update->prior, o.update->posterior, o.update->imu);
    }
  };
  Estimator estimator = make_estimator(settings, {Sensor::imu, Sensor::lidar});
  std::optional<Time> begin;
  while (auto measurement = source.next()) {
    if (!begin) begin = stamp_of(*measurement);
    if (to_seconds(stamp_of(*measurement) - *begin) > seconds) break;
    take(estimator.push(std::move(*measurement)));
  }
  take(estimator.finish());
  const auto measured = regression.measured();
  if (!measured || estimator.statistics().diverged) return;
  *position = lab::refined_lidar_position(described.p, *measured, (described.R * first.inverse()).Log());
}

}  // namespace kilvo::cli
