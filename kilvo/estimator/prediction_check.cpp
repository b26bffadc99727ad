#include "kilvo/estimator/prediction_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kilvo/lidar/relocate.hpp"

namespace kilvo {
namespace {

double met(const RegistrationReport& report) { return report.matched + report.rejected; }
double share_beside(const RegistrationReport& report) { return met(report) > 0 ? report.rejected / met(report) : 0; }

Estimate inflated(Estimate prior, double rotation, double position) {
  prior.P.diagonal().segment<3>(at::R).array() += rotation * rotation;
  prior.P.diagonal().segment<3>(at::p).array() += position * position;
  return prior;
}

bool measures(const Registration& sweep) { return !sweep.refused && sweep.carries && met(sweep.report) > 0; }

}  // namespace

bool PredictionCheck::lies_beside(const RegistrationReport& report) const {
  constexpr double clearly = 0.1, by_chance = 4;  // -, standard deviations
  return share_beside(report) > share_ + std::max(clearly, by_chance * std::sqrt(share_ * (1 - share_) / met(report)));
}

bool PredictionCheck::contradicts(const Registration& sweep) const {
  if (sweep.refused) return sweep.refused == Reason::fits_nowhere;
  return !gives_up() && sweeps_ >= 2 * enough && !sweep.searched && met(sweep.report) > 0 && lies_beside(sweep.report);
}

bool PredictionCheck::is_unusual(double change) const {
  constexpr double unusual = 8;
  return change > std::max(LidarPipeline::agreeing_change, unusual * usual_change_);
}

PredictionCheck::Surprise PredictionCheck::surprise(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error,
                                                    bool rejoins) {
  const int before = std::exchange(in_a_row_, 0);
  const bool was_surprised = std::exchange(surprised_, false);
  if (error_ || rejoins || !measures(sweep) || sweep.searched) return Surprise::none;
  const double change = LidarPipeline::squared_change(prior, sweep, map_error);
  const bool out = is_unusual(change);
  usual_change_ += (std::min(change, LidarPipeline::agreeing_change) - usual_change_) / remembered;
  if (!out) in_a_row_ = std::max(before, 0) + 1;
  if (!out || gives_up()) return Surprise::none;
  in_a_row_ = std::min(before, 0) - 1;
  constexpr int too_many = 3;  // sweeps
  if (in_a_row_ <= -too_many || was_surprised) return Surprise::again;
  surprised_ = before >= enough;
  return surprised_ ? Surprise::first : Surprise::none;
}

Estimate PredictionCheck::released(const Estimate& prior) { return inflated(prior, 0.7 * well_known_rotation, 0.7 * well_known_position); }

Estimate PredictionCheck::lost(const Estimate& prior) const {
  // A search goes to three standard deviations: all round, and to 2 m on the level.
  if (contradicted_sweeps_ + 1 >= enough - 1) return inflated(prior, std::numbers::pi / 3, 2.0 / 3);
  return inflated(prior, 3 * well_known_rotation, 3 * well_known_position);
}

bool PredictionCheck::explains(const Registration& again, const Registration& sweep) const {
  if (again.refused || !again.carries || again.report.matched <= sweep.report.matched || lies_beside(again.report)) return false;
  return sweep.refused || share_beside(again.report) - share_ < 0.5 * (share_beside(sweep.report) - share_);
}

PredictionCheck::Error PredictionCheck::error_between(const State& predicted, const State& found) {
  const Eigen::Matrix<double, 6, 1> change = boxminus(found, predicted).head<6>();
  return {change.head<3>().norm(), change.tail<3>().norm()};
}

bool PredictionCheck::is_small(const Error& off) {
  constexpr double small = 0.3;  // of what the nearest planes bear
  return off.turned < small * well_known_rotation && off.moved < small * well_known_position;
}

bool PredictionCheck::is_far(const Error& off) { return off.turned > 9 * well_known_rotation || off.moved > 9 * well_known_position; }

void PredictionCheck::begin(Time t, const Error& off) {
  if (!error_) {
    recurred_ = recurs();
    since_ = t;
    doubted_sweeps_ = 0;
  }
  // What has grown over some sweeps is not the error of the next one, and no search goes farther.
  constexpr double most = 2;  // of what the nearest planes bear
  const Error before = error_.value_or(Error{});
  error_ = {std::max(before.turned, std::min(off.turned, most * well_known_rotation)),
            std::max(before.moved, std::min(off.moved, most * well_known_position))};
  sweeps_with_error_ = agreeing_sweeps_ = 0;
  begun_ += 1;
  if (gives_up()) error_.reset();
}

void PredictionCheck::learn(const Estimate& prior, const Registration& sweep, const PoseCovariance& map_error) {
  if (contradicts(sweep)) {
    ++contradicted_sweeps_;
  } else if (measures(sweep)) {
    contradicted_sweeps_ = 0;
  }
  if (!measures(sweep)) return;
  if (error_) {
    ++sweeps_with_error_;
    lasted_ = sweep.posterior.t - since_;
    const Error off = error_between(prior.x, sweep.posterior.x);
    // A search may have found another place: then predictions were not off by more.
    const auto follow = [&sweep](double& rms, double now) {
      if (sweep.searched || sweep.unpredicted) now = std::min(now, rms);
      rms = std::sqrt(rms * rms + (now * now - rms * rms) / enough);
    };
    follow(error_->turned, off.turned);
    follow(error_->moved, off.moved);
    const bool out = is_unusual(LidarPipeline::squared_change(prior, sweep, map_error));
    doubted_sweeps_ = std::min(doubted_sweeps_ + 1, remembered);
    unusual_share_ += ((out ? 1 : 0) - unusual_share_) / doubted_sweeps_;
    // A prior that is uncertain for the doubt before agrees with anything.
    agreeing_sweeps_ = out || !is_small(off) ? 0 : agreeing_sweeps_ + 1;
    if (agreeing_sweeps_ >= (recurred_ ? remembered : enough)) error_.reset();
  }
  if (sweep.searched) return;
  sweeps_ = std::min(sweeps_ + 1, remembered);
  if (!gives_up()) begun_ -= begun_ / remembered;
  share_ += (share_beside(sweep.report) - share_) / sweeps_;
}

}  // namespace kilvo
