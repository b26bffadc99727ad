#include "lab/messages/raw_image.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)kilvo::lab::decode_image({data, size});
  return 0;
}
