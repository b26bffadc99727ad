// Fields one after the other, as ROS 1 has them on the wire.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class ByteWriter {
 public:
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  std::vector<std::uint8_t> take() { return std::exchange(bytes_, {}); }
  std::size_t size() const { return bytes_.size(); }
  void reserve(std::size_t size) { bytes_.reserve(size); }

  template <class T>
  ByteWriter& put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    return append(&value, sizeof value);
  }

  /// A uint32 length and the characters.
  ByteWriter& put_string(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    return append(text.data(), text.size());
  }

  /// uint32 seconds, uint32 nanoseconds.
  ByteWriter& put_time(Time t) {
    constexpr std::int64_t second = 1'000'000'000;
    put(static_cast<std::uint32_t>(to_ns(t) / second));
    return put(static_cast<std::uint32_t>(to_ns(t) % second));
  }

  ByteWriter& append(const void* from, std::size_t count);

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace kilvo::lab
