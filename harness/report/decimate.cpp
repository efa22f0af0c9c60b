#include "harness/report/decimate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace loopbench::harness {

std::vector<std::size_t> KeepExtremes(std::span<const double> values, std::size_t most) {
  const std::size_t n = values.size();
  most = std::max<std::size_t>(most, 4);
  std::vector<std::size_t> kept(std::min(n, most));
  std::iota(kept.begin(), kept.end(), 0);
  if (n <= most) return kept;
  kept = {0};
  const std::size_t inner = n - 2, buckets = (most - 2) / 2;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t from = 1 + b * inner / buckets, to = 1 + (b + 1) * inner / buckets;
    std::size_t low = from, high = from;
    for (std::size_t i = from; i < to; ++i) {
      if (!std::isfinite(values[i])) continue;
      if (!std::isfinite(values[low]) || values[i] < values[low]) low = i;
      if (!std::isfinite(values[high]) || values[i] > values[high]) high = i;
    }
    kept.push_back(std::min(low, high));
    if (low != high) kept.push_back(std::max(low, high));
  }
  kept.push_back(n - 1);
  return kept;
}

std::vector<std::size_t> KeepEvenly(std::size_t count, std::size_t most) {
  most = std::max<std::size_t>(most, 2);
  std::vector<std::size_t> kept(std::min(count, most));
  for (std::size_t i = 0; i < kept.size(); ++i) {
    kept[i] = count <= most ? i : i * (count - 1) / (most - 1);
  }
  return kept;
}

}  // namespace loopbench::harness
