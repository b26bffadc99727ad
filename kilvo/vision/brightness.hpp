// What many patches say together of how bright an image is.
#pragma once

#include <vector>

namespace kilvo {

/// The upper one of two in the middle. Of at least one value.
double median_of(std::vector<double> values);

/// Logarithms of brightness ratios, most of which differ by little; the others show something else, and how far off they are says nothing.
/// The maximum of their likelihood with tails of inverse squares: a median follows when a third of them lie on one side, and those along
/// the way a robot goes do.
struct Brightness {
  double log = 0;
  double spread = 0;  // of one patch
  double sigma = 0;   // of log

  /// How much less one that says `other` is worth than one that agrees: a factor of its variance.
  double doubt(double other) const;
};

/// Of at least one ratio.
Brightness brightness_of(std::vector<double> logs);

}  // namespace kilvo
