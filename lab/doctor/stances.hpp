// The soles of a robot whose IMU's way is known: where they stand, and how far each is from standing still, by all that fit_stances()
// looks for.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "lab/doctor/leg_hypotheses.hpp"
#include "lab/doctor/robust_fit.hpp"
#include "lab/doctor/stance_fit.hpp"

namespace kilvo::lab {

class Stances {
 public:
  static constexpr double clock_step = 2e-4;    // s, for derivatives
  static constexpr double stance_slack = 0.02;  // s, by which the clock may be off the one that the fit starts from
  // m, rad: of the rows. A sole tilts with the load on it by a tenth of a degree, in step with the gait, while its middle stays where it
  // is.
  static constexpr double unit_p = 0.003, unit_R = 0.03;
  static constexpr Eigen::Index of_p = 3, of_offset = 6, of_scale = 7, of_apart = 8, of_zeros = 11;

  Stances(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, const LidarWay& way, const GyroPath& gyro, double offset,
          bool with_zeros)
      : way_(way), gyro_(gyro), T_LI_(robot.imu.T_link_imu), offset_(offset) {
    if (with_zeros) joints_ = legs.joints_that_matter(robot);
    const std::vector<LegPose> path = legs.path(robot, hypothesis, sample_period, nullptr);
    const auto n = static_cast<Eigen::Index>(joints_.size());
    for (const LegPose& pose : path) {
      if (with_zeros && (!way.at(pose.t + offset - stance_slack, gyro) || !way.at(pose.t + offset + stance_slack, gyro))) continue;
      Sample s{pose.t, {}};
      for (std::size_t f = 0; f < 2; ++f)
        s.sole[f] = {middle_of(pose.foot[f]), pose.foot[f].R_IF, Eigen::MatrixXd::Zero(3, n), Eigen::MatrixXd::Zero(3, n)};
      samples_.push_back(std::move(s));
    }
    for (Eigen::Index j = 0; j < n; ++j) differentiate(legs, robot, hypothesis, j);
  }

  Eigen::Index unknowns() const { return of_zeros + static_cast<Eigen::Index>(joints_.size()); }
  const std::vector<std::size_t>& joints() const { return joints_; }
  std::size_t stances() const { return stances_.size(); }
  /// Samples of a stance say much the same: about two of them are worth something of their own, in the mean.
  double repeated() const {
    double samples = 0;
    for (const Stance& s : stances_) samples += static_cast<double>(s.end - s.begin);
    return std::max(1.0, samples / (2 * static_cast<double>(stances_.size())));
  }

  Standing standing(bool roughly = false) {
    find(Eigen::VectorXd::Zero(unknowns()), roughly);
    Standing out;
    std::vector<double> moving(samples_.size(), 0);
    for (std::size_t i = 1; i < samples_.size(); ++i) {
      if (moves(i)) moving[i] = std::min(samples_[i].t - samples_[i - 1].t, 2 * sample_period);
      out.moving += moving[i];
    }
    for (const Stance& s : stances_) {
      for (std::size_t i = s.begin + 1; i < s.end; ++i) out.of[s.foot] += moving[i];
    }
    return out;
  }

  /// With another clock and another mount.
  Standing standing(double offset, const SO3& R_link_imu, bool roughly = false) {
    offset_ = offset;
    T_LI_.R = R_link_imu;
    return standing(roughly);
  }

  /// Where the soles seem to stand with these values.
  void find(const Eigen::VectorXd& x, bool first) {
    place(x);
    stances_.clear();
    const double slow = still[first ? 0 : 1], slow_turn = still_turn[first ? 0 : 1];
    for (std::size_t f = 0; f < 2; ++f) {
      std::vector<std::optional<SE3>> soles;
      for (std::size_t i = 0; i < samples_.size(); ++i) soles.push_back(sole_at(x, i, f));
      // From one sample to another.
      const auto rests = [&](std::size_t from, std::size_t to) {
        const double dt = samples_[to].t - samples_[from].t;
        return samples_[to].t - samples_[to - 1].t < 2 * sample_period && soles[from] && soles[to] &&
               (soles[to]->p - soles[from]->p).norm() < slow * dt &&
               (soles[from]->R.inverse() * soles[to]->R).Log().norm() < slow_turn * dt;
      };
      std::size_t begin = 0;
      for (std::size_t i = 1; i <= samples_.size(); ++i) {
        if (i < samples_.size() && rests(i - std::min(i - begin, far), i)) continue;
        if (i >= begin + shortest + 2 * edge) stances_.push_back({f, begin + edge, i - edge});
        begin = i;
      }
    }
    std::ranges::sort(stances_, {}, &Stance::begin);
  }

