// Jacobians for implicit methods: the problem's own, or difference quotients.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "harness/integrator/guarded_ode.h"

namespace loopbench::harness {

bool GuardedOde::EvaluateJacobian(double t, std::span<const double> y,
                                  std::span<const double> f) noexcept {
  ++jacobians_;
  std::fill(jacobian_.begin(), jacobian_.end(), 0.0);
  std::optional<JacobianWork> own;
  try {
    own = ode_.Jacobian(std::min(t, latest_), y, jacobian_);
  } catch (...) {  // Integrate() throws it again
    exception_ = std::current_exception();
    return false;
  }
  if (!own) {
    return Differences(t, y, f);
  }
  calls_ += own->derivatives;
  jacobian_calls_ += own->derivatives;
  dual_evaluations_ += own->dual_evaluations;
  if (!std::all_of(jacobian_.begin(), jacobian_.end(), [](double v) { return std::isfinite(v); })) {
    failure_ = Outcome::kNonFinite;
  }
  return failure_ == Outcome::kFinished;
}

// One column per component. The increment is the root of round-off times the component's size, at
// least atol / rtol, below which the tolerances call a component small: half the digits of the
// quotient are good, which is plenty for Newton's iteration. It follows the direction of motion,
// so as not to leave the region where f is defined (L. Shampine, M. Reichelt, The MATLAB ODE suite,
// 1997, numjac).
bool GuardedOde::Differences(double t, std::span<const double> y, std::span<const double> f) {
  const double root = std::sqrt(std::numeric_limits<double>::epsilon());
  const double small = options_.atol / options_.rtol;
  std::copy(y.begin(), y.end(), shifted_.begin());
  for (size_t j = 0; j < Controlled(); ++j) {
    const double increment = root * std::max(std::abs(y[j]), small);
    shifted_[j] = y[j] + std::copysign(increment, f[j]);
    const std::int64_t before = calls_;
    const bool is_good = Evaluate(t, shifted_, shifted_f_);
    jacobian_calls_ += calls_ - before;
    if (!is_good) {
      return false;
    }
    const double shift = shifted_[j] - y[j];  // as it was rounded
    double* column = jacobian_.data() + j * y.size();
    for (size_t i = 0; i < y.size(); ++i) {
      column[i] = (shifted_f_[i] - f[i]) / shift;
    }
    shifted_[j] = y[j];
  }
  return true;
}

}  // namespace loopbench::harness
