// kilvo live --config FILE
#include <atomic>
#include <fmt/core.h>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/interrupt.hpp"
#include "apps/cli/verbs.hpp"
#ifdef KILVO_WITH_DDS
#include "apps/dds/live.hpp"
#include "apps/node/node.hpp"
#include "lab/recordings/message_log.hpp"
#endif

namespace kilvo::cli {
namespace {

struct LiveWords {
  std::string config, interface, record;
  int domain = 0;
  std::vector<std::string> peers, overrides;
  bool no_deskew = false;
};

#ifdef KILVO_WITH_DDS

node::Options options_of(const LiveWords& words, const lab::LiveConfig& live) {
  node::Options out;
  out.config = words.config;
  out.map_frame = live.map_frame;
  out.odom_frame = live.odom_frame;
  out.base = live.base;
  out.base_frame = live.base_frame;
  out.no_deskew = words.no_deskew;
  out.tf_rate = live.tf_rate;
  out.map_file = live.map_file;
  return out;
}

/// All that is published, as a log. A disk that is full ends the log, not the run.
class Record {
 public:
  Record(const std::string& file, std::string node, std::function<void(const std::string&)> say)
      : log_(file), node_(std::move(node)), say_(std::move(say)) {}

  node::Outlet outlet() {
    return {lab::Encoding::cdr, [this](node::Topic) { return !ended_; },
            [this](node::Topic topic, Time stamp, const std::vector<std::uint8_t>& bytes) { write(topic, stamp, bytes); }};
  }
  void close() {
    if (!ended_) log_.close();
  }

 private:
  void write(node::Topic topic, Time stamp, const std::vector<std::uint8_t>& bytes) {
    const node::TopicFacts& facts = node::facts_of(topic);
    const std::string name = facts.name;
    try {
      log_.write(name.starts_with('/') ? name : "/" + node_ + "/" + name, facts.type, stamp, bytes);
    } catch (const lab::OutputError& error) {
      if (!ended_.exchange(true)) say_(fmt::format("the record ends here: {}", error.what()));
    }
  }

  lab::MessageLog log_;
  std::string node_;
  std::function<void(const std::string&)> say_;
  std::atomic<bool> ended_{false};
};

int live(const LiveWords& words) {
  InterruptWatch interrupt;  // before any thread
  const lab::Settings settings = node::load_settings(words.config, words.overrides);
  std::mutex line;
  const auto say = [&line](const std::string& text) {
    const std::lock_guard lock(line);
    fmt::print(stderr, "kilvo: {}\n", text);
  };
  dds::LiveOptions options{{words.domain, words.interface, words.peers}, options_of(words, settings.live), settings.live.name};
  std::optional<Record> record;
  std::optional<node::Outlet> log;
  if (!words.record.empty()) log = record.emplace(words.record, settings.live.name, say).outlet();
  const auto is_over = [&interrupt] { return interrupt.requested(); };
  try {
    dds::run_live(options, settings, is_over, say, log ? &*log : nullptr);
  } catch (const dds::DdsError& error) {
    throw UsageError(fmt::format("live: {}", error.what()));
  }
  if (record) record->close();
  return done;
}

#else

int live(const LiveWords&) {
  throw UsageError(
      "live: this kilvo was built without DDS: install cyclonedds-dev and cyclonedds-tools (scripts/install_dependencies --dds) and build "
      "it "
      "again");
}

#endif

}  // namespace

void add_live(CLI::App& program, Action& chosen) {
  auto words = std::make_shared<LiveWords>();
  CLI::App* verb = program.add_subcommand("live", "estimate on the robot: sensors and results over DDS, as ROS 2 and Unitree speak it");
  verb->add_option("--config", words->config, "robot, sensors, topics and tuning")->type_name("FILE")->required();
  verb->add_option("--interface", words->interface, "network interface, by name or address; default: the one that Cyclone DDS finds")
      ->type_name("IF");
  verb->add_option("--domain", words->domain, "DDS domain (ROS_DOMAIN_ID); default 0")->type_name("N")->check(CLI::Range(0, 232));
  verb->add_option("--peer", words->peers, "address to look for others at, instead of by multicast; repeatable")
      ->type_name("ADDRESS")
      ->allow_extra_args(false);
  verb->add_option("--record", words->record, "keep all that is published as a log in MCAP, which Foxglove opens")->type_name("FILE");
  verb->add_option("--set", words->overrides, "override one setting, repeatable (lidar.voxel_size=0.2)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_flag("--no-deskew", words->no_deskew, "take each cloud at its stamp, as if its points had been measured at once");
  verb->callback([words, &chosen] { chosen = [words] { return live(*words); }; });
}

}  // namespace kilvo::cli
