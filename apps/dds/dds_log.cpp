#include "apps/dds/dds_log.hpp"

#include <algorithm>
#include <cctype>
#include <dds/dds.h>
#include <fmt/core.h>
#include <utility>

namespace kilvo::dds {
namespace {

constexpr auto quiet = std::chrono::seconds(10);
constexpr std::size_t most_kinds = 100;

void receive(void* log, const dds_log_data_t* data) { static_cast<DdsLog*>(log)->take(std::string(data->message, data->size)); }

}  // namespace

DdsLog::DdsLog(std::function<void(const std::string&)> say) : say_(std::move(say)) { dds_set_log_sink(&receive, this); }
DdsLog::~DdsLog() { dds_set_log_sink(nullptr, nullptr); }

void DdsLog::take(const std::string& line) {
  std::string text = line, kind = line;
  std::erase_if(text, [](char c) { return c == '\n' || c == '\r'; });
  std::erase_if(kind, [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; });
  std::uint64_t left_out = 0;
  {
    const std::lock_guard lock(mutex_);
    if (kinds_.size() >= most_kinds) kinds_.clear();
    const auto now = std::chrono::steady_clock::now();
    Kind& known = kinds_[kind];
    if (known.last != std::chrono::steady_clock::time_point{} && now - known.last < quiet) {
      ++known.left_out;
      return;
    }
    left_out = std::exchange(known.left_out, 0);
    known.last = now;
  }
  say_(left_out == 0 ? "DDS: " + text : fmt::format("DDS: {} (and {} more of this kind)", text, left_out));
}

}  // namespace kilvo::dds
