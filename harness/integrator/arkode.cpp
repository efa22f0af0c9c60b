#include "harness/integrator/arkode.h"

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_version.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "harness/integrator/stepper.h"
#include "mechanism/algebra/factors.h"

// Explicit pairs run in ERKStep, implicit ones in ARKStep, which have the same calls under two
// names. From 7.1 on they are one call, and this is the whole difference for most of them.
#if SUNDIALS_VERSION_MAJOR >= 7
#include <sundials/sundials_adaptcontroller.h>
#define LOOPBENCH_ARK(implicit, call, ...) ARKode##call(__VA_ARGS__)
#define LOOPBENCH_ARK_IMPLICIT(call, ...) ARKode##call(__VA_ARGS__)
#else
#define LOOPBENCH_ARK(implicit, call, ...) \
  ((implicit) ? ARKStep##call(__VA_ARGS__) : ERKStep##call(__VA_ARGS__))
#define LOOPBENCH_ARK_IMPLICIT(call, ...) ARKStep##call(__VA_ARGS__)
#endif

// A call that can fail only by a programming error.
#define LOOPBENCH_SET(implicit, call, ...) \
  ::loopbench::harness::arkode::Require(LOOPBENCH_ARK(implicit, call, __VA_ARGS__), #call)
#define LOOPBENCH_SET_IMPLICIT(call, ...) \
  ::loopbench::harness::arkode::Require(LOOPBENCH_ARK_IMPLICIT(call, __VA_ARGS__), #call)

namespace loopbench::harness {
namespace arkode {

/// A setting that ARKODE rejects is an error in the code, not an outcome of a run.
void Require(int code, const char* what) {
  if (code != 0) throw std::logic_error(std::string("ARKODE rejected ") + what);
}

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* object) const {
    kFree(object);
  }
};
template <class Pointer, auto kFree>
using Owned = std::unique_ptr<std::remove_pointer_t<Pointer>, Free<kFree>>;

struct FreeContext {
  void operator()(std::remove_pointer_t<SUNContext>* context) const { SUNContext_Free(&context); }
};
using Context = std::unique_ptr<std::remove_pointer_t<SUNContext>, FreeContext>;
struct FreeMemory {
  bool implicit = false;
  void operator()([[maybe_unused]] void* memory) const { LOOPBENCH_ARK(implicit, Free, &memory); }
};

#if SUNDIALS_VERSION_MAJOR >= 7
using ControllerPtr = Owned<SUNAdaptController, SUNAdaptController_Destroy>;
#else
struct ControllerPtr {};  // ARKODE 6 keeps the controller inside its memory
#endif

std::span<double> Span(N_Vector v) { return {NV_DATA_S(v), static_cast<size_t>(NV_LENGTH_S(v))}; }

// Debian's library takes a pass per term; these give the same bits (order of additions) in one.
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
    for (size_t j = 0; j < kWidth; ++j) sum[j] += c[k] * from[j];
  }
  std::copy(sum.begin(), sum.end(), to + first);
}

int LinearCombination(int count, sunrealtype* c, N_Vector* x, N_Vector z) {
  const std::span<double> to = Span(z);
  size_t i = 0;
  for (; i + 8 <= to.size(); i += 8) CombineBlock<8>(i, count, c, x, to.data());
  for (; i + 2 <= to.size(); i += 2) CombineBlock<2>(i, count, c, x, to.data());
  if (i < to.size()) CombineBlock<1>(i, count, c, x, to.data());
  return 0;
}

// Number of components in the norms: quadratures come last and have weight zero.
size_t Weighted(std::span<const double> weight) {
  size_t count = weight.size();
  while (count > 0 && weight[count - 1] == 0) --count;
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
  for (size_t i = 0; i < count; ++i) norm = std::max(norm, std::abs(v[i]) * weight[i]);
  return norm;
}

/// Sets the Runge-Kutta method of `memory`, of ERKStep for an explicit table, else of ARKStep.
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

// Context, messages and step-size controller of the supported versions of SUNDIALS. Error texts of
// the context go to `*message` after CaptureMessages(). The controller outlives `memory`.
#if SUNDIALS_VERSION_MAJOR >= 7

void KeepMessage(int, const char*, const char*, const char* text, SUNErrCode, void* message,
                 SUNContext) {
  *static_cast<std::string*>(message) = text;
}

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

void KeepMessage(int code, const char*, const char*, char* text, void* message) {
  if (code < 0) *static_cast<std::string*>(message) = text;  // warnings are positive
}

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
  if (!jok && !ode.EvaluateJacobian(t, Span(y), Span(f))) return -1;
  SetMatrix(ode, gamma, matrix);
  return 0;
}

