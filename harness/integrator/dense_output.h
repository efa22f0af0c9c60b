// The solution between the ends of a step.
//
// A polynomial of degree 5 through the ends of a step and their derivatives, made better twice by
// derivatives at its own points (bootstrapping: W. Enright, K. Jackson, S. Norsett, P. Thomsen,
// Interpolants for Runge-Kutta formulas, ACM Trans. Math. Softw. 12, 1986). Its error is of order
// h^6, that of one degree less, which stands beside it, of order h^5. ARKODE's own interpolant of
// that degree is of the same kind, but 6.4 also asks it for the state at every stop time and would
// then evaluate derivatives there, so that a run would depend on who watches it.
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace loopbench::harness {

/// f(t, y) to `ydot`; false when it cannot be had.
using DenseDerivative =
    std::function<bool(double t, std::span<const double> y, std::span<double> ydot)>;

/// Where the solution is wanted besides the steps' ends.
struct DenseObserver {
  std::vector<double> times;  ///< [s], rising
  /// times[k] with the solution there. `lower` is of one degree less: their difference bounds what
  /// interpolation adds. At the end of a step both are the step's own end as the observer left it.
  std::function<void(std::size_t k, std::span<const double> y, std::span<const double> lower)>
      observe;
  /// The problem's derivative, where those taken here are to be told from the integrator's; else
  /// the problem is asked itself.
  DenseDerivative derivative = nullptr;
};

class DenseOutput {
 public:
  using Derivative = DenseDerivative;

  /// The step from (t0, y0) to (t1, y1), t0 < t1. Five derivatives, of which that at t1 is taken at
  /// the last time before it: what jumps there is the next step's. False when one cannot be had.
  bool Prepare(double t0, std::span<const double> y0, double t1, std::span<const double> y1,
               const Derivative& derivative);

  /// The solution at t in [t0, t1], and the one of a degree less.
  void At(double t, std::span<double> y, std::span<double> lower) const;

 private:
  /// The cubic through both ends and their derivatives, at theta = (t - t0) / h.
  void Cubic(double theta, std::span<double> y) const;

  double t0_ = 0.0, h_ = 0.0;
  std::vector<double> y0_, y1_, f0_, f1_;  ///< derivatives times h
  std::vector<double> bump_, flat_,
      sloping_;  ///< factors of w, of the lower degree and of the full
};

}  // namespace loopbench::harness
