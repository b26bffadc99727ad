// What the fields of a message may be. A message type lists its fields once, in a static function `fields(message, visit)`; WireReader and
// WireWriter walk that list in either encoding.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// A field that ROS 2 has left out of a type (the sequence number of a header).
template <class T>
struct Ros1Only {
  T value{};
};

/// An array of any length of numbers, which stay where they are: a view into the message.
template <class T>
struct Numbers {
  static_assert(std::is_arithmetic_v<T>);
  Bytes raw;

  std::size_t size() const { return raw.size() / sizeof(T); }
  std::vector<T> values() const {
    std::vector<T> out(size());
    if (!raw.empty()) std::memcpy(out.data(), raw.data(), raw.size());
    return out;
  }
  static Numbers of(const std::vector<T>& values) {
    return {Bytes(reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(T))};
  }
};

/// An array of any length of structs that hold numbers only, the first with the largest alignment: a view into the message.
template <class T>
struct Structs {
  Bytes raw;               // the last one ends with its last field
  std::size_t stride = 1;  // bytes from one to the next

  std::size_t size() const { return raw.empty() ? 0 : (raw.size() - T::wire_bytes) / stride + 1; }
  const std::uint8_t* at(std::size_t i) const { return raw.data() + i * stride; }

  /// In CDR the next struct begins where its first number is aligned.
  static constexpr std::size_t stride_in(Encoding encoding) {
    return encoding == Encoding::ros1 ? T::wire_bytes : (T::wire_bytes + T::wire_alignment - 1) / T::wire_alignment * T::wire_alignment;
  }
};

/// Longer arrays of structs and strings than this are refused: an array of empty names must not cost many times its size.
inline constexpr std::size_t most_elements = 10'000;

template <class T>
inline constexpr bool is_number = std::is_arithmetic_v<T>;

}  // namespace kilvo::lab
