// A text file that is written as its lines come.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace kilvo::cli {

class CsvFile {
 public:
  /// Creates or empties the file and writes the line of column names. Throws lab::OutputError, as does everything else here.
  CsvFile(std::filesystem::path path, std::string_view header);

  /// One line without its newline.
  void write(std::string_view line);
  void close();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  [[noreturn]] void fail() const;

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Closer> file_;
};

}  // namespace kilvo::cli
