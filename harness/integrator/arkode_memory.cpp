#include "harness/integrator/arkode_memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "harness/integrator/stepper.h"

namespace loopbench::harness {
namespace {

// Debian's library goes through memory once per term; these give the same bits (same order of
// additions) in one pass.
void Scale(sunrealtype c, N_Vector x, N_Vector z) {
  const std::span<double> from = Span(x), to = Span(z);
  if (c == 1) {
    std::copy(from.begin(), from.end(), to.begin());
  } else {
    std::transform(from.begin(), from.end(), to.begin(), [c](double v) { return c * v; });
  }
}

// One block of a linear combination, small enough to stay in registers.
template <size_t kWidth>
void CombineBlock(size_t first, int count, const sunrealtype* c, const N_Vector* x, double* to) {
  std::array<double, kWidth> sum{};
  for (int k = 0; k < count; ++k) {
    const double* from = NV_DATA_S(x[k]) + first;
    for (size_t j = 0; j < kWidth; ++j) {
      sum[j] += c[k] * from[j];
    }
  }
  std::copy(sum.begin(), sum.end(), to + first);
}

int LinearCombination(int count, sunrealtype* c, N_Vector* x, N_Vector z) {
  const std::span<double> to = Span(z);
  size_t i = 0;
  for (; i + 8 <= to.size(); i += 8) {
    CombineBlock<8>(i, count, c, x, to.data());
  }
  for (; i + 2 <= to.size(); i += 2) {
    CombineBlock<2>(i, count, c, x, to.data());
  }
  if (i < to.size()) {
    CombineBlock<1>(i, count, c, x, to.data());
  }
  return 0;
}

// Number of components in the norms: quadratures come last and have weight zero.
size_t Weighted(std::span<const double> weight) {
  size_t count = weight.size();
  while (count > 0 && weight[count - 1] == 0) {
    --count;
  }
  return count;
}

sunrealtype RmsNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  const size_t count = Weighted(weight);
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    const double term = v[i] * weight[i];
    sum += term * term;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

sunrealtype MaxNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  const size_t count = Weighted(weight);
  double norm = 0;
  for (size_t i = 0; i < count; ++i) {
    norm = std::max(norm, std::abs(v[i]) * weight[i]);
  }
  return norm;
}

}  // namespace

void UseOurOperations(N_Vector v, bool max_norm) {
  v->ops->nvscale = Scale;
  v->ops->nvlinearcombination = LinearCombination;
  v->ops->nvwrmsnorm = max_norm ? MaxNorm : RmsNorm;
}

}  // namespace loopbench::harness

#if SUNDIALS_VERSION_MAJOR >= 7
#include <sunadaptcontroller/sunadaptcontroller_soderlind.h>
#endif

