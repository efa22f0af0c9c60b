#include "harness/trajectory/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace loopbench::harness {

std::vector<SharedColumn> SharedColumns(const Trajectory& ours, const Trajectory& theirs) {
  std::vector<SharedColumn> shared;
  for (std::size_t i = 0; i < ours.columns.size(); ++i) {
    const auto at = std::ranges::find(theirs.columns, ours.columns[i]);
    if (i == ours.time || ours.columns[i].kind.empty() || at == theirs.columns.end()) continue;
    shared.push_back({ours.columns[i].Label(), ours.columns[i].unit, i,
                      static_cast<std::size_t>(at - theirs.columns.begin())});
  }
  return shared;
}

double ValueAt(const Trajectory& ours, std::size_t column, double t) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::size_t rows = ours.rows();
  std::size_t low = 0, high = rows;  // the first row that is not before t
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (ours.At(middle, ours.time) < t ? low : high) = middle + (ours.At(middle, ours.time) < t);
  }
  // a time that was written with fewer digits is the same time
  constexpr double kSame = 1e-12;
  for (const std::size_t row : {low, low - 1}) {
    const bool is_there = row < rows;
    if (is_there && std::abs(ours.At(row, ours.time) - t) <= kSame * std::max(1.0, std::abs(t))) {
      return ours.At(row, column);
    }
  }
  if (low == 0 || low == rows) return kNaN;
  const std::size_t count = std::min<std::size_t>(4, rows);
  const std::size_t first = std::min(low < 2 ? 0 : low - 2, rows - count);
  double value = 0.0;
  for (std::size_t i = first; i < first + count; ++i) {
    double weight = 1.0;
    for (std::size_t k = first; k < first + count; ++k) {
      if (k == i) continue;
      const double own = ours.At(i, ours.time), other = ours.At(k, ours.time);
      weight *= (t - other) / (own - other);
    }
    value += weight * ours.At(i, column);
  }
  return value;
}

std::vector<double> Differences(const Trajectory& ours, const Trajectory& theirs,
                                const SharedColumn& column) {
  std::vector<double> differences;
  for (std::size_t row = 0; row < theirs.rows(); ++row) {
    const double value = ValueAt(ours, column.in_ours, theirs.At(row, theirs.time));
    const double apart = theirs.At(row, column.in_theirs) - value;
    const bool turns = column.unit == "rad";
    differences.push_back(turns ? std::remainder(apart, 2 * std::numbers::pi) : apart);
  }
  return differences;
}

}  // namespace loopbench::harness
