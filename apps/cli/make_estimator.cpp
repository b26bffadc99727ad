#include "apps/cli/make_estimator.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <stdexcept>

#include "lab/clocks/rate_offset.hpp"

namespace kilvo::cli {

std::array<bool, sensor_count> as_flags(const std::vector<Sensor>& sensors) {
  std::array<bool, sensor_count> out{};
  for (const Sensor s : sensors) out[static_cast<std::size_t>(s)] = true;
  return out;
}

Estimator make_estimator(const lab::Settings& settings, const std::vector<Sensor>& used) {
  try {
    return {settings.robot, settings.estimator, as_flags(used)};
  } catch (const std::invalid_argument& error) {
    const std::string why = error.what();
    throw lab::ConfigError(why.starts_with("robot.urdf") ? fmt::format("{}: {}", settings.urdf_file, why) : why);
  }
}

void fit_to_machine(lab::Settings& settings, bool live, int threads) {
  // On a robot the other cores are for others.
  if (live && !settings.given.contains("estimator.wait_for_images")) settings.estimator.wait_for_images = false;
  // In a recording what comes later than the IMU's messages of the same time can be waited for, and so can legs whose time is looked for.
  constexpr double recorded_wait = 1;  // s
  if (!live && settings.estimator.max_wait == EstimatorConfig{}.max_wait) {
    settings.estimator.max_wait = recorded_wait;
    if (settings.leg_clock.clock == "estimated") settings.estimator.max_wait += lab::RateOffset::reach();
  }
  // Reading and the map keep about one core busy.
  if (!settings.given.contains("estimator.threads")) settings.estimator.threads = live ? 1 : std::max(1, threads - 1);
}

}  // namespace kilvo::cli
