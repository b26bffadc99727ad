#include "apps/cli/read_ahead.hpp"

namespace kilvo::cli {
namespace {

// About half a second of data in all: enough to even out chunks that take long to inflate, a few megabytes of scans.
constexpr std::size_t most_batches = 6;
constexpr std::size_t most_in_batch = 256;

bool is_large(const Measurement& m) { return std::holds_alternative<LidarScan>(m) || std::holds_alternative<CameraImage>(m); }

}  // namespace

ReadAhead::ReadAhead(MeasurementSource& source, std::function<double()> progress, std::function<Time()> arrival, bool threaded)
    : source_(source), source_progress_(std::move(progress)), source_arrival_(std::move(arrival)), queue_(most_batches) {
  if (threaded) thread_ = std::thread([this] { read_all(); });
}

void ReadAhead::read_all() {
  try {
    bool wanted = true;
    while (wanted) {
      Batch batch;
      bool full = false;
      while (!full) {
        auto measurement = source_.next();
        if (!measurement) break;
        full = is_large(*measurement) || batch.measurements.size() + 1 >= most_in_batch;
        batch.measurements.emplace_back(*std::move(measurement), source_arrival_());
      }
      batch.progress = source_progress_();
      if (batch.measurements.empty()) break;
      wanted = queue_.push(std::move(batch));
    }
  } catch (...) {
    error_ = std::current_exception();
  }
  queue_.close();
}

std::optional<Measurement> ReadAhead::next() {
  if (!thread_.joinable()) {
    auto measurement = source_.next();
    progress_ = source_progress_();
    arrived_ = source_arrival_();
    return measurement;
  }
  if (taken_ == batch_.measurements.size()) {
    auto batch = queue_.pop();
    if (!batch) {
      if (error_) std::rethrow_exception(error_);
      return std::nullopt;
    }
    batch_ = *std::move(batch);
    progress_ = batch_.progress;
    taken_ = 0;
  }
  auto& [measurement, arrived] = batch_.measurements[taken_++];
  arrived_ = arrived;
  return std::move(measurement);
}

void ReadAhead::stop() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

}  // namespace kilvo::cli
