// Systems with known behaviour for the integrator's tests.
#pragma once

#include "harness/integrator/arkode.h"
#include "tests/standard.h"

namespace loopbench::harness::integrator_test {

using State = std::vector<double>;
constexpr double kGravity = 9.81;

/// A system given by a function; remembers where it was evaluated.
class TestOde : public Ode {
 public:
  /// A function without a result finishes.
  template <class Function>
  TestOde(int size, Function function, int num_quadratures = 0)
      : size_(size),
        num_quadratures_(num_quadratures),
        function_([function](double t, auto y, auto ydot) mutable {
          if constexpr (std::is_void_v<decltype(function(t, y, ydot))>) {
            function(t, y, ydot);
            return Outcome::kFinished;
          } else {
            return function(t, y, ydot);
          }
        }) {}
  int size() const override { return size_; }
  int num_quadratures() const override { return num_quadratures_; }
  Outcome Derivative(double t, std::span<const double> y, std::span<double> ydot) override {
    evaluated.emplace_back(t, State(y.begin(), y.end()));
    return function_(t, y, ydot);
  }
  std::vector<std::pair<double, State>> evaluated;

 private:
  int size_, num_quadratures_;
  std::function<Outcome(double, std::span<const double>, std::span<double>)> function_;
};

/// Smooth, non-autonomous, coupled and non-linear, with the solution
/// (e^sin t, cos t, sin t, 1 / (1 + t^2)).
inline TestOde SmoothProblem() {
  return TestOde(4, [](double t, auto y, auto ydot) {
    ydot[0] = y[0] * y[1];
    ydot[1] = std::sin(t) - std::log(y[0]) - y[2];
    ydot[2] = std::log(y[0]) - y[2] + y[1];
    ydot[3] = -2 * t * y[3] * y[3];
  });
}
inline State SmoothSolution(double t) {
  return {std::exp(std::sin(t)), std::cos(t), std::sin(t), 1 / (1 + t * t)};
}

/// A point mass on a rod of length 1 in Cartesian coordinates (x, z, vx, vz); the rod's force is
/// the multiplier that makes the acceleration of x^2 + z^2 vanish, so the length drifts.
inline TestOde Pendulum() {
  return TestOde(4, [](double, auto y, auto ydot) {
    const double tension =
        (y[2] * y[2] + y[3] * y[3] - kGravity * y[1]) / (y[0] * y[0] + y[1] * y[1]);
    ydot[0] = y[2];
    ydot[1] = y[3];
    ydot[2] = -tension * y[0];
    ydot[3] = -tension * y[1] - kGravity;
  });
}

/// An observer that looks and lets the run continue.
template <class Look>
StepObserver Watch(Look look) {
  return [look](double t, std::span<double> y) mutable {
    look(t, y);
    return StepAction::kContinue;
  };
}

/// Returns default options with one value replaced.
template <class Owner, class T>
IntegratorOptions With(T Owner::*option, std::type_identity_t<T> value) {
  IntegratorOptions options;
  options.*option = std::move(value);
  return options;
}

inline IntegratorOptions WithTolerance(const std::string& profile, double tolerance,
                                       double fixed_step = 0) {
  IntegratorOptions options;
  options.fixed_step = fixed_step;
  options.profile = profile;
  options.rtol = options.atol = tolerance;
  return options;
}

/// The order each profile claims (options.h).
inline int OrderOf(const std::string& profile) {
  if (profile == "trbdf2") return 2;
  if (profile == "bogacki-shampine" || profile == "kennedy-carpenter-32") return 3;
  if (profile == "kennedy-carpenter-43") return 4;
  if (profile == "verner") return 6;
  if (profile == "fehlberg-78") return 8;
  return 5;
}

/// How far an observed order may lie from the claimed one; reasons at the tests.
constexpr double kMaxOrderError = 0.6;

class EveryProfile : public testing::TestWithParam<std::string> {};

/// Profile names without hyphens, as GoogleTest wants them.
inline std::string NameOfProfileTest(const testing::TestParamInfo<std::string>& info) {
  std::string text = info.param;
  std::erase(text, '-');
  return text;
}

}  // namespace loopbench::harness::integrator_test
