// kilvo convert IN... OUT
#include "lab/recordings/convert.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <memory>

#include "apps/cli/exit_code.hpp"
#include "apps/cli/interrupt.hpp"
#include "apps/cli/progress.hpp"
#include "apps/cli/sensor_choice.hpp"
#include "apps/cli/verbs.hpp"
#include "lab/messages/input_error.hpp"
#include "lab/recordings/output_recording.hpp"
#include "lab/recordings/recording_file.hpp"
#include "lab/settings/nearest.hpp"
#include "lab/settings/settings.hpp"

namespace kilvo::cli {
namespace {

namespace fs = std::filesystem;

struct ConvertWords {
  std::vector<std::string> paths;  // the last one is written
  std::vector<std::string> topics;
  std::string config, storage, compression;
  double start = 0, duration = std::numeric_limits<double>::infinity(), split = std::numeric_limits<double>::infinity();
  bool force = false, quiet = false;
};

template <class T>
T choose(const std::string& word, const char* option, std::initializer_list<std::pair<const char*, T>> values) {
  std::string all;
  for (const auto& [name, value] : values) {
    if (word == name) return value;
    all += (all.empty() ? "" : ", ") + std::string(name);
  }
  throw UsageError(fmt::format("convert: {} {}: must be one of {}", option, word, all));
}

lab::OutputFormat format_of(const fs::path& out, const ConvertWords& words) {
  using Format = lab::OutputFormat;
  Format format = lab::output_format(out);
  // A folder by that name may be meant, or a format that there is none of.
  if (format.folder && words.storage.empty() && out.has_extension())
    throw UsageError(fmt::format("convert: {}: no format is called {} (.bag, .mcap, .db3); --storage mcap writes a folder of that name",
                                 out.string(), out.extension().string()));
  if (!words.storage.empty()) {
    if (!format.folder) throw UsageError("convert: --storage is for folders; the name of a file defines its format");
    format.storage =
        choose<Format::Storage>(words.storage, "--storage", {{"mcap", Format::Storage::mcap}, {"sqlite3", Format::Storage::db3}});
    if (format.storage == Format::Storage::db3) format.compression = Format::Compression::none;
  }
  using enum Format::Compression;
  if (!words.compression.empty())
    format.compression = choose<Format::Compression>(words.compression, "--compression",
                                                     {{"none", none}, {"lz4", lz4}, {"zstd", zstd}, {"message", message}});
  if (std::isfinite(words.split) && !format.folder) throw UsageError("convert: --split is for folders");
  if (!(words.split > 0)) throw UsageError("convert: --split must be a number of seconds above 0");
  format.split = words.split;
  return format;
}

/// The topics of the sensors in a configuration; of the camera the compressed ones too.
void add_topics_of(const std::string& config, const lab::RecordingReader& recording, std::set<std::string>& topics) {
  const lab::Settings settings = lab::load_settings(config);
  for (const Sensor sensor : all_sensors) {
    if (!settings.has(sensor)) continue;
    for (const auto& [id, channel] : recording.connections()) {
      if (lab::topic_matches(sensor, settings.topic(sensor), channel.topic)) topics.insert(channel.topic);
    }
  }
  if (topics.empty()) throw lab::InputError(fmt::format("{}: none of the topics in {} is in it", recording.name(), config));
}

std::string_view without_slash(std::string_view topic) { return topic.starts_with('/') ? topic.substr(1) : topic; }

/// What is asked for by name and time must be there, before anything is written.
void check_choice(const ConvertWords& words, const lab::RecordingReader& recording) {
  std::vector<std::string> names;
  for (const auto& [id, channel] : recording.connections()) names.push_back(channel.topic);
  if (names.empty()) throw lab::InputError(fmt::format("{}: holds no messages", recording.name()));
  for (const std::string& topic : words.topics) {
    const auto named = [&](const std::string& name) { return without_slash(name) == without_slash(topic); };
    if (std::ranges::none_of(names, named))
      throw lab::InputError(fmt::format("{}: no topic {}, nearest is {}", recording.name(), topic, lab::nearest(topic, names)));
  }
  const double lasts = to_seconds(recording.end() - recording.begin());
  if (words.start > lasts)
    throw lab::InputError(fmt::format("{}: ends after {:.3f} s, before --start {:g}", recording.name(), lasts, words.start));
}

void check_target(const fs::path& out, const lab::OutputFormat& format, const std::vector<fs::path>& inputs, bool force) {
  std::error_code error;
  for (const fs::path& input : inputs) {
    if (fs::equivalent(input, out, error)) throw UsageError(fmt::format("convert: {} is an input as well", out.string()));
  }
  if (!format.folder && !force && fs::exists(out, error))
    throw UsageError(fmt::format("convert: {} is there already; --force replaces it", out.string()));
}

int convert(const ConvertWords& words) {
  if (words.paths.size() < 2) throw UsageError("convert: needs an input and an output");
  if (!(words.start >= 0) || std::isinf(words.start)) throw UsageError("--start must be a number of seconds, 0 or more");
  if (!(words.duration > 0)) throw UsageError("--duration must be a number of seconds above 0");
  const std::vector<fs::path> inputs(words.paths.begin(), words.paths.end() - 1);
  const fs::path out = words.paths.back();
  const lab::OutputFormat format = format_of(out, words);
  check_target(out, format, inputs, words.force);
  const auto from = lab::open_recordings(inputs);
  check_choice(words, *from);
  lab::ConvertOptions options{{words.topics.begin(), words.topics.end()}, words.start, words.duration, format.encoding(), false};
  options.keep_foreign = format.storage == lab::OutputFormat::Storage::mcap;
  if (!words.config.empty()) add_topics_of(words.config, *from, options.topics);
  InterruptWatch interrupt;
  Progress progress(Progress::style_for(words.quiet));
  const auto to = lab::create_recording(out, format);
  const lab::ConvertReport report = lab::convert_recording(*from, *to, options, [&](double done) {
    progress.update(done, [] { return std::string(); });
    return !interrupt.requested();
  });
  to->close();
  progress.finish();
  for (const std::string& text : report.warnings) fmt::print(stderr, "kilvo: warning: {}\n", text);
  for (const lab::Damage& damage : report.damages)
    fmt::print(stderr, "kilvo: warning: {}: damaged at byte {}: {}\n", damage.file.empty() ? from->name() : damage.file, damage.offset,
               damage.reason);
  if (interrupt.requested()) fmt::print(stderr, "kilvo: error: stopped by the user: {} is not complete\n", out.string());
  if (!words.quiet) fmt::print("{}: {} messages\n", out.string(), report.messages);
  return interrupt.requested() ? run_failed : done;
}

}  // namespace

void add_convert(CLI::App& program, Action& chosen) {
  auto words = std::make_shared<ConvertWords>();
  CLI::App* verb = program.add_subcommand("convert", "a recording in another format: ROS 1 bag, MCAP, rosbag2");
  verb->add_option("IN... OUT", words->paths,
                   "recordings, and what to write: NAME.bag, NAME.mcap, NAME.db3, or a folder of rosbag2; in a bag messages are encoded as "
                   "ROS 1 does, "
                   "in all others as ROS 2 (CDR)")
      ->required()
      ->expected(2, -1);
  verb->add_option("--topics", words->topics, "only these, repeatable (/imu,/points)")
      ->type_name("TOPIC,...")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option("--config", words->config, "only the topics of the sensors in this configuration")->type_name("FILE");
  verb->add_option("--start", words->start, "begin this many seconds into the recording")->type_name("S");
  verb->add_option("--duration", words->duration, "end after this many seconds")->type_name("S");
  verb->add_option("--storage", words->storage, "of a folder: mcap (default) or sqlite3")->type_name("NAME");
  verb->add_option("--compression", words->compression, "none, lz4 (bag, mcap), zstd (mcap, its default), message (sqlite3)")
      ->type_name("NAME");
  verb->add_option("--split", words->split, "of a folder: a new file so often")->type_name("S");
  verb->add_flag("--force", words->force, "replace a file that is there");
  verb->add_flag("--quiet", words->quiet, "no progress, only warnings and errors");
  verb->callback([words, &chosen] { chosen = [words] { return convert(*words); }; });
}

}  // namespace kilvo::cli
