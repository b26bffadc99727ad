// The way of the IMU by the LiDAR's sweeps, smoothed with what the IMU says of the motion between them. H. E. Rauch, F. Tung,
// C. T. Striebel, "Maximum likelihood estimates of linear dynamic systems", 1965.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "lab/doctor/camera_fit.hpp"
#include "lab/doctor/translation_fit.hpp"

namespace kilvo::lab {
namespace {

// What an IMU that walks is off by over a tenth of a second, impacts that alias included (docs/decisions/imu-faults.md).
constexpr double accel_density = 0.013, gyro_density = 4e-4;  // m/s^2 and rad/s per sqrt(Hz)
constexpr double longest_step = 0.35;                         // s between sweeps
constexpr double longest_pause = 0.05, lost_density = 3;      // s between samples of the IMU; m/s^2 per sqrt(Hz) while there are none

// The acceleration at a time between the sample before `it` and `it`.
Eigen::Vector3d accel_at(double t, std::vector<InertialSample>::const_iterator it, const std::vector<InertialSample>& imu) {
  if (it == imu.begin()) return it->accel;
  const auto before = std::prev(it);
  const double share = it->t > before->t ? std::clamp((t - before->t) / (it->t - before->t), 0.0, 1.0) : 1;
  return (1 - share) * before->accel + share * it->accel;
}

// The random walk of a velocity and its place.
Eigen::Matrix2d walk(double density, double dt) {
  Eigen::Matrix2d Q;
  Q << dt * dt / 3, dt / 2, dt / 2, 1;
  return density * density * dt * Q;
}

Eigen::Matrix2d transition(double dt) {
  Eigen::Matrix2d F = Eigen::Matrix2d::Identity();
  F(0, 1) = dt;
  return F;
}

/// From one time to the next: what the IMU says that place and velocity gain, with the variance of an ordinary accelerometer, and with that
/// of one that fails at peaks, which are clipped and alias: by (|a| / 2 g)^6 m/s^2.
struct Step {
  double t = 0, dt = 0;  // s: its end, its length
  SO3 R;                 // from the IMU frame at its end to the world
  Eigen::Vector3d dp = Eigen::Vector3d::Zero(), dv = Eigen::Vector3d::Zero();
  Eigen::Matrix2d ordinary = Eigen::Matrix2d::Zero(), peaks = Eigen::Matrix2d::Zero();
  bool is_station = false;
};

// Two steps as one.
void append(const Step& next, Step& sum) {
  const Eigen::Matrix2d F = transition(next.dt);
  sum.t = next.t;
  sum.R = next.R;
  sum.dp += next.dt * sum.dv + next.dp;
  sum.dv += next.dv;
  sum.ordinary = F * sum.ordinary * F.transpose() + next.ordinary;
  sum.peaks = F * sum.peaks * F.transpose() + next.peaks;
  sum.dt += next.dt;
  sum.is_station = next.is_station;
}

/// What the accelerometer and the sweeps are off by.
struct Noise {
  double ordinary = 1, peaks = 0;  // times those of a step, standard deviation
  double place = 1e-3;             // m, of a sweep
};

/// Kalman filter of a place and its velocity, one axis: `z` are the places of the stations.
struct Filter {
  std::vector<Eigen::Vector2d> x, predicted;
  std::vector<Eigen::Matrix2d> P, before;
  double log_likelihood = 0;

  Filter(const std::vector<Step>& steps, const std::vector<double>& z, const Noise& noise, int axis) {
    const double R = noise.place * noise.place;
    x.emplace_back(z[0], 0);
    P.push_back(Eigen::Vector2d(R, 4).asDiagonal());  // m/s: no robot is faster than twice this
    predicted = x, before = P;
    std::size_t station = 0;
    for (const Step& step : steps) {
      const Eigen::Matrix2d F = transition(step.dt);
      predicted.push_back(F * x.back() + Eigen::Vector2d(step.dp[axis], step.dv[axis]));
      before.push_back(F * P.back() * F.transpose() + noise.ordinary * noise.ordinary * step.ordinary +
                       noise.peaks * noise.peaks * step.peaks);
      x.push_back(predicted.back());
      P.push_back(before.back());
      if (!step.is_station) continue;
      const double S = before.back()(0, 0) + R, innovation = z[++station] - predicted.back()[0];
      const Eigen::Vector2d K = before.back().col(0) / S;
      x.back() += K * innovation;
      P.back() -= (K * before.back().row(0)).eval();
      log_likelihood -= 0.5 * (std::log(S) + innovation * innovation / S);
    }
  }

