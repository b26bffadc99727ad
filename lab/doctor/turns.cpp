#include "lab/doctor/turns.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "kilvo/math/decompositions.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t fewest_intervals = 30;  // intervals
constexpr double least_turning = 0.03;        // rad/s rms, below which nothing is compared
constexpr double gyro_bias_prior = 0.02;      // rad/s
// Of the gyro of a robot: rad/s per m/s^2 and, of scales and skew, without a unit.
constexpr double sensitivity_prior = 1e-3, gyro_axes_prior = 0.005;
constexpr double resolution = 0.01;  // s, of the search for the offset
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
    double until = NAN;  // the end of the turn before, which most begin at
    Eigen::Quaterniond begin, end = Eigen::Quaterniond::Identity();
    for (const Turn& turn : turns) {
      if (!gyro.covers(turn.a + offset, turn.b + offset)) continue;
      const double dt = turn.b - turn.a;
      begin = turn.a == until ? end : gyro.at(turn.a + offset);
      end = gyro.at(turn.b + offset);
      until = turn.b;
      x.push_back(std::sqrt(log_of(begin.conjugate() * end).norm() / dt));
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

namespace {

// What the gyro says of the turns, and how they differ from it under a mount.
class MountResiduals {
 public:
  static constexpr double slack = 0.05;  // s

  MountResiduals(const std::vector<Turn>& turns, const GyroPath& gyro, const SO3& R, double offset) : gyro_(gyro), R_(R), offset_(offset) {
    // The same intervals for every iterate: those that the gyro covers with some slack.
    for (const Turn& turn : turns) {
      if (gyro.covers(turn.a + offset - slack, turn.b + offset + slack)) inside_.push_back(&turn);
    }
  }

  /// Share of a turn's noise that the next one has with the opposite sign.
  void predict(double share) { share_ = share; }

  /// x: rotation (3), offset (1), bias (3) and, where it is longer, sensitivity to acceleration (9), scales and skew (6).
  void operator()(const Eigen::VectorXd& x, Residuals& out) {
    const bool flawed = x.size() > plain;
    sense(offset_ + std::clamp(x[3], -slack, slack), flawed);
    const SO3 back = (R_ * SO3::Exp(x.head<3>())).inverse();
    Eigen::Matrix3d S = Eigen::Matrix3d::Zero(), M = S;
    if (flawed) {
      S = Eigen::Map<const Eigen::Matrix3d>(x.data() + plain);
      const double* m = x.data() + plain + 9;
      M << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
    }
    Eigen::Vector3d last = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      const Turn& turn = *inside_[i];
      const double dt = turn.b - turn.a;
      Eigen::Vector3d rate = rates_[i] - x.segment<3>(4);
      if (flawed) rate -= S * forces_[i] + M * rate;
      const Eigen::Vector3d expected = back * rate;
      Eigen::Vector3d e = nearest(turn, dt * expected) / dt - expected;
      if (share_ > 0 && i > 0 && turn.a == inside_[i - 1]->b) e += share_ * (SO3::Exp(turn.theta[0]).inverse() * last);
      last = e;
      out.r.insert(out.r.end(), {e.x(), e.y(), e.z()});
      out.block.push_back(static_cast<int>(turn.a / block_seconds));
    }
  }

  static constexpr Eigen::Index plain = 7, all = 22;
  static constexpr int of_axis[] = {plain + 9, plain + 12, plain + 14};  // the diagonal of M

 private:
  // Once for all parameters but the offset.
  void sense(double offset, bool with_forces) {
    if (sensed_ == offset && (!with_forces || !forces_.empty())) return;
    sensed_ = offset;
    rates_.clear(), forces_.clear();
    for (const Turn* turn : inside_) {
      rates_.emplace_back(gyro_.rate(turn->a + offset, turn->b + offset));
      if (with_forces) forces_.push_back(gyro_.force(turn->a + offset, turn->b + offset));
    }
  }

  const GyroPath& gyro_;
  SO3 R_;
  double offset_, share_ = 0;
  std::vector<const Turn*> inside_;
  std::optional<double> sensed_;
  std::vector<Eigen::Vector3d> rates_, forces_;
};

MountFit mount_of(const Fit& fit, const std::vector<Turn>& turns, const GyroPath& gyro, const SO3& R, double offset) {
  MountFit out;
  out.fit = fit;
  out.R = R * SO3::Exp(fit.x.head<3>());
  out.offset = offset + fit.x[3];
  out.bias = fit.x.segment<3>(4);
  if (fit.good) out.explained = explained_by(turns, gyro, out.offset, out.R.matrix());
  return out;
}

}  // namespace

MountFit fit_mount(const std::vector<Turn>& turns, const GyroPath& gyro, const SO3& R, double offset, double rotation_prior) {
  MountResiduals residuals(turns, gyro, R, offset);
  constexpr auto n = MountResiduals::plain;
  Eigen::VectorXd prior(n);
  prior << rotation_prior, rotation_prior, rotation_prior, INFINITY, gyro_bias_prior, gyro_bias_prior, gyro_bias_prior;
  const Fit fit = robust_fit(std::ref(residuals), Eigen::VectorXd::Zero(n), prior, Eigen::VectorXd::Constant(n, 1e-3));
  return mount_of(fit, turns, gyro, R, offset);
}

MountFit refine_mount(const std::vector<Turn>& turns, const GyroPath& gyro, const MountFit& start) {
  if (!start.fit.good) return start;
  MountResiduals residuals(turns, gyro, start.R, start.offset);
  constexpr auto n = MountResiduals::all;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n), prior(n);
  x.segment<3>(4) = start.bias;
  prior.head<4>().setConstant(INFINITY);
  prior.segment<3>(4).setConstant(gyro_bias_prior);
  prior.segment<9>(MountResiduals::plain).setConstant(sensitivity_prior);
  prior.tail<6>().setConstant(gyro_axes_prior);
  double least = INFINITY, share = 0;
  for (const double candidate : {0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}) {
    Residuals r;
    residuals.predict(candidate);
    residuals(x, r);
    const double scale = scale_of(r);
    if (scale < least) least = scale, share = candidate;
  }
  residuals.predict(share);
  const Fit fit = robust_fit(std::ref(residuals), x, prior, Eigen::VectorXd::Constant(n, 1e-3));
  if (!fit.good) return start;
  MountFit out = mount_of(fit, turns, gyro, start.R, start.offset);
  for (int axis = 0; axis < 3; ++axis) {
    const int place = MountResiduals::of_axis[axis];
    out.gyro_excess[axis] = fit.x[place];
    out.gyro_excess_sigma[axis] = fit.sigma(place);
  }
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
