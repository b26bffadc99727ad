#include "apps/dds/live.hpp"

#include <chrono>
#include <dds/dds.h>
#include <thread>

#include "apps/dds/dds_inputs.hpp"
#include "apps/dds/dds_log.hpp"
#include "apps/dds/dds_outlet.hpp"
#include "apps/dds/services.hpp"
#include "apps/node/node.hpp"

namespace kilvo::dds {

void run_live(const LiveOptions& options, const lab::Settings& settings, const std::function<bool()>& is_over,
              const std::function<void(const std::string&)>& say, const node::Outlet* log) {
  const DdsLog words(say);
  const Domain domain(options.domain);
  DdsOutlet topics(domain, options.name);
  node::Node node(options.node, settings, log == nullptr ? topics.outlet() : node::both(topics.outlet(), *log), say);
  Services services(domain, options.name, node);
  DdsInputs inputs(domain, settings, node.inputs());
  say("odometry of " + node.base().name() + " on /" + options.name + "/odometry");
  for (int round = 0; !is_over(); ++round) {
    services.look();
    if (round % 2 == 0) node.tick(time_from_ns(dds_time()));
    if (round % 20 == 0) topics.look_for_misfits(say);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  inputs.stop();
  node.stop();
}

}  // namespace kilvo::dds
