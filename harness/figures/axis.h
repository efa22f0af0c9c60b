// Axes, and the points that are drawn along them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace loopbench::harness {

// Scale of a figure: its range, the positions of values on it, and its ticks.

/// Formats a number for figures: plain from 0.01 to 99999, else with powers of ten, "2.5·10⁻⁶".
std::string NumberText(double value);

/// Axis from `low` to `high`; both are positive on a logarithmic axis.
struct Axis {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;

  bool CanShow(double value) const { return std::isfinite(value) && (!logarithmic || value > 0.0); }
  /// Returns the position of a value: 0 at `low` and 1 at `high`.
  double Place(double value) const { return (On(value) - On(low)) / (On(high) - On(low)); }

 private:
  double On(double value) const { return logarithmic ? std::log(value) : value; }
};

/// Range that grows to contain values, and gives an axis with a margin.
class AxisRange {
 public:
  explicit AxisRange(bool logarithmic) : logarithmic_(logarithmic) {}

  void Include(double value) {
    if (!Axis{.logarithmic = logarithmic_}.CanShow(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  /// Returns the axis from the least to the largest value.
  Axis Exact() const { return {low_, high_, logarithmic_}; }
  /// Returns the axis. `margin` is a fraction of the extent. Values that agree in their first
  /// digits still get a range that three digits can express.
  Axis WithMargin(double margin) const;

 private:
  bool logarithmic_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

struct Tick {
  double at = 0.0;
  std::string label;  ///< "" for a small tick
};

/// Returns about `most` labelled ticks and the small ones between them. A logarithmic axis with
/// three powers of ten has these. A shorter one has 1, 2 and 5 or other digits of each decade. A
/// linear axis has multiples of 1, 2 or 5 of a power of ten.
std::vector<Tick> Ticks(const Axis& axis, int most);

// Reduction of the points of curves, and curves that are drawn as one.

/// A place in a drawing [pt], or a pair of values.
using Point = std::pair<double, double>;

/// Two axes and the size of the rectangle that they span [pt].
struct PlotArea {
  Axis x, y;
  double width = 0.0, height = 0.0;

  bool CanShow(const Point& point) const {
    return x.CanShow(point.first) && y.CanShow(point.second);
  }
  Point Place(const Point& point) const {
    return {width * x.Place(point.first), height * y.Place(point.second)};
  }
};

/// Width of a curve [pt], a third of a millimetre: closer features cannot be distinguished.
inline constexpr double kDrawnWidth = 1.0;

/// Returns the first, last, lowest and highest point of each column that is a third of a curve
/// wide. Omitted points lie between kept ones. Points need not be in order of x.
std::vector<Point> Decimated(const PlotArea& area, std::span<const Point> points);

/// True if every point of each curve lies within a drawn width of the other's line, or of its
/// points if no line joins them. Points are in the order of x.
bool Coincide(const PlotArea& area, std::span<const Point> one, std::span<const Point> other,
              bool joined = true);

}  // namespace loopbench::harness
