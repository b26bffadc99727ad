// Axes that are exchanged or reversed.
#include <string>
#include <vector>

#include "lab/doctor/translation_fit.hpp"

namespace kilvo::lab {

std::vector<Eigen::Matrix3d> signed_permutations() {
  constexpr int orders[6][3] = {{0, 1, 2}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}};
  std::vector<Eigen::Matrix3d> out;
  for (const auto& order : orders) {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i) m(i, order[i]) = (signs >> i & 1) != 0 ? -1 : 1;
      out.push_back(m);
    }
  }
  return out;
}

Eigen::Matrix3d nearest_permutation(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double most = -1e9;
  for (const Eigen::Matrix3d& p : signed_permutations()) {
    const double likeness = p.cwiseProduct(m).sum();
    if (likeness > most + 1e-9) {
      most = likeness;
      best = p;
    }
  }
  return best;
}

std::string axes_text(const Eigen::Matrix3d& permutation) {
  std::string out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (permutation(i, j) == 0) continue;
      out += (out.empty() ? "" : " ");
      out += permutation(i, j) > 0 ? '+' : '-';
      out += "xyz"[j];
    }
  }
  return out;
}

}  // namespace kilvo::lab
