// Fewer points of a curve, without losing its extremes.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopbench::harness {

/// Which of the points of a curve are kept, ascending: the first and the last, and of each of equal
/// buckets of points in between the least and the largest value. All of them where there are at
/// most `most` (at least 4). What is not finite is kept only where a bucket has nothing else: one
/// point, so that the curve has its gap.
std::vector<std::size_t> KeepExtremes(std::span<const double> values, std::size_t most);

/// At most `most` (at least 2) of `count` places, evenly, with the first and the last.
std::vector<std::size_t> KeepEvenly(std::size_t count, std::size_t most);

}  // namespace loopbench::harness
