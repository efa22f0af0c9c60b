// Of more records than a picture has points, those that it shows apart.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include "harness/figures/free_figure.h"
#include "harness/record/record.h"

namespace loopbench::harness {

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
