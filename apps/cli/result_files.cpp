#include "apps/cli/result_files.hpp"

#include <fmt/format.h>

#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::cli {
namespace {

constexpr const char* state_columns =
    "t,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz,gx,gy,gz,tau,pclx,pcly,pclz,pcrx,pcry,pcrz,spx,spy,spz,srx,sry,srz";
// Where no sweep says when a row is due.
constexpr Duration state_period = std::chrono::milliseconds(20);

void append(std::string& line, const Eigen::Vector3d& v) {
  fmt::format_to(std::back_inserter(line), ",{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
}

}  // namespace

ResultFiles::ResultFiles(const std::filesystem::path& folder, double smooth_time)
    : odometry_(folder / "odometry.tum"),
      smooth_(folder / "odometry_smooth.tum"),
      sweeps_(folder / "sweeps.tum"),
      states_(folder / "states.csv", state_columns),
      modality_(folder / "modality.csv", "t,modality,cause"),
      timing_(folder / "timing.csv", "t,stage,microseconds"),
      events_(folder / "events.csv", "t,sensor,reason,value,text"),
      folder_(folder),
      smoothing_(smooth_time) {}

void ResultFiles::write_state(const Output& output) {
  odometry_.write({output.t, output.x.pose()});
  smooth_.write({output.t, smoothing_.add(output)});
  const bool without_lidar = output.modality == Modality::ki || output.modality == Modality::coast;
  if (without_lidar && !output.is_sweep && (!last_state_ || output.t - *last_state_ >= state_period)) write_full_state(output);
  if (output.modality != last_modality_) write_modality(output);
  if (output.contacts) write_contacts(output);
  run_summary_.add(output);
}

void ResultFiles::write_sweep(const Output& output) {
  if (output.is_sweep) {
    sweeps_.write({output.t, output.x.pose()});
    write_full_state(output);
    run_summary_.count_sweep();
  }
  if (output.is_sweep || output.is_image) write_stages(output);
  write_indicators(output);
  write_events(output.events);
}

void ResultFiles::write_events(const std::vector<Event>& events) {
  for (const Event& e : events) write_event(e.t, e.sensor ? name_of(*e.sensor) : "", name_of(e.reason), e.value, text_of(e));
}

void ResultFiles::write_description(Time t, Sensor sensor, bool spoils, double size, const std::string& text) {
  write_event(t, name_of(sensor), spoils ? "description_wrong" : "description_doubted", size, text);
}

void ResultFiles::write_event(Time t, const std::string& sensor, const std::string& reason, double value, std::string text) {
  std::string line;
  lab::append_seconds(line, t);
  for (std::size_t quote = text.find('"'); quote != std::string::npos; quote = text.find('"', quote + 2)) text.insert(quote, 1, '"');
  events_.write(fmt::format("{},{},{},{:.9g},\"{}\"", line, sensor, reason, value, text));
}

void ResultFiles::write_contacts(const Output& output) {
  if (!contacts_)
    contacts_.emplace(folder_ / "contacts.csv", "t,left,right,clearance_left,clearance_right,d_a,d_fv_left,d_fv_right,p_left,p_right");
  const Contacts& c = *output.contacts;
  line_.clear();
  lab::append_seconds(line_, output.t);
  const std::size_t stamped = line_.size();
  const auto add = [this](double x, int decimals) {
    line_ += ',';
    lab::append_fixed(line_, x, decimals);
  };
  for (const bool on : c.on) line_ += on ? ",1" : ",0";
  for (const double clearance : c.clearance) add(clearance, 5);
  fmt::format_to(std::back_inserter(line_), ",{:.4g},{:.4g},{:.4g}", c.d_a, c.d_fv[0], c.d_fv[1]);
  for (const double p : c.probability) add(p, 3);
  contacts_->write(line_);
  for (const auto& [stage, microseconds] : {std::pair("kinematic", output.kinematic_us), std::pair("contact", output.contact_us)}) {
    line_.resize(stamped);
    (line_ += ',') += stage;
    add(microseconds, 1);
    timing_.write(line_);
    run_summary_.stages.add(stage, microseconds);
  }
}

// Sweeps and images have a row each; what the other says is left empty.
void ResultFiles::write_indicators(const Output& output) {
  if (output.indicators.empty()) return;
  if (!degradation_)
    degradation_.emplace(folder_ / "degradation.csv", "t,lidar_ratio,lidar_weak,visual_points,lidar_degraded,visual_degraded");
  std::string line, ratio, share, points;
  bool lidar = false, visual = false;
  for (const Indicator& i : output.indicators) {
    const std::string_view name = i.name;
    const bool is_lidar = name.starts_with("lidar");
    (is_lidar ? lidar : visual) |= i.degraded;
    (name == "lidar_ratio" ? ratio : is_lidar ? share : points) = fmt::format("{:.6g}", i.value);
  }
  lab::append_seconds(line, output.t);
  const auto flag = [](const std::string& value, bool on) { return value.empty() ? "" : on ? "1" : "0"; };
  degradation_->write(fmt::format("{},{},{},{},{},{}", line, ratio, share, points, flag(share, lidar), flag(points, visual)));
  run_summary_.degraded["lidar"] += lidar ? 1 : 0;
  run_summary_.degraded["visual"] += visual ? 1 : 0;
}

void ResultFiles::write_full_state(const Output& output) {
  if (last_state_ && output.t <= *last_state_) return;
  const State& x = output.x;
  std::string line;
  lab::append_seconds(line, output.t);
  for (const Eigen::Vector3d& v : {x.v, x.bg, x.ba, x.g}) append(line, v);
  fmt::format_to(std::back_inserter(line), ",{:.9g}", x.tau);
  for (const Eigen::Vector3d& v : x.pc) append(line, v);
  const Eigen::Matrix<double, at::size, 1> sigma = output.P.diagonal().cwiseMax(0).cwiseSqrt();
  append(line, sigma.segment<3>(at::p));
  append(line, sigma.segment<3>(at::R));
  states_.write(line);
  last_state_ = output.t;
}

void ResultFiles::write_modality(const Output& output) {
  std::string line;
  lab::append_seconds(line, output.t);
  modality_.write(fmt::format("{},{},{}", line, name_of(output.modality), text_of(output.cause)));
  last_modality_ = output.modality;
}

void ResultFiles::write_stages(const Output& output) {
  const StageTimes& stages = output.stages;
  std::string t;
  lab::append_seconds(t, output.t);
  const auto write = [&](const char* stage, double microseconds) {
    timing_.write(fmt::format("{},{},{:.1f}", t, stage, microseconds));
    run_summary_.stages.add(stage, microseconds);
  };
  if (output.is_image) write("visual", stages.visual_us);
  if (!output.is_sweep) return;
  write("lidar", stages.lidar_us);
  write("map", stages.map_us);
  write("other", stages.other_us);
}

void ResultFiles::close() {
  odometry_.close();
  smooth_.close();
  sweeps_.close();
  states_.close();
  modality_.close();
  timing_.close();
  events_.close();
  if (contacts_) contacts_->close();
  if (degradation_) degradation_->close();
}

}  // namespace kilvo::cli