SUNLinearSolver_Type IsDirect(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

std::int64_t NewtonIterations(void* memory) {
  long count = 0;
  LOOPBENCH_ARK_IMPLICIT(GetNumNonlinSolvIters, memory, &count);
  return count;
}

/// The dense matrix I - gamma J of a stage and its factors. Quadratures come last in y, and f does
/// not depend on them, so the matrix is block triangular. Only the leading block is factored; its
/// solution does not depend on the quadratures in any bit.
///
/// The matrix belongs to the first implicit stage of a step. If this is not enough, a step that may
/// shrink is shortened. At a fixed step the Jacobian is renewed at the iterate whenever a
/// correction is more than half of the one before.
class Newton {
 public:
  /// Makes ARKStep's `memory` solve stages with Jacobians of `ode`, its user data. Outlives it.
  Newton(void* memory, N_Vector y, GuardedOde& ode, SUNContext context)
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
    // A solution scaled for another gamma would be wrong in the quadratures, which nothing tests.
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
    // A stage starts from the line through the last two states, which saves iterations.
    LOOPBENCH_SET_IMPLICIT(SetPredictorMethod, memory, 1);
  }

  Newton(const Newton&) = delete;
  Newton& operator=(const Newton&) = delete;

 private:
  // Operations of the linear solver, whose content is the Newton object.
  static int Factor(SUNLinearSolver solver, SUNMatrix matrix) {
    Newton& self = *static_cast<Newton*>(solver->content);
    self.factors_.compute(View(matrix).topLeftCorner(self.controlled_, self.controlled_));
    // positive: Newton's iteration has failed, a shorter step may succeed
    return (self.factors_.matrixLU().diagonal().array() == 0).any() ? 1 : 0;
  }

  static int Solve(SUNLinearSolver solver, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype) {
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

  /// At a fixed step: renews the factors if the last two corrections of this stage demand it.
  /// Returns ARKODE's code.
  int Renew(SUNMatrix matrix) {
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

  void* memory_;
  GuardedOde& ode_;
  std::int64_t iterations_ = -1;         ///< before this stage
  std::array<double, 2> corrections_{};  ///< norms of the last two of this stage; 0: none
  Eigen::Index controlled_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  Eigen::VectorXd solution_;
  Owned<SUNMatrix, SUNMatDestroy> matrix_;
  Owned<SUNLinearSolver, SUNLinSolFreeEmpty> solver_;
};

// Callbacks of ARKODE; `data` is the GuardedOde.
int Derivative(sunrealtype t, N_Vector y, N_Vector ydot, void* data) {
  return static_cast<GuardedOde*>(data)->Evaluate(t, Span(y), Span(ydot)) ? 0 : -1;
}
template <bool kIsOde45>
int Weights(N_Vector y, N_Vector weight, void* data) {
  static_cast<const GuardedOde*>(data)->Weights(Span(y), Span(weight), kIsOde45);
  return 0;
}
int NoChange(sunrealtype, N_Vector, void*) { return 0; }

// Returns the times at which steps must end, t_end last; those too close for ARKODE as one.
std::vector<double> StepEnds(const std::vector<double>& stop_times, double t0, double t_end) {
  const double close =
      100 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t0), std::abs(t_end));
  std::vector<double> ends;
  double last = t0;
  for (const double t : stop_times) {
    if (t > last + close && t < t_end - close) ends.push_back(last = t);
  }
  ends.push_back(t_end);
  return ends;
}

}  // namespace arkode

using namespace arkode;

