#include "harness/figures/drawn_points.h"

#include <algorithm>
#include <cmath>

namespace loopbench::harness {
namespace {

double DistanceToSegment(const Point& point, const Point& from, const Point& to) {
  const double dx = to.first - from.first, dy = to.second - from.second;
  const double length = dx * dx + dy * dy;
  const double along =
      length > 0.0
          ? std::clamp(
                ((point.first - from.first) * dx + (point.second - from.second) * dy) / length, 0.0,
                1.0)
          : 0.0;
  return std::hypot(point.first - from.first - along * dx, point.second - from.second - along * dy);
}

std::vector<Point> Placed(const PlotArea& area, std::span<const Point> points) {
  std::vector<Point> placed;
  for (const Point& point : points) placed.push_back(area.Place(point));
  return placed;
}

/// Whether all points lie on the line, or on its points; both in places.
bool LieOn(std::span<const Point> points, std::span<const Point> line, bool joined) {
  constexpr double kDistance = kDrawnWidth;
  return std::ranges::all_of(points, [&](const Point& point) {
    auto at = std::ranges::lower_bound(line, point.first - kDistance, {}, &Point::first);
    if (at != line.begin()) --at;
    for (; at != line.end() && at->first <= point.first + kDistance; ++at) {
      const auto next = !joined || at + 1 == line.end() ? at : at + 1;
      if (DistanceToSegment(point, *at, *next) <= kDistance) return true;
    }
    return false;
  });
}

}  // namespace

std::vector<Point> Decimated(const PlotArea& area, std::span<const Point> points) {
  std::vector<Point> kept;
  for (std::size_t begin = 0; begin < points.size();) {
    const auto column = [&](std::size_t i) {
      return std::floor(3.0 * area.Place(points[i]).first / kDrawnWidth);
    };
    std::size_t end = begin + 1, low = begin, high = begin;
    for (; end < points.size() && column(end) == column(begin); ++end) {
      if (points[end].second < points[low].second) low = end;
      if (points[end].second > points[high].second) high = end;
    }
    std::size_t last = points.size();
    for (const std::size_t i : {begin, std::min(low, high), std::max(low, high), end - 1}) {
      if (i != last) kept.push_back(points[i]);
      last = i;
    }
    begin = end;
  }
  return kept;
}

bool Coincide(const PlotArea& area, std::span<const Point> one, std::span<const Point> other,
              bool joined) {
  if (one.empty() || other.empty()) return false;
  const std::vector<Point> a = Placed(area, one), b = Placed(area, other);
  return LieOn(a, b, joined) && LieOn(b, a, joined);
}

}  // namespace loopbench::harness
