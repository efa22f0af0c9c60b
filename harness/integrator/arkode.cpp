#include "harness/integrator/arkode.h"

#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_version.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "harness/integrator/guarded_ode.h"
#include "harness/integrator/options.h"
#include "harness/integrator/stepper.h"

// From 7.1 on the same calls are ARKode...; this is the whole difference for most of them.
#if SUNDIALS_VERSION_MAJOR >= 7
#include <sunadaptcontroller/sunadaptcontroller_soderlind.h>
#define LOOPBENCH_ARK(call) ARKode##call
#else
#define LOOPBENCH_ARK(call) ERKStep##call
#endif

namespace loopbench::harness {
namespace {

std::span<double> Span(N_Vector v) { return {NV_DATA_S(v), static_cast<size_t>(NV_LENGTH_S(v))}; }

// Vector operations of ERKStep's inner loop. Debian's library goes through memory once per term;
// these give the same bits (same order of additions) in one pass.
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

sunrealtype RmsNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  double sum = 0;
  for (size_t i = 0; i < v.size(); ++i) {
    const double term = v[i] * weight[i];
    sum += term * term;
  }
  return std::sqrt(sum / static_cast<double>(v.size()));
}

sunrealtype MaxNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  double norm = 0;
  for (size_t i = 0; i < v.size(); ++i) {
    norm = std::max(norm, std::abs(v[i]) * weight[i]);
  }
  return norm;
}

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

struct FreeContext {
  void operator()(std::remove_pointer_t<SUNContext>* context) const { SUNContext_Free(&context); }
};
struct FreeVector {
  void operator()(std::remove_pointer_t<N_Vector>* vector) const { N_VDestroy(vector); }
};
struct FreeMemory {
  void operator()(void* memory) const { LOOPBENCH_ARK(Free)(&memory); }
};
using Context = std::unique_ptr<std::remove_pointer_t<SUNContext>, FreeContext>;
using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, FreeVector>;
using Memory = std::unique_ptr<void, FreeMemory>;

// A setting that ARKODE refuses is a mistake in this file, not an ending of a run.
void Require(int code, const char* what) {
  if (code != 0) {
    throw std::logic_error(std::string("ARKODE refused ") + what);
  }
}
#define LOOPBENCH_SET(call, ...) Require(LOOPBENCH_ARK(call)(__VA_ARGS__), #call)

// What differs between the major versions beyond the calls' names: context, messages, controller.
#if SUNDIALS_VERSION_MAJOR >= 7
struct FreeController {
  void operator()(SUNAdaptController c) const { SUNAdaptController_Destroy(c); }
};
using ControllerPtr = std::unique_ptr<std::remove_pointer_t<SUNAdaptController>, FreeController>;

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
void CaptureMessages(void*, std::string*) {}

ControllerPtr SetControl(void* memory, SUNContext context, const Controller& c) {
  // h_new = h e_n^(-k1/q) e_(n-1)^(-k2/q); the ready-made PI controller of 7.1 rejects every step.
  ControllerPtr made(SUNAdaptController_Soderlind(context));
  Require(SUNAdaptController_SetParams_Soderlind(made.get(), c.proportional ? 0.8 : 1,
                                                 c.proportional ? -0.31 : 0, 0, 0, 0),
          "the controller's parameters");
  Require(SUNAdaptController_SetErrorBias(made.get(), c.bias), "the error bias");
  LOOPBENCH_SET(SetAdaptController, memory, made.get());
  // Relative to one more than the lower of the two orders, which is what -1 undoes.
  LOOPBENCH_SET(SetAdaptivityAdjustment, memory, c.uses_method_order ? 0 : -1);
  return made;
}
#else
void KeepMessage(int code, const char*, const char*, char* text, void* message) {
  if (code < 0) {  // warnings are positive
    *static_cast<std::string*>(message) = text;
  }
}
Context MakeContext(std::string*) {
  SUNContext context = nullptr;
  Require(SUNContext_Create(nullptr, &context), "the context");
  return Context(context);
}
void CaptureMessages(void* memory, std::string* message) {
  LOOPBENCH_SET(SetErrHandlerFn, memory, KeepMessage, message);
}

struct Nothing {};
using ControllerPtr = Nothing;  // ARKODE 6 keeps the controller inside its memory
ControllerPtr SetControl(void* memory, SUNContext, const Controller& c) {
  std::array<sunrealtype, 3> parameters{c.proportional ? 0.8 : 1, c.proportional ? 0.31 : 0, 0};
  LOOPBENCH_SET(SetAdaptivityMethod, memory, c.proportional ? ARK_ADAPT_PI : ARK_ADAPT_I, 0,
                c.uses_method_order, parameters.data());
  LOOPBENCH_SET(SetErrorBias, memory, c.bias);
  return {};
}
#endif

}  // namespace

