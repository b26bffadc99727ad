#include "lab/messages/raw_image.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const kilvo::lab::Bytes bytes(data, size);
  for (const auto encoding : {kilvo::lab::Encoding::ros1, kilvo::lab::Encoding::cdr}) (void)kilvo::lab::decode_image({bytes, encoding});
  return 0;
}
