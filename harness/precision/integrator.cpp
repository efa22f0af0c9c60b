#include "harness/precision/integrator.h"

#include <array>
#include <cmath>
#include <limits>

#include "harness/base/text.h"
#include "harness/precision/scalars.h"

namespace loopbench::harness {

namespace {

/// A rational number, rounded once.
struct Ratio {
  int numerator, denominator;
  template <class S>
  S In() const {
    return S(numerator) / S(denominator);
  }
};

// J. Dormand, P. Prince, A family of embedded Runge-Kutta formulae, 1980. The last row of A is the
// solution of order 5; E is that less the one of order 4.
constexpr int kStages = 7;
constexpr Ratio kC[kStages] = {{0, 1}, {1, 5}, {3, 10}, {4, 5}, {8, 9}, {1, 1}, {1, 1}};
constexpr Ratio kA[kStages][kStages - 1] = {
    {},
    {{1, 5}},
    {{3, 40}, {9, 40}},
    {{44, 45}, {-56, 15}, {32, 9}},
    {{19372, 6561}, {-25360, 2187}, {64448, 6561}, {-212, 729}},
    {{9017, 3168}, {-355, 33}, {46732, 5247}, {49, 176}, {-5103, 18656}},
    {{35, 384}, {0, 1}, {500, 1113}, {125, 192}, {-2187, 6784}, {11, 84}}};
constexpr Ratio kE[kStages] = {{71, 57600},      {0, 1},    {-71, 16695}, {71, 1920},
                               {-17253, 339200}, {22, 525}, {-1, 40}};

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
        t_(options.begin) {
    const std::size_t n = static_cast<std::size_t>(system.size);
    for (std::vector<S>* vector : {&y_new_, &error_, &stage_, &before_}) vector->assign(n, S(0));
    for (std::vector<S>& k : k_) k.assign(n, S(0));
    f_.assign(y.size(), S(0));
  }

  OneStepResult Execute() {
    system_.accept(t_, y_);
    result_.outcome = Evaluate(t_, y_, f_);
    if (result_.outcome == Outcome::kFinished) {
      h_ = options_.first_step > S(0) ? options_.first_step : FirstStep();
    }
    while (result_.outcome == Outcome::kFinished && t_ < t_end_) result_.outcome = Advance();
    result_.t_reached = static_cast<double>(t_);
    result_.next_step = static_cast<double>(h_);
    return result_;
  }

 private:
  /// f(t, y), counted, and whether it is finite.
  Outcome Evaluate(S t, const std::vector<S>& y, std::vector<S>& f) {
    using std::isfinite;
    ++result_.rhs_evaluations;
    const Outcome outcome = system_.derivative(t, y, f);
    if (outcome != Outcome::kFinished) return outcome;
    const bool finite = std::ranges::all_of(f, [](const S& v) { return isfinite(v); });
    return finite ? Outcome::kFinished : Outcome::kNonFinite;
  }

  bool IsGragg() const { return options_.method == OneStepMethod::kGragg; }

  /// The error estimate grows with the step as h^EstimateOrder().
  int EstimateOrder() const { return IsGragg() ? 2 * options_.columns - 1 : 5; }

  // y_new_ and error_ of a step of length h.

  Outcome DormandPrince(S h) {
    k_[0] = f_;
    for (int s = 1; s < kStages; ++s) {
      stage_ = y_;
      for (int j = 0; j < s; ++j) {
        const S a = h * kA[s][j].template In<S>();
        for (std::size_t i = 0; i < y_.size(); ++i) stage_[i] += a * k_[j][i];
      }
      const Outcome outcome = Evaluate(t_ + h * kC[s].template In<S>(), stage_, k_[s]);
      if (outcome != Outcome::kFinished) return outcome;
    }
    y_new_ = stage_;
    for (std::size_t i = 0; i < y_.size(); ++i) {
      S sum = S(0);
      for (int s = 0; s < kStages; ++s) sum += kE[s].template In<S>() * k_[s][i];
      error_[i] = h * sum;
    }
    return Outcome::kFinished;
  }

