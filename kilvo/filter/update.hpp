// The only Kalman update: iterated, on the manifold, in covariance form (paper, Eqs. 9-10 and the sequential ones; for the Jacobian
// of the prior: He, Xu, Zhang, "Kalman filters on differentiable manifolds", 2021). Neither the prior covariance nor the information
// of the measurement is inverted, so both may be singular: a pose that is known, a direction that nobody measures.
#pragma once

#include <tuple>

#include "kilvo/filter/gain.hpp"
#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/math/field.hpp"

namespace kilvo {

struct UpdateConfig {
  int max_iterations = 5;
  double rotation_step = 5e-5;  // rad
  double position_step = 2e-4;  // m
  int min_iterations = 1;       // of a model that is coarse at first; no setting

  static constexpr auto fields() {
    return std::tuple{Field{"max_iterations", &UpdateConfig::max_iterations, "-", "iterations of one update at most"},
                      Field{"rotation_step", &UpdateConfig::rotation_step, "rad", "an update has converged when its step turns by less"},
                      Field{"position_step", &UpdateConfig::position_step, "m", "and moves by less"}};
  }
};

struct Update {
  Estimate posterior;
  int iterations = 0;
  bool converged = false;
  int rows = 0;  // after reduction; 0: nothing was measured and the posterior is the prior
};

/// P seen in the tangent space of an iterate whose rotation is `turned` (rad) away from the prior's: J^-1 P J^-T.
inline Covariance seen_at_iterate(const Covariance& P, const Eigen::Vector3d& turned) {
  if (turned.isZero(0)) return P;
  const Eigen::Matrix3d J_inverse = right_jacobian(turned);
  Covariance Q = P;
  Q.middleRows<3>(at::R) = J_inverse * P.middleRows<3>(at::R);
  Q.middleCols<3>(at::R) = (Q.middleCols<3>(at::R) * J_inverse.transpose()).eval();
  Q.triangularView<Eigen::StrictlyUpper>() = Q.transpose();
  return Q;
}

/// `model(iterate, prior covariance)` returns Information<N> (many rows) or Rows<N> (few rows) about the iterate. It may associate and
/// gate anew at each iterate. `shared`: how the error of the prior's pose goes with noise of the pose that is common to all rows (and is
/// in the model's R already), where what made the one made the other as well. `kept`: where the last step's gain is left.
template <class Model>
Update update(const Estimate& prior, Model&& model, const UpdateConfig& config, const PoseCovariance* shared = nullptr,
              Gain<most_rows_of<Model>>* kept = nullptr) {
  Update out;
  out.posterior.t = prior.t;
  State x = prior.x;
  ErrorVector e = ErrorVector::Zero();  // x [-] prior.x; J^-1 e = e, since Jr(e_R) e_R = e_R
  Covariance seen;
  Eigen::Vector3d turned;
  Gain<most_rows_of<Model>> own;
  Gain<most_rows_of<Model>>& gain = kept != nullptr ? *kept : own;
  for (int k = 1; k <= config.max_iterations; ++k) {
    const auto measured = model(static_cast<const State&>(x), prior.P);
    const auto& rows = as_rows(measured);
    const auto count = rows.r.size();
    if (count == 0) return {prior, k, false, 0};

    turned = e.segment<3>(at::R);
    const Covariance& P = turned.isZero(0) ? prior.P : (seen = seen_at_iterate(prior.P, turned));
    gain.project(P, rows);
    if (shared != nullptr) {
      // The rows measure x plus that noise: P H' + C and S + H C + C' H'. Of S the lower triangle counts.
      const auto C = (*shared * rows.H.template leftCols<6>().transpose()).eval();
      const auto HC = (rows.H.template leftCols<6>() * C).eval();
      gain.S() += HC + HC.transpose();
      gain.W().template topRows<6>() += C;
    }
    if (!gain.factor()) return {prior, k, false, 0};
    const ErrorVector d = gain.step(rows, e);

    x = boxplus(x, d);
    e = boxminus(x, prior.x);
    out.iterations = k;
    out.rows = static_cast<int>(count);
    out.converged = k >= config.min_iterations && d.segment<3>(at::R).norm() < config.rotation_step &&
                    d.segment<3>(at::p).norm() < config.position_step;
    if (out.converged || k == config.max_iterations) {
      gain.reduce(P, out.posterior.P);
      break;
    }
  }
  out.posterior.x = x;
  return out;
}

}  // namespace kilvo
