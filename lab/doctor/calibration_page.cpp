#include "lab/doctor/calibration_page.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

namespace kilvo::lab {
namespace {

constexpr double reach = 10;              // standard deviations from the middle of a picture to its edge
constexpr double width = 200, high = 14;  // px, of the picture of a component

const char* const page_head = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>KILVO calibration</title>
<style>
body{font:15px/1.45 system-ui,sans-serif;margin:1.5rem auto;max-width:76rem;padding:0 1rem;color:#1c2126}
div.wide{overflow-x:auto}
table{border-collapse:collapse;white-space:nowrap}
td,th{padding:.2rem .5rem;text-align:left;border-bottom:1px solid #e2e5e8;vertical-align:middle}
.changed{color:#b3261e;font-weight:600}.unknown{color:#77808a}
svg{display:block}
</style></head><body>
)";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

double place(double value, double sigma) {
  const double x = sigma > 0 && std::isfinite(value / sigma) ? std::clamp(value / sigma, -reach, reach) : 0;
  return 0.5 * width * (1 + x / reach);
}

// The band of three standard deviations, and a dot for each component before (hollow) and after.
std::string picture(const Refinement& before, const Refinement* after) {
  const auto n = static_cast<double>(before.change.size());
  std::string out = fmt::format("<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">", width + 10, high * n);
  out +=
      fmt::format("<rect x=\"{}\" width=\"{}\" height=\"{}\" fill=\"#e8f3ea\"/>", place(-3, 1) + 5, place(3, 1) - place(-3, 1), high * n);
  out += fmt::format("<line x1=\"{0}\" x2=\"{0}\" y2=\"{1}\" stroke=\"#9aa1a8\"/>", place(0, 1) + 5, high * n);
  for (std::size_t i = 0; i < before.change.size(); ++i) {
    const double y = high * (static_cast<double>(i) + 0.5);
    out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{}\" r=\"4\" fill=\"none\" stroke=\"#b3261e\"/>",
                       place(before.change[i], before.sigma[i]) + 5, y);
    if (after == nullptr || i >= after->change.size()) continue;
    out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{}\" r=\"3.5\" fill=\"#1f6feb\"/>", place(after->change[i], after->sigma[i]) + 5, y);
  }
  return out + "</svg>";
}

// Millimetres, milliseconds and per cent are easier to read.
std::string readable(const std::vector<double>& x, const std::string& unit) {
  const bool small = unit == "m" || unit == "s";
  const double factor = small ? 1e3 : unit == "-" ? 100 : 1;
  std::string out;
  for (const double v : x) out += fmt::format("{}{:.2f}", out.empty() ? "" : ", ", factor * v);
  return out + (unit == "-" ? " %" : fmt::format(" {}{}", small ? "m" : "", unit));
}

std::string row_of(const Refinement& before, const Refinement* after) {
  const char* const kind = !before.observable ? "unknown" : before.is_taken() && !before.changes.empty() ? "changed" : "kept";
  const std::string decision = !before.observable                             ? "not observable, kept: " + before.advice
                               : before.changes.empty() && before.significant ? "off, and there is no setting for it"
                               : before.changes.empty() || !before.is_taken() ? "kept"
                                                                              : "changed by " + readable(before.taken, before.unit);
  return fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"{}\">{}</td></tr>\n",
                     name_of(before.sensor), escaped(before.what), readable(before.change, before.unit),
                     readable(before.sigma, before.unit), after == nullptr ? "-" : readable(after->change, after->unit),
                     picture(before, after), kind, escaped(decision));
}

}  // namespace

std::string to_html(const Calibration& calibration) {
  std::string out = page_head;
  out += fmt::format("<h1>Calibration</h1>\n<p>{} with {}</p>\n", escaped(calibration.recording), escaped(calibration.config));
  if (!calibration.mended.empty()) {
    out += "<h2>Mended first</h2>\n<ul>\n";
    for (const Finding& f : calibration.mended) {
      out += fmt::format("<li>{}: {}<br>{}<br>", name_of(f.sensor), escaped(f.text), escaped(f.evidence));
      for (const Change& c : f.changes) out += fmt::format("<code>{}: {}</code><br>", escaped(c.key), escaped(c.value));
      out += "</li>\n";
    }
    out += "</ul>\n";
  }
  out +=
      "<h2>Measured less described</h2>\n<p>Hollow red: as described. Blue: measured again with the settings that were written. "
      "The green band is three standard deviations wide on either side. A change is smaller than what was measured by the share that "
      "chance "
      "explains. A picture ends at ten."
      "</p>\n<div class=\"wide\"><table>\n<tr><th>sensor</th><th>value</th><th>before</th><th>standard deviation</th><th>after</th>"
      "<th>in standard deviations</th><th>decision</th></tr>\n";
  for (const Refinement& before : calibration.before) {
    const auto after = std::ranges::find(calibration.after, before.what, &Refinement::what);
    out += row_of(before, after == calibration.after.end() ? nullptr : &*after);
  }
  return out + "</table></div>\n</body></html>\n";
}

}  // namespace kilvo::lab
