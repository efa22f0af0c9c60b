// A figure that the user chooses: any value of the records against any other.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// What is asked for. Keys are those of records; `x` may hold texts, which become equally spaced
/// ticks. Two series ("series.drift_t" and "series.drift") give one curve per record.
struct FreeFigure {
  std::string x, y;
  std::string group;  ///< keys "a,b": one curve per combination of values; "" for a single curve
  std::string log;    ///< "x", "y", "xy" or "none"; "" for axes that span two decades and more
  /// Unless set, the title has the keys and the values that all records share.
  std::optional<std::string> title = std::nullopt;
};

/// The keys in "a,b".
std::vector<std::string> KeysIn(const std::string& list);

/// What names a case, in the order of titles.
inline constexpr std::array<const char*, 7> kCaseKeys = {
    "mechanism", "formulation", "enforcement", "coordinates", "solver", "rtol", "horizon"};

struct FreeFigureResult {
  Figure figure;
  /// What a reader should know: keys that differ within a curve, failed runs without a value.
  std::vector<std::string> remarks;
};

/// Throws ConfigError when a key is in no record.
void RequireKeys(const FreeFigure& wanted, std::span<const Record> records);

/// Draws the records that have both values. Points of a curve are joined in the order of x unless
/// two of them share one. A run that failed is a cross at its value, or at the lower edge when it
/// has none; it is never left out. Records of other kinds than those with a y value take no part.
///
/// @throws ConfigError when a key is in no record, when y is no number, when no record has both, or
/// when a logarithmic axis is asked for and no value is positive.
FreeFigureResult MakeFreeFigure(std::span<const Record> records, const FreeFigure& wanted);

}  // namespace loopbench::harness
