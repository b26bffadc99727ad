#include "lab/doctor/scan_odometry.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "kilvo/math/decompositions.hpp"
#include "lab/doctor/camera_fit.hpp"
#include "lab/doctor/plane_grid.hpp"

namespace kilvo::lab {
namespace {

constexpr double fine = 0.5, exact_fine = 0.7, coarse = 2;  // m, sides of voxels
constexpr double far = 8;                                   // m, beyond which points go to the coarse grid only
constexpr double grazing = 0.3;                             // cosine of the incidence, below which an exact way uses no point
constexpr double sensor_noise = 0.02;                       // m
constexpr double gate = 0.5;                                // m
constexpr int sweep_iterations = 10;
constexpr std::size_t stride = 4;        // of the points of a sweep, those that are registered
constexpr std::size_t least_used = 500;  // of them, where there are as many
constexpr std::size_t enough = 60;       // of them on planes
constexpr double velocity_change = 1.0;  // m/s from sweep to sweep, standard deviation
constexpr double velocity_known = 0.02;  // m/s, by a way that was found before
constexpr int knots = 32;                // of the motion within a sweep

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

using Double4 = double __attribute__((vector_size(32)));

// One point's row: its derivative J over (turn, position, velocity), weight and residual.
struct Row {
  double J[9];
  double weight, r;
};

// Lower triangle of sum w J J', and sum w r J.
struct NormalSums {
  double columns[4][8] = {};  // rows 0 to 7 of the first four columns
  double corner[4][4] = {};   // rows 4 to 7 of the next four
  double last[9] = {};        // row 8
  double g[9] = {};

  Matrix9 H() const {
    Matrix9 out = Matrix9::Zero();
    for (int j = 0; j < 8; ++j) {
      for (int i = j; i < 8; ++i) out(i, j) = j < 4 ? columns[j][i] : corner[j - 4][i - 4];
    }
    for (int j = 0; j < 9; ++j) out(8, j) = last[j];
    return out;
  }
};

[[gnu::always_inline]] inline void load(Double4& to, const double* from) { std::memcpy(&to, from, sizeof(to)); }

// sums += s x, of four
[[gnu::always_inline]] inline void add(double* sums, double s, const Double4& x) {
  Double4 sum;
  load(sum, sums);
  sum += s * x;
  std::memcpy(sums, &sum, sizeof(sum));
}

KILVO_WIDE void add_rows(const Row* rows, std::size_t count, NormalSums& to) {
  for (const Row* row = rows; row != rows + count; ++row) {
    Double4 upper, lower;
    load(upper, row->J);
    load(lower, row->J + 4);
    upper *= row->weight;
    lower *= row->weight;
    for (int j = 0; j < 4; ++j) {
      add(to.columns[j], row->J[j], upper);
      add(to.columns[j] + 4, row->J[j], lower);
      add(to.corner[j], row->J[4 + j], lower);
    }
    const double w8 = row->weight * row->J[8], wr = row->weight * row->r;
    for (int j = 0; j < 9; ++j) {
      to.last[j] += w8 * row->J[j];
      to.g[j] += wr * row->J[j];
    }
  }
}

double middle_of(const Sweep& sweep) { return 0.5 * (sweep.begin + sweep.end); }

class Odometry final : public SweepRegistration {
 public:
  explicit Odometry(bool exact) : exact_(exact), fine_(exact ? exact_fine : fine) {}

  SweepPose step(const Sweep& sweep, const Deskew& deskew) override {
    deskew_ = deskew;
    const double middle = middle_of(sweep);
    SweepPose pose = predicted(middle);
    turn(sweep, middle, pose);
    // With the swing taken out it is the place in the middle, else the mean over the sweep.
    const bool mean = velocity_sigma_ == velocity_change;
    const double share = mean ? std::abs(deskew.times) : 0;
    // Times as they come are kept to the last bit.
    pose.begin = share == 1 ? sweep.begin : middle + share * (sweep.begin - middle);
    pose.end = share == 1 ? sweep.end : middle + share * (sweep.end - middle);
    pose.good = first_ || align(pose);
    keep(pose);
    deskew_ = {};  // what it points to may be gone at the next sweep
    return pose;
  }

 private:
  SweepPose predicted(double t) const {
    SweepPose out;
    out.t = t;
    if (first_) return out;
    const double dt = t - last_.t;
    out.v_W = last_.v_W;
    out.T_WL.p = last_.T_WL.p + dt * last_.v_W;
    out.T_WL.R = last_.T_WL.R;
    if (deskew_.gyro != nullptr) {
      if (deskew_.gyro->covers(last_.t + deskew_.offset, t + deskew_.offset)) out.T_WL.R = last_.T_WL.R * lidar_turn(last_.t, t);
    } else {
      out.T_WL.R = last_.T_WL.R * SO3::Exp(dt * omega_);
    }
    return out;
  }

