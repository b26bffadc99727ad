#include "lab/messages/wire_reader.hpp"

namespace kilvo::lab {
namespace {

Bytes body_of(const WireMessage& message) {
  if (message.encoding == Encoding::ros1) return message.bytes;
  return message.bytes.size() < encapsulation_bytes ? Bytes{} : message.bytes.subspan(encapsulation_bytes);
}

/// Why the encapsulation header is not one of little-endian XCDR version 1; else empty.
std::string refusal(const WireMessage& message) {
  if (message.encoding == Encoding::ros1) return {};
  if (message.encoding == Encoding::other) return "its encoding is neither ros1 nor cdr";
  if (message.bytes.size() < encapsulation_bytes) return "shorter than the encapsulation header of CDR";
  if (message.bytes[0] == 0 && message.bytes[1] == 0) return "big-endian CDR is not read";
  if (message.bytes[0] != 0 || message.bytes[1] != 1)
    return "CDR representation " + std::to_string(256 * message.bytes[0] + message.bytes[1]) +
           " is not read (1 is: plain CDR, little-endian)";
  return {};
}

}  // namespace

WireReader::WireReader(const WireMessage& message)
    : size_(message.bytes.size()),
      begin_(message.encoding == Encoding::ros1 ? 0 : encapsulation_bytes),
      cdr_(message.encoding != Encoding::ros1),
      refused_(refusal(message)),
      reader_(body_of(message)) {
  if (!refused_.empty()) reader_.fail();
}

std::string WireReader::fault() const {
  if (!refused_.empty()) return refused_;
  if (!reader_.ok()) {
    return "a field at byte " + std::to_string(begin_ + reader_.position()) + " does not fit the message's " + std::to_string(size_) +
           " bytes";
  }
  if (reader_.remaining() > (cdr_ ? most_padding : 0)) return std::to_string(reader_.remaining()) + " bytes left over at the end";
  return {};
}

void WireReader::read(std::string_view& text) {
  const std::size_t count = read_count();
  text = as_text(reader_.take(count));
  // In CDR the length counts a zero behind the text; some writers leave both out of an empty text.
  if (!cdr_ || text.empty()) return;
  if (text.back() != '\0') return reader_.fail();
  text.remove_suffix(1);
}

void WireReader::read(Time& time) {
  constexpr std::int64_t second = 1'000'000'000;
  std::int64_t seconds = 0;
  if (cdr_) {
    std::int32_t signed_seconds = 0;
    read(signed_seconds);
    seconds = signed_seconds;
  } else {
    std::uint32_t unsigned_seconds = 0;
    read(unsigned_seconds);
    seconds = unsigned_seconds;
  }
  std::uint32_t nanoseconds = 0;
  read(nanoseconds);
  time = time_from_ns(seconds * second + nanoseconds);
}

std::size_t WireReader::read_count() {
  std::uint32_t count = 0;
  read(count);
  return count;
}

Bytes WireReader::take(std::size_t count, std::size_t stride, std::size_t last) {
  if (count == 0) return {};
  if (count - 1 > reader_.remaining() / stride) reader_.fail();  // before it is multiplied
  return reader_.take((count - 1) * stride + last);
}

}  // namespace kilvo::lab