// Members are destroyed in reverse order: the context outlives the others, the memory does not.
struct Stepper::Arkode {
  Arkode(GuardedOde& guarded, double t_start, double t_end, const std::vector<double>& y0)
      : ode_(guarded),
        profile_(*FindProfile(ode_.options().profile)),
        ends_(StepEnds(ode_.options().stop_times, t_start, t_end)),
        context_(MakeContext(&message_)) {
    y_.reset(N_VNew_Serial(static_cast<sunindextype>(y0.size()), context_.get()));
    std::copy(y0.begin(), y0.end(), Span(y_.get()).begin());
    // every vector of ARKODE is a clone of this one
    y_->ops->nvscale = Scale;
    y_->ops->nvlinearcombination = LinearCombination;
    y_->ops->nvwrmsnorm = profile_.is_ode45 ? MaxNorm : RmsNorm;
    memory_ = {profile_.is_implicit
                   ? ARKStepCreate(nullptr, Derivative, t_start, y_.get(), context_.get())
                   : ERKStepCreate(Derivative, t_start, y_.get(), context_.get()),
               FreeMemory{profile_.is_implicit}};
    CaptureMessages(memory(), profile_.is_implicit, &message_);
    SetProblem();
    SetController(profile_.controller);
    SetSteps(t_start);
  }

  void SetProblem() {
    LOOPBENCH_SET(profile_.is_implicit, SetUserData, memory(), &ode_);
    LOOPBENCH_SET(profile_.is_implicit, WFtolerances, memory(),
                  profile_.is_ode45 ? Weights<true> : Weights<false>);
    SetTable(memory(), profile_.table);
    if (profile_.is_implicit) {
      newton_ = std::make_unique<Newton>(memory(), y_.get(), ode_, context_.get());
      // the other interpolant evaluates a derivative at the end of every step
      LOOPBENCH_SET_IMPLICIT(SetInterpolantType, memory(), ARK_INTERP_LAGRANGE);
    }
    if (profile_.needs_fresh_derivative) {
      LOOPBENCH_SET(profile_.is_implicit, SetPostprocessStepFn, memory(), NoChange);
    }
  }

  void SetController(const Controller& c) {
    controller_ = SetControl(memory(), profile_.is_implicit, context_.get(), c);
    LOOPBENCH_SET(profile_.is_implicit, SetSafetyFactor, memory(), c.safety);
    LOOPBENCH_SET(profile_.is_implicit, SetMaxGrowth, memory(), c.growth);
    LOOPBENCH_SET(profile_.is_implicit, SetMaxFirstGrowth, memory(), c.first_growth);
    LOOPBENCH_SET(profile_.is_implicit, SetMinReduction, memory(), c.reduction);
    LOOPBENCH_SET(profile_.is_implicit, SetMaxEFailGrowth, memory(), c.repeated_failure);
    LOOPBENCH_SET(profile_.is_implicit, SetSmallNumEFails, memory(), 2);
    LOOPBENCH_SET(profile_.is_implicit, SetFixedStepBounds, memory(), 1, c.keep_below);
  }

  void SetSteps(double t0) {
    const IntegratorOptions& options = ode_.options();
    LOOPBENCH_SET(profile_.is_implicit, SetMaxNumSteps, memory(), -1);  // limited here
    // A fast transient, a knot or a singular configuration may need a step many orders of magnitude
    // shorter, by repeated halving. This program detects vanishing steps; ARKODE stops at 7.
    LOOPBENCH_SET(profile_.is_implicit, SetMaxErrTestFails, memory(), 60);
    LOOPBENCH_SET(profile_.is_implicit, SetMaxHnilWarns, memory(),
                  -1);  // so is the test for vanishing steps
    SetStopTime();
    // At the stop time 6.4 returns its interpolant. The step's end is moved to the stop time
    // first, and there the linear interpolant is 0 * y_old + 1 * y_new, the step's own end, whereas
    // higher degrees would evaluate derivatives for it.
    LOOPBENCH_SET(profile_.is_implicit, SetInterpolantDegree, memory(), 1);
    double longest = options.max_step;
    if (longest == 0 && profile_.is_ode45) longest = 0.1 * (t_end() - t0);
    LOOPBENCH_SET(profile_.is_implicit, SetMaxStep, memory(), longest);  // 0 is none
    if (options.fixed_step > 0) {
      LOOPBENCH_SET(profile_.is_implicit, SetFixedStep, memory(), options.fixed_step);
    } else if (profile_.is_ode45 || options.initial_step > 0) {
      LOOPBENCH_SET(profile_.is_implicit, SetInitStep, memory(),
                    options.initial_step > 0 ? std::min(options.initial_step, t_end() - t0)
                                             : ode_.FirstStepOfOde45(t0, t_end(), y(), longest));
    }
  }