  /// Each sample of a stance against the mean of its middle half.
  void rows(const Eigen::VectorXd& x, Residuals& out) {
    place(x);
    out.width = 6;
    std::vector<SE3> soles;
    for (std::size_t k = 0; k < stances_.size(); ++k) {
      const Stance& stance = stances_[k];
      const std::size_t n = stance.end - stance.begin;
      soles.clear();
      for (std::size_t i = stance.begin; i < stance.end; ++i) soles.push_back(sole_at(x, i, stance.foot).value_or(SE3{}));
      const SO3 middle = soles[n / 2].R;
      Eigen::Vector3d p = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
      const std::size_t from = n / 4, to = n - n / 4;
      for (std::size_t i = from; i < to; ++i) {
        p += soles[i].p / static_cast<double>(to - from);
        turn += (middle.inverse() * soles[i].R).Log() / static_cast<double>(to - from);
      }
      for (const SE3& sole : soles) {
        const Eigen::Vector3d dp = (sole.p - p) / unit_p, dR = ((middle.inverse() * sole.R).Log() - turn) / unit_R;
        out.r.insert(out.r.end(), {dp.x(), dp.y(), dp.z(), dR.x(), dR.y(), dR.z()});
        out.block.push_back(static_cast<int>(k));
      }
    }
  }

  /// Of these rows, where they have just been taken.
  void derivative(const Eigen::VectorXd& x, Derivatives& J) {
    place_later(x);
    std::vector<SE3> soles;
    std::vector<SoleChange> changes;
    Eigen::Index row = 0;
    for (const Stance& stance : stances_) {
      const std::size_t n = stance.end - stance.begin;
      soles.clear(), changes.clear();
      for (std::size_t i = stance.begin; i < stance.end; ++i) {
        soles.push_back(sole_at(x, i, stance.foot).value_or(SE3{}));
        changes.push_back(change_of(x, i, stance.foot, soles.back()));
      }
      // Turns are against the middle sole.
      const SO3 back = soles[n / 2].R.inverse();
      const Eigen::Matrix3Xd of_middle = changes[n / 2].bottomRows<3>();
      SoleChange mean = SoleChange::Zero(6, x.size());
      const std::size_t from = n / 4, to = n - n / 4;
      for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Vector3d turn = (back * soles[i].R).Log();
        changes[i].bottomRows<3>() =
            right_jacobian(turn).inverse() * changes[i].bottomRows<3>() - right_jacobian(-turn).inverse() * of_middle;
        if (i >= from && i < to) mean += changes[i] / static_cast<double>(to - from);
      }
      for (const SoleChange& change : changes) {
        J.middleRows<3>(row) = (change - mean).topRows<3>() / unit_p;
        J.middleRows<3>(row + 3) = (change - mean).bottomRows<3>() / unit_R;
        row += 6;
      }
    }
  }

  SO3 rotation(const Eigen::VectorXd& x) const { return SO3::Exp(x.head<3>()) * T_LI_.R; }

 private:
  static constexpr double sample_period = 0.019;  // s between samples
  // m/s, rad/s, of a sole that stands: as far as it is known before and after the first fit. Soles that roll seem to stand, too.
  static constexpr double still[] = {0.15, 0.05}, still_turn[] = {0.45, 0.15};
  static constexpr std::size_t shortest = 8;  // samples of a stance
  static constexpr std::size_t edge = 2;      // samples at either end, where soles roll
  static constexpr std::size_t far = 3;       // samples, of which a sole's speed is taken: stamps jitter
  static constexpr double nudge = 1e-4;       // rad

  /// By the unknowns: of a sole's place in the world, and of its turn in its own frame.
  using SoleChange = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  /// The middle of a sole and its turn in the link's frame, and how they change with the joints' zeros.
  struct Sole {
    Eigen::Vector3d c;
    SO3 R;
    Eigen::MatrixXd by_c, by_R;  // 3 x joints
  };

  struct Sample {
    double t = 0;
    std::array<Sole, 2> sole;
  };

  struct Stance {
    std::size_t foot = 0, begin = 0, end = 0;  // samples
  };

  // The feet are `apart` from where they are described, the left one by it, the right one by its negative.
  static double side(std::size_t f) { return f == 0 ? 1 : -1; }

  static Eigen::Vector3d middle_of(const FootPose& foot) {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (int i = 0; i < foot.corners; ++i) out += foot.p[static_cast<std::size_t>(i)] / foot.corners;
    return out;
  }

  // A robot that stands still stands with any legs.
  bool moves(std::size_t i) const {
    constexpr double slow = 0.05;  // m/s
    const double t = samples_[i].t + offset_;
    const auto a = way_.at(t - stance_slack, gyro_), b = way_.at(t + stance_slack, gyro_);
    return a && b && (b->p - a->p).norm() > slow * 2 * stance_slack;
  }

