// One cloud, read as its own point times suggest and in every other way that a topic might have been decided on.
#include "lab/messages/point_cloud2.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  const Bytes message(data, size);
  const auto times = observe_point_cloud2(message);
  if (times) {
    const auto format = detect_point_time({*times, *times}, std::chrono::milliseconds(100));
    if (format) (void)decode_point_cloud2(message, *format);
    if (format) (void)format->text();
  }
  for (const auto reference : {TimeReference::none, TimeReference::scan_start, TimeReference::absolute, TimeReference::other_clock}) {
    (void)decode_point_cloud2(message, {"t", "", TimeUnit::microseconds, reference, true});
  }
  return 0;
}
