// kilvo config check FILE, kilvo config show [FILE]
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/make_estimator.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/shipped_config.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/settings/show_settings.hpp"

namespace kilvo::cli {
namespace {

struct ConfigOptions {
  std::string file;
  std::vector<std::string> overrides;
  bool markdown = false;
};

int check(const ConfigOptions& options) {
  const lab::Settings settings = lab::load_settings(options.file, options.overrides);
  std::vector<Sensor> configured;
  std::string names;
  for (const Sensor sensor : all_sensors) {
    if (!settings.has(sensor)) continue;
    configured.push_back(sensor);
    names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", name_of(sensor), settings.topic(sensor));
  }
  if (!settings.has(Sensor::imu))
    throw lab::ConfigError(fmt::format("{}: imu.topic is missing: nothing is estimated without an IMU", options.file));
  lab::require_complete(settings, configured);
  make_estimator(settings, configured);  // whatever a run would find fault with
  fmt::print("{}: good: {}\n", options.file, names);
  return done;
}

int show(const ConfigOptions& options) {
  if (options.markdown) {
    fmt::print("{}", lab::settings_markdown());
    return done;
  }
  const auto file = config_file(options.file.empty() ? std::nullopt : std::optional(options.file));
  fmt::print("# {}\n{}", file.string(), lab::settings_yaml(lab::load_settings(file, options.overrides)));
  return done;
}

}  // namespace

void add_config(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<ConfigOptions>();
  CLI::App* verb = program.add_subcommand("config", "check or show a configuration");
  verb->require_subcommand(1);
  verb->get_formatter()->label("SUBCOMMAND", "VERB");
  const auto add_set = [&options](CLI::App* to) {
    to->add_option("--set", options->overrides, "override one setting, repeatable")->type_name("KEY=VALUE")->allow_extra_args(false);
  };
  CLI::App* check_verb = verb->add_subcommand("check", "validate a configuration file");
  check_verb->add_option("FILE", options->file, "configuration file (YAML)")->required();
  add_set(check_verb);
  check_verb->callback([options, &chosen] { chosen = [options] { return check(*options); }; });

  CLI::App* show_verb = verb->add_subcommand("show", "print every setting with its value, unit and meaning, as a configuration file");
  show_verb->add_option("FILE", options->file, "configuration file (YAML); default: that of the Unitree G1");
  add_set(show_verb);
  show_verb->add_flag("--markdown", options->markdown, "print the tables of docs/parameters.md: every setting and its default");
  show_verb->callback([options, &chosen] { chosen = [options] { return show(*options); }; });
}

}  // namespace kilvo::cli
