// The last samples of IMU and legs, with which each thread brings a live propagator up to date.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <variant>

#include "kilvo/estimator/live_propagator.hpp"
#include "kilvo/estimator/recent.hpp"

namespace kilvo::live {

class RawSamples {
 public:
  /// In the order of their arrival.
  void keep(const ImuSample& s) {
    // The time went back: what was before is of another epoch.
    if (newest_imu_ && *newest_imu_ - s.t > longest_step) all_.clear();
    newest_imu_ = s.t;
    add(s);
  }
  void keep(const Feet& s) {
    // The most of lately: it is smallest just before an IMU sample.
    const Duration lag = newest_imu_ ? *newest_imu_ - s.t : Duration(0);
    lag_ -= lag_ / 4096;
    if (lag < longest_lag) lag_ = std::max(lag_, lag);
    add(s);
  }

  /// What `runner` does not know yet; what no later one will need is forgotten.
  void catch_up(LivePropagator& runner) {
    const auto stamp = [](const Raw& raw) { return std::visit([](const auto& s) { return s.t; }, raw); };
    const Time known = runner.known();
    while (!all_.empty() && stamp(*all_.begin()) < known) all_.pop_front();
    runner.expect_legs_after(lag_);
    for (const Raw& raw : all_) std::visit([&runner](const auto& s) { runner.push(s); }, raw);
  }

 private:
  using Raw = std::variant<ImuSample, Feet>;
  static constexpr std::size_t most = 8192;
  static constexpr Duration longest_step = std::chrono::seconds(2);
  static constexpr Duration longest_lag = std::chrono::milliseconds(250);  // more is a wrong stamp, or of no use at all
  void add(const Raw& raw) {
    if (all_.size() >= most) all_.pop_front();
    all_.push_back(raw);
  }

  Recent<Raw> all_;
  std::optional<Time> newest_imu_;
  Duration lag_{};  // by which the leg samples' stamps trail the IMU's as they arrive
};

}  // namespace kilvo::live
