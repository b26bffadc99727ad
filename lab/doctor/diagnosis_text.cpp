#include "lab/doctor/diagnosis_text.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace kilvo::lab {
namespace {

const char* word(Check::Verdict verdict) {
  constexpr const char* words[] = {"good", "note", "WRONG", "cannot be judged"};
  return words[static_cast<int>(verdict)];
}

}  // namespace

std::string to_text(const Diagnosis& diagnosis) {
  std::string out;
  for (const Finding& f : diagnosis.findings) {
    out += fmt::format("WRONG  {}: {}\n       evidence: {}\n       remedy: {}\n", name_of(f.sensor), f.text, f.evidence, f.remedy);
  }
  for (const Check& c : diagnosis.checks) {
    if (c.verdict != Check::Verdict::wrong) out += fmt::format("{:<6} {}: {}: {}\n", word(c.verdict), name_of(c.sensor), c.what, c.detail);
  }
  const std::size_t n = diagnosis.findings.size();
  if (n > 0) return out + fmt::format("The description is wrong in {} place{}.\n", n, n == 1 ? "" : "s");
  if (diagnosis.unknown()) return out + "Nothing could be judged.\n";
  const bool in_part = std::ranges::any_of(diagnosis.checks, [](const Check& c) { return c.verdict == Check::Verdict::unknown; });
  return out + (in_part ? "What could be judged of the description fits the data.\n" : "The description fits the data.\n");
}

std::string to_json(const Diagnosis& diagnosis) {
  nlohmann::ordered_json out;
  out["verdict"] = !diagnosis.good() ? "wrong" : diagnosis.unknown() ? "unknown" : "good";
  out["findings"] = nlohmann::ordered_json::array();
  for (const Finding& f : diagnosis.findings) {
    nlohmann::ordered_json changes = nlohmann::ordered_json::object();
    for (const Change& c : f.changes) changes[c.key] = c.value;
    out["findings"].push_back({{"sensor", name_of(f.sensor)},
                               {"cause", f.cause},
                               {"text", f.text},
                               {"evidence", f.evidence},
                               {"remedy", f.remedy},
                               {"size", std::isfinite(f.size) ? f.size : 0.0},
                               {"unit", f.unit},
                               {"settings", changes}});
  }
  out["checks"] = nlohmann::ordered_json::array();
  for (const Check& c : diagnosis.checks)
    out["checks"].push_back({{"sensor", name_of(c.sensor)}, {"what", c.what}, {"verdict", word(c.verdict)}, {"detail", c.detail}});
  return out.dump(2) + "\n";
}

}  // namespace kilvo::lab
