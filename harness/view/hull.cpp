#include "harness/view/hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// Indices of points that are apart, in order.
std::vector<int> Distinct(const Points& points, double tolerance) {
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const bool is_new = std::ranges::none_of(
        kept, [&](int k) { return (points[k] - points[i]).norm() <= tolerance; });
    if (is_new) kept.push_back(i);
  }
  return kept;
}

/// The point of `among` for which `measure` is largest.
template <class Measure>
int Farthest(const std::vector<int>& among, Measure measure) {
  return *std::ranges::max_element(among, {}, measure);
}

/// The hull of points in a plane, counter-clockwise about `normal` (Andrew's monotone chain).
std::vector<int> Polygon(const Points& points, std::vector<int> order, const Vector3d& along,
                         const Vector3d& normal) {
  const Vector3d x = along.normalized(), y = normal.cross(x).normalized();
  const auto at = [&](int i) { return Eigen::Vector2d(points[i].dot(x), points[i].dot(y)); };
  std::ranges::sort(order, [&](int a, int b) {
    const Eigen::Vector2d p = at(a), q = at(b);
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  std::vector<int> hull;
  const auto add = [&](int i, std::size_t least) {
    while (hull.size() > least) {
      const Eigen::Vector2d a = at(hull[hull.size() - 2]), b = at(hull.back()), c = at(i);
      if ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0.0) break;
      hull.pop_back();
    }
    hull.push_back(i);
  };
  for (const int i : order) add(i, 1);
  const std::size_t lower = hull.size();
  for (auto i = order.rbegin() + 1; i != order.rend(); ++i) add(*i, lower);
  hull.pop_back();
  return hull;
}

/// All triples that have every point on one side.
std::vector<std::vector<int>> Triangles(const Points& points, const std::vector<int>& kept,
                                        double tolerance) {
  std::vector<std::vector<int>> faces;
  const std::size_t n = kept.size();
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      for (std::size_t c = b + 1; c < n; ++c) {
        const Vector3d normal =
            (points[kept[b]] - points[kept[a]]).cross(points[kept[c]] - points[kept[a]]);
        if (normal.norm() <= tolerance * tolerance) continue;
        bool above = false, below = false;
        for (const int i : kept) {
          const double height = normal.normalized().dot(points[i] - points[kept[a]]);
          above = above || height > tolerance;
          below = below || height < -tolerance;
        }
        if (!(above && below)) faces.push_back({kept[a], kept[b], kept[c]});
      }
    }
  }
  return faces;
}

}  // namespace

std::vector<std::vector<int>> HullFaces(const Points& points, double tolerance) {
  const std::vector<int> kept = Distinct(points, tolerance);
  if (kept.size() < 2) return {};
  const Vector3d& origin = points[kept.front()];
  const int far = Farthest(kept, [&](int i) { return (points[i] - origin).norm(); });
  const int other = Farthest(kept, [&](int i) { return (points[i] - points[far]).norm(); });
  const Vector3d along = points[other] - points[far];
  const auto off_line = [&](int i) {
    return along.normalized().cross(points[i] - points[far]).norm();
  };
  const int aside = Farthest(kept, off_line);
  if (off_line(aside) <= tolerance) return {{std::min(far, other), std::max(far, other)}};
  const Vector3d normal = along.cross(points[aside] - points[far]).normalized();
  const bool flat = std::ranges::all_of(
      kept, [&](int i) { return std::abs(normal.dot(points[i] - points[far])) <= tolerance; });
  if (flat) return {Polygon(points, kept, along, normal)};
  constexpr std::size_t kMost = 24;
  return kept.size() > kMost ? std::vector<std::vector<int>>() : Triangles(points, kept, tolerance);
}

}  // namespace loopbench::harness
