// The fields of a message -> bytes, in either encoding.
#pragma once

#include "lab/messages/byte_writer.hpp"
#include "lab/messages/wire_fields.hpp"

namespace kilvo::lab {

class WireWriter {
 public:
  explicit WireWriter(Encoding encoding);

  template <class... Fields>
  void operator()(const Fields&... fields) {
    (write(fields), ...);
  }

  void reserve(std::size_t size) { bytes_.reserve(size); }
  std::vector<std::uint8_t> take() { return bytes_.take(); }

 private:
  template <class T>
  requires is_number<T>
  void write(const T& value) {
    align(sizeof(T));
    bytes_.put(value);
  }
  template <class T>
  void write(const Ros1Only<T>& field) {
    if (!cdr_) write(field.value);
  }
  template <class T, std::size_t n>
  void write(const std::array<T, n>& values) {
    for (const T& value : values) write(value);
  }
  template <class T>
  void write(const Numbers<T>& numbers) {
    write(static_cast<std::uint32_t>(numbers.size()));
    if (numbers.size() > 0) align(sizeof(T));
    bytes_.append(numbers.raw.data(), numbers.raw.size());
  }
  template <class T>
  void write(const Structs<T>& structs) {
    write(static_cast<std::uint32_t>(structs.size()));
    for (std::size_t i = 0; i < structs.size(); ++i) {
      align(T::wire_alignment);
      bytes_.append(structs.at(i), T::wire_bytes);
    }
  }
  template <class T>
  void write(const std::vector<T>& elements) {
    write(static_cast<std::uint32_t>(elements.size()));
    for (const T& element : elements) write(element);
  }
  template <class T>
  requires requires(const T& message, WireWriter& writer) { T::fields(message, writer); }
  void write(const T& message) { T::fields(message, *this); }
  void write(const std::string_view& text);
  void write(const std::string& text) { write(std::string_view(text)); }
  void write(const Time& time);

  void align(std::size_t size) {
    if (cdr_) pad((size - (bytes_.size() - begin_) % size) % size);
  }
  void pad(std::size_t count);

  bool cdr_;
  std::size_t begin_ = 0;
  ByteWriter bytes_;
};

template <class T>
std::vector<std::uint8_t> write_message(const T& message, Encoding encoding) {
  WireWriter writer(encoding);
  T::fields(message, writer);
  return writer.take();
}

}  // namespace kilvo::lab