  SO3 lidar_turn(double a, double b) const {
    const Eigen::Quaterniond R_I = deskew_.gyro->between(a + deskew_.offset, b + deskew_.offset);
    return deskew_.R_IL.inverse() * SO3::from_quaternion(R_I) * deskew_.R_IL;
  }

  std::optional<SE3> lidar_at(double t) const {
    const auto T_WI = deskew_.way->at(t + deskew_.offset, *deskew_.gyro);
    return T_WI ? std::optional(*T_WI * SE3{deskew_.R_IL, deskew_.p_IL}) : std::nullopt;
  }

  // By how much the LiDAR is off a constant velocity within the sweep, in its frame in the middle: a robot that walks changes its
  // velocity by 0.3 m/s in a tenth of a second, in step with its gait.
  std::vector<Eigen::Vector3d> swing(const Sweep& sweep, double middle, SweepPose& pose) {
    std::vector<Eigen::Vector3d> out(knots + 1, Eigen::Vector3d::Zero());
    velocity_sigma_ = velocity_change;
    const double span = sweep.end - sweep.begin;
    if (deskew_.way == nullptr || !(span > 1e-4)) return out;
    const auto a = lidar_at(sweep.begin), m = lidar_at(middle), b = lidar_at(sweep.end);
    if (!a || !m || !b) return out;
    const Eigen::Vector3d v = (b->p - a->p) / span;
    for (int k = 0; k <= knots; ++k) {
      const double t = sweep.begin + span * k / knots;
      if (const auto at = lidar_at(t)) out[static_cast<std::size_t>(k)] = m->R.inverse() * Eigen::Vector3d(at->p - m->p - (t - middle) * v);
    }
    pose.v_W = v;
    velocity_sigma_ = velocity_known;
    return out;
  }

  // The points as seen from the LiDAR in the middle of the sweep but for its translation, which is part of the search.
  void turn(const Sweep& sweep, double middle, SweepPose& pose) {
    points_.clear();
    const std::vector<Eigen::Vector3d> swung = swing(sweep, middle, pose);
    const double sum = sweep.begin + sweep.end - 2 * sweep.t;
    const bool deskew = deskew_.gyro != nullptr && deskew_.gyro->covers(sweep.begin + deskew_.offset, sweep.end + deskew_.offset);
    // The turning at 33 times within the sweep, nearest one taken: 3 ms at 1 rad/s is a fifth of a degree, so interpolate.
    std::vector<Eigen::Vector3d> theta(knots + 1, Eigen::Vector3d::Zero());
    const double span = sweep.end - sweep.begin;
    if (deskew && span > 1e-4) {
      for (int k = 0; k <= knots; ++k) theta[static_cast<std::size_t>(k)] = lidar_turn(middle, sweep.begin + span * k / knots).Log();
    }
    for (const TimedPoint& p : *sweep.points) {
      double t = static_cast<double>(p.t);
      if (deskew_.times != 1) t = 0.5 * sum + deskew_.times * (t - 0.5 * sum);
      const double at = span > 1e-4 ? std::clamp((sweep.t + t - sweep.begin) / span, 0.0, 1.0) * knots : 0;
      const auto k = std::min(static_cast<std::size_t>(at), static_cast<std::size_t>(knots - 1));
      const double share = at - static_cast<double>(k);
      const Eigen::Vector3d turned = (1 - share) * theta[k] + share * theta[k + 1];
      const Eigen::Vector3d x = p.p.cast<double>();
      const Eigen::Vector3d moved = (1 - share) * swung[k] + share * swung[k + 1];
      points_.push_back({x + turned.cross(x) + 0.5 * turned.cross(turned.cross(x)) + moved, deskew ? sweep.t + t - middle : 0.0});
    }
  }

  const GridPlane* plane_at(const Eigen::Vector3d& p, double range) {
    if (range < far) {
      if (const GridPlane* plane = fine_.find(p)) return plane;
    }
    return coarse_.find(p);
  }

