// Any bytes as what Unitree's robots publish, and as each message in CDR.
#include "lab/messages/message_decoder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  const WireMessage message(Bytes(data, size), Encoding::cdr);
  const PointTimeFormat time{"timestamp", "float64", TimeUnit::nanoseconds, TimeReference::absolute, true};
  for (int i = 0; i < kilvo::sensor_count; ++i) {
    const auto sensor = static_cast<kilvo::Sensor>(i);
    for (const auto type : accepted_types(sensor)) (void)decode_measurement(sensor, type, message, time);
  }
  return 0;
}
