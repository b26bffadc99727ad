#include "lab/doctor/turns.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/math/decompositions.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t fewest_intervals = 30;  // intervals
constexpr double least_turning = 0.03;        // rad/s rms, below which nothing is compared
constexpr double gyro_bias_prior = 0.02;      // rad/s
constexpr double resolution = 0.005;          // s, of the search for the offset
constexpr std::size_t most_offsets = 6;

struct Pair {
  const Turn* turn;
  Eigen::Vector3d gyro;  // rad
};

std::vector<Pair> pairs_of(const std::vector<Turn>& turns, const GyroPath& gyro, double offset) {
  std::vector<Pair> out;
  for (const Turn& turn : turns) {
    if (gyro.covers(turn.a + offset, turn.b + offset)) out.push_back({&turn, log_of(gyro.between(turn.a + offset, turn.b + offset))});
  }
  return out;
}

// The choice that the gyro agrees with best.
const Eigen::Vector3d& nearest(const Turn& turn, const Eigen::Vector3d& expected) {
  if (turn.choices == 1) return turn.theta[0];
  return (turn.theta[0] - expected).squaredNorm() <= (turn.theta[1] - expected).squaredNorm() ? turn.theta[0] : turn.theta[1];
}

const Eigen::Vector3d& nearest_length(const Turn& turn, double length) {
  if (turn.choices == 1) return turn.theta[0];
  return std::abs(turn.theta[0].norm() - length) <= std::abs(turn.theta[1].norm() - length) ? turn.theta[0] : turn.theta[1];
}

Eigen::Matrix3d orthogonal_of(const Eigen::Matrix3d& C) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(C, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

double median_of(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

// Outliers count as much as nine tenths of the rows allow.
double robust_share(std::vector<double>& errors, std::vector<double>& sizes) {
  if (errors.size() < fewest_intervals) return 0;
  std::ranges::sort(errors);
  double e = 0, s = 0;
  const std::size_t n = errors.size() * 9 / 10;
  for (std::size_t i = 0; i < n; ++i) e += errors[i];
  for (const double size : sizes) s += size;
  s *= static_cast<double>(n) / static_cast<double>(sizes.size());
  return s > 0 ? 1 - e / s : 0;
}

}  // namespace

double explained_by(const std::vector<Turn>& turns, const GyroPath& gyro, double offset, const Eigen::Matrix3d& axes, double scale) {
  std::vector<double> errors, sizes;
  for (const Pair& p : pairs_of(turns, gyro, offset)) {
    const Eigen::Vector3d expected = axes.transpose() * p.gyro / scale;
    const double dt2 = (p.turn->b - p.turn->a) * (p.turn->b - p.turn->a);
    errors.push_back((nearest(*p.turn, expected) - expected).squaredNorm() / dt2);
    sizes.push_back(expected.squaredNorm() / dt2);
  }
  return robust_share(errors, sizes);
}

TurnAgreement agree(const std::vector<Turn>& turns, const GyroPath& gyro, double offset) {
  TurnAgreement out;
  const std::vector<Pair> pairs = pairs_of(turns, gyro, offset);
  out.count = pairs.size();
  if (pairs.size() < fewest_intervals) return out;
  std::vector<double> ratios;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  double time2 = 0;
  for (const Pair& p : pairs) {
    spread += p.gyro * p.gyro.transpose();
    time2 += (p.turn->b - p.turn->a) * (p.turn->b - p.turn->a);
  }
  spread /= time2;
  out.turning = std::sqrt(spread.trace());
  out.weakest = std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues()[0]));
  for (const Pair& p : pairs) {
    const double length = p.turn->theta[0].norm();
    if (p.turn->choices == 1 && length > 0.3 * out.turning * (p.turn->b - p.turn->a)) ratios.push_back(p.gyro.norm() / length);
  }
  out.scale = ratios.size() < fewest_intervals ? 1 : median_of(ratios);
  for (int k = 0; k < 8; ++k) {
    Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
    double dot = 0, square = 0;
    for (const Pair& p : pairs) {
      const Eigen::Vector3d expected = out.axes.transpose() * p.gyro / out.scale;
      const Eigen::Vector3d& theta = k == 0 ? nearest_length(*p.turn, p.gyro.norm() / out.scale) : nearest(*p.turn, expected);
      const double error = (theta - expected).norm() / (0.5 * expected.norm() + 0.05 * (p.turn->b - p.turn->a));
      const double weight = k < 2 ? 1 : 1 / (1 + error * error);
      C += weight * p.gyro * theta.transpose();
      dot += weight * theta.dot(expected);
      square += weight * expected.squaredNorm();
    }
    out.axes = orthogonal_of(C);
    // Of two feet the nearer is chosen: with a free scale, none would ever be far.
    if (k > 2 && square > 0 && dot > 0 && pairs.front().turn->choices == 1) out.scale *= square / dot;
  }
  out.explained = explained_by(turns, gyro, offset, out.axes, out.scale);
  return out;
}