  bool align(SweepPose& pose) {
    const Eigen::Vector3d expected = pose.v_W;
    double scale = 0.1;
    for (int k = 0; k < sweep_iterations; ++k) {
      std::vector<double> distances;
      rows_.clear();
      const Eigen::Matrix3d R = pose.T_WL.R.matrix(), back = R.transpose();
      const std::size_t step = exact_ ? 1 : std::clamp<std::size_t>(points_.size() / least_used, 1, stride);
      for (std::size_t i = 0; i < points_.size(); i += step) {
        const Point& p = points_[i];
        const Eigen::Vector3d arm = R * p.p;
        const Eigen::Vector3d at = arm + pose.T_WL.p + p.dt * pose.v_W;
        const GridPlane* plane = plane_at(at, p.p.norm());
        if (plane == nullptr) continue;
        const double r = plane->n.dot(at - plane->centre);
        if (std::abs(r) > gate || (exact_ && std::abs(plane->n.dot(arm)) < grazing * arm.norm())) continue;
        distances.push_back(std::abs(r));
        const double noise = plane->variance + sensor_noise * sensor_noise;
        const double weight = 1 / (noise * (1 + r * r / (4 * (scale * scale + noise))));
        const Eigen::Vector3d a = back * (arm.cross(plane->n)), &n = plane->n;
        rows_.push_back({{a.x(), a.y(), a.z(), n.x(), n.y(), n.z(), p.dt * n.x(), p.dt * n.y(), p.dt * n.z()}, weight, r});
      }
      NormalSums normal;
      add_rows(rows_.data(), rows_.size(), normal);
      Matrix9 H = normal.H();
      Vector9 g(normal.g);
      if (distances.size() < enough) return false;
      pose.weakest = 3 * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(Eigen::Matrix3d(H.block<3, 3>(3, 3))).eigenvalues()[0] /
                     H.block<3, 3>(3, 3).trace();
      H.block<3, 3>(6, 6).diagonal().array() += 1 / (velocity_sigma_ * velocity_sigma_);
      g.tail<3>() += (pose.v_W - expected) / (velocity_sigma_ * velocity_sigma_);
      H.diagonal().array() += 1e-6 * H.diagonal().maxCoeff();
      const Vector9 d = -H.ldlt().solve(g);
      if (!d.allFinite()) return false;
      pose.T_WL.R = pose.T_WL.R * SO3::Exp(d.head<3>());
      pose.T_WL.p += d.segment<3>(3);
      pose.v_W += d.tail<3>();
      const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
      std::ranges::nth_element(distances, middle);
      scale = std::max(0.01, 1.48 * *middle);
      pose.thickness = scale;
      if (k > 2 && d.head<3>().norm() < 2e-5 && d.segment<3>(3).norm() < 1e-4) break;
    }
    return true;
  }

  void keep(SweepPose& pose) {
    if (!first_ && pose.good) {
      const double dt = pose.t - last_.t;
      if (dt > 1e-3 && dt < 1) {
        omega_ = (last_.T_WL.R.inverse() * pose.T_WL.R).Log() / dt;
        // What the sweep itself says of its velocity is weak; what the way says is not.
        pose.v_W = (pose.T_WL.p - last_.T_WL.p) / dt;
      }
    }
    if (pose.good || first_) {
      near_.clear();
      all_.clear();
      for (const Point& p : points_) {
        all_.push_back(pose.T_WL * p.p + p.dt * pose.v_W);
        if (p.p.norm() < far) near_.push_back(all_.back());
      }
      fine_.insert(near_);
      coarse_.insert(all_);
    } else {
      omega_.setZero();
    }
    last_ = pose;
    first_ = false;
  }

  struct Point {
    Eigen::Vector3d p;
    double dt;
  };
  Deskew deskew_;
  bool exact_;
  PlaneGrid fine_, coarse_{coarse};
  std::vector<Point> points_;
  std::vector<Row> rows_;                    // of one iteration
  std::vector<Eigen::Vector3d> near_, all_;  // points of a sweep in the first sweep's frame
  SweepPose last_;
  Eigen::Vector3d omega_ = Eigen::Vector3d::Zero();
  double velocity_sigma_ = velocity_change;
  bool first_ = true;
};

}  // namespace

void ScanOdometry::extend(const std::vector<Sweep>& sweeps, const Deskew& deskew) {
  const std::size_t before = way_.size();
  const bool follow = before > 0 && before <= sweeps.size() && middle_of(sweeps[before - 1]) == way_.back().t;
  if (!follow) {
    registration_ = std::make_unique<Odometry>(deskew.exact);
    way_.clear();
  }
  while (way_.size() < sweeps.size()) way_.push_back(registration_->step(sweeps[way_.size()], deskew));
}

std::vector<SweepPose> scan_odometry(const std::vector<Sweep>& sweeps, const Deskew& deskew, OdometryRange range) {
  Odometry odometry(deskew.exact);
  std::vector<SweepPose> out;
  for (std::size_t i = range.begin; i < std::min(range.end, sweeps.size()); ++i) out.push_back(odometry.step(sweeps[i], deskew));
  return out;
}

}  // namespace kilvo::lab
