// The smallest piece of a ROS 1 bag (format 2.0): a record is a header of name=value fields, and data.
#pragma once

#include <optional>
#include <string>

#include "kilvo/sensors/time.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

inline constexpr std::string_view bag_magic = "#ROSBAG V2.0\n";

enum class BagOp : std::uint8_t { message = 2, bag_header = 3, index = 4, chunk = 5, chunk_info = 6, connection = 7 };

/// The fields of any record header; a field that the record does not have stays empty. Views into the bytes that were parsed.
struct BagRecordHeader {
  std::optional<BagOp> op;
  std::optional<std::uint32_t> connection;   // conn
  std::optional<std::uint32_t> size;         // of a chunk when inflated
  std::optional<std::uint32_t> count;        // of index entries
  std::optional<std::uint32_t> chunk_count;  // bag header
  std::optional<std::uint64_t> index_pos;    // bag header
  std::optional<Time> time;
  std::string_view compression, topic, encryptor;
};

/// Nothing unless the bytes are a whole sequence of fields with an op.
std::optional<BagRecordHeader> parse_bag_header(Bytes header);

/// Headers longer than this are taken for damage.
inline constexpr std::size_t most_header_bytes = 1 << 20;
/// Nor is a connection longer than this.
inline constexpr std::size_t most_connection_bytes = 4 << 20;

/// From the header and the data of a connection record.
std::optional<Channel> parse_connection(const BagRecordHeader& header, Bytes data);

}  // namespace kilvo::lab
