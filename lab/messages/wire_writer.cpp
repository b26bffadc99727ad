#include "lab/messages/wire_writer.hpp"

namespace kilvo::lab {

WireWriter::WireWriter(Encoding encoding) : cdr_(encoding != Encoding::ros1) {
  if (!cdr_) return;
  constexpr std::array<std::uint8_t, 4> little_endian{0, 1, 0, 0};
  bytes_.append(little_endian.data(), little_endian.size());
  begin_ = bytes_.size();
}

void WireWriter::write(const std::string_view& text) {
  write(static_cast<std::uint32_t>(text.size() + (cdr_ ? 1 : 0)));
  bytes_.append(text.data(), text.size());
  if (cdr_) bytes_.put('\0');
}

void WireWriter::write(const Time& time) {
  constexpr std::int64_t second = 1'000'000'000;
  // Rounded down, so that the nanoseconds are positive before 1970 too.
  const std::int64_t ns = to_ns(time), seconds = ns / second - (ns % second < 0 ? 1 : 0);
  write(static_cast<std::uint32_t>(seconds));
  write(static_cast<std::uint32_t>(ns - seconds * second));
}

void WireWriter::pad(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) bytes_.put(std::uint8_t{0});
}

}  // namespace kilvo::lab
