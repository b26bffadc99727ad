#include "lab/recordings/file_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include "lab/messages/input_error.hpp"

namespace kilvo::lab {

FileBytes::FileBytes(const std::filesystem::path& path) : name_(path.string()) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw InputError(name_ + ": no such file");
  if (!std::filesystem::is_regular_file(status)) throw InputError(name_ + ": not a file");
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw InputError(name_ + ": cannot be opened for reading");
  size_ = std::filesystem::file_size(path, error);
  if (error) size_ = 0;
}

FileBytes::FileBytes(std::string name, int descriptor) : name_(std::move(name)), descriptor_(descriptor) {
  const off_t size = ::lseek(descriptor, 0, SEEK_END);
  size_ = size < 0 ? 0 : static_cast<std::uint64_t>(size);
}

FileBytes::~FileBytes() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

FileBytes::FileBytes(FileBytes&& other) noexcept
    : name_(std::move(other.name_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      content_(std::move(other.content_)),
      size_(std::exchange(other.size_, 0)) {}

std::size_t FileBytes::read_at(std::uint64_t offset, std::span<std::uint8_t> to) const {
  if (offset >= size_) return 0;
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), size_ - offset));
  if (descriptor_ < 0) {
    std::copy_n(content_.begin() + static_cast<std::ptrdiff_t>(offset), wanted, to.begin());
    return wanted;
  }
  std::size_t done = 0;
  while (done < wanted) {
    const auto got = ::pread(descriptor_, to.data() + done, wanted - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

Bytes FileWindow::view(std::uint64_t offset, std::size_t count) {
  const bool held = offset >= begin_ && offset - begin_ <= held_ && held_ - (offset - begin_) >= count;
  if (!held) {
    // After a jump little is read, for another may follow; while it goes on, more and more.
    const bool goes_on = offset >= begin_ && offset - begin_ <= held_;
    ahead_ = goes_on ? 2 * ahead_ : first_block_bytes;
    if (count > buffer_.size()) buffer_.resize(count);
    ahead_ = std::clamp(ahead_, count, buffer_.size());
    begin_ = offset;
    held_ = file_->read_at(offset, std::span(buffer_).first(ahead_));
  }
  const auto from = static_cast<std::size_t>(offset - begin_);
  return Bytes(buffer_).subspan(from, std::min(count, held_ - from));
}

}  // namespace kilvo::lab