std::vector<double> likely_offsets(const std::vector<Turn>& turns, const GyroPath& gyro, double reach) {
  struct Peak {
    double offset, correlation;
  };
  std::vector<Peak> all;
  std::vector<double> x, y;
  for (double offset = -reach; offset <= reach; offset += resolution) {
    x.clear(), y.clear();
    for (const Turn& turn : turns) {
      if (!gyro.covers(turn.a + offset, turn.b + offset)) continue;
      const double dt = turn.b - turn.a;
      x.push_back(std::sqrt(gyro.rate(turn.a + offset, turn.b + offset).norm()));
      y.push_back(std::sqrt(nearest_length(turn, dt * x.back() * x.back()).norm() / dt));
    }
    if (x.size() < fewest_intervals) continue;
    const Eigen::Map<const Eigen::VectorXd> a(x.data(), static_cast<Eigen::Index>(x.size())), b(y.data(), a.size());
    const Eigen::VectorXd da = a.array() - a.mean(), db = b.array() - b.mean();
    const double norm = da.norm() * db.norm();
    all.push_back({offset, norm > 0 ? da.dot(db) / norm : 0});
  }
  std::vector<Peak> peaks;
  for (std::size_t i = 1; i + 1 < all.size(); ++i) {
    if (all[i].correlation >= all[i - 1].correlation && all[i].correlation > all[i + 1].correlation) peaks.push_back(all[i]);
  }
  std::ranges::sort(peaks, [](const Peak& p, const Peak& q) { return p.correlation > q.correlation; });
  std::vector<double> out;
  for (const Peak& p : peaks) {
    if (out.size() < most_offsets && p.correlation > 0.3) out.push_back(p.offset);
  }
  return out;
}

MountFit fit_mount(const std::vector<Turn>& turns, const GyroPath& gyro, const SO3& R, double offset, double rotation_prior) {
  MountFit out;
  // The same intervals for every iterate: those that the gyro covers with some slack.
  std::vector<const Turn*> inside;
  constexpr double slack = 0.05;
  for (const Turn& turn : turns) {
    if (gyro.covers(turn.a + offset - slack, turn.b + offset + slack)) inside.push_back(&turn);
  }
  const auto residuals = [&](const Eigen::VectorXd& x, Residuals& r) {
    const SO3 mount = R * SO3::Exp(x.head<3>());
    const double tau = offset + std::clamp(x[3], -slack, slack);
    for (const Turn* turn : inside) {
      const double dt = turn->b - turn->a;
      const Eigen::Vector3d rate = log_of(gyro.between(turn->a + tau, turn->b + tau)) / dt - x.tail<3>();
      const Eigen::Vector3d expected = mount.inverse() * rate;
      const Eigen::Vector3d e = nearest(*turn, dt * expected) / dt - expected;
      r.r.insert(r.r.end(), {e.x(), e.y(), e.z()});
      r.block.push_back(static_cast<int>(turn->a / block_seconds));
    }
  };
  Eigen::VectorXd start = Eigen::VectorXd::Zero(7), prior(7), step(7);
  prior << rotation_prior, rotation_prior, rotation_prior, INFINITY, gyro_bias_prior, gyro_bias_prior, gyro_bias_prior;
  step << 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3;
  out.fit = robust_fit(residuals, start, prior, step);
  out.R = R * SO3::Exp(out.fit.x.head<3>());
  out.offset = offset + out.fit.x[3];
  out.bias = out.fit.x.tail<3>();
  if (out.fit.good) out.explained = explained_by(turns, gyro, out.offset, out.R.matrix());
  return out;
}

std::vector<Turn> best_half(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& fit) {
  std::vector<double> errors;
  for (const Turn& turn : turns) {
    const double a = turn.a + fit.offset, b = turn.b + fit.offset, dt = turn.b - turn.a;
    if (!gyro.covers(a, b)) {
      errors.push_back(INFINITY);
      continue;
    }
    const Eigen::Vector3d expected = fit.R.inverse() * Eigen::Vector3d(log_of(gyro.between(a, b)) - dt * fit.bias);
    errors.push_back((nearest(turn, expected) - expected).norm() / dt);
  }
  const double middle = median_of(errors);
  std::vector<Turn> out;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (errors[i] <= middle) out.push_back(turns[i]);
  }
  return out;
}

}  // namespace kilvo::lab
