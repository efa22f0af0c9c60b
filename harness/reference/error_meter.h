// Errors of a run against references: states, published series.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "harness/config/published_series.h"
#include "harness/record/record.h"
#include "harness/reference/reference.h"

namespace loopbench::harness {

// What holds a run against what is known of its motion: a certified reference (error_meter.h) or a
// published series (error_meter.h).

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

// The true error of a run: how far it is from a reference (reference.h), as far as that is
// certified.

class ErrorMeter : public Meter {
 public:
  /// Of the run of one part. What `measured` and the reference refer to outlives the meter.
  ErrorMeter(const Measured& measured, int part, const Reference& reference);

  /// Those that the reference is certified at.
  const std::vector<double>& times() const override { return times_; }

  /// Energies count from the first picture, which is that of the start: what does not move may be
  /// left out of a simplified model.
  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override;

  /// Errors at the end, at most and in the mean (keys error_*, docs/errors-and-costs.md), and
  /// series.error. The error at the end is left out where the run or the certificate did not get
  /// there.
  void Write(Record& record) const override;

 private:
  Measured measured_;
  int part_;
  const Reference& reference_;
  std::vector<double> times_;
  std::vector<std::size_t> at_;  ///< which of them were added
  std::vector<Distance> distances_;
  double first_energy_ = 0.0, interpolation_ = 0.0;
};

/// What a row says of its reference: keys reference, reference_runs, reference_error and
/// reference_valid_until.
void WriteCertificate(const Reference& reference, Record& record);

// The error of a run against a published series (harness/config/published_series.h), in the same
// measures as against a certified reference. What the series does not have is left out.

class SeriesMeter : public Meter {
 public:
  /// Of the run of one part, over `horizon` [s]. What `measured` and the series refer to outlives
  /// the meter.
  SeriesMeter(const Measured& measured, int part, const PublishedSeries& series, double horizon);

  /// Those of the series up to the horizon.
  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override;

  /// Keys error_*; of points the distance in the axes that the series has. "error_over_uncertainty"
  /// is the largest difference of any number from the published one, over its accuracy: at 1 and
  /// below the series does not tell the run from the truth.
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

/// What a row says of its series: reference, reference_runs (name and source),
/// reference_error and its like for each measure, and reference_valid_until, the last time within
/// `horizon`.
void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record);

}  // namespace loopbench::harness
