// A simulated walk, its sensors failing, and how wrong the estimate becomes: in metres, and in units of what it says of itself.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/failures.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo::test {

/// Measurements that were recorded, with the times of their arrival.
class Recorded final : public MeasurementSource {
 public:
  Recorded(const std::vector<std::pair<Time, Measurement>>& all) : all_(all) {}
  std::optional<Measurement> next() override {
    if (index_ == all_.size()) return std::nullopt;
    return all_[index_++].second;
  }
  Time arrived() const { return all_[index_ - 1].first; }

 private:
  const std::vector<std::pair<Time, Measurement>>& all_;
  std::size_t index_ = 0;
};

struct Moment {
  double s = 0;  // since the beginning of the walk
  double error = 0, sigma = 0, sigmas = 0, tilt_sigmas = 0;
  double accel_bias = 0;  // m/s^2
  double step = 0;        // how far the estimate moved beyond the truth since the moment before, m
  Modality modality{};
  Reason cause = Reason::start;
};

struct Outcome {
  std::vector<Moment> moments;  // of each output
  Statistics statistics;
  std::vector<std::pair<double, Event>> events;  // of all outputs, with the time of the output, s
  bool finite = true, ordered = true;

  double worst(double Moment::*part, double from, double until) const {
    double out = 0;
    for (const Moment& m : moments) {
      if (m.s >= from && m.s < until) out = std::max(out, m.*part);
    }
    return out;
  }
  double rms_error() const {
    double sum = 0;
    for (const Moment& m : moments) sum += m.error * m.error;
    return std::sqrt(sum / static_cast<double>(moments.size()));
  }
  std::vector<std::string> changes() const {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < moments.size(); ++i) {
      if (i == 0 || moments[i].modality != moments[i - 1].modality) out.push_back(name_of(moments[i].modality));
    }
    return out;
  }
  double when_worst(double Moment::*part, double from, double until) const {
    double out = 0, worst = 0;
    for (const Moment& m : moments) {
      if (m.s >= from && m.s < until && m.*part > worst) {
        worst = m.*part;
        out = m.s;
      }
    }
    return out;
  }
  bool has_cause(Reason cause) const {
    return std::ranges::any_of(moments, [&](const Moment& m) { return m.cause == cause; });
  }
  Modality modality_at(double s) const {
    Modality out{};
    for (const Moment& m : moments) {
      if (m.s <= s) out = m.modality;
    }
    return out;
  }
};

/// What else may be different in a run.
struct Changes {
  std::optional<std::array<bool, sensor_count>> used = {};
  std::function<bool(Measurement&, double s)> edit = {};  // `s`: of arrival; false: it does not arrive
  std::function<void(Robot&)> robot = {};
  std::function<double(double s)> where = {};  // the walk was there at the time `s` of the stamps; else at `s`
};

class FailingWalk {
 public:
  FailingWalk(const std::string& name, std::uint64_t seed, double seconds, bool camera = false,
              const std::function<void(lab::SimulatorConfig&)>& edit = {}) {
    lab::SimulatorConfig config = small(seconds);
    config.seed = seed;
    config.lidar.points = 4000;
    config.joints.delivery.rate = 500;
    config.camera.width = 160;
    config.camera.height = 120;
    config.camera.fx = config.camera.fy = 85.3;
    config.camera.cx = 80.3;
    config.camera.cy = 59.5;
    config.use[static_cast<std::size_t>(Sensor::camera)] = camera;
    if (edit) edit(config);
    used_ = config.use;
    simulator_ = std::make_unique<lab::Simulator>(scenario(name), config);
    while (auto m = simulator_->next()) measurements_.emplace_back(simulator_->arrived(), *std::move(m));
    settings_ =
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  }

  const lab::Settings& settings() const { return settings_; }
  const std::array<bool, sensor_count>& used() const { return used_; }
  SE3 truth_at(Time t) const { return simulator_->walk().imu(simulator_->seconds_of(t)); }
  const lab::Walk& truth() const { return simulator_->walk(); }
  double seconds_of(Time t) const { return simulator_->seconds_of(t); }
  Time time(double seconds) const { return simulator_->start() + from_seconds(seconds); }

