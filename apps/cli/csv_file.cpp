#include "apps/cli/csv_file.hpp"

#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <system_error>

#include "lab/mapping/output_error.hpp"

namespace kilvo::cli {

namespace fs = std::filesystem;

CsvFile::CsvFile(fs::path path, std::string_view header) : path_(std::move(path)), file_(std::fopen(path_.c_str(), "wb")) {
  if (!file_) fail();
  write(header);
}

void CsvFile::fail() const { throw lab::OutputError(fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(errno))); }

void CsvFile::write(std::string_view line) {
  if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size() || std::fputc('\n', file_.get()) == EOF) fail();
}

void CsvFile::close() {
  if (file_ && std::fclose(file_.release()) != 0) fail();
}

void write_text_file(const fs::path& path, std::string_view text) {
  CsvFile file(path, text);
  file.close();
}

void prepare_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw lab::OutputError(fmt::format("{}: cannot be created: {}", folder.string(), error.message()));
  if (!fs::is_directory(folder, error)) throw lab::OutputError(fmt::format("{}: is not a folder", folder.string()));
  const fs::path probe = folder / ".kilvo_can_write_here";
  write_text_file(probe, "");
  fs::remove(probe, error);
}

}  // namespace kilvo::cli
