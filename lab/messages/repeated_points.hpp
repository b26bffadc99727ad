// Points that come again: of drivers that publish the last few scans in each message.
#pragma once

#include <cstdint>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo::lab {

class RepeatedPoints {
 public:
  /// Takes out of a scan what the one before held already, by the place and the time of its points: how many. A few points that are alike
  /// by chance, and sweeps that only overlap in time, are left alone.
  std::size_t take_out(LidarScan& scan);

 private:
  struct Seen {
    std::uint64_t place;  // of the bits of x, y, z
    std::int64_t t;       // ns
  };
  std::size_t count_repeated();

  std::vector<Seen> before_, now_;  // a share of the points, chosen by their place
  std::int64_t newest_ = 0;         // ns, of the scan before
};

}  // namespace kilvo::lab
