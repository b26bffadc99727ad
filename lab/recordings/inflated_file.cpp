#include "lab/recordings/inflated_file.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <unistd.h>
#include <zstd.h>

#include "lab/messages/input_error.hpp"
#include "lab/recordings/inflate.hpp"

namespace kilvo::lab {
namespace {

// Recordings shrink to a tenth at best; what claims to become so much larger is made to fill the disk.
constexpr std::uint64_t most_ratio = 1000, always_allowed = std::uint64_t{1} << 26;

/// Gone as soon as it is closed.
int nameless_file() {
  std::string path = (std::filesystem::temp_directory_path() / "kilvo-inflated-XXXXXX").string();
  const int descriptor = ::mkstemp(path.data());
  if (descriptor >= 0) ::unlink(path.c_str());
  return descriptor;
}

bool write_all(int descriptor, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(descriptor, bytes.data(), bytes.size());
    if (done <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
  return true;
}

}  // namespace

bool is_zstd_file(const FileBytes& file) {
  std::array<std::uint8_t, 4> begin{};
  return file.read_at(0, begin) == begin.size() && is_zstd(begin);
}

InflatedFile inflate_file(const FileBytes& compressed) {
  const int descriptor = nameless_file();
  if (descriptor < 0) throw InputError(compressed.name() + ": no temporary file can be made to inflate it into");
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  std::vector<std::uint8_t> in(ZSTD_DStreamInSize()), out(ZSTD_DStreamOutSize());
  const std::uint64_t most = std::max(always_allowed, most_ratio * compressed.size());
  std::optional<Damage> damage;
  std::uint64_t at = 0, written = 0;
  std::size_t hint = 1;
  while (!damage) {
    const std::size_t got = compressed.read_at(at, in);
    if (got == 0) break;
    ZSTD_inBuffer from{in.data(), got, 0};
    while (from.pos < from.size && !damage) {
      ZSTD_outBuffer to{out.data(), out.size(), 0};
      hint = ZSTD_decompressStream(context.get(), &to, &from);
      if (ZSTD_isError(hint) != 0) damage = Damage{at + from.pos, std::string("zstd: ") + ZSTD_getErrorName(hint)};
      written += to.pos;
      if (written > most) damage = Damage{at + from.pos, "zstd: inflates to more than a thousand times its size"};
      if (!write_all(descriptor, Bytes(out).first(to.pos))) {
        ::close(descriptor);
        throw InputError(compressed.name() + ": no room to inflate it in " + std::filesystem::temp_directory_path().string());
      }
    }
    at += got;
  }
  if (!damage && hint != 0) damage = Damage{compressed.size(), "the compressed file ends too early"};
  return {FileBytes(compressed.name(), descriptor), damage};
}

}  // namespace kilvo::lab
