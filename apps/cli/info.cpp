// kilvo info INPUT
#include <algorithm>
#include <fmt/core.h>
#include <memory>
#include <set>
#include <stdexcept>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/joint_advice.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/shipped_config.hpp"
#include "apps/cli/verbs.hpp"
#include "kilvo/legs/joint_chain.hpp"
#include "lab/messages/input_error.hpp"
#include "lab/recordings/description.hpp"
#include "lab/recordings/recording_source.hpp"
#include "lab/settings/leg_joints.hpp"
#include "lab/settings/nearest.hpp"

namespace kilvo::cli {
namespace {

struct InfoOptions {
  std::vector<std::string> inputs;  // several are one recording
  std::string config;

  std::vector<std::filesystem::path> paths() const { return {inputs.begin(), inputs.end()}; }
};

std::string listed(const std::vector<Sensor>& sensors) {
  std::string names;
  for (const Sensor sensor : sensors) names += (names.empty() ? "" : ", ") + std::string(name_of(sensor));
  return names;
}

std::string use_of(const lab::TopicDescription& topic) {
  if (!topic.used_for.empty()) return listed(topic.used_for);
  return topic.fits.empty() ? "-" : fmt::format("- (could be {})", listed(topic.fits));
}

void print_topics(const lab::RecordingDescription& about) {
  std::size_t topic_width = 5, type_width = 4;
  for (const lab::TopicDescription& topic : about.topics) {
    topic_width = std::max(topic_width, topic.topic.size());
    type_width = std::max(type_width, topic.type.size());
  }
  fmt::print("{:<{}}  {:<{}}  {:>9}  {:>8}  {:>7}  {}\n", "topic", topic_width, "type", type_width, "messages", "rate Hz", "gap s", "use");
  for (const lab::TopicDescription& topic : about.topics) {
    fmt::print("{:<{}}  {:<{}}  {:>9}  {:>8.2f}  {:>7.3f}  {}\n", topic.topic, topic_width, topic.type, type_width, topic.count, topic.rate,
               topic.largest_gap, use_of(topic));
    if (!topic.detail.empty()) fmt::print("{:<{}}  {}\n", "", topic_width, topic.detail);
  }
}

// Names of the joints between the IMU and the feet; none when the URDF cannot tell.
std::set<std::string> joints_of_legs(const Robot& robot) {
  std::set<std::string> out;
  try {
    const LinkTree tree(robot);
    for (const Foot& foot : robot.feet) {
      for (const std::string& joint : tree.chain(robot.imu.link, foot.link).names) out.insert(joint);
    }
  } catch (const std::invalid_argument& e) {
    fmt::print("joints: {}\n", e.what());
  }
  return out;
}

// The names in that of the first leg messages which has most of them: hands and heads may be on the same topic.
std::vector<std::string> best_names(const InfoOptions& options, lab::RecordingOptions wanted, const std::set<std::string>& joints) {
  constexpr int patience = 20;
  const auto found = [&](const std::vector<std::string>& names) {
    return std::ranges::count_if(names, [&](const std::string& name) { return joints.contains(name); });
  };
  for (const Sensor sensor : all_sensors) wanted[sensor].use = sensor == Sensor::legs;
  std::vector<std::string> best;
  try {
    lab::RecordingSource source(options.paths(), wanted);
    for (int i = 0; i < patience;) {
      const auto measurement = source.next();
      if (!measurement) break;
      const auto* sample = std::get_if<JointSample>(&*measurement);
      if (sample == nullptr) continue;
      if (best.empty() || found(sample->names) > found(best)) best = sample->names;
      ++i;
    }
  } catch (const lab::InputError&) {  // the table says that there is no such topic
  }
  return best;
}

// The leg messages against the joints that the URDF has between the IMU and the feet.
void print_joints(const InfoOptions& options, const lab::Settings& settings, const lab::RecordingOptions& wanted) {
  const Robot& robot = settings.robot;
  if (!settings.has(Sensor::legs) || robot.legs.type != "joints" || robot.urdf.empty() || robot.imu.link.empty()) return;
  const std::set<std::string> needed = joints_of_legs(robot);
  const std::vector<std::string> names = best_names(options, wanted, needed);
  if (needed.empty() || names.empty()) return;
  std::vector<std::string> missing;
  for (const std::string& joint : needed) {
    if (std::ranges::find(names, joint) == names.end()) missing.push_back(joint);
  }
  fmt::print("joints: {} of the {} between {} and the feet in {} are in {}\n", needed.size() - missing.size(), needed.size(),
             robot.imu.link, settings.urdf_file, settings.topic(Sensor::legs));
  for (const std::string& joint : missing) fmt::print("  {} is not in the messages, nearest is {}\n", joint, lab::nearest(joint, names));
  if (!missing.empty()) fmt::print("  {}\n", joint_advice(robot, names));
}

int info(const InfoOptions& options) {
  const auto config = config_file(options.config.empty() ? std::nullopt : std::optional(options.config), options.inputs.front());
  const lab::Settings settings = lab::load_settings(config);
  lab::RecordingOptions wanted;
  for (const Sensor sensor : all_sensors) {
    wanted[sensor].use = settings.has(sensor);
    wanted[sensor].topic = settings.topic(sensor);
  }
  wanted[Sensor::legs].joints = lab::leg_joints(settings.robot);
  const lab::RecordingDescription about = lab::describe_recording(options.paths(), wanted);
  const std::string chunks = about.storage.chunks > 0 ? fmt::format(" in {} chunks", about.storage.chunks) : "";
  fmt::print("{}: {}, {:.1f} MB, {:.3f} s, {} messages{} ({})\n", about.file, about.storage.format, static_cast<double>(about.bytes) * 1e-6,
             to_seconds(about.end - about.begin), about.messages, chunks, about.storage.compression);
  fmt::print("use: with {}\n", config.string());
  print_topics(about);
  print_joints(options, settings, wanted);
  for (const lab::Damage& damage : about.damages)
    fmt::print("damaged at byte {}{}: {}\n", damage.offset, damage.file.empty() ? "" : " of " + damage.file, damage.reason);
  return done;
}

}  // namespace

void add_info(CLI::App& program, Action& chosen) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* verb = program.add_subcommand("info", "content of a recording, and the use of each topic");
  verb->add_option(
          "INPUT", options->inputs,
          "a ROS 1 bag, an MCAP file, a .db3 or folder of rosbag2, or a folder with recording.bag in it; several are one recording")
      ->required()
      ->expected(1, -1);
  verb->add_option("--config", options->config,
                   "configuration with the topics; default: config.yaml in INPUT if that is a folder, else the shipped "
                   "robots/g1.yaml")
      ->type_name("FILE");
  verb->callback([options, &chosen] { chosen = [options] { return info(*options); }; });
}

}  // namespace kilvo::cli
