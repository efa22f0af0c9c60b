// How a cost grows with size: the exponent of cost = c size^p.
//
// Least squares of log(cost) against log(size), one point per size. Costs of real programs are not
// powers (fixed costs at small sizes, caches at large ones), so the fit comes with two spreads: the
// standard error from the residuals, and the range of slopes between neighbouring sizes.
#pragma once

#include <span>

namespace loopbench::harness {

struct PowerFit {
  int sizes = 0;                         ///< points used; below 2 everything else is NaN
  double smallest = 0.0, largest = 0.0;  ///< sizes at the ends
  double exponent = 0.0;
  double standard_error = 0.0;  ///< of the exponent; NaN with two points, which fit any line
  double coefficient = 0.0;     ///< cost at size 1 of the fitted line
  double slope_min = 0.0, slope_max = 0.0;  ///< between neighbouring sizes
};

/// Points with a size or cost that is not positive and finite are left out; of equal sizes the
/// geometric mean of their costs counts as one point.
PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs);

}  // namespace loopbench::harness
