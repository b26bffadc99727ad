// Whether the times of the points are those at which they were measured: with the right ones the surroundings are sharpest.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <map>
#include <span>

#include "lab/doctor/examination.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t stretch = 70;  // sweeps
constexpr double clearly = 0.9;      // of the thickness
constexpr std::size_t fewest_blocks = 4;

/// What the points' times may have to be multiplied by, and what follows.
struct Hypothesis {
  double times;
  const char* words;
  std::vector<SweepPose> way = {};
  double turning_error = INFINITY;  // rad/s, robust standard deviation against the gyro
  std::size_t turns = 0;
};

double surer_by(const Hypothesis& a, const Hypothesis& b) {
  return smaller_by(a.turning_error * a.turning_error, b.turning_error * b.turning_error, static_cast<double>(std::min(a.turns, b.turns)));
}

// A way that is lost tells nothing of the times.
void hold_against_gyro(Hypothesis& h, const Deskew& deskew) {
  constexpr double least_explained = 0.8;
  const std::vector<Turn> turns = turns_of(h.way);
  const MountFit fit = fit_mount(turns, *deskew.gyro, deskew.R_IL, deskew.offset);
  if (fit.fit.good && fit.explained > least_explained) h.turning_error = fit.fit.scale;
  h.turns = turns.size();
}

double mean_thickness(std::span<const SweepPose> way) {
  double sum = 0, n = 0;
  for (const SweepPose& p : way) {
    if (!p.good || p.thickness == 0) continue;
    sum += p.thickness;
    n += 1;
  }
  return n > 0 ? sum / n : INFINITY;
}

/// By how many standard deviations the surfaces of one way are thinner than those of the other, by the scatter of blocks of a second.
double thinner_by(const std::vector<SweepPose>& way, const std::vector<SweepPose>& than) {
  std::map<int, std::pair<double, int>> blocks;  // sum and number of logarithms
  for (std::size_t i = 0; i < std::min(way.size(), than.size()); ++i) {
    if (!way[i].good || !than[i].good || !(way[i].thickness > 0) || !(than[i].thickness > 0)) continue;
    auto& [sum, n] = blocks[static_cast<int>(way[i].t / block_seconds)];
    sum += std::log(than[i].thickness / way[i].thickness);
    ++n;
  }
  if (blocks.size() < fewest_blocks) return 0;
  double sum = 0, squares = 0;
  for (const auto& [second, block] : blocks) {
    const double mean = block.first / block.second;
    sum += mean;
    squares += mean * mean;
  }
  const auto n = static_cast<double>(blocks.size());
  const double mean = sum / n, variance = (squares / n - mean * mean) / (n - 1);
  return mean / std::sqrt(std::max(variance, 1e-12));
}

/// The sweeps that turn most.
OdometryRange turning_most(const std::vector<Sweep>& sweeps, const GyroPath& gyro) {
  std::size_t best = 0;
  double most = -1;
  std::vector<double> sums(sweeps.size() + 1, 0);
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    const Sweep& s = sweeps[i];
    sums[i + 1] = sums[i] + (gyro.covers(s.begin, s.end) && s.end > s.begin ? gyro.rate(s.begin, s.end).norm() : 0);
  }
  for (std::size_t i = 0; i + stretch < sums.size(); ++i) {
    if (sums[i + stretch] - sums[i] <= most) continue;
    most = sums[i + stretch] - sums[i];
    best = i;
  }
  return {best, best + stretch};
}

}  // namespace

double Examination::median_duration() const {
  std::vector<double> durations;
  for (const Sweep& s : recorded_.sweeps) durations.push_back(s.duration());
  return median_of(durations);
}

