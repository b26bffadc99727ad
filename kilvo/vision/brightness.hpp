// The brightness of an image as a consensus of many patches.
#pragma once

#include <vector>

namespace kilvo {

/// The upper one of two in the middle. Of at least one value.
double median_of(std::vector<double> values);

/// Logarithms of brightness ratios, most of which differ by little; the others show something else, at any distance.
/// The maximum of their likelihood with tails of inverse squares: a median follows when a third of them lie on one side, as in a walk.
struct Brightness {
  double log = 0;
  double spread = 0;  // of one patch
  double sigma = 0;   // of log

  /// Factor on the variance of a ratio `other` against one that agrees.
  double doubt(double other) const;
};

/// Of at least one ratio.
Brightness brightness_of(std::vector<double> logs);

}  // namespace kilvo
