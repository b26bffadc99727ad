// Times single functions. Every figure is the median of many interleaved repetitions, in microseconds and as a multiple of a 25x25
// inverse timed in the same run, by which a limit of one machine becomes a limit of another.
//   kilvo_bench_micro [--csv FILE] [--benchmark_filter=REGEX] [--benchmark_repetitions=N]
#include <algorithm>
#include <benchmark/benchmark.h>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace {

constexpr std::string_view reference_name = "inverse_25x25";

struct Figure {
  std::int64_t order;  // as registered; repetitions run, and end, in random order
  std::string name;
  double microseconds;
};

class MedianReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.error_occurred) {
        failed_ = true;
        std::cerr << run.benchmark_name() << ": " << run.error_message << "\n";
      }
      if (run.aggregate_name != "median") continue;
      const double per_second = benchmark::GetTimeUnitMultiplier(run.time_unit);
      figures_.push_back({run.family_index, run.run_name.function_name, run.GetAdjustedCPUTime() / per_second * 1e6});
      std::cerr << "." << std::flush;
    }
  }

  void Finalize() override {
    std::cerr << "\n";
    std::sort(figures_.begin(), figures_.end(), [](const Figure& a, const Figure& b) { return a.order < b.order; });
  }

  const std::vector<Figure>& figures() const { return figures_; }
  bool failed() const { return failed_; }
  std::optional<double> reference() const {
    for (const Figure& f : figures_) {
      if (f.name == reference_name) return f.microseconds;
    }
    return std::nullopt;
  }

 private:
  std::vector<Figure> figures_;
  bool failed_ = false;
};

void print(const MedianReporter& report) {
  const auto reference = report.reference();
  std::printf("%-34s %14s %16s\n", "function", "p50 us", "x inverse 25x25");
  for (const Figure& f : report.figures()) {
    std::printf("%-34s %14.3f ", f.name.c_str(), f.microseconds);
    reference ? std::printf("%16.3f\n", f.microseconds / *reference) : std::printf("%16s\n", "-");
  }
}

bool write_csv(const std::string& path, const MedianReporter& report) {
  std::ofstream out(path);
  out << "function,p50_us,multiple_of_inverse\n";
  const auto reference = report.reference();
  for (const Figure& f : report.figures()) {
    out << f.name << ',' << f.microseconds << ',';
    if (reference) out << f.microseconds / *reference;
    out << '\n';
  }
  out.close();
  return !out.fail();
}

}  // namespace

int main(int argc, char** argv) {
  std::string csv;
  // Repetitions in random order: whatever else the machine does falls on all figures alike. What the caller says comes later and wins.
  std::vector<std::string> words{argv[0], "--benchmark_repetitions=15", "--benchmark_min_time=0.02",
                                 "--benchmark_enable_random_interleaving=true"};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--csv" && i + 1 < argc) {
      csv = argv[++i];
    } else {
      words.push_back(word);
    }
  }
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;

  MedianReporter report;
  if (benchmark::RunSpecifiedBenchmarks(&report) == 0) return 2;
  print(report);
  if (!csv.empty() && !write_csv(csv, report)) {
    std::cerr << csv << ": cannot be written\n";
    return 2;
  }
  return report.failed() ? 1 : 0;
}
