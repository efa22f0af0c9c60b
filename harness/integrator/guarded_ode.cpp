#include "harness/integrator/guarded_ode.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace loopbench::harness {

GuardedOde::GuardedOde(Ode& ode, const IntegratorOptions& options)
    : options_(options), ode_(ode), time_(options.time_limit_s) {
  if (FindProfile(options.profile)->is_implicit) {
    const auto size = static_cast<size_t>(ode.size());
    jacobian_.resize(size * Controlled());
    shifted_.resize(size);
    shifted_f_.resize(size);
  }
}

bool GuardedOde::Evaluate(double t, std::span<const double> y, std::span<double> ydot) noexcept {
  // Reading the clock costs a fifth of a small system's derivative, hence every 16th call only.
  constexpr std::int64_t kCallsPerClock = 16;
  if (failure_ != Outcome::kFinished || exception_) {
    return false;
  }
  ++calls_;
  try {
    failure_ = ode_.Derivative(std::min(t, latest_), y, ydot);
  } catch (...) {  // Integrate() throws it again
    exception_ = std::current_exception();
    return false;
  }
  if (failure_ == Outcome::kFinished &&
      !std::all_of(ydot.begin(), ydot.end(), [](double v) { return std::isfinite(v); })) {
    failure_ = Outcome::kNonFinite;
  }
  return failure_ == Outcome::kFinished && !(calls_ % kCallsPerClock == 0 && OutOfTime());
}

void GuardedOde::SetStop(double t) {
  latest_ = std::isinf(t) ? t : std::nextafter(t, -std::numeric_limits<double>::infinity());
}

bool GuardedOde::OutOfTime() {
  if (!time_.Reached()) {
    return false;
  }
  failure_ = Outcome::kTimeLimit;
  return true;
}

void GuardedOde::Weights(std::span<const double> y, std::span<double> weight, bool is_ode45) const {
  const double rtol = options_.rtol, atol = options_.atol;
  const size_t controlled = Controlled();
  for (size_t i = 0; i < controlled; ++i) {
    const double relative = rtol * std::abs(y[i]);
    weight[i] = 1 / (is_ode45 ? std::max(relative, atol) : relative + atol);
  }
  std::fill(weight.begin() + static_cast<std::ptrdiff_t>(controlled), weight.end(), 0.0);
}

double GuardedOde::FirstStepOfOde45(double t0, double t_end, std::span<const double> y0,
                                    double longest) {
  std::vector<double> f(y0.size());
  if (!Evaluate(t0, y0, f)) {
    return 0;
  }
  const double threshold = options_.atol / options_.rtol;
  double rate = 0;
  for (size_t i = 0; i < Controlled(); ++i) {
    rate = std::max(rate, std::abs(f[i]) / std::max(std::abs(y0[i]), threshold));
  }
  rate /= 0.8 * std::pow(options_.rtol, 0.2);
  const double h = std::min(longest, t_end - t0);
  return h * rate > 1 ? 1 / rate : h;
}

}  // namespace loopbench::harness
