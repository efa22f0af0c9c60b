#include "harness/integrator/arkode.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "harness/config/options.h"
#include "harness/integrator/arkode_memory.h"
#include "harness/integrator/stepper.h"

namespace loopbench::harness {
namespace {

// w = theta^2 (1 - theta)^2 and its derivative vanish at both ends, so p + w (a + b theta) keeps
// the end values of a cubic p. Its derivative at theta = 1/2 is zero. Derivatives are therefore
// taken at 1/3 and 2/3.
double W(double theta) { return theta * theta * (1 - theta) * (1 - theta); }
double DW(double theta) { return 2 * theta * (1 - theta) * (1 - 2 * theta); }
constexpr double kFirst = 1.0 / 3.0, kSecond = 2.0 / 3.0;

}  // namespace

void DenseOutput::Cubic(double theta, std::span<double> y) const {
  const double s = 1 - theta;
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    const double rise = y1_[i] - y0_[i];
    y[i] =
        y0_[i] + theta * theta * (3 - 2 * theta) * rise + theta * s * (s * f0_[i] - theta * f1_[i]);
  }
}

bool DenseOutput::Prepare(double t0, std::span<const double> y0, double t1,
                          std::span<const double> y1, const Derivative& derivative) {
  t0_ = t0;
  h_ = t1 - t0;
  y0_.assign(y0.begin(), y0.end());
  y1_.assign(y1.begin(), y1.end());
  const std::size_t n = y0_.size();
  f0_.resize(n), f1_.resize(n), bump_.assign(n, 0.0), flat_.assign(n, 0.0), sloping_.assign(n, 0.0);
  std::vector<double> y(n), rate(n);
  const auto scaled = [&](double t, std::span<const double> at, std::vector<double>& f) {
    if (!derivative(t, at, f)) return false;
    for (double& value : f) value *= h_;
    return std::ranges::all_of(f, [](double value) { return std::isfinite(value); });
  };
  constexpr double kBack = -std::numeric_limits<double>::infinity();
  if (!scaled(t0, y0_, f0_) || !scaled(std::nextafter(t1, kBack), y1_, f1_)) return false;
  // derivative at a point of the curve minus the cubic's own derivative
  const auto excess = [&](double theta, std::vector<double>& more) {
    Cubic(theta, y);
    for (std::size_t i = 0; i < n; ++i) y[i] += W(theta) * bump_[i];
    if (!scaled(t0_ + theta * h_, y, rate)) return false;
    more.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double own = 6 * theta * (1 - theta) * (y1_[i] - y0_[i]) +
                         (1 - theta) * (1 - 3 * theta) * f0_[i] + theta * (3 * theta - 2) * f1_[i];
      more[i] = rate[i] - own;
    }
    return true;
  };
  std::vector<double> first, second;
  if (!excess(kFirst, first)) return false;
  for (std::size_t i = 0; i < n; ++i) bump_[i] = first[i] / DW(kFirst);
  if (!excess(kFirst, first) || !excess(kSecond, second)) return false;
  // (w (a + b theta))' = w' a + (w' theta + w) b at both points
  const double a1 = DW(kFirst), b1 = a1 * kFirst + W(kFirst);
  const double a2 = DW(kSecond), b2 = a2 * kSecond + W(kSecond);
  const double determinant = a1 * b2 - a2 * b1;
  for (std::size_t i = 0; i < n; ++i) {
    flat_[i] = (first[i] * b2 - second[i] * b1) / determinant;
    sloping_[i] = (a1 * second[i] - a2 * first[i]) / determinant;
  }
  return true;
}

void DenseOutput::At(double t, std::span<double> y, std::span<double> lower) const {
  const double theta = (t - t0_) / h_;
  Cubic(theta, y);
  for (std::size_t i = 0; i < y0_.size(); ++i) {
    lower[i] = y[i] + W(theta) * bump_[i];
    y[i] += W(theta) * (flat_[i] + theta * sloping_[i]);
  }
}
namespace {

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

// Returns the times at which steps must end, in order, t_end last. Times too close for ARKODE to
// separate are merged.
std::vector<double> StepEnds(const std::vector<double>& stop_times, double t0, double t_end) {
  const double close =
      100 * std::numeric_limits<double>::epsilon() * std::max(std::abs(t0), std::abs(t_end));
  std::vector<double> ends;
  double last = t0;
  for (const double t : stop_times) {
    if (t > last + close && t < t_end - close) {
      ends.push_back(last = t);
    }
  }
  ends.push_back(t_end);
  return ends;
}

}  // namespace

// Members are destroyed in reverse order: the context must outlive the others, and the memory must
// not.
struct Stepper::Arkode {
  Arkode(GuardedOde& guarded, double t_start, double t_end, const std::vector<double>& y0)
      : ode_(guarded),
        profile_(*FindProfile(ode_.options().profile)),
        ends_(StepEnds(ode_.options().stop_times, t_start, t_end)),
        context_(MakeContext(&message_)) {
    y_.reset(N_VNew_Serial(static_cast<sunindextype>(y0.size()), context_.get()));
    std::copy(y0.begin(), y0.end(), Span(y_.get()).begin());
    UseOurOperations(y_.get(), profile_.is_ode45);  // every vector of ARKODE is a clone of this one
    memory_ = Memory(profile_.is_implicit
                         ? ARKStepCreate(nullptr, Derivative, t_start, y_.get(), context_.get())
                         : ERKStepCreate(Derivative, t_start, y_.get(), context_.get()),
                     FreeMemory{profile_.is_implicit});
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
    if (longest == 0 && profile_.is_ode45) {
      longest = 0.1 * (t_end() - t0);
    }
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
  Vector y_;
  ControllerPtr controller_;
  std::unique_ptr<Newton> newton_;  // of implicit methods
  Memory memory_;
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
  return arkode_->newton_ ? NewtonFailures(arkode_->memory()) : 0;
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
    case ARK_CONV_FAILURE:
    case ARK_NLS_SETUP_RECVR:
      return Outcome::kNewtonFailure;
    default:
      return Outcome::kIntegratorError;
  }
}

}  // namespace loopbench::harness
