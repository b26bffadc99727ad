// Bytes of a file at any offset. Nothing is mapped: what is read is what is held in memory.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "lab/messages/bytes.hpp"

namespace kilvo::lab {

inline constexpr std::size_t window_bytes = 1 << 16;  // of a FileWindow that walks through a file
/// Who seeks the next sound place looks at the first so many bytes, for it is often near, then at twice as many, up to the last.
inline constexpr std::size_t first_block_bytes = 4 << 10, most_block_bytes = 1 << 20;

/// A file opened for reading, or bytes in memory that stand for one (tests, fuzzers).
class FileBytes {
 public:
  /// Throws InputError when the file is missing, a directory, or not readable.
  explicit FileBytes(const std::filesystem::path& path);
  /// An open file, which is closed in the end; `name` is what messages call it.
  FileBytes(std::string name, int descriptor);
  explicit FileBytes(std::vector<std::uint8_t> content) : name_("bytes in memory"), content_(std::move(content)), size_(content_.size()) {}
  ~FileBytes();
  FileBytes(FileBytes&& other) noexcept;
  FileBytes& operator=(FileBytes&&) = delete;

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }

  /// Fills `to` from `offset` on; returns how many bytes there were (fewer at the end of the file or after a read error).
  std::size_t read_at(std::uint64_t offset, std::span<std::uint8_t> to) const;

 private:
  std::string name_;
  int descriptor_ = -1;
  std::vector<std::uint8_t> content_;
  std::uint64_t size_ = 0;
};

/// Reads small pieces of a file through one buffer, so that neighbouring pieces cost one system call.
class FileWindow {
 public:
  FileWindow(const FileBytes& file, std::size_t size) : file_(&file), buffer_(size) {}

  /// The bytes [offset, offset + count), fewer at the end of the file. Valid until the next call. The buffer grows to `count`: the
  /// caller has checked it.
  Bytes view(std::uint64_t offset, std::size_t count);

  std::size_t capacity() const { return buffer_.size(); }

 private:
  const FileBytes* file_;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t begin_ = 0;  // of what the buffer holds
  std::size_t held_ = 0;
  std::size_t ahead_ = 0;  // bytes that were read last
};

}  // namespace kilvo::lab
