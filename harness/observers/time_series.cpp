#include "harness/observers/time_series.h"

#include <algorithm>
#include <cmath>

namespace loopbench::harness {

namespace {

// Which of `n` samples stay: evenly spaced, always with the last one.
std::vector<std::size_t> Kept(std::size_t n, int points) {
  const std::size_t count = std::min(n, static_cast<std::size_t>(points));
  std::vector<std::size_t> kept(count);
  for (std::size_t i = 0; i < count; ++i) kept[i] = count == n ? i : i * (n - 1) / (count - 1);
  return kept;
}

}  // namespace

TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples) {
  TimeSeries thin;
  for (const std::size_t k : Kept(std::min(samples, series.t.size()), points)) {
    thin.t.push_back(series.t[k]);
    thin.value.push_back(series.value[k]);
  }
  return thin;
}

double LargestGap(const TimeSeries& series, int points, std::size_t samples) {
  const std::vector<std::size_t> kept = Kept(samples, points);
  double gap = 0.0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const std::size_t a = kept[i - 1], b = kept[i];
    const double slope = (series.value[b] - series.value[a]) / (series.t[b] - series.t[a]);
    for (std::size_t k = a + 1; k < b; ++k) {
      const double line = series.value[a] + slope * (series.t[k] - series.t[a]);
      gap = std::max(gap, std::abs(series.value[k] - line));
    }
  }
  return gap;
}

}  // namespace loopbench::harness
