#include "lab/recordings/rosbag2_writer.hpp"

#include <algorithm>
#include <fstream>
#include <yaml-cpp/yaml.h>

namespace kilvo::lab {
namespace {

namespace fs = std::filesystem;

YAML::Node nanoseconds(const char* key, std::int64_t ns) {
  YAML::Node node;
  node[key] = ns;
  return node;
}

std::int64_t span_of(const TimesSummary& times) { return to_ns(times.last) - to_ns(times.first); }

}  // namespace

Rosbag2Writer::Rosbag2Writer(const fs::path& folder, OutputFormat format, Create create)
    : folder_(folder), format_(format), create_(std::move(create)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!fs::is_directory(folder_, error)) throw OutputError(folder_.string() + ": the folder cannot be made");
  if (!fs::is_empty(folder_, error)) throw OutputError(folder_.string() + ": the folder is not empty");
  begin_file();
}

Rosbag2Writer::~Rosbag2Writer() {
  try {
    close();
  } catch (const OutputError&) {
    // For those who call close().
  }
}

void Rosbag2Writer::begin_file() {
  if (writer_) writer_->close();
  const char* ending = format_.storage == OutputFormat::Storage::db3 ? ".db3" : ".mcap";
  const std::string name = fs::absolute(folder_).lexically_normal().filename().string() + "_" + std::to_string(files_.size()) + ending;
  files_.push_back({name, {}});
  writer_ = create_(folder_ / name);
  for (Topic& topic : topics_) topic.id = writer_->add_channel(topic.channel);
}

std::uint32_t Rosbag2Writer::add_channel(const Channel& channel) {
  topics_.push_back({channel, 0, writer_->add_channel(channel)});
  return static_cast<std::uint32_t>(topics_.size() - 1);
}

void Rosbag2Writer::write(std::uint32_t channel, Time recorded, Bytes message) {
  const TimesSummary& so_far = files_.back().times;
  if (so_far.count > 0 && to_seconds(recorded - so_far.first) >= format_.split) begin_file();
  files_.back().times.add(recorded);
  ++topics_.at(channel).count;
  writer_->write(*topics_[channel].id, recorded, message);
}

void Rosbag2Writer::flush() {
  writer_->flush();
  write_metadata();
}

void Rosbag2Writer::close() {
  if (closed_) return;
  closed_ = true;
  writer_->close();
  write_metadata();
}

void Rosbag2Writer::write_metadata() const {
  const bool by_message = format_.compression == OutputFormat::Compression::message;
  TimesSummary all;
  YAML::Node root, about;
  for (const File& file : files_) {
    if (file.times.count > 0) all.append(file.times);
    YAML::Node entry;
    entry["path"] = file.name;
    entry["starting_time"] = nanoseconds("nanoseconds_since_epoch", to_ns(file.times.first));
    entry["duration"] = nanoseconds("nanoseconds", span_of(file.times));
    entry["message_count"] = file.times.count;
    about["files"].push_back(entry);
    about["relative_file_paths"].push_back(file.name);
  }
  about["version"] = 5;
  about["storage_identifier"] = format_.storage == OutputFormat::Storage::db3 ? "sqlite3" : "mcap";
  about["duration"] = nanoseconds("nanoseconds", span_of(all));
  about["starting_time"] = nanoseconds("nanoseconds_since_epoch", to_ns(all.first));
  about["message_count"] = all.count;
  about["topics_with_message_count"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Topic& topic : topics_) {
    YAML::Node entry;
    entry["topic_metadata"]["name"] = topic.channel.topic;
    entry["topic_metadata"]["type"] = ros2_type_name(topic.channel.type);
    entry["topic_metadata"]["serialization_format"] = "cdr";
    entry["topic_metadata"]["offered_qos_profiles"] = "";
    entry["message_count"] = topic.count;
    about["topics_with_message_count"].push_back(entry);
  }
  about["compression_format"] = by_message ? "zstd" : "";
  about["compression_mode"] = by_message ? "MESSAGE" : "";
  root["rosbag2_bagfile_information"] = about;
  std::ofstream file(folder_ / "metadata.yaml", std::ios::binary | std::ios::trunc);
  file << root << "\n";
  file.close();
  if (file.fail()) throw OutputError((folder_ / "metadata.yaml").string() + ": cannot be written (disk full?)");
}

}  // namespace kilvo::lab
