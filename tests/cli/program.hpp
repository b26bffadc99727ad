// Starts the `kilvo` program as a user would.
#pragma once

#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

namespace kilvo::stories {

struct Finished {
  int code = -1;  // exit code; minus the signal that ended it
  std::string out, err;
};

/// Runs `program` with these words and waits.
Finished run_program(const std::filesystem::path& program, const std::vector<std::string>& words);

/// The program under test.
Finished kilvo(const std::vector<std::string>& words);

/// A running program.
class Started {
 public:
  explicit Started(const std::vector<std::string>& words, const std::filesystem::path& program = KILVO_PROGRAM);
  void send(int signal) const;
  Finished wait();

 private:
  pid_t pid_;
  std::filesystem::path out_, err_;
};

/// A folder that is gone when the test is over.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Waits, at most ten seconds, until there is something in the file.
void wait_for_content(const std::filesystem::path& path);

std::string read_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace kilvo::stories
