// A single step of each method of integrator.h, with its error estimate.
#pragma once

#include <array>
#include <vector>

#include "harness/precision/integrator.h"

namespace loopbench::harness {

/// Room for steps from (t, y, f(t, y)) to t + h.
template <class S>
class OneStep {
 public:
  /// `columns` of Gragg's extrapolation, kMostColumns at most.
  OneStep(const Problem<S>& system, OneStepMethod method, int columns);

  /// The error estimate grows with the step as h^estimate_order().
  int estimate_order() const { return method_ == OneStepMethod::kGragg ? 2 * columns_ - 1 : 5; }

  /// y_new() and error() of a step; f is the derivative at (t, y). kNonFinite when a derivative is
  /// not finite.
  Outcome Attempt(S t, const std::vector<S>& y, const std::vector<S>& f, S h);

  const std::vector<S>& y_new() const { return y_new_; }
  const std::vector<S>& error() const { return error_; }
  /// f at y_new() where the method knows it (the last stage of Dormand-Prince), else empty.
  const std::vector<S>& f_new() const { return f_new_; }

  /// f(t, y), counted, and whether it is finite.
  Outcome Evaluate(S t, const std::vector<S>& y, std::vector<S>& f);
  std::int64_t evaluations() const { return evaluations_; }

 private:
  static constexpr int kStages = 7;
  Outcome DormandPrince(S t, const std::vector<S>& y, const std::vector<S>& f, S h);
  Outcome Gragg(S t, const std::vector<S>& y, const std::vector<S>& f, S h);
  /// The modified midpoint rule with n substeps.
  Outcome Midpoint(S t, const std::vector<S>& y, const std::vector<S>& f, S h, int n,
                   std::vector<S>& result);

  const Problem<S>& system_;
  OneStepMethod method_;
  int columns_;
  std::vector<S> y_new_, error_, f_new_, stage_, before_;
  std::array<std::vector<S>, kStages> k_;
  std::array<std::vector<S>, kMostColumns> table_;  ///< the last row of the extrapolation
  std::int64_t evaluations_ = 0;
};

}  // namespace loopbench::harness
