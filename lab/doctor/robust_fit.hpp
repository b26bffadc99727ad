// Least squares over rows with outliers: Gauss-Newton with Cauchy's weights, the scale learnt from the rows themselves, and a covariance
// from the scatter of blocks of rows (which may depend on each other within a block). A. C. Cameron, D. L. Miller, "A practitioner's guide
// to cluster-robust inference", 2015.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace kilvo::lab {

/// Residuals of groups of rows (a group is weighed as one), and the block in time that each group belongs to.
struct Residuals {
  int width = 3;           // rows of a group
  std::vector<double> r;   // width * groups
  std::vector<int> block;  // per group, not decreasing
  void clear() {
    r.clear();
    block.clear();
  }
  std::size_t groups() const { return block.size(); }
};

struct Fit {
  bool good = false;  // enough rows, a solution within its steps
  Eigen::VectorXd x;
  Eigen::MatrixXd cov;                   // of x, from the scatter of the blocks
  Eigen::VectorXd growth_without_prior;  // factor by which each of x, and its standard deviation, would grow if it alone had no prior
  double scale = 0;                      // robust standard deviation of one row
  double cost = 0;                       // mean of log(1 + |r|^2 / s^2) at the scale that was given, for comparisons
  std::size_t groups = 0;
  double sigma(int i) const;
};

using ResidualFunction = std::function<void(const Eigen::VectorXd&, Residuals&)>;
/// Of each row by each parameter.
using Derivatives = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// At a place at which the residuals have just been taken; the derivatives have their size already.
using DerivativeFunction = std::function<void(const Eigen::VectorXd&, Derivatives&)>;

/// `prior_sigma`: of each parameter about its value at the start (infinite: none). `step`: for derivatives by differences, where there is
/// no `derivative`, and for the end of the search.
Fit robust_fit(const ResidualFunction& residuals, const Eigen::VectorXd& start, const Eigen::VectorXd& prior_sigma,
               const Eigen::VectorXd& step, int iterations = 12, const DerivativeFunction& derivative = nullptr);

/// The middle one, of an even number the upper; 0 of none.
double median_of(std::vector<double> x);
/// Robust standard deviation of a row: of the median of the groups' lengths.
double scale_of(const Residuals& r);

/// Mean over groups of log(1 + |r|^2 / (width s^2)).
double cost_of(const Residuals& r, double scale);

/// What leaving out each block in turn would change: the jackknife. A few blocks that fit themselves do not look sure by it. Each block has
/// its information `H` and its gradient `g`; `H`: of all blocks and the prior.
template <class Blocks, class Matrix>
Matrix jackknife(const Blocks& blocks, const Matrix& H) {
  Matrix out = Matrix::Zero(H.rows(), H.cols());
  for (const auto& b : blocks) {
    const auto change = (H - b.H).ldlt().solve(b.g).eval();
    out += change * change.transpose();
  }
  return out;
}

}  // namespace kilvo::lab
