// Any bytes as an MCAP file: every message in order, and each of them decoded as what its topic says it is.
#include "lab/messages/input_error.hpp"
#include "lab/messages/message_decoder.hpp"
#include "lab/recordings/mcap_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  try {
    McapReader reader(FileBytes(std::vector<std::uint8_t>(data, data + size)));
    const PointTimeFormat time{"timestamp", "float64", TimeUnit::nanoseconds, TimeReference::absolute, true};
    while (const auto message = reader.next()) {
      const auto& type = message->connection->type;
      for (const auto sensor : sensors_of_type(type)) (void)decode_measurement(sensor, type, message->wire(), time);
    }
  } catch (const InputError&) {
    // No MCAP file.
  }
  return 0;
}