// Members are destroyed in reverse order: the context must outlive the vector, the controller and
// the memory.
struct Stepper::Arkode {
  Arkode(GuardedOde& guarded, double t_start, double t_stop, const std::vector<double>& y0)
      : ode_(guarded), t_end_(t_stop), context_(MakeContext(&message_)) {
    const Profile& profile = *FindProfile(ode_.options().profile);
    y_.reset(N_VNew_Serial(static_cast<sunindextype>(y0.size()), context_.get()));
    std::copy(y0.begin(), y0.end(), Span(y_.get()).begin());
    y_->ops->nvscale = Scale;  // every vector of ARKODE is a clone of this one
    y_->ops->nvlinearcombination = LinearCombination;
    y_->ops->nvwrmsnorm = profile.is_ode45 ? MaxNorm : RmsNorm;
    memory_.reset(ERKStepCreate(Derivative, t_start, y_.get(), context_.get()));
    CaptureMessages(memory_.get(), &message_);
    SetProblem(profile);
    SetController(profile.controller);
    SetSteps(profile, t_start);
  }

  void SetProblem(const Profile& profile) {
    LOOPBENCH_SET(SetUserData, memory_.get(), &ode_);
    LOOPBENCH_SET(WFtolerances, memory_.get(), profile.is_ode45 ? Weights<true> : Weights<false>);
    Require(ERKStepSetTableName(memory_.get(), profile.table), "the table");
    if (profile.needs_fresh_derivative) {
      LOOPBENCH_SET(SetPostprocessStepFn, memory_.get(), NoChange);
    }
  }

  void SetController(const Controller& c) {
    controller_ = SetControl(memory_.get(), context_.get(), c);
    LOOPBENCH_SET(SetSafetyFactor, memory_.get(), c.safety);
    LOOPBENCH_SET(SetMaxGrowth, memory_.get(), c.growth);
    LOOPBENCH_SET(SetMaxFirstGrowth, memory_.get(), c.first_growth);
    LOOPBENCH_SET(SetMinReduction, memory_.get(), c.reduction);
    LOOPBENCH_SET(SetMaxEFailGrowth, memory_.get(), c.repeated_failure);
    LOOPBENCH_SET(SetSmallNumEFails, memory_.get(), 2);
    LOOPBENCH_SET(SetFixedStepBounds, memory_.get(), 1, c.keep_below);
  }

  void SetSteps(const Profile& profile, double t0) {
    const IntegratorOptions& options = ode_.options();
    LOOPBENCH_SET(SetMaxNumSteps, memory_.get(), -1);   // the limit is ours
    LOOPBENCH_SET(SetMaxHnilWarns, memory_.get(), -1);  // so is the test for vanishing steps
    LOOPBENCH_SET(SetStopTime, memory_.get(), t_end_);
    // At the stop time 6.4 returns its interpolant. The step's end is moved to the stop time
    // first, and there the linear interpolant is 0 * y_old + 1 * y_new, the step's own end, whereas
    // higher degrees would evaluate derivatives for it.
    LOOPBENCH_SET(SetInterpolantDegree, memory_.get(), 1);
    double longest = options.max_step;
    if (longest == 0 && profile.is_ode45) {
      longest = 0.1 * (t_end_ - t0);
    }
    LOOPBENCH_SET(SetMaxStep, memory_.get(), longest);  // 0 is none
    if (options.fixed_step > 0) {
      LOOPBENCH_SET(SetFixedStep, memory_.get(), options.fixed_step);
    } else if (profile.is_ode45) {
      LOOPBENCH_SET(SetInitStep, memory_.get(), ode_.FirstStepOfOde45(t0, t_end_, y(), longest));
    }
  }

  std::span<double> y() const { return Span(y_.get()); }

  GuardedOde& ode_;
  double t_end_;
  std::string message_;
  Context context_;
  Vector y_;
  ControllerPtr controller_;
  Memory memory_;
};

Stepper::Stepper(GuardedOde& ode, double t0, double t_end, const std::vector<double>& y0)
    : arkode_(std::make_unique<Arkode>(ode, t0, t_end, y0)) {}

Stepper::~Stepper() = default;

int Stepper::Step(double& t) {
  return LOOPBENCH_ARK(Evolve)(arkode_->memory_.get(), arkode_->t_end_, arkode_->y_.get(), &t,
                               ARK_ONE_STEP);
}

void Stepper::Restart(double t, const std::vector<double>& y) {
  std::copy(y.begin(), y.end(), arkode_->y().begin());
  LOOPBENCH_SET(Reset, arkode_->memory_.get(), t, arkode_->y_.get());
  LOOPBENCH_SET(SetStopTime, arkode_->memory_.get(), arkode_->t_end_);  // Reset clears it
}

std::span<const double> Stepper::y() const { return arkode_->y(); }

const std::string& Stepper::message() const { return arkode_->message_; }

double Stepper::last_step() const {
  sunrealtype h = 0;
  LOOPBENCH_ARK(GetLastStep)(arkode_->memory_.get(), &h);
  return h;
}

std::int64_t Stepper::rejected() const {
  long count = 0;
  LOOPBENCH_ARK(GetNumErrTestFails)(arkode_->memory_.get(), &count);
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
    case ARK_ERR_FAILURE:
      return Outcome::kStepTooSmall;
    default:
      return Outcome::kIntegratorError;
  }
}

}  // namespace loopbench::harness