// What the times have to be multiplied by, about the middle of a sweep: 1 unless both surfaces and gyro say for sure that it is another.
double Examination::right_point_times(Deskew deskew) {
  const OdometryRange range = turning_most(recorded_.sweeps, *deskew.gyro);
  const double span = median_duration(), period = recorded_.stamps[index_of(Sensor::lidar)].period;
  // Times of too large a unit. Those of sweeps that overlap span as much, and are right.
  const bool too_long = period > 0 && 0.7 * span > period;
  std::vector<Hypothesis> all{{1, "with the points' times"}, {0, "without"}, {-1, "with reversed ones"}};
  if (too_long) all.push_back({period / span, "with times that span one interval of the sweeps"});
  const auto way = [&](double times) {
    deskew.times = times;
    return scan_odometry(recorded_.sweeps, deskew, range);
  };
  all[1].way = way(0);
  const double rigid = mean_thickness(all[1].way);
  // Times that make surfaces thinner would make them thicker if they were reversed.
  const double with = mean_thickness(std::span(way_).subspan(range.begin, std::min(stretch, way_.size() - range.begin)));
  if (!too_long && with < clearly * rigid) {
    earlier_.point_times_are_good = true;
    check(Sensor::lidar, "point times", Check::Verdict::good,
          fmt::format("surfaces are {:.1f} mm thick with the points' times, {:.1f} mm without", 1e3 * with, 1e3 * rigid));
    return 1;
  }
  std::string surfaces, turning;
  const Hypothesis *given = &all[0], *best = given;
  for (Hypothesis& h : all) {
    if (h.way.empty()) h.way = way(h.times);
    hold_against_gyro(h, deskew);
    if (h.turning_error < best->turning_error) best = &h;
    surfaces += fmt::format("{}{:.1f} mm{} {}", surfaces.empty() ? "" : ", ", 1e3 * mean_thickness(h.way), surfaces.empty() ? " thick" : "",
                            h.words);
    turning += fmt::format("{}{:.1f}", turning.empty() ? "" : ", ", 1e3 * h.turning_error);
  }
  const std::string evidence = fmt::format("surfaces are {}; sweeps turn as the gyro does to {} mrad/s", surfaces, turning);
  // Fewer parameters alone make that a little smaller; where the turning is sure, surfaces that are likely thinner are enough.
  constexpr double half = 0.5, likely = 2;  // of the error; standard deviations
  if (best != given && std::isfinite(given->turning_error) && best->turning_error < half * given->turning_error &&
      surer_by(*best, *given) > sure_among(all.size()) && thinner_by(best->way, given->way) > likely) {
    find_point_times(best->times, deskew, evidence);
    return best->times;
  }
  const bool good = mean_thickness(given->way) <= rigid / clearly;
  earlier_.point_times_are_good = good && best == given;
  point_times_are_undecided_ = !earlier_.point_times_are_good;
  check(Sensor::lidar, "point times", good ? Check::Verdict::good : Check::Verdict::note, evidence);
  return 1;
}

void Examination::find_point_times(double times, const Deskew& deskew, const std::string& evidence) {
  Finding f{Sensor::lidar, {}, {}, evidence, {}, 0, {}, {}, true};
  if (times < 0) {
    f.cause = "point_times_reversed";
    f.text = "the points' times run backwards within a sweep";
    f.remedy = "the driver must publish the time of each point from the beginning of the sweep";
  } else if (times > 0) {
    const double span = median_duration(), period = recorded_.stamps[index_of(Sensor::lidar)].period;
    f.cause = "point_times_unit";
    f.text = fmt::format("the points' times span {:.0f} ms of sweeps that take {:.0f} ms", 1e3 * span, 1e3 * period);
    f.remedy = "the driver must publish the points' times in the unit of their field";
    f.size = span / period;
  } else {
    std::vector<double> after;  // s from the stamp to the middle
    for (const Sweep& s : recorded_.sweeps) after.push_back(0.5 * (s.begin + s.end) - s.t);
    f.cause = "clouds_deskewed";
    f.size = median_of(after) + deskew.offset;
    f.unit = "s";
    f.text =
        "the clouds are motion-compensated already: with the points' times, which they still have, the motion within a sweep is removed "
        "twice";
    f.evidence += fmt::format("; taken as measured at once, {:.0f} ms after their stamps, sweeps turn as the gyro does",
                              std::round(1e3 * f.size) + 0.0);  // no -0
    f.changes = {{"lidar.deskew", "false"}};
    constexpr double negligible = 0.005;  // s, that the estimator finds and corrects by itself
    if (std::abs(f.size) > negligible) f.changes.push_back({"lidar.time_offset", fmt::format("{:.4f}", robot_.lidar.time_offset + f.size)});
    for (const Change& c : f.changes) f.remedy += fmt::format("{}{}: {}", f.remedy.empty() ? "" : " and ", c.key, c.value);
    f.remedy += ", or the driver must publish the points as they were measured";
  }
  find(std::move(f));
}

}  // namespace kilvo::lab
