// O-DCA held against the oracle: errors of one sample, and the worst of a family.
#pragma once

#include "mechanism/formulation/options.h"
#include "tests/contract/sample.h"
#include "tests/standard.h"

namespace loopbench::testing {

/// Errors are relative to the largest component of the oracle's answer.
struct Comparison {
  Outcome outcome = Outcome::kFinished;
  double error = 0.0;        ///< of udot
  double force_error = 0.0;  ///< of joint forces
  int rank = 0;              ///< as the formulation reports it
};

/// Compares O-DCA with the oracle at the sample's state.
template <class Space>
Comparison CompareOdca(const Sample<Space>& sample, Coordinates coordinates, SolverKind solver);

/// Requirements on a family of samples, and its worst error.
class Family {
 public:
  /// At least `share` of the samples must have rcond above 1e-2, and these are held to 1e-12. A
  /// share of zero: the bound with rcond alone.
  Family(const std::string& name, double share) : name_(name), share_(share) {}
  /// Holds both coordinate sets and the given solvers to the sample's bound, joint forces where
  /// they are unique.
  template <class Space>
  void Hold(const Sample<Space>& sample, bool as_published);
  /// Prints and records the worst.
  void Finish();

 private:
  std::string name_;
  double share_;
  int samples_ = 0, good_ = 0;
  double worst_ = 0.0, worst_good_ = 0.0, worst_of_bound_ = 0.0, worst_force_ = 0.0;
  double smallest_rcond_ = 1.0;
};

}  // namespace loopbench::testing