  void differentiate(RecordedLegs& legs, const Robot& robot, const LegHypothesis* hypothesis, Eigen::Index j) {
    LegHypothesis h = hypothesis != nullptr ? *hypothesis : LegHypothesis{};
    const std::size_t joint = joints_[static_cast<std::size_t>(j)];
    h.position = [base = hypothesis != nullptr ? hypothesis->position : nullptr, joint](std::size_t i, double& q) {
      if (base) base(i, q);
      if (i == joint) q += nudge;
    };
    std::size_t k = 0;
    for (const LegPose& pose : legs.path(robot, &h, sample_period, nullptr)) {
      while (k < samples_.size() && samples_[k].t < pose.t) ++k;
      if (k == samples_.size() || samples_[k].t != pose.t) continue;
      for (std::size_t f = 0; f < 2; ++f) {
        Sole& sole = samples_[k].sole[f];
        sole.by_c.col(j) = (middle_of(pose.foot[f]) - sole.c) / nudge;
        sole.by_R.col(j) = (sole.R.inverse() * pose.foot[f].R_IF).Log() / nudge;
      }
    }
  }

  // Where the IMU was at each sample, which of all unknowns the clock alone changes.
  void place(const Eigen::VectorXd& x) {
    T_IL_ = SE3{rotation(x), T_LI_.p + x.segment<3>(of_p)}.inverse();
    const double offset = offset_ + std::clamp(x[of_offset], -stance_slack, stance_slack);
    if (offset == placed_by_) return;
    placed_by_ = offset;
    T_WI_.clear();
    for (const Sample& s : samples_) T_WI_.push_back(way_.at(s.t + offset, gyro_));
  }

  // After place() with the same values.
  std::optional<SE3> sole_at(const Eigen::VectorXd& x, std::size_t i, std::size_t f) const {
    const std::optional<SE3>& T_WI = T_WI_[i];
    if (!T_WI) return std::nullopt;
    const Sole& sole = samples_[i].sole[f];
    if (joints_.empty()) return *T_WI * T_IL_ * SE3{sole.R, (1 + x[of_scale]) * sole.c};
    const auto zeros = x.tail(x.size() - of_zeros);
    const SE3 in_link{sole.R * SO3::Exp(sole.by_R * zeros),
                      (1 + x[of_scale]) * (sole.c + sole.by_c * zeros) + side(f) * x.segment<3>(of_apart)};
    return *T_WI * T_IL_ * in_link;
  }

  // Where the IMU was a little later than place() says.
  void place_later(const Eigen::VectorXd& x) {
    const double later = offset_ + std::clamp(x[of_offset] + clock_step, -stance_slack, stance_slack);
    T_WI_later_.clear();
    for (const Sample& s : samples_) T_WI_later_.push_back(way_.at(s.t + later, gyro_));
  }

  // After place() and place_later() with the same values. `T_WF`: sole_at() them.
  SoleChange change_of(const Eigen::VectorXd& x, std::size_t i, std::size_t f, const SE3& T_WF) const {
    SoleChange out = SoleChange::Zero(6, x.size());
    if (!T_WI_[i]) return out;
    const Sole& sole = samples_[i].sole[f];
    const auto zeros = x.tail(x.size() - of_zeros);
    const double scale = 1 + x[of_scale];
    const Eigen::Matrix3d R_WL = (T_WI_[i]->R * T_IL_.R).matrix(), R_FL = T_WF.R.matrix().transpose() * R_WL;
    const Eigen::Vector3d c = sole.c + sole.by_c * zeros, from_imu = scale * c + side(f) * x.segment<3>(of_apart) - T_IL_.inverse().p;
    const Eigen::Matrix3d left = right_jacobian(-x.head<3>());
    out.topLeftCorner<3, 3>() = R_WL * skew(from_imu) * left;
    out.bottomLeftCorner<3, 3>() = -R_FL * left;
    out.block<3, 3>(0, of_p) = -R_WL;
    if (T_WI_later_[i]) {
      const SE3 moved = *T_WI_later_[i] * T_WI_[i]->inverse() * T_WF;
      out.col(of_offset) << (moved.p - T_WF.p) / clock_step, (T_WF.R.inverse() * moved.R).Log() / clock_step;
    }
    out.col(of_scale).head<3>() = R_WL * c;
    out.block<3, 3>(0, of_apart) = side(f) * R_WL;
    out.topRightCorner(3, zeros.size()) = scale * R_WL * sole.by_c;
    out.bottomRightCorner(3, zeros.size()) = right_jacobian(sole.by_R * zeros) * sole.by_R;
    return out;
  }

  const LidarWay& way_;
  const GyroPath& gyro_;
  SE3 T_LI_;
  double offset_;
  std::vector<std::size_t> joints_;
  std::vector<Sample> samples_;
  SE3 T_IL_;                                           // with the values of place()
  std::vector<std::optional<SE3>> T_WI_later_, T_WI_;  // of the samples, the latter with this clock:
  std::optional<double> placed_by_;
  std::vector<Stance> stances_;
};

}  // namespace kilvo::lab
