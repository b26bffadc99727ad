#include "kilvo/legs/standing_rate.hpp"

#include <algorithm>
#include <cmath>

#include "kilvo/sensors/time.hpp"

namespace kilvo {
namespace {

constexpr double block = 0.1;         // s
constexpr double sure_of_both = 0.9;  // probability of each foot, throughout
constexpr std::size_t shortest = 15;  // blocks of a line
constexpr std::size_t settling = 5;   // blocks: a stand settles for any number of these first
// White noise of the gyro over half a second, rad/s: it is in the angle's slope and not beside its line.
constexpr double white = 3e-4, white_time = 0.5;
// Prior of the sway of a standing body, rad, with the weight of so many angles.
constexpr double usual_sway = 1e-3, usual_count = 2;
constexpr double hidden = 0.5;  // of a turn, by compliance of soles and joints
// A larger sigma is the beginning of a walk, or sway slower than the standing phase, rad/s.
constexpr double largest_sigma = 1e-3;

}  // namespace

void StandingRate::begin_block(const Feet& feet) {
  begin_ = feet.t;
  for (std::size_t side = 0; side < 2; ++side) R_IF_[side] = feet.foot[side].R_IF;
  turned_.setZero();
}

void StandingRate::close_block(const Feet& feet) {
  const Angles& before = angles_[count_ - 1];
  const Eigen::Vector3d left = (R_IF_[0] * feet.foot[0].R_IF.inverse()).Log(), right = (R_IF_[1] * feet.foot[1].R_IF.inverse()).Log();
  const Eigen::Vector3d soles = 0.5 * (left + right);
  angles_[count_] = {before.time + to_seconds(feet.t - begin_), before.beyond + turned_ - soles, before.soles + soles,
                     before.apart + 0.5 * (left - right)};
  ++count_;
  begin_block(feet);
}

// The line through the angles from `first` on.
GyroBiasReading StandingRate::line(std::size_t first) const {
  const auto n = static_cast<double>(count_ - first);
  double time = 0, squares = 0;
  Eigen::Vector3d beyond = Eigen::Vector3d::Zero(), products = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero(),
                  apart = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < count_; ++i) {
    time += angles_[i].time / n;
    beyond += angles_[i].beyond / n;
  }
  for (std::size_t i = first; i < count_; ++i) {
    const double since = angles_[i].time - time;
    squares += since * since;
    products += since * (angles_[i].beyond - beyond);
    turn += since * angles_[i].soles;
    apart += since * angles_[i].apart;
  }
  GyroBiasReading out;
  out.bias = products / squares;
  // Of first order: how much an angle beside the line is like the one before it.
  double beside = 0, together = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < count_; ++i) {
    const Eigen::Vector3d off = angles_[i].beyond - beyond - (angles_[i].time - time) * out.bias;
    beside += off.squaredNorm();
    together += off.dot(before);
    before = off;
  }
  const double alike = std::clamp(together / std::max(beside, 1e-12), 0.0, 0.95);
  const double variance = (beside + usual_count * usual_sway * usual_sway) / (3 * (n - 2) + usual_count);
  // Compliant soles hide a part of a turn; their disagreement is a lower bound of it.
  const double unseen2 = (hidden * hidden * turn.squaredNorm() + apart.squaredNorm()) / (squares * squares);
  const double white2 = white * white * white_time / (angles_[count_ - 1].time - angles_[first].time);
  out.sigma = std::sqrt(variance * (1 + alike) / (1 - alike) / squares + unseen2 + white2);
  return out;
}

// Of the lines without the settling, the one with the smallest sigma; and of that, the information that is new.
std::optional<GyroBiasReading> StandingRate::news() {
  if (count_ < shortest || count_ % settling != 0) return std::nullopt;  // seldom, since many lines take their time
  GyroBiasReading best = line(0);
  for (std::size_t first = settling; first + shortest <= count_; first += settling) {
    const GyroBiasReading shorter = line(first);
    if (shorter.sigma < best.sigma) best = shorter;
  }
  constexpr double more = 1.3;
  const double known = 1 / (best.sigma * best.sigma), said = said_.sigma > 0 ? 1 / (said_.sigma * said_.sigma) : 0;
  if (best.sigma > largest_sigma || known < more * said) return std::nullopt;
  GyroBiasReading out;
  out.bias = (known * best.bias - said * said_.bias) / (known - said);
  out.sigma = 1 / std::sqrt(known - said);
  said_ = best;
  return out;
}

std::optional<GyroBiasReading> StandingRate::add(const Feet& feet, const Contacts& contacts, const Eigen::Vector3d& gyro) {
  // A foot of which only a point is known does not show how the body turns.
  constexpr int fewest_corners = 3;
  const bool stands = contacts.probability[0] > sure_of_both && contacts.probability[1] > sure_of_both &&
                      feet.foot[0].corners >= fewest_corners && feet.foot[1].corners >= fewest_corners;
  const double dt = stands_ ? to_seconds(feet.t - last_) : 0;
  last_ = feet.t;
  const bool goes_on = stands && stands_ && dt <= to_seconds(least_silence) && count_ < most;
  stands_ = stands;
  if (!stands) return std::nullopt;
  if (!goes_on) {
    angles_[0] = {};
    count_ = 1;
    said_ = {};
    begin_block(feet);
    return std::nullopt;
  }
  turned_ += dt * gyro;
  if (to_seconds(feet.t - begin_) < block) return std::nullopt;
  close_block(feet);
  return news();
}

}  // namespace kilvo
