// Bytes -> the fields of a message, in either encoding.
#pragma once

#include <string>

#include "lab/messages/decoded.hpp"
#include "lab/messages/wire_fields.hpp"

namespace kilvo::lab {

/// After the first field that the bytes do not hold every field is zero or empty and fault() says where that was.
class WireReader {
 public:
  explicit WireReader(const WireMessage& message);

  template <class... Fields>
  void operator()(Fields&... fields) {
    (read(fields), ...);
  }

  /// Empty when every field was there and nothing is left over. CDR may be padded at its end to a multiple of 8 bytes.
  std::string fault() const;

 private:
  template <class T>
  requires is_number<T>
  void read(T& value) {
    align(sizeof(T));
    value = reader_.read<T>();
  }
  template <class T>
  void read(Ros1Only<T>& field) {
    if (!cdr_) read(field.value);
  }
  template <class T, std::size_t n>
  void read(std::array<T, n>& values) {
    for (T& value : values) read(value);
  }
  template <class T>
  void read(Numbers<T>& numbers) {
    const std::size_t count = read_count();
    if (count > 0) align(sizeof(T));
    numbers.raw = take(count, sizeof(T), sizeof(T));
  }
  template <class T>
  void read(Structs<T>& structs) {
    const std::size_t count = read_count();
    if (count > 0) align(T::wire_alignment);
    structs.stride = Structs<T>::stride_in(cdr_ ? Encoding::cdr : Encoding::ros1);
    structs.raw = take(count, structs.stride, T::wire_bytes);
  }
  template <class T>
  void read(std::vector<T>& elements) {
    const std::size_t count = read_count();
    // Each has at least a byte, so a false count is known before anything is allocated for it.
    if (count > most_elements || count > reader_.remaining()) reader_.fail();
    if (!reader_.ok()) return;
    elements.resize(count);
    for (T& element : elements) read(element);
  }
  template <class T>
  requires requires(T& message, WireReader& reader) { T::fields(message, reader); }
  void read(T& message) { T::fields(message, *this); }
  void read(std::string_view& text);
  void read(Time& time);

  void align(std::size_t size) {
    if (cdr_) reader_.skip((size - reader_.position() % size) % size);
  }
  std::size_t read_count();
  Bytes take(std::size_t count, std::size_t stride, std::size_t last);

  std::size_t size_;  // of the whole message
  std::size_t begin_ = 0;
  bool cdr_;
  std::string refused_;
  ByteReader reader_;
};

/// All of a message, or why not. The views in it are into `message`.
template <class T>
Decoded<T> read_message(const WireMessage& message) {
  WireReader reader(message);
  T fields;
  T::fields(fields, reader);
  std::string fault = reader.fault();
  if (!fault.empty()) return DecodeError{std::string(T::name) + ": " + std::move(fault)};
  return fields;
}

}  // namespace kilvo::lab
