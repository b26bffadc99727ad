#include "lab/report/figure.hpp"

#include <cmath>

namespace kilvo::lab {

Json rounded(double x, int digits) {
  if (!std::isfinite(x)) return nullptr;
  const double scale = std::pow(10.0, digits);
  return std::round(x * scale) / scale + 0.0;  // + 0.0: no -0
}

Json column(const std::vector<double>& values, const std::vector<std::size_t>& kept, int digits) {
  Json out = Json::array();
  for (const std::size_t i : kept) out.push_back(rounded(values[i], digits));
  return out;
}

Json line(const std::string& name, const std::string& role, Json x, Json y) {
  return {{"name", name}, {"role", role}, {"x", std::move(x)}, {"y", std::move(y)}};
}

Json figure(const std::string& kind, const std::string& id, const std::string& section, const std::string& title, const std::string& note) {
  return {{"kind", kind}, {"id", id}, {"section", section}, {"title", title}, {"note", note}};
}

LengthUnit unit_for(double largest_m) {
  if (largest_m < 2) return {"mm", 1e3, 3};
  return {"m", 1, 4};
}

}  // namespace kilvo::lab
