// A scale of a figure: its range, the places of values on it, and its ticks.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace loopbench::harness {

/// Numbers as all figures have them: plain from 0.01 to 99999, else with powers of ten, "2.5·10⁻⁶".
std::string NumberText(double value);

/// From `low` to `high`, which are positive on a logarithmic one.
struct Axis {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;

  bool CanShow(double value) const { return std::isfinite(value) && (!logarithmic || value > 0.0); }
  /// 0 at `low` and 1 at `high`.
  double Place(double value) const { return (On(value) - On(low)) / (On(high) - On(low)); }

 private:
  double On(double value) const { return logarithmic ? std::log(value) : value; }
};

/// Grows around values, to an axis with room beside them.
class AxisRange {
 public:
  explicit AxisRange(bool logarithmic) : logarithmic_(logarithmic) {}

  void Include(double value) {
    if (!Axis{.logarithmic = logarithmic_}.CanShow(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  /// `margin` is a fraction of the extent. Values that agree in their first digits still get a
  /// range that three digits can express.
  Axis WithMargin(double margin) const;

 private:
  bool logarithmic_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

struct Tick {
  double at = 0.0;
  std::string label;  ///< "" for a small one
};

/// About `most` labelled ticks and the small ones between them. A logarithmic axis with three
/// powers of ten has these, a shorter one 1, 2 and 5 or other digits of each decade. A linear axis
/// has multiples of 1, 2 or 5 of a power of ten.
std::vector<Tick> Ticks(const Axis& axis, int most);

}  // namespace loopbench::harness
