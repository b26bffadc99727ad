// `kilvo live`: the node over DDS, until it is told to stop.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/dds/domain.hpp"
#include "apps/node/options.hpp"
#include "apps/node/outlet.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::dds {

struct LiveOptions {
  DomainOptions domain;
  node::Options node;
  std::string name = "kilvo";  // of the node: its topics are /kilvo/odometry and so on
};

/// Runs until `is_over` says so; it is asked about 20 times a second. `log` receives all that is published, too, if it is there. `say`: a
/// line for the user, from any thread. Throws DdsError, lab::ConfigError.
void run_live(const LiveOptions& options, const lab::Settings& settings, const std::function<bool()>& is_over,
              const std::function<void(const std::string&)>& say, const node::Outlet* log = nullptr);

}  // namespace kilvo::dds
