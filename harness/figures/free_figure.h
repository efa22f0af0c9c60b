// A figure of any value against another, and its points that differ.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// A figure that the user chooses: any value of the records against any other.

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

// Of more records than a picture has points, those that it shows apart.

/// Takes records as they come and keeps at most `most` of them, cut down to what a free figure
/// looks at: one for each cell of the picture, curve, failure and doubt. Cells are as fine as
/// `most` allows, on linear and on logarithmic axes alike.
class DistinctPoints {
 public:
  DistinctPoints(const FreeFigure& wanted, std::size_t most);

  /// Throws ConfigError where x or y is a series.
  void Add(const Record& record);

  const std::vector<Record>& records() const { return kept_; }
  std::size_t seen() const { return seen_; }
  /// The side of a cell as a share of an axis; 0 where every record was kept.
  double cell() const { return parts_ == 0 ? 0.0 : 1.0 / parts_; }

 private:
  struct Span {
    double least = 0.0, largest = 0.0, least_size = 0.0, largest_size = 0.0;
  };
  std::string KeyOf(const Record& record) const;
  std::string CellOf(const Record& record, int axis) const;
  void Coarsen();

  std::array<std::string, 2> axes_;
  std::vector<std::string> group_, keys_;  ///< keys_: all that a figure looks at
  std::size_t most_, seen_ = 0;
  int parts_ = 0;  ///< of an axis; 0: no two points are one
  std::array<Span, 2> spans_;
  std::vector<Record> kept_;
  std::unordered_set<std::string> cells_;
};

}  // namespace loopbench::harness
