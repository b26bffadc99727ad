#include "kilvo/filter/update.hpp"

#include <Eigen/Dense>

namespace kilvo {
namespace {

// P seen in the tangent space of an iterate whose rotation is `turned` (rad) away from the prior's: J^-1 P J^-T.
Covariance seen_at_iterate(const Covariance& P, const Eigen::Vector3d& turned) {
  if (turned.isZero(0)) return P;
  const Eigen::Matrix3d J_inverse = right_jacobian(turned);
  Covariance Q = P;
  Q.middleRows<3>(at::R) = J_inverse * P.middleRows<3>(at::R);
  Q.middleCols<3>(at::R) = (Q.middleCols<3>(at::R) * J_inverse.transpose()).eval();
  Q.triangularView<Eigen::StrictlyUpper>() = Q.transpose();
  return Q;
}

}  // namespace

template <int Max>
Update detail::iterate(const Estimate& prior, ModelView<Max> model, const UpdateConfig& config, const PoseCovariance* shared,
                       Gain<Max>* kept) {
  Update out;
  out.posterior.t = prior.t;
  State x = prior.x;
  ErrorVector e = ErrorVector::Zero();  // x [-] prior.x; J^-1 e = e, since Jr(e_R) e_R = e_R
  Covariance seen;
  Eigen::Vector3d turned;
  Gain<Max> own;
  Gain<Max>& gain = kept != nullptr ? *kept : own;
  for (int k = 1; k <= config.max_iterations; ++k) {
    const Rows<Max> rows = model(x, prior.P);
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
    out.iterations = k;
    out.rows = static_cast<int>(count);
    out.converged = k >= config.min_iterations && d.segment<3>(at::R).norm() < config.rotation_step &&
                    d.segment<3>(at::p).norm() < config.position_step;
    if (out.converged || k == config.max_iterations) {
      gain.reduce(P, out.posterior.P);
      break;
    }
    e = boxminus(x, prior.x);
  }
  out.posterior.x = x;
  return out;
}

template Update detail::iterate<6>(const Estimate&, ModelView<6>, const UpdateConfig&, const PoseCovariance*, Gain<6>*);
template Update detail::iterate<7>(const Estimate&, ModelView<7>, const UpdateConfig&, const PoseCovariance*, Gain<7>*);
template Update detail::iterate<12>(const Estimate&, ModelView<12>, const UpdateConfig&, const PoseCovariance*, Gain<12>*);
template Update detail::iterate<14>(const Estimate&, ModelView<14>, const UpdateConfig&, const PoseCovariance*, Gain<14>*);

}  // namespace kilvo
