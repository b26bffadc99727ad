#include "apps/cli/make_estimator.hpp"

#include <fmt/core.h>
#include <stdexcept>

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

}  // namespace kilvo::cli
