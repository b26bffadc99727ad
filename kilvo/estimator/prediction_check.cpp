#include "kilvo/estimator/prediction_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kilvo/lidar/relocate.hpp"

namespace kilvo {
namespace {

double met(const RegistrationReport& report) { return report.matched + report.rejected; }
double share_beside(const RegistrationReport& report) { return met(report) > 0 ? report.rejected / met(report) : 0; }

// Moves a root mean square by `weight` towards that of `b`.
void average(PredictionCheck::Error& a, const PredictionCheck::Error& b, double weight) {
  a.turned = std::sqrt((1 - weight) * a.turned * a.turned + weight * b.turned * b.turned);
  a.moved = std::sqrt((1 - weight) * a.moved * a.moved + weight * b.moved * b.moved);
}

}  // namespace

bool PredictionCheck::contradicts(const Registration& sweep) const {
  constexpr int enough = 10;                      // sweeps
  constexpr double clearly = 0.1, by_chance = 4;  // -, standard deviations
  if (gives_up() || sweeps_ < enough || sweep.refused || sweep.searched || met(sweep.report) == 0) return false;
  return share_beside(sweep.report) > share_ + std::max(clearly, by_chance * std::sqrt(share_ * (1 - share_) / met(sweep.report)));
}

PredictionCheck::Surprise PredictionCheck::surprise(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error) {
  const int expected = std::exchange(expected_sweeps_, 0);
  const bool was_surprised = std::exchange(surprised_, false);
  if (sweep.refused || !sweep.carries || sweep.searched || sweep.report.matched == 0) return Surprise::none;
  const double change = LidarPipeline::squared_change(prior, sweep, map_error);
  constexpr double unusual = 8, memory = 50;  // -, sweeps
  const bool out = change > std::max(LidarPipeline::agreeing_change, unusual * usual_change_);
  usual_change_ += (std::min(change, LidarPipeline::agreeing_change) - usual_change_) / memory;
  if (!out) expected_sweeps_ = expected + 1;
  constexpr int before = 5;  // sweeps
  surprised_ = out && !gives_up() && (was_surprised || expected >= before);
  return !surprised_ ? Surprise::none : was_surprised ? Surprise::again : Surprise::first;
}

Estimate PredictionCheck::released(const Estimate& prior) {
  constexpr double part = 0.7;  // of what would be searched for
  Estimate out = prior;
  out.P.diagonal().segment<3>(at::R).array() += std::pow(part * well_known_rotation, 2);
  out.P.diagonal().segment<3>(at::p).array() += std::pow(part * well_known_position, 2);
  return out;
}

bool PredictionCheck::explains(const Registration& again, const Registration& sweep) const {
  const double left = share_beside(again.report) - share_, before = share_beside(sweep.report) - share_;
  return !again.refused && again.carries && left < 0.5 * before && again.report.matched > sweep.report.matched;
}

PredictionCheck::Error PredictionCheck::error_between(const State& predicted, const State& found) {
  const Eigen::Matrix<double, 6, 1> change = boxminus(found, predicted).head<6>();
  return {change.head<3>().norm(), change.tail<3>().norm()};
}

void PredictionCheck::begin(const Error& off) {
  const Error before = error_.value_or(Error{});
  error_ = {std::max(before.turned, off.turned), std::max(before.moved, off.moved)};
  sweeps_with_error_ = 0;
  begun_ += 1;
  if (gives_up()) error_.reset();
}

void PredictionCheck::learn(const State& predicted, const Registration& sweep) {
  constexpr int remembered_errors = 5;  // sweeps
  constexpr double as_usual = 2;
  if (error_) ++sweeps_with_error_;
  if (sweep.searched || !sweep.carries || met(sweep.report) == 0) return;
  sweeps_ = std::min(sweeps_ + 1, remembered);
  const double weight = 1.0 / sweeps_;
  if (!gives_up()) begun_ -= begun_ / remembered;
  share_ += weight * (share_beside(sweep.report) - share_);
  const Error change = error_between(predicted, sweep.posterior.x);
  if (!error_) return average(usual_, change, weight);
  average(*error_, change, 1.0 / remembered_errors);
  if (error_->turned > as_usual * usual_.turned || error_->moved > as_usual * usual_.moved) return;
  error_.reset();
  sweeps_with_error_ = 0;
}

}  // namespace kilvo
