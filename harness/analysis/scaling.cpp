#include "harness/analysis/scaling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace loopbench::harness {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// (log size, mean log cost), by growing size.
std::vector<std::pair<double, double>> LogPoints(std::span<const double> sizes,
                                                 std::span<const double> costs) {
  std::map<double, std::pair<double, int>> sums;
  for (std::size_t i = 0; i < std::min(sizes.size(), costs.size()); ++i) {
    const double x = std::log(sizes[i]), y = std::log(costs[i]);
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    auto& [sum, count] = sums[x];
    sum += y;
    ++count;
  }
  std::vector<std::pair<double, double>> points;
  for (const auto& [x, sum] : sums) points.emplace_back(x, sum.first / sum.second);
  return points;
}

}  // namespace

PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs) {
  const auto points = LogPoints(sizes, costs);
  PowerFit fit;
  fit.sizes = static_cast<int>(points.size());
  if (points.size() < 2) {
    fit.smallest = fit.largest = points.empty() ? kNaN : std::exp(points[0].first);
    fit.exponent = fit.standard_error = fit.coefficient = fit.slope_min = fit.slope_max = kNaN;
    return fit;
  }
  fit.smallest = std::exp(points.front().first);
  fit.largest = std::exp(points.back().first);
  const double n = static_cast<double>(points.size());
  double x_mean = 0.0, y_mean = 0.0, xx = 0.0, xy = 0.0, rest = 0.0;
  for (const auto& [x, y] : points) {
    x_mean += x / n;
    y_mean += y / n;
  }
  for (const auto& [x, y] : points) {
    xx += (x - x_mean) * (x - x_mean);
    xy += (x - x_mean) * (y - y_mean);
  }
  fit.exponent = xy / xx;
  fit.coefficient = std::exp(y_mean - fit.exponent * x_mean);
  fit.slope_min = std::numeric_limits<double>::infinity();
  fit.slope_max = -fit.slope_min;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [x, y] = points[i];
    const double residual = y - y_mean - fit.exponent * (x - x_mean);
    rest += residual * residual;
    if (i == 0) continue;
    const double slope = (y - points[i - 1].second) / (x - points[i - 1].first);
    fit.slope_min = std::min(fit.slope_min, slope);
    fit.slope_max = std::max(fit.slope_max, slope);
  }
  fit.standard_error = points.size() > 2 ? std::sqrt(rest / (n - 2.0) / xx) : kNaN;
  return fit;
}

}  // namespace loopbench::harness
