#include "lab/doctor/leg_acceleration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kilvo/math/so3.hpp"
#include "lab/doctor/force_integral.hpp"
#include "lab/doctor/robust_fit.hpp"

namespace kilvo::lab {
namespace {

// s, between the poses of a row: half of the shortest step, in which the body is displaced by a centimetre against uniform motion.
constexpr double interval = 0.1;
constexpr std::size_t fewest_rows = 60;  // of three equations each
constexpr double turn_prior = 1, place_prior = 0.02, bias_prior = 0.15, gyro_prior = 0.01,
                 clock_prior = 0.05;  // rad, m, m/s^2, rad/s, s

// Unknowns of a row: ratio of the lengths, mount (3), place of the IMU (3), gravity (3), biases of gyro (3) and accelerometer (3), clock of
// the legs; and the row's right side.
constexpr int of_turn = 1, of_place = 4, of_gravity = 7, of_gyro = 10, of_bias = 13, of_clock = 16, unknowns = 17;
using Row = Eigen::Matrix<double, 3, unknowns + 1>;
using Gram = Eigen::Matrix<double, unknowns + 1, unknowns + 1>;
using Columns = Eigen::Matrix<double, unknowns + 1, Eigen::Dynamic>;  // rows, transposed

Eigen::Vector3d middle_of(const FootPose& foot) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (int i = 0; i < foot.corners; ++i) out += foot.p[static_cast<std::size_t>(i)] / foot.corners;
  return out;
}

/// A pose of the legs on the IMU's clock.
struct Moment {
  double t = 0;
  Eigen::Matrix3d R_WL = Eigen::Matrix3d::Identity();
  std::array<Eigen::Vector3d, 2> sole;  // in the link's frame
  std::array<Eigen::Vector3d, 2> speed{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::size_t lower = 0;  // foot
};

std::vector<Moment> moments_of(const std::vector<LegPose>& path, const ForceIntegral& force, const GyroPath& gyro, const SO3& R_IL,
                               double offset) {
  std::vector<Moment> out;
  for (const LegPose& pose : path) {
    const double t = pose.t + offset;
    if (!force.covers(t, t) || !gyro.covers(t, t)) continue;
    Moment m;
    m.t = t;
    m.R_WL = gyro.at(t).toRotationMatrix() * R_IL.matrix();
    m.sole = {middle_of(pose.foot[0]), middle_of(pose.foot[1])};
    m.lower = force.up(t).dot(m.R_WL * (m.sole[1] - m.sole[0])) < 0 ? 1 : 0;
    out.push_back(m);
  }
  for (std::size_t i = 1; i + 1 < out.size(); ++i) {
    for (std::size_t f = 0; f < 2; ++f)
      out[i].speed[f] = (out[i + 1].sole[f] - out[i - 1].sole[f]) / std::max(1e-6, out[i + 1].t - out[i - 1].t);
  }
  return out;
}

// Second difference of something at three times, as a change of place in `interval`.
template <class F>
auto bend(const std::array<const Moment*, 3>& at, F&& of) {
  const double before = at[1]->t - at[0]->t, after = at[2]->t - at[1]->t, mean = 0.5 * (before + after);
  return (mean * ((of(*at[2]) - of(*at[1])) / after - (of(*at[1]) - of(*at[0])) / before)).eval();
}

Row row_of(const std::array<const Moment*, 3>& at, const ForceIntegral& force, const Eigen::Vector3d& p_LI) {
  const std::size_t foot = at[1]->lower;
  const double span = 0.5 * (at[2]->t - at[0]->t);
  const Eigen::Matrix3d R = bend(at, [](const Moment& m) -> Eigen::Matrix3d { return m.R_WL; });
  Row row;
  row.col(0) = bend(at, [&](const Moment& m) { return force.place(m.t); });
  row.middleCols<3>(of_turn) = -bend(at, [&](const Moment& m) -> Eigen::Matrix3d { return m.R_WL * skew(m.sole[foot] - p_LI); });
  row.middleCols<3>(of_place) = -R;
  row.middleCols<3>(of_gravity) = span * span * Eigen::Matrix3d::Identity();
  // A gyro with a bias sees gravity turn.
  row.middleCols<3>(of_gyro) = -span * span * skew(force.gravity()) * force.turned(at[1]->t);
  row.middleCols<3>(of_bias) = -bend(at, [&](const Moment& m) { return force.place_by_bias(m.t); });
  row.col(of_clock) = -bend(at, [&](const Moment& m) -> Eigen::Vector3d { return m.R_WL * m.speed[foot]; });
  row.col(unknowns) = -bend(at, [&](const Moment& m) -> Eigen::Vector3d { return m.R_WL * (m.sole[foot] - p_LI); });
  return row;
}

/// Of times at which one foot is the lower one all along.
struct Rows {
  Columns columns;           // three of each row
  std::vector<int> seconds;  // by row
  Eigen::Index size() const { return static_cast<Eigen::Index>(seconds.size()); }
};

// What rough encoders and stamps give each pose for itself, which in a second difference is the same over any interval. Of the
// motion the fourth power of the ratio of the intervals is left, 1e-4 at 100 Hz: slow encoders seem rough.
double noise_of(const std::vector<Moment>& moments) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 1; i + 1 < moments.size(); ++i) {
    const std::array at{&moments[i - 1], &moments[i], &moments[i + 1]};
    const double before = at[1]->t - at[0]->t, after = at[2]->t - at[1]->t;
    if (before > 2 * after || after > 2 * before) continue;  // a gap
    const std::size_t foot = at[1]->lower;
    sum += bend(at, [foot](const Moment& m) { return m.sole[foot]; }).squaredNorm();
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

Rows rows_of(const std::vector<Moment>& moments, const ForceIntegral& force, const Eigen::Vector3d& p_LI) {
  Rows out;
  std::vector<Row> rows;
  double last = -1e9;
  std::size_t changed = 0, a = 0;  // where the lower foot became the lower one; a row's first moment
  for (std::size_t c = 1; c < moments.size(); ++c) {
    if (moments[c].lower != moments[c - 1].lower) changed = c;
    const double begin = moments[c].t - 2 * interval;
    while (moments[a + 1].t <= begin) ++a;
    if (a < changed || moments[a].t > begin + 0.5 * interval || moments[a].t < begin - 0.5 * interval) continue;
    const auto b = std::ranges::lower_bound(moments, 0.5 * (moments[a].t + moments[c].t), {}, &Moment::t);
    if (b->t - last < 0.5 * interval) continue;
    const double shorter = std::min(b->t - moments[a].t, moments[c].t - b->t);
    if (shorter < 0.7 * interval) continue;
    bool is_borne = true;
    for (double t = moments[a].t; t <= moments[c].t; t += 0.25 * interval) is_borne = is_borne && force.is_borne(t);
    if (!is_borne) continue;
    last = b->t;
    rows.push_back(row_of({&moments[a], &*b, &moments[c]}, force, p_LI));
    out.seconds.push_back(static_cast<int>(b->t));
  }
  out.columns.resize(Eigen::NoChange, 3 * out.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) out.columns.middleCols<3>(3 * i) = rows[static_cast<std::size_t>(i)].transpose();
  return out;
}

struct Solution {
  Eigen::Matrix<double, unknowns, 1> x = Eigen::Matrix<double, unknowns, 1>::Zero();
  Gram gram;           // weighted, with the prior
  double weights = 0;  // sum over the rows
  Eigen::Matrix<double, unknowns, unknowns> cov;
};

Solution solve(const Rows& of) {
  constexpr int iterations = 15;
  Eigen::Matrix<double, unknowns, 1> prior = Eigen::Matrix<double, unknowns, 1>::Zero();
  prior.segment<3>(of_turn).setConstant(1 / (turn_prior * turn_prior));
  prior.segment<3>(of_place).setConstant(1 / (place_prior * place_prior));
  prior.segment<3>(of_bias).setConstant(1 / (bias_prior * bias_prior));
  prior.segment<3>(of_gyro).setConstant(1 / (gyro_prior * gyro_prior));
  prior[of_clock] = 1 / (clock_prior * clock_prior);
  struct Block {
    Eigen::Matrix<double, unknowns, unknowns> H = Eigen::Matrix<double, unknowns, unknowns>::Zero();
    Eigen::Matrix<double, unknowns, 1> g = Eigen::Matrix<double, unknowns, 1>::Zero();
  };
  const auto J = of.columns.topRows<unknowns>();
  Solution out;
  Columns weighted(unknowns + 1, of.columns.cols());
  Eigen::RowVectorXd e(of.columns.cols());
  std::vector<double> lengths(of.seconds.size());
  double s2 = 1e-5;  // m^2: of a sole that rolls
  for (int k = 0; k < iterations; ++k) {
    e = of.columns.row(unknowns);
    e.noalias() -= out.x.transpose() * J;
    out.weights = 0;
    for (Eigen::Index i = 0; i < of.size(); ++i) {
      const double length = e.segment<3>(3 * i).squaredNorm(), weight = 1 / (1 + length / (6 * s2));
      lengths[static_cast<std::size_t>(i)] = length;
      weighted.middleCols<3>(3 * i) = weight * of.columns.middleCols<3>(3 * i);
      out.weights += weight;
    }
    out.gram.noalias() = weighted * of.columns.transpose();
    out.gram.diagonal().head<unknowns>() += s2 * prior;
    const Eigen::Matrix<double, unknowns, unknowns> H = out.gram.topLeftCorner<unknowns, unknowns>();
    out.x = H.ldlt().solve(out.gram.topRightCorner<unknowns, 1>());
    if (k + 1 == iterations) {
      std::vector<Block> blocks;
      for (Eigen::Index i = 0; i < of.size(); ++i) {
        const auto n = static_cast<std::size_t>(i);
        if (blocks.empty() || of.seconds[n] != of.seconds[n - 1]) blocks.emplace_back();
        const auto rows = weighted.middleCols<3>(3 * i).topRows<unknowns>();
        blocks.back().H += rows.lazyProduct(J.middleCols<3>(3 * i).transpose());
        blocks.back().g += rows * e.segment<3>(3 * i).transpose();
      }
      out.cov = jackknife(blocks, H);
    }
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::ranges::nth_element(lengths, middle);
    constexpr double median_of_three = 2.366;  // of chi-square
    s2 = *middle / median_of_three + 1e-12;
  }
  return out;
}

}  // namespace

MeasuredForce::MeasuredForce(const std::vector<InertialSample>& imu, GyroPath turns)
    : gyro(std::move(turns)), integral(std::make_shared<const ForceIntegral>(imu, gyro)) {}

LegAcceleration fit_leg_acceleration(const std::vector<LegPose>& path, const MeasuredForce& measured, const SE3& T_link_imu,
                                     double offset) {
  LegAcceleration out;
  const ForceIntegral& force = *measured.integral;
  const GyroPath& gyro = measured.gyro;
  out.offset = offset;
  Solution found;
  double noise = 0;  // m^2, of a row's right side
  // The clock is not linear.
  constexpr int rounds = 3;
  for (int k = 0; k < rounds; ++k) {
    const std::vector<Moment> moments = moments_of(path, force, gyro, T_link_imu.R.inverse(), out.offset);
    const Rows rows = rows_of(moments, force, T_link_imu.p);
    out.rows = rows.seconds.size() < fewest_rows ? 0 : rows.seconds.size();
    if (out.rows == 0) return out;
    found = solve(rows);
    constexpr double most = 0.05;  // s
    if (k + 1 < rounds) {
      out.offset += std::clamp(found.x[of_clock], -most, most);
    } else {
      noise = noise_of(moments);
    }
  }
  // A row is of two intervals, and the next one begins half of one later.
  constexpr double overlap = 4;
  out.independent = 3 * static_cast<double>(out.rows) / overlap - unknowns;
  // Of the two accelerations, what the other unknowns do not explain.
  constexpr int others = unknowns - 1;
  const Eigen::Matrix<double, others, others> H = found.gram.block<others, others>(1, 1);
  Eigen::Matrix<double, others, 2> both;
  both << found.gram.block<others, 1>(1, 0), found.gram.block<others, 1>(1, unknowns);
  Eigen::Matrix2d rest;
  rest << found.gram(0, 0), found.gram(0, unknowns), found.gram(unknowns, 0), found.gram(unknowns, unknowns);
  rest -= both.transpose() * H.ldlt().solve(both);
  const double together = rest(0, 1);
  if (!(rest(0, 0) > 0 && rest(1, 1) > 0) || !found.x.allFinite()) return out;
  out.acceleration = std::sqrt(rest(0, 0) / found.weights) / (interval * interval);
  out.noise = noise * found.weights / rest(0, 0);
  out.contradicts = (rest(0, 0) - 2 * together + rest(1, 1)) / rest(0, 0) - out.noise;
  if (!(together > 0)) return out;
  out.good = true;
  out.least_scale = together / rest(0, 0);
  out.most_scale = rest(1, 1) / together;
  out.explained = out.least_scale / out.most_scale;
  out.offset_sigma = std::sqrt(found.cov(of_clock, of_clock));
  out.scale_sigma = std::sqrt(found.cov(0, 0));
  out.turn = found.x.segment<3>(of_turn);
  out.sigma = found.cov.diagonal().segment<3>(of_turn).cwiseSqrt();
  return out;
}

}  // namespace kilvo::lab
