// One recording -> another, of any format: messages are re-encoded where the formats differ.
#pragma once

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

struct ConvertOptions {
  std::set<std::string> topics;  // only these, with or without the leading slash; empty: all
  double start = 0;              // s from the beginning of the recording
  double duration = std::numeric_limits<double>::infinity();
  Encoding encoding = Encoding::cdr;  // of what is written
  bool keep_foreign = false;          // what cannot be re-encoded is written as it is, where the format can hold it (MCAP)
};

struct ConvertReport {
  std::uint64_t messages = 0;         // written
  std::vector<std::string> warnings;  // topics left out and why, messages that do not fit their definition
  std::vector<Damage> damages;        // of the input
};

/// `keep_going` is asked after each message with the progress, 0 to 1. Throws OutputError.
ConvertReport convert_recording(
    RecordingReader& from, MessageWriter& to, const ConvertOptions& options,
    const std::function<bool(double)>& keep_going = [](double) { return true; });

}  // namespace kilvo::lab
