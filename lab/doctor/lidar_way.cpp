// The way of the IMU by the LiDAR's sweeps, smoothed with what the IMU says of the motion between them. H. E. Rauch, F. Tung,
// C. T. Striebel, "Maximum likelihood estimates of linear dynamic systems", 1965.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "lab/doctor/camera_fit.hpp"

namespace kilvo::lab {
namespace {

// What an IMU that walks is off by over a tenth of a second, impacts that alias included (docs/decisions/imu-faults.md).
constexpr double accel_density = 0.013, gyro_density = 4e-4;  // m/s^2 and rad/s per sqrt(Hz)
constexpr double most_noise = 0.01;    // m, of a sweep's place: more is the accelerometer's, which tells nothing then
constexpr double longest_step = 0.35;  // s between sweeps

// The acceleration at a time between the sample before `it` and `it`.
Eigen::Vector3d accel_at(double t, std::vector<InertialSample>::const_iterator it, const std::vector<InertialSample>& imu) {
  if (it == imu.begin()) return it->accel;
  const auto before = std::prev(it);
  const double share = it->t > before->t ? std::clamp((t - before->t) / (it->t - before->t), 0.0, 1.0) : 1;
  return (1 - share) * before->accel + share * it->accel;
}

/// Double integration from `a` to `b`, s, of a body that is at rest in `from` at the beginning; `step(t, place, velocity)` after each
/// sample.
template <class Step>
void integrate(double a, double b, const SE3& from, const std::vector<InertialSample>& imu, const GyroPath& gyro,
               const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba, Step&& step) {
  Eigen::Vector3d p = from.p, v = Eigen::Vector3d::Zero();
  auto it = std::ranges::lower_bound(imu, a, {}, &InertialSample::t);
  for (double t = a; t < b && it != imu.end(); ++it) {
    const double next = std::min(it->t, b), dt = next - t;
    if (!(dt > 0)) continue;
    const SO3 R = from.R * SO3::from_quaternion(gyro.between(a, 0.5 * (t + next)));
    const Eigen::Vector3d force = R * Eigen::Vector3d(accel_at(0.5 * (t + next), it, imu) - ba) + g_W;
    p = p + dt * v + 0.5 * dt * dt * force;
    v += dt * force;
    step(next, p, v);
    t = next;
  }
}

/// What the IMU says of the motion from one sweep to the next: place and velocity gained by a body that was at rest.
struct Increment {
  Eigen::Vector3d dp = Eigen::Vector3d::Zero(), dv = Eigen::Vector3d::Zero();
};

Increment increment(double a, double b, const SO3& R_a, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                    const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba) {
  Increment out;
  integrate(a, b, SE3{R_a, Eigen::Vector3d::Zero()}, imu, gyro, g_W, ba, [&](double, const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
    out = {p, v};
  });
  return out;
}

double median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

// Kalman filter and Rauch-Tung-Striebel smoother of a place and its velocity, one axis; with `density` of the velocity's random walk.
std::vector<double> smooth(const std::vector<double>& z, const std::vector<double>& dt, const std::vector<double>& dp,
                           const std::vector<double>& dv, double noise, double density) {
  using Vector = Eigen::Vector2d;
  using Matrix = Eigen::Matrix2d;
  const std::size_t n = z.size();
  std::vector<Vector> x(n), predicted(n);
  std::vector<Matrix> P(n), before(n), F(n, Matrix::Identity());
  for (std::size_t k = 0; k < n; ++k) {
    if (k == 0) {
      predicted[k] = {z[0], 0};
      before[k] = Vector(1e2 * noise * noise, 4).asDiagonal();  // m/s: no robot is faster than twice this
    } else {
      const double t = dt[k - 1], q = density * density;
      F[k](0, 1) = t;
      Matrix Q;
      Q << q * t * t * t / 3, q * t * t / 2, q * t * t / 2, q * t;
      predicted[k] = F[k] * x[k - 1] + Vector(dp[k - 1], dv[k - 1]);
      before[k] = F[k] * P[k - 1] * F[k].transpose() + Q;
    }
    const Vector K = before[k].col(0) / (before[k](0, 0) + noise * noise);
    x[k] = predicted[k] + K * (z[k] - predicted[k][0]);
    P[k] = before[k] - K * before[k].row(0);
  }
  for (std::size_t k = n - 1; k-- > 0;) x[k] += P[k] * F[k + 1].transpose() * before[k + 1].inverse() * (x[k + 1] - predicted[k + 1]);
  std::vector<double> out;
  for (const Vector& state : x) out.push_back(state[0]);
  return out;
}

// The same of a random walk.
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

/// A sweep's pose, of the IMU.
struct SweepStation {
  double t;
  SE3 T_WI;
};

// The points of a sweep tell its pose to a millimetre, each sweep for itself; the IMU tells to a tenth of that how it moved meanwhile.
void smooth_stations(std::vector<SweepStation>& run, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                     const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba) {
  const std::size_t n = run.size();
  constexpr std::size_t fewest = 8;
  if (n < fewest || !gyro.covers(run.front().t, run.back().t)) return;
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
    z = smooth_walk(z, dt, std::max(5e-5, 1.48 * median(steps) / std::sqrt(2.0)), gyro_density);
    for (std::size_t k = 0; k < n; ++k) turned[k][axis] = z[k];
  }
  for (std::size_t k = 0; k < n; ++k) run[k].T_WI.R = SO3::Exp(turned[k]) * by_gyro[k];
  std::vector<Increment> moved;
  for (std::size_t k = 1; k < n; ++k) moved.push_back(increment(run[k - 1].t, run[k].t, run[k - 1].T_WI.R, imu, gyro, g_W, ba));
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> z(n), dp, dv, apart;
    for (std::size_t k = 0; k < n; ++k) z[k] = run[k].T_WI.p[axis];
    for (const Increment& i : moved) dp.push_back(i.dp[axis]), dv.push_back(i.dv[axis]);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const double before = (z[k] - z[k - 1] - dp[k - 1]) / dt[k - 1] + dv[k - 1], after = (z[k + 1] - z[k] - dp[k]) / dt[k];
      apart.push_back(std::abs(after - before) * 0.5 * (dt[k - 1] + dt[k]));
    }
    // Of z[k - 1] - 2 z[k] + z[k + 1].
    const double noise = 1.48 * median(apart) / std::sqrt(6.0);
    if (noise > most_noise) continue;
    z = smooth(z, dt, dp, dv, std::max(1e-4, noise), accel_density);
    for (std::size_t k = 0; k < n; ++k) run[k].T_WI.p[axis] = z[k];
  }
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
    std::vector<SweepStation> run;
    for (j = i; j < sweeps.size() && (j == i || sweeps[j].t - sweeps[j - 1].t < longest_step); ++j)
      run.push_back({sweeps[j].t, sweeps[j].T_WI});
    smooth_stations(run, imu, gyro, g_W, ba);
    for (std::size_t k = 0; k < run.size(); ++k) sweeps[i + k].T_WI = run[k].T_WI;
  }
  for (std::size_t i = 1; i < sweeps.size(); ++i) {
    if (sweeps[i].t - sweeps[i - 1].t < longest_step) bridge(sweeps[i - 1], sweeps[i], imu, gyro, g_W, ba);
  }
}

// Double integration from one sweep to the next; the velocity at its beginning is the one with which it ends where the next sweep says.
void LidarWay::bridge(const Pose& a, const Pose& b, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                      const Eigen::Vector3d& g_W, const Eigen::Vector3d& ba) {
  if (!gyro.covers(a.t, b.t)) return;
  std::vector<Pose> steps{a};
  integrate(a.t, b.t, a.T_WI, imu, gyro, g_W, ba, [&](double t, const Eigen::Vector3d& p, const Eigen::Vector3d&) {
    steps.push_back({t, {a.T_WI.R * SO3::from_quaternion(gyro.between(a.t, t)), p}});
  });
  const double span = steps.back().t - a.t;
  if (!(span > 0) || b.t - steps.back().t > 0.05) return;
  const Eigen::Vector3d missing = (b.T_WI.p - steps.back().T_WI.p) / span;
  for (Pose& pose : steps) {
    pose.T_WI.p += (pose.t - a.t) * missing;
    if (poses_.empty() || pose.t > poses_.back().t) poses_.push_back(pose);
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
