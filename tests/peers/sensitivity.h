// How far accelerations move with the last bits of a state: what they are compared to.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace loopbench::harness::peers_test {

inline constexpr double kEps = std::numeric_limits<double>::epsilon();

inline double Largest(std::span<const double> values) {
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

inline double LargestDifference(std::span<const double> a, std::span<const double> b) {
  double largest = a.size() == b.size() ? 0.0 : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    // written so that a NaN stays
    if (!(std::abs(a[i] - b[i]) <= largest)) largest = std::abs(a[i] - b[i]);
  }
  return largest;
}

/// How far `function` moves from its `value` at y when y does in its last bits: what round-off in a
/// state, and in sums of forces that nearly cancel, does to accelerations.
template <class Function>
double Sensitivity(std::span<const double> y, std::span<const double> value,
                   const Function& function) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> bits(-kEps, kEps);
  std::vector<double> near(y.size());
  double largest = 0.0;
  for (int draw = 0; draw < 16; ++draw) {
    for (std::size_t i = 0; i < y.size(); ++i) {
      near[i] = y[i] + bits(random) * std::max(1.0, std::abs(y[i]));
    }
    const std::vector<double> other = function(near);
    largest = std::max(largest, LargestDifference(value, other));
  }
  return largest;
}

}  // namespace loopbench::harness::peers_test
