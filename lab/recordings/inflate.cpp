#include "lab/recordings/inflate.hpp"

#include <algorithm>
#include <bzlib.h>
#include <lz4frame.h>
#include <memory>
#include <zstd.h>

namespace kilvo::lab {
namespace {

// The first guess is a usual ratio; beyond it the output grows as data really come out, so that a false claim costs little.
constexpr std::size_t usual_ratio = 8;

/// Makes room for more output, up to `size` bytes and one more, by which too much is noticed.
void grow(std::vector<std::uint8_t>& bytes, Bytes compressed, std::size_t size) {
  bytes.resize(std::min(size + 1, std::max(usual_ratio * compressed.size(), 2 * bytes.size())));
}

Inflated refused(std::string fault) { return {{}, 0, std::move(fault)}; }

Inflated doubtful(std::vector<std::uint8_t> bytes, std::size_t filled, std::string fault) {
  bytes.resize(filled);
  return {std::move(bytes), 0, std::move(fault)};
}

Inflated finished(std::vector<std::uint8_t> bytes, std::size_t filled, std::size_t size) {
  bytes.resize(filled);
  const bool short_of = filled < size;
  return {std::move(bytes), filled, short_of ? "inflates to " + std::to_string(filled) + " bytes instead of " + std::to_string(size) : ""};
}

constexpr int zstd_window_log = 27;  // 128 MB, what zstd allows unasked
constexpr std::size_t checksum_bytes = 4;
constexpr std::size_t lz4_step = 1 << 16;

/// rosbag's lz4 stream is the LZ4 frame format.
Inflated inflate_lz4(Bytes compressed, std::size_t size) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0) return refused("lz4: no memory");
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw, &LZ4F_freeDecompressionContext);
  std::vector<std::uint8_t> bytes;
  std::size_t in = 0, out = 0;
  while (true) {
    if (out == bytes.size()) grow(bytes, compressed, size);
    // What a failing call had inflated is lost, hence many calls; and the checksum at the end is a call of its own.
    const std::size_t left = compressed.size() - in;
    std::size_t given = bytes.size() - out, taken = left > checksum_bytes ? std::min(left - checksum_bytes, lz4_step) : left;
    const std::size_t hint = LZ4F_decompress(context.get(), bytes.data() + out, &given, compressed.data() + in, &taken, nullptr);
    if (LZ4F_isError(hint) != 0) return doubtful(std::move(bytes), out, std::string("lz4: ") + LZ4F_getErrorName(hint));
    in += taken;
    out += given;
    if (out > size) return doubtful(std::move(bytes), size, "lz4: more data than the chunk claims");
    if (hint == 0 || (taken == 0 && given == 0)) return finished(std::move(bytes), out, size);
  }
}

Inflated inflate_bz2(Bytes compressed, std::size_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return refused("bz2: no memory");
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> owner(&stream, &BZ2_bzDecompressEnd);
  // bzlib is old and takes its input as non-const; it does not write to it.
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(compressed.data()));
  stream.avail_in = static_cast<unsigned>(compressed.size());
  std::vector<std::uint8_t> bytes;
  std::size_t out = 0;
  while (true) {
    if (out == bytes.size()) grow(bytes, compressed, size);
    stream.next_out = reinterpret_cast<char*>(bytes.data() + out);
    stream.avail_out = static_cast<unsigned>(bytes.size() - out);
    const unsigned room = stream.avail_out, input = stream.avail_in;
    const int result = BZ2_bzDecompress(&stream);
    out += room - stream.avail_out;
    if (out > size) return doubtful(std::move(bytes), size, "bz2: more data than the chunk claims");
    if (result != BZ_OK && result != BZ_STREAM_END)
      return doubtful(std::move(bytes), out, "bz2: damaged data (" + std::to_string(result) + ")");
    const bool stuck = stream.avail_out == room && stream.avail_in == input;
    if (result == BZ_STREAM_END || stuck) return finished(std::move(bytes), out, size);
  }
}

/// `exact`: less than `size` is a fault too.
Inflated inflate_frames(Bytes compressed, std::size_t size, bool exact) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return refused("zstd: no memory");
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, zstd_window_log);
  std::vector<std::uint8_t> bytes;
  ZSTD_inBuffer in{compressed.data(), compressed.size(), 0};
  std::size_t out = 0;
  while (true) {
    if (out == bytes.size()) grow(bytes, compressed, size);
    ZSTD_outBuffer to{bytes.data(), bytes.size(), out};
    const std::size_t before = in.pos;
    const std::size_t hint = ZSTD_decompressStream(context.get(), &to, &in);
    if (ZSTD_isError(hint) != 0) return doubtful(std::move(bytes), out, std::string("zstd: ") + ZSTD_getErrorName(hint));
    const bool stuck = to.pos == out && in.pos == before;
    out = to.pos;
    if (out > size) return doubtful(std::move(bytes), size, "zstd: more data than the chunk claims");
    if (hint == 0 && in.pos == in.size) return finished(std::move(bytes), out, exact ? size : out);
    if (!stuck) continue;
    Inflated cut = finished(std::move(bytes), out, out);
    cut.fault = "zstd: ends too early";
    return cut;
  }
}

}  // namespace

bool is_zstd(Bytes bytes) { return bytes.size() >= 4 && bytes[0] == 0x28 && bytes[1] == 0xB5 && bytes[2] == 0x2F && bytes[3] == 0xFD; }

Inflated inflate_zstd(Bytes compressed, std::size_t most) {
  const unsigned long long claimed = ZSTD_getFrameContentSize(compressed.data(), compressed.size());
  const bool known = claimed != ZSTD_CONTENTSIZE_UNKNOWN && claimed != ZSTD_CONTENTSIZE_ERROR;
  if (known && claimed > most) return refused("claims to inflate to " + std::to_string(claimed) + " bytes");
  return inflate_frames(compressed, known ? static_cast<std::size_t>(claimed) : most, known);
}

Inflated inflate_chunk(std::string_view compression, Bytes compressed, std::size_t size) {
  if (size > most_chunk_bytes) return refused("claims to inflate to " + std::to_string(size) + " bytes");
  if (compressed.empty()) return refused("has no data");
  if (compression == "lz4") return inflate_lz4(compressed, size);
  if (compression == "bz2") return inflate_bz2(compressed, size);
  if (compression == "zstd") return inflate_frames(compressed, size, true);
  return refused("unknown compression " + std::string(compression.substr(0, 20)));
}

}  // namespace kilvo::lab
