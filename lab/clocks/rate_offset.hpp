// By how much the clocks of two angular rates of one body differ: one is the other, later or earlier. First every offset of a grid is tried
// on the same samples; when one of them is far likelier than the others, a Kalman filter follows it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kilvo/sensors/time.hpp"

namespace kilvo::lab {

class RateOffset {
 public:
  RateOffset();

  /// The rate that tells the time, in time order, rad/s.
  void add_reference(Time t, const Eigen::Vector3d& rate);
  /// What the other one may have been at its time t, in the same axes: a gyroscope's rate, or that of each foot, of which one stands.
  void add(Time t, std::span<const Eigen::Vector3d> candidates);

  /// To be added to the times of add(), s; nothing while no offset is sure. reach() at most, either way.
  std::optional<double> offset() const { return is_found_ ? std::optional(offset_) : std::nullopt; }
  static double reach() { return most * step; }  // s
  /// The larger of both rates within the last second, rad/s.
  double liveliness() const { return std::max(lively_reference_, lively_other_); }

 private:
  static constexpr double step = 0.005;     // s, of the grid
  static constexpr int most = 120;          // steps either way
  static constexpr std::size_t kept = 512;  // steps of the reference: 2.5 s
  static constexpr std::size_t most_candidates = 2;
  struct Sample {
    Time t{};
    std::size_t count = 0;
    std::array<Eigen::Vector3d, most_candidates> rate;
  };

  std::int64_t place_of(Time t) const;
  Eigen::Vector3d reference(std::int64_t place) const { return reference_[static_cast<std::size_t>(place) % kept]; }
  std::optional<Eigen::Vector3d> reference_at(Time t, Eigen::Vector3d* slope) const;
  double distance(const Sample& sample, const Eigen::Vector3d& rate, Eigen::Vector3d* difference) const;
  void try_all(const Sample& sample);
  void decide();
  void refine(const Sample& sample);

  // The reference on the grid, from its first sample on.
  std::vector<Eigen::Vector3d> reference_;
  std::optional<Time> origin_, last_reference_;
  Eigen::Vector3d last_rate_ = Eigen::Vector3d::Zero();
  std::int64_t end_ = 0;  // of the grid's places that are known
  // What waits until the reference has come far enough.
  std::vector<Sample> waiting_;
  std::size_t first_waiting_ = 0;
  std::optional<Time> last_;
  double lively_reference_ = 0, lively_other_ = 0;

  std::array<double, 2 * most + 1> squares_{};  // by offset: sum of squared differences
  double samples_ = 0;
  bool is_found_ = false;
  double offset_ = 0, variance_ = 0;  // s, s^2
  int refused_ = 0;                   // samples in a row that did not fit
  double noise_ = 0;                  // variance of a difference, each axis, (rad/s)^2
};

}  // namespace kilvo::lab
