#include <algorithm>
#include <cmath>

#include "lab/report/figures.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t most_frames = 1500;

/// The last of rows in the order of time that is not after t; end() when there is none.
template <class Rows, class TimeOf>
auto last_by(const Rows& rows, Time t, TimeOf time_of) {
  auto after = std::upper_bound(rows.begin(), rows.end(), t, [&](Time a, const auto& row) { return a < time_of(row); });
  return after == rows.begin() ? rows.end() : std::prev(after);
}

void append(Json& out, const SE3& T_WI, const std::vector<Eigen::Vector3d>& leg) {
  for (const Eigen::Vector3d& p_I : leg) {
    const Eigen::Vector3d p_W = T_WI * p_I;
    for (const double x : p_W) out.push_back(std::lround(100 * x));
  }
}

}  // namespace

Json playback_of(const TimeBase& time, const RunFiles& run) {
  if (run.skeleton.empty() || run.odometry.empty()) return nullptr;
  Json t = Json::array(), p = Json::array(), on = Json::array();
  const std::size_t step = run.skeleton.size() / most_frames + 1;
  for (std::size_t i = 0; i < run.skeleton.size(); i += step) {
    const SkeletonRow& row = run.skeleton[i];
    const auto pose = last_by(run.odometry, row.t, [](const StampedPose& one) { return one.t; });
    if (pose == run.odometry.end() || row.legs[0].empty() || row.legs[0].size() != row.legs[1].size()) continue;
    Json points = Json::array();
    append(points, pose->T, row.legs[0]);
    append(points, pose->T, row.legs[1]);
    const auto contact = last_by(run.contacts, row.t, [](const ContactRow& one) { return one.sample.t; });
    int bits = 0;
    if (contact != run.contacts.end()) bits = (contact->sample.down[0] ? 1 : 0) + (contact->sample.down[1] ? 2 : 0);
    t.push_back(std::round(1e3 * time.seconds(row.t)) / 1e3);
    p.push_back(std::move(points));
    on.push_back(bits);
  }
  if (t.empty()) return nullptr;
  return {{"t", t}, {"joints", run.skeleton.front().legs[0].size()}, {"p", p}, {"on", on}};
}

}  // namespace kilvo::lab