  /// The modified midpoint rule with n substeps, to y_new_.
  Outcome Midpoint(S h, int n) {
    const S step = h / S(n);
    before_ = y_;
    y_new_ = y_;
    for (std::size_t i = 0; i < y_.size(); ++i) y_new_[i] += step * f_[i];
    for (int m = 1; m < n; ++m) {
      const Outcome outcome = Evaluate(t_ + S(m) * step, y_new_, k_[0]);
      if (outcome != Outcome::kFinished) return outcome;
      for (std::size_t i = 0; i < y_.size(); ++i) {
        const S next = before_[i] + S(2) * step * k_[0][i];
        before_[i] = y_new_[i];
        y_new_[i] = next;
      }
    }
    return Outcome::kFinished;
  }

  /// An even number of substeps has an error in even powers of h: every column gains two orders,
  ///   T_j,k+1 = T_jk + (T_jk - T_j-1,k) / ((n_j / n_j-k-1)^2 - 1),  n_j = 2 (j + 1).
  Outcome Gragg(S h) {
    for (int j = 0; j < options_.columns; ++j) {
      const Outcome outcome = Midpoint(h, 2 * (j + 1));
      if (outcome != Outcome::kFinished) return outcome;
      for (int k = 0; k < j; ++k) {
        const S ratio = S(j + 1) / S(j - k), weight = S(1) / (ratio * ratio - S(1));
        for (std::size_t i = 0; i < y_.size(); ++i) {
          const S newer = y_new_[i];
          y_new_[i] += (newer - table_[k][i]) * weight;
          table_[k][i] = newer;
        }
      }
      table_[j] = y_new_;
    }
    const std::vector<S>& before_last = table_[options_.columns - 2];
    for (std::size_t i = 0; i < y_.size(); ++i) error_[i] = y_new_[i] - before_last[i];
    return Outcome::kFinished;
  }

  /// MATLAB's: the fastest component changes by 0.8 rtol^(1/order) of its magnitude, at least 1.
  S FirstStep() {
    using std::abs;
    using std::pow;
    if (options_.fixed_step > S(0)) return options_.fixed_step;
    S rate = S(0);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      rate = std::max(rate, S(abs(f_[i]) / std::max(S(abs(y_[i])), S(1))));
    }
    rate /= S(kSafety) * pow(options_.tolerance, S(1) / S(EstimateOrder()));
    return longest_ * rate > S(1) ? S(1) / rate : longest_;
  }

  /// The largest component of the error estimate over its tolerance.
  S ScaledError() const {
    using std::abs;
    S worst = S(0);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const S allowed = options_.tolerance * std::max(S(abs(y_[i])), S(1));
      worst = std::max(worst, S(abs(error_[i]) / allowed));
    }
    return worst;
  }

  /// The factor that would just be accepted, between the controller's bounds.
  S Factor(S scaled_error, S largest) const {
    using std::pow;
    if (scaled_error == S(0)) return largest;
    const S ideal = S(kSafety) * pow(scaled_error, S(-1) / S(EstimateOrder()));
    return std::clamp(ideal, S(kReduction), largest);
  }

  /// Takes one accepted step.
  Outcome Advance() {
    S largest = S(kGrowth);
    for (int failures = 0;;) {
      const bool last = !(t_ + h_ < t_end_ - close_);
      const S h = last ? t_end_ - t_ : h_;
      const Outcome outcome = IsGragg() ? Gragg(h) : DormandPrince(h);
      const bool is_known = outcome == Outcome::kFinished;
      if (!is_known && !options_.steps_around_failures) return outcome;
      if (options_.fixed_step > S(0)) return Accept(last ? t_end_ : t_ + h, h);
      const S error = is_known ? ScaledError() : std::numeric_limits<S>::max();
      if (error <= S(1)) {
        // a clipped step gives less information than the planned one
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
    y_ = y_new_;
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
    if (rewritten || IsGragg() || f_.empty()) return Evaluate(t_, y_, f_);
    f_ = k_[kStages - 1];  // the last stage of Dormand-Prince is at the end of the step
    return Outcome::kFinished;
  }

  const Problem<S>& system_;
  const OneStepOptions<S>& options_;
  const S t_end_;
  const S longest_;  // ode45's longest step is a tenth of the interval
  // no step for a rounding remainder of the interval; ARKODE's bound
  const S close_ = S(100) * std::numeric_limits<S>::epsilon() * t_end_;
  std::vector<S>& y_;
  std::vector<S> f_;
  std::vector<S> y_new_, error_, stage_, before_;
  std::array<std::vector<S>, kStages> k_;
  std::array<std::vector<S>, kMaxColumns> table_;  ///< the last row of the extrapolation
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
