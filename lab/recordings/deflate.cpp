#include "lab/recordings/deflate.hpp"

#include <lz4frame.h>
#include <string>
#include <zstd.h>

#include "lab/recordings/message_writer.hpp"

namespace kilvo::lab {

std::vector<std::uint8_t> deflate_lz4(Bytes bytes) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  preferences.frameInfo.blockSizeID = LZ4F_max1MB;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  std::vector<std::uint8_t> frame(LZ4F_compressFrameBound(bytes.size(), &preferences));
  const std::size_t size = LZ4F_compressFrame(frame.data(), frame.size(), bytes.data(), bytes.size(), &preferences);
  if (LZ4F_isError(size) != 0) throw OutputError(std::string("lz4: ") + LZ4F_getErrorName(size));
  frame.resize(size);
  return frame;
}

std::vector<std::uint8_t> deflate_zstd(Bytes bytes) {
  std::vector<std::uint8_t> frame(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(size) != 0) throw OutputError(std::string("zstd: ") + ZSTD_getErrorName(size));
  frame.resize(size);
  return frame;
}

}  // namespace kilvo::lab
