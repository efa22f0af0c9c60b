// A model in the program of a peer. C++17, as harness/exchange/model.h.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>

#include "harness/exchange/model.h"

namespace loopbench::peers {

/// Error of a step that is rejected at every step size.
class StepTooSmall : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Counters of the program since Start().
struct Counts {
  std::int64_t steps = 0, rejected = 0, derivatives = 0, projections = 0;
};

/// Program made from an exchange::Model; coordinates q [num_q] and speeds u [num_u] in its order.
class Program {
 public:
  virtual ~Program() = default;

  /// Computes qdot = N(q) u and udot by the peer's equations.
  virtual void Derivative(const double* q, const double* u, double* qdot, double* udot) = 0;

  /// Starts from (q, u) at time 0; the last step ends at `t_end`.
  virtual void Start(const double* q, const double* u, double tolerance, double t_end) = 0;
  /// Takes one accepted, projected step. Throws StepTooSmall or errors of the program, which end
  /// the run.
  virtual void Step() = 0;
  virtual double time() const = 0;  ///< [s]
  virtual void State(double* q, double* u) const = 0;
  virtual Counts counts() const = 0;
};

/// Makes a program of Simbody: tree joints become mobilizers with the same coordinates and speeds,
/// cut joints and couplings become constraints, rotors become flywheels, forces become Simbody's
/// own elements. Throws Unsupported for a helical cut joint.
///
/// RungeKuttaMersonIntegrator runs with `accuracy` = tolerance (|W yerr|_RMS, its own weights). The
/// constraint tolerance is a tenth of the accuracy, Simbody's default. Positions, speeds and the
/// error estimate are projected if they violate it.
std::unique_ptr<Program> MakeSimbodyProgram(const exchange::Model& model);

/// Makes a program of MuJoCo from the document of harness/exchange/export_mjcf.h at zero, and
/// corrects closures that do not hold there. Throws exchange::Unsupported for parts that MJCF does
/// not have.
///
/// MuJoCo has no error control and no projection. The fixed step of its classical Runge-Kutta
/// method is 0.1 s tolerance^(1/4): its error of order four is then proportional to the tolerance.
/// Closures are as stiff as these steps allow.
std::unique_ptr<Program> MakeMujocoProgram(const exchange::Model& model);

}  // namespace loopbench::peers
