// The error of a run against a published series (harness/config/published_series.h), in the same
// measures as against a certified reference. What the series does not have is left out.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "harness/config/published_series.h"
#include "harness/reference/meter.h"

namespace loopbench::harness {

class SeriesMeter : public Meter {
 public:
  /// Of the run of one part, over `horizon` [s]. What `measured` and the series refer to outlives
  /// the meter.
  SeriesMeter(const Measured& measured, int part, const PublishedSeries& series, double horizon);

  /// Those of the series up to the horizon.
  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override;

  /// Keys error_*; of points the distance in the axes that the series has. "error_over_accuracy" is
  /// the largest difference of any number from the published one, over its accuracy: at 1 and below
  /// the series does not tell the run from the truth.
  void Write(Record& record) const override;

 private:
  double Difference(const PublishedQuantity& quantity, std::size_t k, const Snapshot& own) const;

  Measured measured_;
  int part_;
  const PublishedSeries& series_;
  double horizon_;
  std::vector<double> times_;
  std::map<std::string, double> largest_;  ///< by key of the record
  std::vector<double> at_, positions_;     ///< times and errors of points there
  double over_accuracy_ = 0.0, interpolation_ = 0.0;
  std::int64_t points_ = 0;
};

/// What a row says of its series: reference, reference_witnesses (name and source),
/// reference_error and its like for each measure, and trust_horizon, the last time within
/// `horizon`.
void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record);

}  // namespace loopbench::harness
