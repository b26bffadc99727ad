#include "lab/messages/compressed_image.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const kilvo::lab::Bytes bytes(data, size);
  (void)kilvo::lab::decode_compressed_image(bytes);
  (void)kilvo::lab::decode_jpeg(bytes);
  (void)kilvo::lab::decode_png(bytes);
  return 0;
}
