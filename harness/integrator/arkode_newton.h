// Newton's iteration for the stages of an implicit Runge-Kutta method in ARKODE.
#pragma once

#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <cstdint>
#include <memory>
#include <type_traits>

#include "harness/integrator/arkode_versions.h"
#include "mechanism/algebra/factors.h"

namespace loopbench::harness {

/// The dense matrix I - gamma J of a stage and its factors. Quadratures come last in y, and f does
/// not depend on them, so that the matrix is block triangular: only the leading block is factored,
/// and what it gives does not depend on the quadratures in any bit.
class Newton {
 public:
  /// Makes ARKStep's `memory` solve its stages with Jacobians of the GuardedOde that is its user
  /// data. The first `controlled` components of y are not quadratures. Steps of fixed length cannot
  /// shrink, and may take Stepper::kMostIterations. Must outlive `memory`.
  Newton(void* memory, N_Vector y, Eigen::Index controlled, bool fixed_step, SUNContext context);
  Newton(const Newton&) = delete;
  Newton& operator=(const Newton&) = delete;

 private:
  struct FreeMatrix {
    void operator()(std::remove_pointer_t<SUNMatrix>* matrix) const { SUNMatDestroy(matrix); }
  };
  struct FreeSolver {
    void operator()(std::remove_pointer_t<SUNLinearSolver>* s) const { SUNLinSolFreeEmpty(s); }
  };

  // Operations of the linear solver, whose content is the Newton object.
  static int Factor(SUNLinearSolver solver, SUNMatrix matrix);
  static int Solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype);

  Eigen::Index controlled_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  Eigen::VectorXd solution_;
  std::unique_ptr<std::remove_pointer_t<SUNMatrix>, FreeMatrix> matrix_;
  std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, FreeSolver> solver_;
};

/// Newton iterations of the run so far, and stages that did not converge: each of these shortened
/// the step, or ended the run.
std::int64_t NewtonIterations(void* memory);
std::int64_t NewtonFailures(void* memory);

}  // namespace loopbench::harness
