// Bytes as they came off the wire, and a cursor over them that never reads past their end.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace kilvo::lab {

static_assert(std::endian::native == std::endian::little, "ROS 1 messages are little-endian and are read by plain copies");

using Bytes = std::span<const std::uint8_t>;

inline std::string_view as_text(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

/// Reads fields one after the other. After the first read beyond the end every read gives zeros or nothing and ok() is false, so
/// that a decoder may read a whole message and look once.
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

  /// A number of fixed size.
  template <class T>
  T read() {
    T value{};
    const Bytes from = take(sizeof(T));
    if (ok_) std::memcpy(&value, from.data(), sizeof(T));
    return value;
  }

  /// The next `count` bytes; empty when there are fewer.
  Bytes take(std::size_t count) {
    if (!ok_ || count > remaining()) {
      fail();
      return {};
    }
    const Bytes taken = bytes_.subspan(position_, count);
    position_ += count;
    return taken;
  }

  void skip(std::size_t count) { take(count); }
  void fail() { ok_ = false; }

  /// A uint32 length, and that many elements of `element_size` bytes. The length is checked before anybody allocates for it.
  Bytes array(std::size_t element_size = 1) {
    const std::size_t count = read<std::uint32_t>();
    if (count > remaining() / element_size) {
      fail();
      return {};
    }
    return take(count * element_size);
  }

  std::string_view string() { return as_text(array()); }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace kilvo::lab