  /// Every measurement that arrives, in order.
  template <class Take>
  void play(std::vector<lab::Failure> failures, Take&& take) const {
    Recorded recorded(measurements_);
    lab::FailingSource source(recorded, std::move(failures), simulator_->start(), [&recorded] { return recorded.arrived(); });
    while (auto m = source.next()) take(*std::move(m));
  }

  /// The walk, and then the same again: the worst errors in both, each in its own world, m; and when they began, s.
  std::vector<std::pair<double, double>> twice() const {
    Estimator estimator(settings_.robot, settings_.estimator, used_);
    std::vector<std::vector<Output>> epochs;
    const auto take = [&epochs](std::vector<Output> outputs) {
      for (Output& o : outputs) {
        epochs.resize(std::max<std::size_t>(epochs.size(), o.epoch + 1));
        epochs[o.epoch].push_back(std::move(o));
      }
    };
    for (int round = 0; round < 2; ++round) play({}, [&](Measurement m) { take(estimator.push(std::move(m))); });
    take(estimator.finish());
    std::vector<std::pair<double, double>> out;
    for (const auto& outputs : epochs) out.emplace_back(worst_error(outputs), simulator_->seconds_of(outputs.front().t));
    return out;
  }

  /// Of the positions, in the world as it began, m.
  double worst_error(const std::vector<Output>& outputs) const {
    double out = 0;
    std::optional<SE3> T_WR;
    for (const Output& o : outputs) {
      const SE3 truth = simulator_->walk().imu(simulator_->seconds_of(o.t));
      const SE3 T_WI = SE3{o.R_LW.value_or(SO3()).inverse(), Eigen::Vector3d::Zero()} * o.x.pose();
      if (!T_WR) T_WR = T_WI * truth.inverse();
      out = std::max(out, (T_WI.p - (*T_WR * truth).p).norm());
    }
    return out;
  }

  Outcome with(std::vector<lab::Failure> failures, const Changes& changes = {}) const {
    Robot robot = settings_.robot;
    if (changes.robot) changes.robot(robot);
    Estimator estimator(robot, settings_.estimator, changes.used.value_or(used_));
    Outcome out;
    std::optional<SE3> T_WR;
    std::optional<Time> last;
    std::optional<Eigen::Vector3d> off;
    const auto take = [&](const std::vector<Output>& outputs) {
      for (const Output& o : outputs) {
        const double s = simulator_->seconds_of(o.t);
        const SE3 truth = simulator_->walk().imu(changes.where ? changes.where(s) : s);
        if (!T_WR) T_WR = o.x.pose() * truth.inverse();
        out.ordered = out.ordered && (!last || o.t > *last);
        out.finite = out.finite && is_finite({o.t, o.x, o.P});
        last = o.t;
        Moment m = moment_of(o, *T_WR * truth);
        const Eigen::Vector3d now = o.x.p - (*T_WR * truth).p;
        if (off) m.step = (now - *off).norm();
        off = now;
        m.s = s;
        for (const Event& event : o.events) out.events.emplace_back(m.s, event);
        out.moments.push_back(std::move(m));
      }
    };
    play(std::move(failures), [&](Measurement m) {
      if (!changes.edit || changes.edit(m, simulator_->seconds_of(stamp_of(m)))) take(estimator.push(std::move(m)));
    });
    take(estimator.finish());
    out.statistics = estimator.statistics();
    return out;
  }

 private:
  static Moment moment_of(const Output& o, const SE3& truth) {
    Moment m;
    const Eigen::Vector3d e = o.x.p - truth.p;
    m.error = e.norm();
    m.sigma = std::sqrt(std::max(0.0, o.P.diagonal().segment<3>(at::p).maxCoeff()));
    m.sigmas = (e.array().abs() / o.P.diagonal().segment<3>(at::p).array().max(1e-12).sqrt()).maxCoeff();
    const Eigen::Vector3d r = (o.x.R.inverse() * truth.R).Log();
    m.tilt_sigmas = (r.array().abs() / o.P.diagonal().segment<3>(at::R).array().max(1e-12).sqrt()).maxCoeff();
    m.accel_bias = o.x.ba.norm();
    m.modality = o.modality;
    m.cause = o.cause;
    return m;
  }

  std::unique_ptr<lab::Simulator> simulator_;
  std::vector<std::pair<Time, Measurement>> measurements_;
  lab::Settings settings_;
  std::array<bool, sensor_count> used_{};
};

}  // namespace kilvo::test
