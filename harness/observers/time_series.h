// Values sampled at accepted steps, and the few of them that records keep.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace loopbench::harness {

/// A value sampled at accepted steps.
struct TimeSeries {
  std::vector<double> t, value;
};

/// Of the first `samples` (all, unless said) every k-th, k chosen so that at most `points` >= 2
/// remain, always with the last one.
TimeSeries Thin(const TimeSeries& series, int points, std::size_t samples = SIZE_MAX);

/// The largest distance of the first `samples` from the line through those that Thin() keeps.
double LargestGap(const TimeSeries& series, int points, std::size_t samples);

}  // namespace loopbench::harness
