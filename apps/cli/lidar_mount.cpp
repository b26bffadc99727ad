#include "apps/cli/lidar_mount.hpp"

#include <algorithm>

#include "apps/cli/make_estimator.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/mount_regression.hpp"

namespace kilvo::cli {

bool can_refine_lidar_position(const std::vector<lab::Refinement>& refined, bool without_deskew) {
  return !without_deskew && std::ranges::find(refined, lab::lidar_position, &lab::Refinement::what) != refined.end();
}

void refine_lidar_position(std::vector<lab::Refinement>& refined, const SO3& first, lab::Settings settings, MeasurementSource& source,
                           double seconds) {
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
    const double shift = estimator.statistics().clock_shift[index_of(Sensor::lidar)];
    take(estimator.push(std::move(*measurement)));
    // Its clock is another one from now on.
    if (estimator.statistics().clock_shift[index_of(Sensor::lidar)] != shift) regression = lab::MountRegression(described);
  }
  take(estimator.finish());
  const auto measured = regression.measured();
  const Statistics& run = estimator.statistics();
  const auto position = std::ranges::find(refined, lab::lidar_position, &lab::Refinement::what);
  if (!measured || run.diverged || run.epochs > 1 || run.maps_begun_anew > 0 || run.rollbacks > 0 || position == refined.end()) return;
  *position = lab::refined_lidar_position(described.p, *measured, (described.R * first.inverse()).Log());
}

}  // namespace kilvo::cli
