#include "apps/cli/csv_file.hpp"

#include <cerrno>
#include <cstring>
#include <fmt/core.h>

#include "lab/mapping/output_error.hpp"

namespace kilvo::cli {

CsvFile::CsvFile(std::filesystem::path path, std::string_view header) : path_(std::move(path)), file_(std::fopen(path_.c_str(), "wb")) {
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

}  // namespace kilvo::cli
