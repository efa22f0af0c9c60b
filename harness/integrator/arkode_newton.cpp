#include "harness/integrator/arkode_newton.h"

#include "harness/integrator/arkode_vectors.h"
#include "harness/integrator/guarded_ode.h"
#include "harness/integrator/stepper.h"

namespace loopbench::harness {
namespace {

using Matrix = Eigen::Map<Eigen::MatrixXd>;

Matrix View(SUNMatrix matrix) {
  return {SM_DATA_D(matrix), SM_ROWS_D(matrix), SM_COLUMNS_D(matrix)};
}

// ARKODE's callback for I - gamma J; jok allows the Jacobian of an earlier stage.
int LinearSystem(sunrealtype t, N_Vector y, N_Vector f, SUNMatrix matrix, SUNMatrix,
                 sunbooleantype jok, sunbooleantype* is_current, sunrealtype gamma, void* data,
                 N_Vector, N_Vector, N_Vector) {
  auto& ode = *static_cast<GuardedOde*>(data);
  *is_current = jok ? SUNFALSE : SUNTRUE;
  if (!jok && !ode.EvaluateJacobian(t, Span(y), Span(f))) {
    return -1;
  }
  Matrix A = View(matrix);
  const auto controlled = static_cast<Eigen::Index>(ode.Controlled());
  A.setIdentity();
  A.leftCols(controlled) -=
      gamma * Eigen::Map<const Eigen::MatrixXd>(ode.jacobian().data(), A.rows(), controlled);
  return 0;
}

SUNLinearSolver_Type IsDirect(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

}  // namespace

Newton::Newton(void* memory, N_Vector y, Eigen::Index controlled, bool fixed_step,
               SUNContext context)
    : controlled_(controlled),
      factors_(controlled),
      solution_(controlled),
      matrix_(SUNDenseMatrix(NV_LENGTH_S(y), NV_LENGTH_S(y), context)),
      solver_(SUNLinSolNewEmpty(context)) {
  solver_->content = this;
  solver_->ops->gettype = IsDirect;
  solver_->ops->setup = Factor;
  solver_->ops->solve = Solve;
  LOOPBENCH_SET_IMPLICIT(SetLinearSolver, memory, solver_.get(), matrix_.get());
  LOOPBENCH_SET_IMPLICIT(SetLinSysFn, memory, LinearSystem);
  // A solution scaled for a gamma that has changed would be wrong in the quadratures, whose
  // convergence nothing tests.
  LOOPBENCH_SET_IMPLICIT(SetLinearSolutionScaling, memory, SUNFALSE);
  // f of a stage is (z - a) / gamma: evaluated at z it would multiply what Newton left over by J.
  LOOPBENCH_SET_IMPLICIT(SetDeduceImplicitRhs, memory, SUNTRUE);
  // ARKODE's own 20 and 51 steps between matrices and Jacobians let the error test fail until the
  // run ends; a Jacobian per step costs less than the iterations and the rejected steps it saves.
  LOOPBENCH_SET_IMPLICIT(SetLSetupFrequency, memory, 1);
  LOOPBENCH_SET_IMPLICIT(SetJacEvalFrequency, memory, 1);
  // What Newton leaves over, in units of the tolerance: at ARKODE's 0.1 it rules the global error.
  LOOPBENCH_SET_IMPLICIT(SetNonlinConvCoef, memory, 0.01);
  // A step that may shrink is cheaper shortened than iterated on.
  LOOPBENCH_SET_IMPLICIT(SetMaxNonlinIters, memory, fixed_step ? Stepper::kMostIterations : 8);
  // A stage starts from the line through the last two states: fewer and less distant iterations
  // than from the last state alone.
  LOOPBENCH_SET_IMPLICIT(SetPredictorMethod, memory, 1);
}

int Newton::Factor(SUNLinearSolver solver, SUNMatrix matrix) {
  Newton& self = *static_cast<Newton*>(solver->content);
  self.factors_.compute(View(matrix).topLeftCorner(self.controlled_, self.controlled_));
  // positive: Newton's iteration has failed, a shorter step may succeed
  return (self.factors_.matrixLU().diagonal().array() == 0).any() ? 1 : 0;
}

int Newton::Solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype) {
  Newton& self = *static_cast<Newton*>(solver->content);
  const Eigen::Index n = self.controlled_, quadratures = NV_LENGTH_S(b) - n;
  const Eigen::Map<const Eigen::VectorXd> rhs(NV_DATA_S(b), NV_LENGTH_S(b));
  Eigen::Map<Eigen::VectorXd> to(NV_DATA_S(x), NV_LENGTH_S(x));
  // in a vector of its own, whose alignment does not depend on the number of quadratures
  Eigen::VectorXd& solution = self.solution_;
  solution.noalias() = self.factors_.permutationP() * rhs.head(n);
  self.factors_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(solution);
  self.factors_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(solution);
  to.head(n) = solution;
  to.tail(quadratures) = rhs.tail(quadratures);
  to.tail(quadratures).noalias() -= View(matrix).bottomLeftCorner(quadratures, n) * solution;
  return 0;
}

std::int64_t NewtonIterations(void* memory) {
  long count = 0;
  LOOPBENCH_ARK_IMPLICIT(GetNumNonlinSolvIters, memory, &count);
  return count;
}

std::int64_t NewtonFailures(void* memory) {
  long count = 0;
  LOOPBENCH_ARK_IMPLICIT(GetNumNonlinSolvConvFails, memory, &count);
  return count;
}

}  // namespace loopbench::harness
