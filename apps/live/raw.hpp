// The last samples of IMU and legs, with which each thread brings a forerunner up to date.
#pragma once

#include <cstddef>
#include <variant>

#include "kilvo/estimator/forerunner.hpp"
#include "kilvo/estimator/recent.hpp"

namespace kilvo::live {

using Raw = std::variant<ImuSample, Feet>;

inline constexpr std::size_t most_raw = 8192;

inline void keep(const Raw& raw, Recent<Raw>& all) {
  if (all.size() >= most_raw) all.pop_front();
  all.push_back(raw);
}

/// What `runner` does not know yet; what no later one will need is forgotten.
inline void catch_up(Forerunner& runner, Recent<Raw>& all) {
  const auto stamp = [](const Raw& raw) { return std::visit([](const auto& s) { return s.t; }, raw); };
  const Time known = runner.known();
  while (!all.empty() && stamp(*all.begin()) < known) all.pop_front();
  for (const Raw& raw : all) std::visit([&runner](const auto& s) { runner.push(s); }, raw);
}

}  // namespace kilvo::live
