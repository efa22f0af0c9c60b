// What holds a run against what is known of its motion: a certified reference (error_meter.h) or a
// published series (series_meter.h).
#pragma once

#include <vector>

#include "harness/record/record.h"
#include "harness/reference/snapshot.h"

namespace loopbench::harness {

class Meter {
 public:
  virtual ~Meter() = default;

  /// When the run is looked at [s], rising.
  virtual const std::vector<double>& times() const = 0;

  /// The run at times()[k], and the same with an interpolant of one degree less: their distance is
  /// at least what interpolation adds.
  virtual void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) = 0;

  virtual void Write(Record& record) const = 0;
};

}  // namespace loopbench::harness
