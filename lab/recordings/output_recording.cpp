#include "lab/recordings/output_recording.hpp"

#include "lab/recordings/db3_writer.hpp"
#include "lab/recordings/mcap_writer.hpp"
#include "lab/recordings/rosbag1_writer.hpp"
#include "lab/recordings/rosbag2_writer.hpp"

namespace kilvo::lab {
namespace {

using Storage = OutputFormat::Storage;
using Compression = OutputFormat::Compression;

std::unique_ptr<MessageWriter> create_file(const std::filesystem::path& path, const OutputFormat& format) {
  const OutputError wrong(path.string() +
                          ": the format does not know this compression (bag: none, lz4; mcap: none, lz4, zstd; db3: none, message)");
  const Compression c = format.compression;
  switch (format.storage) {
    case Storage::bag:
      if (c != Compression::none && c != Compression::lz4) throw wrong;
      return std::make_unique<Rosbag1Writer>(path,
                                             c == Compression::none ? Rosbag1Writer::Compression::none : Rosbag1Writer::Compression::lz4);
    case Storage::db3:
      if (c != Compression::none && c != Compression::message) throw wrong;
      return std::make_unique<Db3Writer>(path, c == Compression::message);
    case Storage::mcap:
      break;
  }
  if (c == Compression::message) throw wrong;
  const auto packed = c == Compression::none  ? McapWriter::Compression::none
                      : c == Compression::lz4 ? McapWriter::Compression::lz4
                                              : McapWriter::Compression::zstd;
  return std::make_unique<McapWriter>(path, packed, "ros2");
}

}  // namespace

OutputFormat output_format(const std::filesystem::path& path) {
  OutputFormat format;
  const std::string ending = path.extension().string();
  if (ending == ".bag") return format;
  format.storage = ending == ".db3" ? Storage::db3 : Storage::mcap;
  format.folder = ending != ".db3" && ending != ".mcap";
  if (format.storage == Storage::mcap) format.compression = Compression::zstd;
  return format;
}

std::unique_ptr<MessageWriter> create_recording(const std::filesystem::path& path, const OutputFormat& format) {
  if (!format.folder) return create_file(path, format);
  return std::make_unique<Rosbag2Writer>(path, format, [format](const std::filesystem::path& file) { return create_file(file, format); });
}

}  // namespace kilvo::lab