  /// Places, smoothed, at the beginning and the end of each step.
  std::vector<double> places(const std::vector<Step>& steps) {
    for (std::size_t k = x.size() - 1; k-- > 0;)
      x[k] += P[k] * transition(steps[k].dt).transpose() * before[k + 1].inverse() * (x[k + 1] - predicted[k + 1]);
    std::vector<double> out;
    for (const Eigen::Vector2d& state : x) out.push_back(state[0]);
    return out;
  }
};

// The noise under which these places are the likeliest. All of it at once: one part after the other ends where the sweeps are blamed for
// what the accelerometer has missed.
Noise likeliest(const std::vector<Step>& between, const std::vector<double>& z, int axis) {
  Noise best;
  double most = -INFINITY;
  for (const double place : {5e-4, 1e-3, 2e-3, 5e-3, 1e-2}) {
    for (const double peaks : {0.0, 0.3, 1.0, 3.0}) {
      for (const double ordinary : {1.0, 3.0, 10.0}) {
        const Noise noise{ordinary, peaks, place};
        const double likelihood = Filter(between, z, noise, axis).log_likelihood;
        if (likelihood <= most) continue;
        most = likelihood;
        best = noise;
      }
    }
  }
  return best;
}

// Kalman filter and smoother of a random walk.
std::vector<double> smooth_walk(const std::vector<double>& z, const std::vector<double>& dt, double noise, double density) {
  const std::size_t n = z.size();
  std::vector<double> x(n, z[0]), P(n, noise * noise), before(n, 0);
  for (std::size_t k = 1; k < n; ++k) {
    before[k] = P[k - 1] + density * density * dt[k - 1];
    const double K = before[k] / (before[k] + noise * noise);
    x[k] = x[k - 1] + K * (z[k] - x[k - 1]);
    P[k] = (1 - K) * before[k];
  }
  for (std::size_t k = n - 1; k-- > 0;) x[k] += P[k] / before[k + 1] * (x[k + 1] - x[k]);
  return x;
}

// The sweeps tell rotations to some hundredths of a degree, each for itself; the gyro tells how they differ.
void smooth_rotations(std::vector<LidarWay::Pose>& run, const GyroPath& gyro) {
  const std::size_t n = run.size();
  std::vector<double> dt;
  std::vector<SO3> by_gyro;
  for (std::size_t k = 0; k < n; ++k) {
    by_gyro.push_back(run[0].T_WI.R * SO3::from_quaternion(gyro.between(run[0].t, run[k].t)));
    if (k > 0) dt.push_back(run[k].t - run[k - 1].t);
  }
  std::vector<Eigen::Vector3d> turned(n);
  for (std::size_t k = 0; k < n; ++k) turned[k] = (run[k].T_WI.R * by_gyro[k].inverse()).Log();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> z(n), steps;
    for (std::size_t k = 0; k < n; ++k) z[k] = turned[k][axis];
    for (std::size_t k = 1; k < n; ++k) steps.push_back(std::abs(z[k] - z[k - 1]));
    z = smooth_walk(z, dt, std::max(5e-5, 1.48 * median_of(steps) / std::sqrt(2.0)), gyro_density);
    for (std::size_t k = 0; k < n; ++k) turned[k][axis] = z[k];
  }
  for (std::size_t k = 0; k < n; ++k) run[k].T_WI.R = SO3::Exp(turned[k]) * by_gyro[k];
}

// Sample by sample from the first station to the last.
std::vector<Step> steps_of(const std::vector<LidarWay::Pose>& run, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                           const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba) {
  std::vector<Step> out;
  for (std::size_t k = 1; k < run.size(); ++k) {
    const double a = run[k - 1].t, b = run[k].t;
    auto it = std::ranges::lower_bound(imu, a, {}, &InertialSample::t);
    for (double t = a; t < b;) {
      const double next = it == imu.end() ? b : std::min(it->t, b), dt = next - t, middle = 0.5 * (t + next);
      if (dt > 0) {
        const auto R_at = [&](double at) { return run[k - 1].T_WI.R * SO3::from_quaternion(gyro.between(a, at)); };
        const Eigen::Vector3d force = R_at(middle) * Eigen::Vector3d((it == imu.end() ? imu.back().accel : accel_at(middle, it, imu)) - ba);
        const Eigen::Vector3d accel = force + g_W;
        Step step{next, dt, R_at(next), 0.5 * dt * dt * accel, dt * accel};
        step.ordinary = walk(dt > longest_pause ? lost_density : accel_density, dt);
        step.peaks = walk(std::pow(accel.norm() / (2 * gravity), 6) * std::sqrt(dt), dt);
        out.push_back(step);
      }
      t = next;
      if (it != imu.end() && it->t <= b) ++it;
    }
    out.back().is_station = true;
  }
  return out;
}

std::vector<Step> between_stations(const std::vector<Step>& steps) {
  std::vector<Step> out;
  bool begins = true;
  for (const Step& step : steps) {
    if (begins) {
      out.push_back(step);
    } else {
      append(step, out.back());
    }
    begins = step.is_station;
  }
  return out;
}

}  // namespace

