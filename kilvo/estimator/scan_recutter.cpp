#include "kilvo/estimator/scan_recutter.hpp"

#include <algorithm>
#include <utility>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo {

std::vector<LidarScan> ScanRecutter::add(const LidarScan& scan) {
  if (rest_.points.empty()) rest_.t = scan.t;
  const auto shift = static_cast<std::int32_t>((scan.t - rest_.t).count());
  for (LidarPoint p : scan.points) {
    p.offset_ns += shift;
    rest_.points.push_back(p);
  }
  std::vector<LidarScan> out;
  const Time end = end_of(scan);
  for (const Time cut : cuts_) {
    if (cut > end) break;
    if (rest_.points.empty() || cut - begin_of(rest_) < longest_ / 2) continue;  // too little to be a scan: the next cut takes it
    const auto is_before = [&](const LidarPoint& p) { return rest_.t + Duration(p.offset_ns) <= cut; };
    const auto middle = std::stable_partition(rest_.points.begin(), rest_.points.end(), is_before);
    if (middle != rest_.points.begin()) out.push_back({rest_.t, {rest_.points.begin(), middle}});
    rest_.points.erase(rest_.points.begin(), middle);
  }
  std::erase_if(cuts_, [end](Time cut) { return cut <= end; });
  if (!rest_.points.empty() && end - begin_of(rest_) > longest_) out.push_back(std::exchange(rest_, {}));
  return out;
}

}  // namespace kilvo
