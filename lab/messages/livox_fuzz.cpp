#include "lab/messages/livox.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  const Bytes message(data, size);
  const auto times = observe_livox(message);
  const auto format = times ? detect_livox_point_time({*times}) : Decoded<PointTimeFormat>(DecodeError{});
  (void)decode_livox(message, format ? *format : PointTimeFormat{});
  return 0;
}
