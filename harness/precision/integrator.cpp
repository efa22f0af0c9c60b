#include "harness/precision/integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/integrator/cpu_time.h"
#include "harness/precision/one_step.h"
#include "harness/precision/scalars.h"

namespace loopbench::harness {

namespace {

// harness/config/options.cpp: the values of profile ode45.
constexpr double kSafety = 0.8, kGrowth = 5.0, kReduction = 0.1, kRepeatedFailure = 0.5;

template <class S>
class Run {
 public:
  Run(const Problem<S>& system, S t_end, std::vector<S>& y, const OneStepOptions<S>& options)
      : system_(system),
        options_(options),
        t_end_(t_end),
        longest_(options.longest_step > S(0) ? options.longest_step
                                             : (t_end - options.begin) / S(10)),
        y_(y),
        step_(system, options.method, options.columns),
        t_(options.begin) {
    f_.assign(y.size(), S(0));
  }

  OneStepResult Execute() {
    system_.accept(t_, y_);
    result_.outcome = step_.Evaluate(t_, y_, f_);
    if (result_.outcome == Outcome::kFinished) {
      h_ = options_.first_step > S(0) ? options_.first_step : FirstStep();
    }
    while (result_.outcome == Outcome::kFinished && t_ < t_end_) result_.outcome = Advance();
    result_.t_reached = static_cast<double>(t_);
    result_.rhs_evaluations = step_.evaluations();
    result_.next_step = static_cast<double>(h_);
    return result_;
  }

 private:
  /// MATLAB's: the fastest component changes by 0.8 rtol^(1/order) of its magnitude, at least 1.
  S FirstStep() {
    using std::abs;
    using std::pow;
    if (options_.fixed_step > S(0)) return options_.fixed_step;
    S rate = S(0);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      rate = std::max(rate, S(abs(f_[i]) / std::max(S(abs(y_[i])), S(1))));
    }
    rate /= S(kSafety) * pow(options_.tolerance, S(1) / S(step_.estimate_order()));
    return longest_ * rate > S(1) ? S(1) / rate : longest_;
  }

  /// The largest component of the error estimate over its tolerance.
  S ScaledError() const {
    using std::abs;
    S worst = S(0);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const S allowed = options_.tolerance * std::max(S(abs(y_[i])), S(1));
      worst = std::max(worst, S(abs(step_.error()[i]) / allowed));
    }
    return worst;
  }

  /// The factor that would just be accepted, between the controller's bounds.
  S Factor(S scaled_error, S largest) const {
    using std::pow;
    if (scaled_error == S(0)) return largest;
    const S ideal = S(kSafety) * pow(scaled_error, S(-1) / S(step_.estimate_order()));
    return std::clamp(ideal, S(kReduction), largest);
  }

  /// One accepted step.
  Outcome Advance() {
    S largest = S(kGrowth);
    for (int failures = 0;;) {
      const bool last = !(t_ + h_ < t_end_ - close_);
      const S h = last ? t_end_ - t_ : h_;
      const Outcome outcome = step_.Attempt(t_, y_, f_, h);
      const bool is_known = outcome == Outcome::kFinished;
      if (!is_known && !options_.steps_around_failures) return outcome;
      if (options_.fixed_step > S(0)) return Accept(last ? t_end_ : t_ + h, h);
      const S error = is_known ? ScaledError() : std::numeric_limits<S>::max();
      if (error <= S(1)) {
        // what was clipped was good enough, and says less than the step that was meant
        const S next = h * Factor(error, largest);
        h_ = std::min(last && failures == 0 ? std::max(h_, next) : next, longest_);
        return Accept(last ? t_end_ : t_ + h, h);
      }
      ++result_.rejected;
      if (++failures == options_.most_failures) {
        return is_known ? Outcome::kStepTooSmall : outcome;
      }
      h_ = h * (is_known ? Factor(error, failures > 1 ? S(kRepeatedFailure) : S(1))
                         : S(kRepeatedFailure));
      largest = S(1);  // a step after a failure does not grow
    }
  }

  Outcome Accept(S t, S h) {
    using std::abs;
    t_ = t;
    y_ = step_.y_new();
    ++result_.steps;
    const bool rewritten = system_.accept(t_, y_);
    if (t_ < t_end_) {
      if (h <= S(16) * std::numeric_limits<S>::epsilon() * abs(t_)) return Outcome::kStepTooSmall;
      if (result_.steps >= options_.step_limit) return Outcome::kStepLimit;
      if (time_.Reached()) return Outcome::kTimeLimit;
    } else {
      return Outcome::kFinished;
    }
    result_.restarts += rewritten ? 1 : 0;
    if (rewritten || step_.f_new().empty()) return step_.Evaluate(t_, y_, f_);
    f_ = step_.f_new();
    return Outcome::kFinished;
  }

  const Problem<S>& system_;
  const OneStepOptions<S>& options_;
  const S t_end_;
  const S longest_;  // ode45's longest step is a tenth of the interval
  // no step for what rounding has left of the interval; ARKODE's bound
  const S close_ = S(100) * std::numeric_limits<S>::epsilon() * t_end_;
  std::vector<S>& y_;
  std::vector<S> f_;
  OneStep<S> step_;
  OneStepResult result_;
  S t_, h_ = S(0);
  CpuLimit time_{options_.time_limit_s};
};

}  // namespace

template <class S>
OneStepResult IntegrateSystem(const Problem<S>& system, S t_end, std::vector<S>& y,
                              const OneStepOptions<S>& options) {
  return Run<S>(system, t_end, y, options).Execute();
}

#define LOOPBENCH_INSTANTIATE(S)                                                \
  template OneStepResult IntegrateSystem(const Problem<S>&, S, std::vector<S>&, \
                                         const OneStepOptions<S>&);
LOOPBENCH_INSTANTIATE(double)
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
