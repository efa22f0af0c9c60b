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

// Interface that compares a run with known data of its motion: a certified reference or published
// data (both in error_meter.h).

class Meter {
 public:
  virtual ~Meter() = default;

  /// When the run is looked at [s], rising.
  virtual const std::vector<double>& times() const = 0;

  /// Adds the run at times()[k], and its interpolant of one degree less: their distance is a lower
  /// estimate of the interpolation error.
  virtual void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) = 0;

  virtual void Write(Record& record) const = 0;
};

// The true error of a run: how far it is from a reference (reference.h), as far as that is
// certified.

class ErrorMeter : public Meter {
 public:
  /// Measures the run of one subsystem; referents of `measured` and the reference outlive it.
  ErrorMeter(const Measured& measured, int part, const Reference& reference);

  /// Returns the times at which the reference is certified.
  const std::vector<double>& times() const override { return times_; }

  /// Adds a snapshot. Energies are relative to the first snapshot, at the start: simplified models
  /// may omit immovable bodies.
  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override;

  /// Writes errors at the end, their maximum and mean (keys error_*, docs/errors-and-costs.md), and
  /// series.error. Omits the error at the end if the run or the certificate ends earlier.
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

/// Writes the reference's keys: reference, reference_runs, reference_error and
/// reference_valid_until.
void WriteCertificate(const Reference& reference, Record& record);

// Error of a run against published data (harness/config/published_series.h), in the measures of a
// certified reference. Quantities without published data are left out.

class SeriesMeter : public Meter {
 public:
  /// Measures the run of one subsystem, over `horizon` [s]. The objects that `measured` and the
  /// series refer to outlive the meter.
  SeriesMeter(const Measured& measured, int part, const PublishedSeries& series, double horizon);

  /// Returns the times of the series up to the horizon.
  const std::vector<double>& times() const override { return times_; }

  void Add(std::size_t k, const Snapshot& own, const Snapshot& lower) override;

  /// Writes the keys error_*; errors of points use the axes of the series. "error_over_uncertainty"
  /// is the largest deviation from a published number over its uncertainty. At 1 and below the run
  /// agrees with the series.
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

/// Writes the keys of the published data: reference, reference_runs (name and source),
/// reference_error and its counterparts for each measure, and reference_valid_until, the last time
/// within `horizon`.
void WriteCertificate(const MechanismDescription& user, const PublishedSeries& series,
                      double horizon, Record& record);

}  // namespace loopbench::harness
