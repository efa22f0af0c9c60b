// The true error of a run: how far it is from a reference (reference.h), as far as that is
// certified.
#pragma once

#include <vector>

#include "harness/reference/meter.h"
#include "harness/reference/reference.h"

namespace loopbench::harness {

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

/// What a row says of its reference: keys reference, reference_witnesses, reference_error and
/// trust_horizon.
void WriteCertificate(const Reference& reference, Record& record);

}  // namespace loopbench::harness
