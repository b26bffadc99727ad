#include "lab/messages/byte_writer.hpp"

namespace kilvo::lab {

ByteWriter& ByteWriter::append(const void* from, std::size_t count) {
  const auto* first = static_cast<const std::uint8_t*>(from);
  bytes_.insert(bytes_.end(), first, first + count);
  return *this;
}

}  // namespace kilvo::lab