LidarWay::LidarWay(const std::vector<SweepPose>& poses, const SE3& T_IL, double offset, const std::vector<InertialSample>& imu,
                   const GyroPath& gyro, const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba) {
  constexpr double weak = 0.02;  // share of the sweep's information: below it the LiDAR does not know its way
  std::vector<Pose> sweeps;
  for (const SweepPose& p : poses) {
    if (!p.good || p.weakest < weak) continue;
    Pose pose{p.t + offset, p.T_WL * T_IL.inverse()};
    // A sweep gives the mean of the way during it, which is off its middle by a T^2 / 24.
    const double a = p.begin + offset, b = p.end + offset;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    double n = 0;
    for (auto it = std::ranges::lower_bound(imu, a, {}, &InertialSample::t); it != imu.end() && it->t < b; ++it) {
      force += pose.T_WI.R * SO3::from_quaternion(gyro.between(pose.t, it->t)) * Eigen::Vector3d(it->accel - ba);
      n += 1;
    }
    if (n > 0) pose.T_WI.p -= (b - a) * (b - a) / 24 * (force / n + g_W);
    sweeps.push_back(pose);
  }
  for (std::size_t i = 0, j = 0; i < sweeps.size(); i = j) {
    std::vector<Pose> run;
    for (j = i; j < sweeps.size() && (j == i || sweeps[j].t - sweeps[j - 1].t < longest_step); ++j) {
      const double t = sweeps[j].t;
      if (gyro.covers(t, t) && (run.empty() || t > run.back().t)) run.push_back({t, sweeps[j].T_WI});
    }
    add(run, imu, gyro, g_W, ba);
  }
}

// The points of a sweep tell its place to a millimetre, each sweep for itself; the IMU tells to a tenth of that how it moved meanwhile.
void LidarWay::add(std::vector<Pose>& run, const std::vector<InertialSample>& imu, const GyroPath& gyro, const Eigen::Vector3d& g_W,
                   const Eigen::Vector3d& ba) {
  if (run.size() < 2) return;
  smooth_rotations(run, gyro);
  const std::vector<Step> steps = steps_of(run, imu, gyro, g_W, ba), between = between_stations(steps);
  const std::size_t first = poses_.size();
  poses_.push_back({run[0].t, run[0].T_WI});
  for (const Step& step : steps) poses_.push_back({step.t, {step.R, Eigen::Vector3d::Zero()}});
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> z;
    for (const Pose& station : run) z.push_back(station.T_WI.p[axis]);
    const std::vector<double> places = Filter(steps, z, likeliest(between, z, axis), axis).places(steps);
    for (std::size_t k = 0; k < places.size(); ++k) poses_[first + k].T_WI.p[axis] = places[k];
  }
}

std::optional<SE3> LidarWay::at(double t, const GyroPath& gyro) const {
  const auto after = std::ranges::upper_bound(poses_, t, {}, &Pose::t);
  if (after == poses_.begin() || after == poses_.end()) return std::nullopt;
  const Pose &a = *std::prev(after), &b = *after;
  if (b.t - a.t > 0.06) return std::nullopt;
  const double s = (t - a.t) / (b.t - a.t);
  return SE3{a.T_WI.R * SO3::from_quaternion(gyro.between(a.t, t)), (1 - s) * a.T_WI.p + s * b.T_WI.p};
}

}  // namespace kilvo::lab