  // The next step must not pass the next of ends_. A stop time lets the derivative see no time of
  // its own; the end of the run does only if it is a stop time too.
  void SetStopTime() {
    const std::vector<double>& stops = ode_.options().stop_times;
    const double end = ends_[next_];
    const bool is_stop =
        end < t_end() || (!stops.empty() && std::binary_search(stops.begin(), stops.end(), end));
    ode_.SetStop(is_stop ? end : std::numeric_limits<double>::infinity());
    LOOPBENCH_SET(profile_.is_implicit, SetStopTime, memory(), end);
  }

  void Restart(double t) {
    LOOPBENCH_SET(profile_.is_implicit, Reset, memory(), t, y_.get());
    SetStopTime();  // Reset clears it
  }

  // Goes on from a stop time that a step has reached. ARKODE would go on with the step that was
  // clipped; the step before it is the better guess.
  void PassStop(double t, double clipped) {
    ++next_;
    if (clipped < unclipped_ && ode_.options().fixed_step == 0) {
      LOOPBENCH_SET(profile_.is_implicit, SetInitStep, memory(), unclipped_);
    }
    Restart(t);
  }

  double last_step() const {
    sunrealtype h = 0;
    LOOPBENCH_ARK(profile_.is_implicit, GetLastStep, memory(), &h);
    return h;
  }

  void* memory() const { return memory_.get(); }
  double t_end() const { return ends_.back(); }
  std::span<double> y() const { return Span(y_.get()); }

  GuardedOde& ode_;
  const Profile& profile_;
  std::vector<double> ends_;  // where steps must end; the next is ends_[next_]
  size_t next_ = 0;
  double unclipped_ = 0;  // length of the last step that did not end at a stop time
  std::string message_;
  Context context_;
  Owned<N_Vector, N_VDestroy> y_;
  ControllerPtr controller_;
  std::unique_ptr<Newton> newton_;  // of implicit methods
  std::unique_ptr<void, FreeMemory> memory_;
};

Stepper::Stepper(GuardedOde& ode, double t0, double t_end, const std::vector<double>& y0)
    : arkode_(std::make_unique<Arkode>(ode, t0, t_end, y0)) {}

Stepper::~Stepper() = default;

int Stepper::Step(double& t) {
  Arkode& a = *arkode_;
  const int code = LOOPBENCH_ARK(a.profile_.is_implicit, Evolve, a.memory(), a.t_end(), a.y_.get(),
                                 &t, ARK_ONE_STEP);
  if (code != ARK_TSTOP_RETURN) {
    a.unclipped_ = a.last_step();
  } else if (t < a.t_end()) {
    a.PassStop(t, a.last_step());
  }
  return code;
}

void Stepper::Restart(double t, const std::vector<double>& y) {
  std::copy(y.begin(), y.end(), arkode_->y().begin());
  arkode_->Restart(t);
}

std::span<const double> Stepper::y() const { return arkode_->y(); }

const std::string& Stepper::message() const { return arkode_->message_; }

double Stepper::last_step() const { return arkode_->last_step(); }

std::int64_t Stepper::rejected() const {
  long count = 0;
  LOOPBENCH_ARK(arkode_->profile_.is_implicit, GetNumErrTestFails, arkode_->memory(), &count);
  return count;
}

std::int64_t Stepper::newton_iterations() const {
  return arkode_->newton_ ? NewtonIterations(arkode_->memory()) : 0;
}

std::int64_t Stepper::newton_failures() const {
  long count = 0;
  if (arkode_->newton_) {
    LOOPBENCH_ARK_IMPLICIT(GetNumNonlinSolvConvFails, arkode_->memory(), &count);
  }
  return count;
}

Outcome OutcomeOfReturnCode(int code) {
  switch (code) {
    case ARK_SUCCESS:
    case ARK_TSTOP_RETURN:
    case ARK_WARNING:
      return Outcome::kFinished;
    case ARK_TOO_MUCH_WORK:
      return Outcome::kStepLimit;
    case ARK_ERR_FAILURE:  // the error test failed too often in one step
      return Outcome::kStepTooSmall;
    case ARK_CONV_FAILURE:  // Newton's iteration failed, too often in one step or at a fixed one
    case ARK_NLS_SETUP_RECVR:
      return Outcome::kNewtonFailure;
    default:
      return Outcome::kIntegratorError;
  }
}

}  // namespace loopbench::harness
