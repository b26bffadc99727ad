// What the page draws: figures as JSON. The page (lab/report/page/) knows six kinds; see the functions of the same names there.
//   lines  panels over time: {panels: [{label, unit, from_zero, lines: [{name, role, x, y}], bands: [{name, role, x, y}]}]}
//   plane  curves with equal scales: {x_label, y_label, equal, lines}
//   strip  what was on when: {rows: [{label, spans: [[begin, end, class, text]]}]}
//   bars   a histogram: {x_label, log, edges, groups: [{name, role, counts}]}; counts or percents
//   cloud  points to turn: {n, xyz, rgb | intensity, low, high, lines}
//   table  {columns, rows}
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

using Json = nlohmann::ordered_json;

/// Every figure's time axis counts seconds from here.
struct TimeBase {
  Time zero{};
  double seconds(Time t) const { return to_seconds(t - zero); }
};

/// A number with `digits` decimals, so that the page stays small; null when not finite.
Json rounded(double x, int digits);

/// The rows `kept` of a column, rounded.
Json column(const std::vector<double>& values, const std::vector<std::size_t>& kept, int digits);

/// One curve. `role` decides its colour in the page: estimate, truth, x, y, z, left, right, 0, 1, 2, ...
Json line(const std::string& name, const std::string& role, Json x, Json y);

/// A figure without its content. `note` is a sentence below the title.
Json figure(const std::string& kind, const std::string& id, const std::string& section, const std::string& title, const std::string& note);

/// Length in a unit that fits the largest one.
struct LengthUnit {
  const char* name = "m";
  double scale = 1;
  int digits = 4;
};
LengthUnit unit_for(double largest_m);

}  // namespace kilvo::lab
