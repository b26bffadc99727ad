// Any bytes as what Unitree's robots publish, and as each message in CDR.
#include "lab/messages/message_decoder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  const WireMessage message(Bytes(data, size), Encoding::cdr);
  const PointTimeFormat time{"timestamp", "float64", TimeUnit::nanoseconds, TimeReference::absolute, true};
  for (const kilvo::Sensor sensor : kilvo::all_sensors) {
    for (const auto type : accepted_types(sensor)) (void)decode_measurement(sensor, type, message, time);
  }
  return 0;
}
