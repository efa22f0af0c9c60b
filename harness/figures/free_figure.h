// Figure of any value against another, and its distinct points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "harness/figures/axis.h"
#include "harness/figures/figures.h"
#include "harness/record/record.h"

namespace loopbench::harness {

// A figure that the user chooses: any value of the records against any other.

/// Request for a figure. Keys are keys of records; `x` may hold texts, which become equally spaced
/// ticks. Two series ("series.drift_t" and "series.drift") give one curve per record.
struct FreeFigure {
  std::string x, y;
  std::string group;  ///< keys "a,b": one curve per combination of values; "" for a single curve
  std::string log;    ///< "x", "y", "xy" or "none"; "" for axes that span at least two decades
  /// Title; by default the keys and the values that all records share.
  std::optional<std::string> title = std::nullopt;
  /// "NAME=TEXT": text of an axis (NAME is its key) or of a curve (NAME is its label).
  std::vector<std::string> labels = {};
};

/// Keys that identify a case, in the order of titles.
inline constexpr std::array<const char*, 7> kCaseKeys = {
    "mechanism", "formulation", "enforcement", "coordinates", "solver", "rtol", "horizon"};

struct FreeFigureResult {
  Figure figure;
  /// Remarks for the reader: keys that differ within a curve, failed runs without a value.
  std::vector<std::string> remarks;
};

/// Throws ConfigError if no record has one of the keys.
void RequireKeys(const FreeFigure& wanted, std::span<const Record> records);

/// Draws the records that have both values. Points of a curve are joined in the order of x unless
/// two of them share one. A failed run is a cross at its value, or at the lower edge if it has
/// none; it is never left out. Only records of the kinds with a y value take part.
///
/// @throws ConfigError if a key is in no record, y is not numeric, no record has both values, or no
/// value of a logarithmic axis is positive. Labels without an axis or curve are errors, too.
FreeFigureResult MakeFreeFigure(std::span<const Record> records, const FreeFigure& wanted);

// Selection of distinguishable records if there are more records than points in a picture.

/// Takes records one by one and keeps at most `most` of them, reduced to the keys of a free figure:
/// one per cell of the picture, curve, failure and warning state. Cells are as fine as `most`
/// allows, on linear and on logarithmic axes.
class DistinctPoints {
 public:
  DistinctPoints(const FreeFigure& wanted, std::size_t most);

  /// Adds a record. Throws ConfigError if x or y is a series.
  void Add(const Record& record);

  const std::vector<Record>& records() const { return kept_; }
  std::size_t seen() const { return seen_; }
  /// Side of a cell as a fraction of an axis; 0 if every record was kept.
  double cell() const { return parts_ == 0 ? 0.0 : 1.0 / parts_; }

 private:
  std::string KeyOf(const Record& record) const;
  std::string CellOf(const Record& record, std::size_t axis) const;
  void Coarsen();

  std::array<std::string, 2> axes_;
  std::vector<std::string> group_, keys_;  ///< keys_: all keys that the figure uses
  std::size_t most_, seen_ = 0;
  int parts_ = 0;                              ///< cells per axis; 0: all points are kept
  std::array<std::array<Axis, 2>, 2> scales_;  ///< of x and y: linear and logarithmic
  std::vector<Record> kept_;
  std::unordered_set<std::string> cells_;
};

}  // namespace loopbench::harness