namespace loopbench::harness {

void SetTable(void* memory, const ButcherTable& table) {
  std::vector<double> rows, b = table.b, c = table.c, d = table.b_embedded;
  for (const std::vector<double>& row : table.A) rows.insert(rows.end(), row.begin(), row.end());
  ARKodeButcherTable copy =
      ARKodeButcherTable_Create(table.stages(), table.order, table.embedded_order, c.data(),
                                rows.data(), b.data(), d.empty() ? nullptr : d.data());
  const int code = table.is_implicit()
                       ? ARKStepSetTables(memory, table.order, table.embedded_order, copy, nullptr)
                       : ERKStepSetTable(memory, copy);
  ARKodeButcherTable_Free(copy);
  Require(code, "the table");
}

#if SUNDIALS_VERSION_MAJOR >= 7

namespace {
void KeepMessage(int, const char*, const char*, const char* text, SUNErrCode, void* message,
                 SUNContext) {
  *static_cast<std::string*>(message) = text;
}
}  // namespace

Context MakeContext(std::string* message) {
  SUNContext context = nullptr;
  Require(SUNContext_Create(SUN_COMM_NULL, &context), "the context");
  SUNContext_ClearErrHandlers(context);
  SUNContext_PushErrHandler(context, KeepMessage, message);
  return Context(context);
}

void CaptureMessages(void*, bool, std::string*) {}

ControllerPtr SetControl(void* memory, bool, SUNContext context, const Controller& c) {
  // h_new = h e_n^(-k1/q) e_(n-1)^(-k2/q); the ready-made PI controller of 7.1 rejects every step.
  ControllerPtr made(SUNAdaptController_Soderlind(context));
  Require(SUNAdaptController_SetParams_Soderlind(made.get(), c.proportional ? 0.8 : 1,
                                                 c.proportional ? -0.31 : 0, 0, 0, 0),
          "the controller's parameters");
  Require(SUNAdaptController_SetErrorBias(made.get(), c.bias), "the error bias");
  LOOPBENCH_SET(, SetAdaptController, memory, made.get());
  // Relative to one more than the lower of the two orders; -1 cancels this.
  LOOPBENCH_SET(, SetAdaptivityAdjustment, memory, c.uses_method_order ? 0 : -1);
  return made;
}

#else

namespace {
void KeepMessage(int code, const char*, const char*, char* text, void* message) {
  if (code < 0) {  // warnings are positive
    *static_cast<std::string*>(message) = text;
  }
}
}  // namespace

Context MakeContext(std::string*) {
  SUNContext context = nullptr;
  Require(SUNContext_Create(nullptr, &context), "the context");
  return Context(context);
}

void CaptureMessages(void* memory, bool implicit, std::string* message) {
  LOOPBENCH_SET(implicit, SetErrHandlerFn, memory, KeepMessage, message);
}

ControllerPtr SetControl(void* memory, bool implicit, SUNContext, const Controller& c) {
  std::array<sunrealtype, 3> parameters{c.proportional ? 0.8 : 1, c.proportional ? 0.31 : 0, 0};
  LOOPBENCH_SET(implicit, SetAdaptivityMethod, memory, c.proportional ? ARK_ADAPT_PI : ARK_ADAPT_I,
                0, c.uses_method_order, parameters.data());
  LOOPBENCH_SET(implicit, SetErrorBias, memory, c.bias);
  return {};
}

#endif
namespace {

using Matrix = Eigen::Map<Eigen::MatrixXd>;

Matrix View(SUNMatrix matrix) {
  return {SM_DATA_D(matrix), SM_ROWS_D(matrix), SM_COLUMNS_D(matrix)};
}

/// I - gamma J, with the last Jacobian of `ode`.
void SetMatrix(const GuardedOde& ode, double gamma, SUNMatrix matrix) {
  Matrix A = View(matrix);
  const auto controlled = static_cast<Eigen::Index>(ode.Controlled());
  A.setIdentity();
  A.leftCols(controlled) -=
      gamma * Eigen::Map<const Eigen::MatrixXd>(ode.jacobian().data(), A.rows(), controlled);
}

// ARKODE's callback for the matrix; jok allows the Jacobian of an earlier stage.
int LinearSystem(sunrealtype t, N_Vector y, N_Vector f, SUNMatrix matrix, SUNMatrix,
                 sunbooleantype jok, sunbooleantype* is_current, sunrealtype gamma, void* data,
                 N_Vector, N_Vector, N_Vector) {
  auto& ode = *static_cast<GuardedOde*>(data);
  *is_current = jok ? SUNFALSE : SUNTRUE;
  if (!jok && !ode.EvaluateJacobian(t, Span(y), Span(f))) {
    return -1;
  }
  SetMatrix(ode, gamma, matrix);
  return 0;
}

SUNLinearSolver_Type IsDirect(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

}  // namespace

Newton::Newton(void* memory, N_Vector y, GuardedOde& ode, SUNContext context)
    : memory_(memory),
      ode_(ode),
      controlled_(static_cast<Eigen::Index>(ode.Controlled())),
      factors_(controlled_),
      solution_(controlled_),
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
  // f of a stage is (z - a) / gamma: evaluated at z it would multiply Newton's residual by J.
  LOOPBENCH_SET_IMPLICIT(SetDeduceImplicitRhs, memory, SUNTRUE);
  // ARKODE's own 20 and 51 steps between matrices and Jacobians let the error test fail until the
  // run ends; a Jacobian per step costs less than the iterations and the rejected steps it saves.
  LOOPBENCH_SET_IMPLICIT(SetLSetupFrequency, memory, 1);
  LOOPBENCH_SET_IMPLICIT(SetJacEvalFrequency, memory, 1);
  LOOPBENCH_SET_IMPLICIT(SetNonlinConvCoef, memory, ode.options().newton_coefficient);
  LOOPBENCH_SET_IMPLICIT(SetMaxNonlinIters, memory, Stepper::MaxIterations(ode.options()));
  if (ode.options().fixed_step > 0) {
    // a correction that grows ends the iteration elsewhere; here it renews the Jacobian
    LOOPBENCH_SET_IMPLICIT(SetNonlinRDiv, memory, 1e9);
  }
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

int Newton::Renew(SUNMatrix matrix) {
  if (ode_.options().fixed_step == 0) return 0;
  if (const std::int64_t before = NewtonIterations(memory_); before != iterations_) {
    iterations_ = before;
    corrections_ = {};
  }
  if (corrections_[0] == 0 || corrections_[1] <= 0.5 * corrections_[0]) return 0;
  sunrealtype t = 0, gamma = 0;
  N_Vector y = nullptr;  // the iterate of the residual
  LOOPBENCH_ARK_IMPLICIT(GetCurrentTime, memory_, &t);
  LOOPBENCH_ARK_IMPLICIT(GetCurrentGamma, memory_, &gamma);
  LOOPBENCH_ARK_IMPLICIT(GetCurrentState, memory_, &y);
  std::vector<double> f(Span(y).size());
  if (!ode_.Evaluate(t, Span(y), f) || !ode_.EvaluateJacobian(t, Span(y), f)) return -1;
  SetMatrix(ode_, gamma, matrix);
  return Factor(solver_.get(), matrix);
}

int Newton::Solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype) {
  Newton& self = *static_cast<Newton*>(solver->content);
  if (const int code = self.Renew(matrix); code != 0) return code;
  const Eigen::Index n = self.controlled_, quadratures = NV_LENGTH_S(b) - n;
  const Eigen::Map<const Eigen::VectorXd> rhs(NV_DATA_S(b), NV_LENGTH_S(b));
  Eigen::Map<Eigen::VectorXd> to(NV_DATA_S(x), NV_LENGTH_S(x));
  // in a vector of its own, whose alignment does not depend on the number of quadratures
  Eigen::VectorXd& solution = self.solution_;
  solution.noalias() = self.factors_.permutationP() * rhs.head(n);
  self.factors_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(solution);
  self.factors_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(solution);
  self.corrections_ = {self.corrections_[1], solution.norm()};
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
