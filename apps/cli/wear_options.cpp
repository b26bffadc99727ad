#include "apps/cli/wear_options.hpp"

#include <cmath>
#include <iterator>
#include <numbers>

namespace kilvo::cli {
namespace {

using lab::SimulatorConfig;

constexpr double degree = std::numbers::pi / 180, milli = 1e-3, percent = 0.01;

struct WearOption {
  const char *name, *unit, *text;
  double to_si, low, high;  // limits in the option's unit
  double& (*value)(SimulatorConfig&);
};

constexpr WearOption table[] = {
    {"--sole-motion", "MM", "compression of loaded soles", milli, 0, 50, [](SimulatorConfig& c) -> double& { return c.wear.sole_motion; }},
    {"--shock", "M/S", "velocity of the foot that encoders show at a touchdown", 1, 0, 10,
     [](SimulatorConfig& c) -> double& { return c.wear.shock; }},
    {"--impact", "M/S2", "amplitude of the torso's vibration at each touchdown", 1, 0, 200,
     [](SimulatorConfig& c) -> double& { return c.wear.impact; }},
    {"--joint-flex", "DEG", "compliance of the joints: deflection under 100 N m", degree, 0, 10,
     [](SimulatorConfig& c) -> double& { return c.wear.flex; }},
    {"--backlash", "DEG", "play of each joint", degree, 0, 5, [](SimulatorConfig& c) -> double& { return c.wear.backlash; }},
    {"--zero-offset", "DEG", "sigma of the encoders' zeros", degree, 0, 10,
     [](SimulatorConfig& c) -> double& { return c.wear.zero_offset; }},
    {"--link-length", "PERCENT", "sigma of the true lengths of thighs and shins", percent, 0, 10,
     [](SimulatorConfig& c) -> double& { return c.wear.link_length; }},
    {"--velocity-lag", "MS", "low pass on the joint velocities", milli, 0, 100,
     [](SimulatorConfig& c) -> double& { return c.wear.velocity_lag; }},
    {"--stamp-jitter", "MS", "sigma of the joint stamps", milli, 0, 100, [](SimulatorConfig& c) -> double& { return c.wear.stamp_jitter; }},
    {"--lost", "PERCENT", "joint and IMU messages that are lost", percent, 0, 90,
     [](SimulatorConfig& c) -> double& { return c.wear.lost; }},
    {"--repeated", "PERCENT", "joint and IMU messages that are repeated", percent, 0, 90,
     [](SimulatorConfig& c) -> double& { return c.wear.repeated; }},
    {"--vibration", "M/S2", "rms vibration of the torso while walking, 45 to 90 Hz", 1, 0, 50,
     [](SimulatorConfig& c) -> double& { return c.wear.vibration; }},
    {"--leg-rate", "HZ", "rate of the joint messages", 1, 1, 4000, [](SimulatorConfig& c) -> double& { return c.joints.delivery.rate; }},
    {"--imu-rate", "HZ", "rate of the IMU, without an anti-aliasing filter", 1, 1, 4000,
     [](SimulatorConfig& c) -> double& { return c.imu.delivery.rate; }},
};

// A range of CLI11 lets NaN pass, as it is neither below nor above.
std::string refuse_nan(const std::string& word) {
  double value = 0;
  return CLI::detail::lexical_cast(word, value) && std::isnan(value) ? word + " is not a number" : std::string();
}

static_assert(std::size(table) == std::tuple_size_v<decltype(WearOptions::given)>);

}  // namespace

void add_wear_options(CLI::App& verb, WearOptions& options) {
  for (std::size_t i = 0; i < std::size(table); ++i) {
    const WearOption& o = table[i];
    verb.add_option(o.name, options.given[i], o.text)
        ->type_name(o.unit)
        ->check(CLI::Range(o.low, o.high))
        ->check(refuse_nan)
        ->group("Wear of the robot");
  }
}

void apply(const WearOptions& options, SimulatorConfig& config) {
  for (std::size_t i = 0; i < std::size(table); ++i) {
    if (options.given[i]) table[i].value(config) = table[i].to_si * *options.given[i];
  }
}

}  // namespace kilvo::cli
