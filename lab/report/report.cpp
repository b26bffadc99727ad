#include "lab/report/report.hpp"

#include "lab/report/figures.hpp"
#include "lab/report/page.hpp"

namespace kilvo::lab {
namespace {

/// Calls f() and puts the name of the file in front of what it has to say.
template <class F>
auto about(const std::filesystem::path& path, F&& f) {
  try {
    return f();
  } catch (const EvaluationError& e) {
    throw EvaluationError(path.string() + ": " + e.what());
  }
}

std::vector<ContactSample> samples_of(const std::vector<ContactRow>& rows) {
  std::vector<ContactSample> samples;
  samples.reserve(rows.size());
  for (const ContactRow& row : rows) samples.push_back(row.sample);
  return samples;
}

TimeBase time_base(const RunFiles& run) {
  if (!run.odometry.empty()) return {run.odometry.front().t};
  if (!run.states.empty()) return {run.states.front().t};
  return {};
}

/// JSON that may stand in an HTML script element: there is no way out of it without '<'.
std::string in_html(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

/// The recording's name without folders and ending; the folder's where that is not known.
std::string title_of(const RunFiles& run) {
  if (!run.summary.contains("input") || !run.summary["input"].is_string()) return run.name;
  std::filesystem::path input = run.summary["input"].get<std::string>();
  if (!input.has_filename()) input = input.parent_path();
  return input.has_stem() ? input.stem().string() : run.name;
}

Json warnings_of(const Json& summary) {
  Json out = Json::array();
  if (summary.contains("failure") && summary["failure"].is_string()) out.push_back(summary["failure"].get<std::string>());
  if (summary.contains("warnings") && summary["warnings"].is_array())
    for (const auto& warning : summary["warnings"]) out.push_back(warning.is_string() ? warning.get<std::string>() : warning.dump());
  return out;
}

/// Why the run must not be trusted; empty: nothing is known against it.
Json reasons_for_distrust(const RunFiles& run, const Way& way) {
  Json out = Json::array();
  const auto is_true = [&](const char* key) { return run.summary.contains(key) && run.summary[key] == true; };
  if (run.summary.contains("failure") && run.summary["failure"].is_string()) out.push_back(run.summary["failure"].get<std::string>());
  if (is_true("diverged")) out.push_back("the estimate diverged");
  if (way.evaluation && judge_divergence(*way.evaluation).diverged)
    out.push_back("the error against the truth is larger than a drift could be");
  if (run.summary.contains("recovery") && run.summary["recovery"].is_object() && run.summary["recovery"].value("maps_begun_anew", 0) > 0)
    out.push_back("the map was restarted: poses before and after are in different frames");
  return out;
}

}  // namespace

Report make_report(const ReportOptions& options) {
  const RunFiles run = read_run_files(options.folder);
  const TimeBase time = time_base(run);
  std::vector<StampedPose> truth;
  if (options.truth) truth = read_tum(*options.truth);
  const Way way = options.truth ? about(*options.truth, [&] { return way_of(run, truth); }) : way_of(run);
  std::vector<ContactSample> true_contacts;
  std::optional<ContactEvaluation> contacts;
  if (options.true_contacts) {
    true_contacts = read_contacts(*options.true_contacts);
    if (!run.contacts.empty())
      contacts = about(*options.true_contacts, [&] { return evaluate_contacts(samples_of(run.contacts), true_contacts); });
  }

  Json page;
  page["name"] = title_of(run);
  page["folder"] = run.name;
  page["version"] = run.summary.contains("version") && run.summary["version"].is_string() ? run.summary["version"].get<std::string>() : "";
  page["input"] = run.summary.contains("input") && run.summary["input"].is_string() ? run.summary["input"].get<std::string>() : "";
  page["headlines"] = headlines(run, way, contacts);
  page["distrust"] = reasons_for_distrust(run, way);
  page["warnings"] = warnings_of(run.summary);
  page["missing"] = run.missing;
  page["has_truth"] = options.truth.has_value();
  page["of_sweeps"] = way.of_sweeps;
  page["figures"] = Json::array();
  for (Figures& group : std::vector<Figures>{map_figures(time, run, way), path_figures(time, way), error_figures(time, way, run.states),
                                             state_figures(time, run.states, truth, way),
                                             contact_figures(time, run.contacts, true_contacts, contacts), modality_figures(time, run),
                                             rate_figures(time, run), stage_figures(time, run.timing), summary_figures(run.summary)}) {
    for (Json& one : group) page["figures"].push_back(std::move(one));
  }

  const std::string_view frame = report_page();
  const std::size_t place = frame.find(report_data_marker);
  std::string html(frame.substr(0, place));
  html += in_html(page);
  html += frame.substr(place + report_data_marker.size());
  return {html, run.missing};
}

}  // namespace kilvo::lab
