// Reads every FILE.mcap below a folder that has a FILE.json beside it, as the conformance tests of the format (foxglove/mcap,
// tests/conformance/data) have it, and compares channels and messages with what the JSON says:
//   mcap_conformance DIR
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/mcap_reader.hpp"

namespace {

namespace fs = std::filesystem;
using kilvo::lab::McapReader;
using nlohmann::json;

struct Message {
  std::string topic, type;
  std::int64_t time = 0;
  std::vector<std::uint8_t> data;
  bool operator==(const Message&) const = default;
};

/// The fields of a record by name: each is a pair [name, value], numbers as text.
json fields_of(const json& record) {
  json fields;
  for (const auto& field : record["fields"]) fields[field[0].get<std::string>()] = field[1];
  return fields;
}

std::vector<Message> expected_messages(const json& records) {
  std::map<std::string, std::string> types, topics, schema_of;
  std::vector<Message> messages;
  for (const json& record : records) {
    const json f = fields_of(record);
    if (record["type"] == "Schema") types[f["id"]] = f["name"];
    if (record["type"] == "Channel") {
      topics[f["id"]] = f["topic"];
      schema_of[f["id"]] = f["schema_id"];
    }
    if (record["type"] != "Message") continue;
    const std::string id = f["channel_id"];
    Message m{topics[id], types[schema_of[id]], std::stoll(f["log_time"].get<std::string>()), {}};
    for (const json& byte : f["data"]) m.data.push_back(static_cast<std::uint8_t>(std::stoi(byte.get<std::string>())));
    messages.push_back(std::move(m));
  }
  std::ranges::stable_sort(messages, {}, &Message::time);
  return messages;
}

std::string fault_of(const fs::path& path) {
  std::ifstream file(fs::path(path).replace_extension(".json"));
  const json description = json::parse(file);
  try {
    McapReader reader(path);
    std::vector<Message> found;
    while (const auto m = reader.next())
      found.push_back({m->connection->topic, m->connection->type, kilvo::to_ns(m->time), {m->bytes.begin(), m->bytes.end()}});
    if (reader.damage()) return "damaged at " + std::to_string(reader.damage()->offset) + ": " + reader.damage()->reason;
    const auto expected = expected_messages(description["records"]);
    if (found.size() != expected.size()) return std::to_string(found.size()) + " messages instead of " + std::to_string(expected.size());
    return found == expected ? "" : "other messages than expected";
  } catch (const kilvo::lab::InputError& error) {
    return error.what();
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: mcap_conformance DIR\n";
    return 2;
  }
  int files = 0, wrong = 0;
  for (const auto& entry : fs::recursive_directory_iterator(argv[1])) {
    if (entry.path().extension() != ".mcap") continue;
    ++files;
    const std::string fault = fault_of(entry.path());
    if (fault.empty()) continue;
    ++wrong;
    std::cout << entry.path().string() << ": " << fault << "\n";
  }
  std::cout << files << " files, " << wrong << " not read as their JSON says\n";
  return files > 0 && wrong == 0 ? 0 : 1;
}
