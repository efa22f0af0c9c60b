// What of a curve's points is drawn, and which curves are drawn as one.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "harness/figures/axis.h"

namespace loopbench::harness {

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

/// The width of a curve [pt], a third of a millimetre: what is nearer cannot be told apart.
inline constexpr double kDrawnWidth = 1.0;

/// Of each column as wide as a third of a curve the first and the last point, the lowest and the
/// highest: what is left out lies between points that are kept. Points need not be in order of x.
std::vector<Point> Decimated(const PlotArea& area, std::span<const Point> points);

/// Whether every point of each lies within a drawn width of the other's line, or of its points if
/// no line joins them. Points in the order of x.
bool Coincide(const PlotArea& area, std::span<const Point> one, std::span<const Point> other,
              bool joined = true);

}  // namespace loopbench::harness
