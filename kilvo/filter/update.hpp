// The only Kalman update: iterated, on the manifold, in covariance form (paper, Eqs. 9-10 and the sequential ones; for the Jacobian
// of the prior: He, Xu, Zhang, "Kalman filters on differentiable manifolds", 2021). Neither the prior covariance nor the information
// of the measurement is inverted, so both may be singular: a pose that is known, a direction without a measurement.
#pragma once

#include <type_traits>

#include "kilvo/filter/gain.hpp"
#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/state.hpp"
#include "kilvo/filter/update_config.hpp"

namespace kilvo {

struct Update {
  Estimate posterior;
  int iterations = 0;
  bool converged = false;
  int rows = 0;  // after reduction; 0: nothing was measured and the posterior is the prior
};

namespace detail {

/// A model without its type, so that the iteration is compiled once for each number of rows.
template <int Max>
class ModelView {
 public:
  template <class Model>
  explicit ModelView(Model& model) : model_(&model), call_(&call<Model>) {}

  Rows<Max> operator()(const State& x, const Covariance& prior) const { return call_(model_, x, prior); }

 private:
  template <class Model>
  static Rows<Max> call(const void* model, const State& x, const Covariance& prior) {
    Model& typed = *static_cast<Model*>(const_cast<void*>(model));
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(typed(x, prior))>, Rows<Max>>) {
      return typed(x, prior);
    } else {
      return as_rows(typed(x, prior));
    }
  }

  const void* model_;
  Rows<Max> (*call_)(const void*, const State&, const Covariance&);
};

/// Of most 6, 7, 12 or 14 rows; another number needs another line in update.cpp.
template <int Max>
Update iterate(const Estimate& prior, ModelView<Max> model, const UpdateConfig& config, const PoseCovariance* shared, Gain<Max>* kept);

}  // namespace detail

/// `model(iterate, prior covariance)` returns Information<N> (many rows) or Rows<N> (few rows) about the iterate. It may associate and
/// gate anew at each iterate. `shared`: how the error of the prior's pose goes with noise of the pose that is common to all rows (and is
/// in the model's R already), where what made the one made the other as well. `kept`: where the last step's gain is left.
template <class Model>
Update update(const Estimate& prior, Model&& model, const UpdateConfig& config, const PoseCovariance* shared = nullptr,
              Gain<most_rows_of<Model>>* kept = nullptr) {
  return detail::iterate<most_rows_of<Model>>(prior, detail::ModelView<most_rows_of<Model>>(model), config, shared, kept);
}

}  // namespace kilvo
