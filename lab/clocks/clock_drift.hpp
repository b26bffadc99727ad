// By how much a sensor's clock goes faster or slower than the IMU's. Two oscillators differ by 10 to 100 parts in a million, which are 0.2
// s an hour. How long messages take at least on their way stays the same for hours; what changes evenly in it is the clock.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class ClockDrift {
 public:
  /// Of a stretch of some seconds that ends `at`: the least delay from stamp to arrival of the sensor, less that of the IMU, s. In order.
  void add(Time at, double delay);

  /// To be added to the stamps from now on. Nothing is made good of what had been lost before the drift was known, nor taken back.
  Duration correction() const { return from_seconds(correction_); }
  /// Of the sensor's clock against the IMU's: positive, it is fast. 0 while no drift is known.
  double rate() const { return rate_; }

 private:
  struct Block {
    double at, delay;  // s
  };
  void add_block(const Block& block);
  std::optional<double> slope() const;

  std::vector<Block> newest_;  // of the block that is being filled
  std::deque<Block> blocks_;
  Time begin_{}, newest_until_{};
  std::optional<double> known_until_;  // s, from the beginning: the correction is of the drift until then
  double rate_ = 0, correction_ = 0;
};

}  // namespace kilvo::lab
