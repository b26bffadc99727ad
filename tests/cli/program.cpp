#include "tests/cli/program.hpp"

#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

namespace kilvo::stories {
namespace {

namespace fs = std::filesystem;

fs::path new_file() {
  std::string name = (fs::temp_directory_path() / "kilvo_story_XXXXXX").string();
  const int file = mkstemp(name.data());
  if (file < 0) throw std::runtime_error("no temporary file");
  ::close(file);
  return name;
}

void redirect(int stream, const fs::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_TRUNC);
  ::dup2(file, stream);
  ::close(file);
}

}  // namespace

Started::Started(const std::vector<std::string>& words, const fs::path& program) : out_(new_file()), err_(new_file()) {
  std::vector<std::string> copy{program.string()};
  copy.insert(copy.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  arguments.reserve(copy.size() + 1);
  for (std::string& word : copy) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    redirect(STDOUT_FILENO, out_);
    redirect(STDERR_FILENO, err_);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
}

void Started::send(int signal) const { ::kill(pid_, signal); }

Finished Started::wait() {
  int status = 0;
  ::waitpid(pid_, &status, 0);
  Finished done{WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), read_text(out_), read_text(err_)};
  fs::remove(out_);
  fs::remove(err_);
  return done;
}

Finished run_program(const fs::path& program, const std::vector<std::string>& words) { return Started(words, program).wait(); }

Finished kilvo(const std::vector<std::string>& words) { return run_program(KILVO_PROGRAM, words); }

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "kilvo_stories_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

void wait_for_content(const fs::path& path) {
  constexpr useconds_t pause_us = 10000;
  for (int i = 0; i < 1000; ++i) {
    std::error_code error;
    if (fs::file_size(path, error) > 0 && !error) return;
    ::usleep(pause_us);
  }
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_text(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

}  // namespace kilvo::stories
