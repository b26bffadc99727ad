// What is in a recording, and what KILVO would use it for: the content of `kilvo info`.
#pragma once

#include "lab/recordings/recording_source.hpp"

namespace kilvo::lab {

struct TopicDescription {
  std::string topic;
  std::string type;
  Encoding encoding = Encoding::ros1;
  std::uint64_t count = 0;
  Time first{}, last{};          // recorded; both 0 when there are no messages
  double rate = 0;               // Hz over that time; 0 below two messages
  double largest_gap = 0;        // s between two messages of one publisher
  std::vector<Sensor> fits;      // what a topic of this type could be used for
  std::vector<Sensor> used_for;  // what it would be used for with the options given
  std::string detail;            // by the first messages: point times found, joints, image size, or why they cannot be read
};

struct RecordingDescription {
  std::string file;
  std::uint64_t bytes = 0;
  Time begin{}, end{};
  StorageSummary storage;
  std::uint64_t messages = 0;
  std::vector<TopicDescription> topics;  // by name
  std::vector<Damage> damages;
};

/// Needs a few milliseconds for each gigabyte. Of the options only the topics matter. Throws InputError as open_recording() does; a
/// topic that cannot be used is no error.
RecordingDescription describe_recording(const std::vector<std::filesystem::path>& inputs, const RecordingOptions& options = {});
inline RecordingDescription describe_recording(const std::filesystem::path& input, const RecordingOptions& options = {}) {
  return describe_recording(std::vector{input}, options);
}

}  // namespace kilvo::lab
