#include "lab/messages/point_time.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

namespace kilvo::lab {
namespace {

constexpr std::array all_units{TimeUnit::seconds, TimeUnit::milliseconds, TimeUnit::microseconds, TimeUnit::nanoseconds};

const char* name_of_unit(TimeUnit unit) {
  constexpr const char* names[] = {"seconds", "milliseconds", "microseconds", "nanoseconds"};
  return names[static_cast<int>(unit)];
}

const char* name_of_reference(TimeReference reference) {
  constexpr const char* names[] = {"none", "from the scan's start", "before the scan's end", "absolute", "on a clock of its own"};
  return names[static_cast<int>(reference)];
}

double seconds_in(TimeUnit unit) { return static_cast<double>(nanoseconds_in(unit)) * 1e-9; }

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text.empty() ? "none" : text;
}

/// One candidate field over all the clouds that have it.
struct Series {
  std::string field, type;
  std::vector<FieldTimes> times;
  std::vector<double> stamps;  // s, of the same clouds
  double span = 0;             // largest within a cloud, own unit
};

std::vector<Series> collect(const std::vector<CloudTimes>& clouds) {
  std::vector<Series> all;
  for (const auto& cloud : clouds) {
    for (const auto& times : cloud.candidates) {
      auto it = std::ranges::find(all, times.field, &Series::field);
      if (it == all.end()) it = all.insert(all.end(), Series{times.field, times.type, {}, {}, 0});
      it->times.push_back(times);
      it->stamps.push_back(to_seconds(cloud.stamp.time_since_epoch()));
      it->span = std::max(it->span, times.high - times.low);
    }
  }
  return all;
}

/// Seconds between scans.
double period_of(const std::vector<CloudTimes>& clouds, Duration nominal) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < clouds.size(); ++i) {
    const double step = to_seconds(clouds[i].stamp - clouds[i - 1].stamp);
    if (step > 0.005 && step < 2) steps.push_back(step);
  }
  if (steps.empty()) return to_seconds(nominal);
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return steps[steps.size() / 2];
}

/// The unit in which the field is the time of the day or the year that the stamps also count.
std::optional<TimeUnit> absolute_unit(const Series& series, double period) {
  const double reach = to_seconds(farthest_point_time);
  for (const TimeUnit unit : all_units) {
    const double scale = seconds_in(unit);
    bool near = true;
    for (std::size_t i = 0; i < series.times.size(); ++i) near &= std::abs(series.times[i].middle * scale - series.stamps[i]) < reach;
    if (!near) continue;
    // On a clock that has just started, relative times are near the stamp too; but absolute ones advance with it.
    const double advance = scale * (series.times.back().middle - series.times.front().middle);
    const double stamp_advance = series.stamps.back() - series.stamps.front();
    const bool young_clock = series.stamps.front() < 2 * reach;
    const bool advances = stamp_advance > 0 ? advance > 0.5 * stamp_advance : series.times.front().middle * scale > 1.2 * period;
    if (!young_clock || advances) return unit;
  }
  return std::nullopt;
}

struct UnitBySpan {
  TimeUnit unit;
  bool usual;
};

std::optional<UnitBySpan> unit_by_span(double span, double period) {
  for (const TimeUnit unit : all_units) {
    const double scans = span * seconds_in(unit) / period;
    if (scans >= 0.2 && scans <= 1.2) return UnitBySpan{unit, true};
  }
  // A throttled topic or a sensor that is mostly covered: the largest unit that is not too long.
  for (const TimeUnit unit : all_units) {
    const double scans = span * seconds_in(unit) / period;
    if (scans >= 0.01 && scans <= 1.2) return UnitBySpan{unit, false};
  }
  return std::nullopt;
}

TimeReference reference_of(const Series& series, TimeUnit unit) {
  double low = 0, high = 0;
  for (const auto& times : series.times) {
    low = std::min(low, times.low * seconds_in(unit));
    high = std::max(high, times.high * seconds_in(unit));
  }
  const double reach = to_seconds(farthest_point_time);
  if (high > reach || low < -reach) return TimeReference::other_clock;
  return -low > high ? TimeReference::scan_end : TimeReference::scan_start;
}

std::optional<PointTimeFormat> understand(const Series& series, double period) {
  PointTimeFormat format{series.field, series.type, TimeUnit::nanoseconds, TimeReference::absolute, true};
  if (const auto unit = absolute_unit(series, period)) {
    format.unit = *unit;
    return format;
  }
  const auto by_span = unit_by_span(series.span, period);
  if (!by_span) return std::nullopt;
  format.unit = by_span->unit;
  format.usual_span = by_span->usual;
  format.reference = reference_of(series, format.unit);
  return format;
}

std::string fields_of(const std::vector<CloudTimes>& clouds) { return clouds.empty() ? "none" : join(clouds.front().fields); }

DecodeError not_understood(const Series& series, double period) {
  char numbers[120];
  std::snprintf(numbers, sizeof numbers, "%g within a cloud, scans every %.3g s", series.span, period);
  return {"the point times in field " + series.field + " (" + series.type + ") fit no unit: they span " + numbers};
}

}  // namespace

std::string PointTimeFormat::text() const {
  if (reference == TimeReference::none) return "none: every point is taken at the cloud's stamp";
  std::string words = field + " (" + type + "): " + name_of_unit(unit) + ", " + name_of_reference(reference);
  if (!usual_span) words += " (the scan covers less than 0.2 of its period: unit uncertain)";
  return words;
}

Decoded<PointTimeFormat> detect_point_time(const std::vector<CloudTimes>& clouds, Duration nominal_period) {
  const auto all = collect(clouds);
  if (all.empty()) return DecodeError{"the clouds have no point times (fields: " + fields_of(clouds) + ")"};
  const double period = period_of(clouds, nominal_period);
  const Series* varying = nullptr;
  for (const auto& series : all) {
    if (!(series.span > 0)) continue;
    if (auto format = understand(series, period)) return *std::move(format);
    if (varying == nullptr) varying = &series;
  }
  if (varying != nullptr) return not_understood(*varying, period);
  return DecodeError{"the point times are all equal (field " + all.front().field + "; fields: " + fields_of(clouds) + ")"};
}

}  // namespace kilvo::lab
