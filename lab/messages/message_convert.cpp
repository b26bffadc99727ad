// MessageSchema::convert: the fields of a message, one after the other, out of one encoding into the other.
#include "lab/messages/byte_writer.hpp"
#include "lab/messages/message_schema.hpp"

namespace kilvo::lab {
namespace {

using Kind = SchemaField::Kind;
using Array = SchemaField::Array;

constexpr std::size_t most_growth = 8;  // a message that becomes larger than this many times its size is not one

class Conversion {
 public:
  Conversion(const MessageSchema& schema, const WireMessage& from, Encoding to)
      : types_(schema.types()),
        from_cdr_(from.encoding == Encoding::cdr),
        to_cdr_(to == Encoding::cdr),
        most_(most_growth * from.bytes.size() + 1024),
        reader_(from_cdr_ ? from.bytes.subspan(encapsulation_bytes) : from.bytes) {
    constexpr std::array<std::uint8_t, encapsulation_bytes> little_endian{0, 1, 0, 0};
    if (to_cdr_) writer_.append(little_endian.data(), little_endian.size());
  }

  bool all() {
    fields(0);
    return reader_.ok() && reader_.remaining() <= (from_cdr_ ? most_padding : 0);
  }
  std::size_t position() const { return reader_.position(); }
  std::vector<std::uint8_t> take() { return writer_.take(); }

 private:
  void fields(std::size_t type) {
    // A struct of nothing has a byte in ROS 2, for no language of its makers has empty ones.
    if (types_[type].fields.empty()) {
      if (from_cdr_) reader_.skip(1);
      if (to_cdr_) writer_.put(std::uint8_t{0});
    }
    for (const SchemaField& field : types_[type].fields) take(field);
  }

  void take(const SchemaField& field) {
    std::size_t count = 1;
    if (field.array == Array::fixed) count = field.length;
    if (field.array == Array::dynamic) {
      count = number<std::uint32_t>();
      // Each has at least a byte, or nothing at all.
      if (count > reader_.remaining()) reader_.fail();
    }
    if (field.kind == Kind::number) return raw(field.bytes, count);
    for (std::size_t i = 0; i < count && reader_.ok(); ++i) one(field);
  }

  void one(const SchemaField& field) {
    if (writer_.size() > most_) return reader_.fail();
    switch (field.kind) {
      case Kind::text:
        return text();
      case Kind::time:
        return raw(4, 2);
      case Kind::header:
        if (!from_cdr_) reader_.skip(4);
        if (!to_cdr_) writer_.put(std::uint32_t{0});
        raw(4, 2);
        return text();
      case Kind::type:
        return fields(field.type);
      case Kind::number:
        return;
    }
  }

  void raw(std::size_t bytes, std::size_t count) {
    if (count == 0) return;
    align(bytes);
    if (count > reader_.remaining() / bytes) reader_.fail();
    const Bytes values = reader_.take(bytes * count);
    writer_.append(values.data(), values.size());
  }

  template <class T>
  T number() {
    align(sizeof(T));
    const T value = reader_.read<T>();
    writer_.put(value);
    return value;
  }

  void text() {
    if (from_cdr_) align_reader(4);
    if (to_cdr_) align_writer(4);
    std::string_view value = as_text(reader_.take(reader_.read<std::uint32_t>()));
    if (from_cdr_ && !value.empty()) value.remove_suffix(1);
    writer_.put(static_cast<std::uint32_t>(value.size() + (to_cdr_ ? 1 : 0)));
    writer_.append(value.data(), value.size());
    if (to_cdr_) writer_.put('\0');
  }

  void align(std::size_t bytes) {
    if (from_cdr_) align_reader(bytes);
    if (to_cdr_) align_writer(bytes);
  }
  void align_reader(std::size_t bytes) { reader_.skip((bytes - reader_.position() % bytes) % bytes); }
  void align_writer(std::size_t bytes) {
    while ((writer_.size() - encapsulation_bytes) % bytes != 0) writer_.put(std::uint8_t{0});
  }

  const std::vector<SchemaType>& types_;
  bool from_cdr_, to_cdr_;
  std::size_t most_;
  ByteReader reader_;
  ByteWriter writer_;
};

}  // namespace

Decoded<std::vector<std::uint8_t>> MessageSchema::convert(const WireMessage& from, Encoding to) const {
  const bool cdr = from.encoding == Encoding::cdr;
  if (from.encoding == Encoding::other || to == Encoding::other) return DecodeError{"only ros1 and cdr are converted"};
  if (cdr && (from.bytes.size() < encapsulation_bytes || from.bytes[0] != 0 || from.bytes[1] != 1))
    return DecodeError{types_.front().name + ": not little-endian CDR of version 1"};
  Conversion conversion(*this, from, to);
  if (!conversion.all()) {
    return DecodeError{types_.front().name + ": byte " + std::to_string(conversion.position()) + " of " +
                       std::to_string(from.bytes.size()) + " does not fit the definition"};
  }
  return conversion.take();
}

}  // namespace kilvo::lab
