// Reads and decodes on a thread of its own while the estimator works. What comes out is what the source gives, in its order.
#pragma once

#include <exception>
#include <functional>
#include <thread>
#include <vector>

#include "apps/cli/bounded_queue.hpp"
#include "kilvo/sensors/measurement_source.hpp"

namespace kilvo::cli {

class ReadAhead {
 public:
  /// `progress`: how far the source is, 0 to 1; `arrival`: when what it gave last arrived. Without a thread of its own, `threaded` false,
  /// it just asks the source. The source must not be touched before stop().
  ReadAhead(MeasurementSource& source, std::function<double()> progress, std::function<Time()> arrival, bool threaded);
  ~ReadAhead() { stop(); }
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  std::optional<Measurement> next();
  /// When the measurement that next() gave last arrived.
  Time arrived() const { return arrived_; }
  /// 0 to 1.
  double progress() const { return progress_; }
  /// No more is wanted: from here on the source is the caller's.
  void stop();

 private:
  // Handed over together, so that a thousand small messages do not cost a thousand locks.
  struct Batch {
    std::vector<std::pair<Measurement, Time>> measurements;
    double progress = 0;
  };
  void read_all();

  MeasurementSource& source_;
  std::function<double()> source_progress_;
  std::function<Time()> source_arrival_;
  BoundedQueue<Batch> queue_;
  Batch batch_;
  std::size_t taken_ = 0;  // of batch_
  double progress_ = 0;
  Time arrived_{};
  std::exception_ptr error_;  // of the thread; read after it has closed the queue
  std::thread thread_;
};

}  // namespace kilvo::cli
