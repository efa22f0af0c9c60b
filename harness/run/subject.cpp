#include <cmath>
#include <sstream>

#include "harness/base/text.h"
#include "harness/integrator/arkode.h"
#include "harness/integrator/stepper.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

// Short compared with any motion of unit bars; the second is for small and fast machines.
constexpr double kWarmUpSteps[] = {5e-3, 5e-5};
constexpr int kNumWarmUpSteps = 10;
constexpr double kNever = 1e9;  // time limit of a benchmark's integrator [s]

template <class Space>
BenchmarkState ComputeStateIn(const MechanismDescription& description, Coordinates coordinates) {
  BenchmarkState state;
  const Mechanism<Space, double> mechanism(description, coordinates);
  const Start<double> start = Assemble<Space>(description, mechanism);
  state.outcome = start.outcome;
  state.message = start.message;
  if (start.outcome != Outcome::kFinished) return state;
  const Method method{"odca", Enforcement::kVelocity, coordinates, SolverKind::kRankRevealing};
  for (const double step : kWarmUpSteps) {
    const auto formulation = MakeFormulation<Space>(method, mechanism);
    state.outcome = formulation->Start(0.0, start.q, start.u);
    if (state.outcome != Outcome::kFinished) return state;
    if (formulation->state_size() == 0) {
      state.outcome = Outcome::kInexpressible;
      state.message = "prescribed motions leave no state to integrate";
      return state;
    }
    std::vector<double> y(formulation->state_size());
    formulation->ToState(start.q, start.u, y);
    IntegratorOptions options;
    options.profile = "dormand-prince";
    options.fixed_step = step;
    const double end = kNumWarmUpSteps * step;
    const IntegratorResult result = Integrate(*formulation, 0.0, end, y, options);
    state.outcome = result.outcome;
    state.message = result.message;
    if (state.outcome == Outcome::kFinished) state.outcome = formulation->FromState(end, y);
    if (state.outcome != Outcome::kFinished) continue;
    state.q = formulation->q();
    state.u = formulation->u();
    std::vector<double> numbers(state.q.begin(), state.q.end());
    numbers.insert(numbers.end(), state.u.begin(), state.u.end());
    state.hash = HashRounded(numbers);
    break;
  }
  return state;
}

template <class Space>
class SubjectIn final : public BenchmarkSubject {
 public:
  SubjectIn(const MechanismDescription& description, const Method& method,
            const BenchmarkState& state, const std::string& integrator, double step)
      : mechanism_(description, method.coordinates),
        formulation_(MakeFormulation<Space>(method, mechanism_)) {
    const Outcome outcome = formulation_->Start(0.0, state.q, state.u);
    if (outcome != Outcome::kFinished) {
      throw std::invalid_argument(fmt::format("cannot start: {}", ToString(outcome)));
    }
    GiveJacobian(integrator, JacobianKind::kForward, description, *formulation_);
    y_.resize(formulation_->state_size());
    ydot_.resize(y_.size());
    formulation_->ToState(state.q, state.u, y_);
    rank_ = formulation_->Examine(0.0, y_, ydot_) == Outcome::kFinished
                ? formulation_->diagnostics().rank
                : -1;
    options_.profile = integrator;
    options_.fixed_step = step;
    options_.time_limit_s = kNever;
  }

  Outcome Derivative() override { return formulation_->Derivative(0.0, y_, ydot_); }

  Outcome Step() override {
    if (!stepper_) {
      guarded_ = std::make_unique<GuardedOde>(*formulation_, options_);
      // the end of the interval is far, so that no step is clipped
      stepper_ = std::make_unique<Stepper>(*guarded_, 0.0, 1e3 * options_.fixed_step, y_);
    } else {
      stepper_->Restart(0.0, y_);
    }
    double t = 0.0;
    const Outcome outcome = OutcomeOfReturnCode(stepper_->Step(t));
    return guarded_->failure() == Outcome::kFinished ? outcome : guarded_->failure();
  }

  std::span<const double> derivative() const override { return ydot_; }
  int bodies() const override { return mechanism_.num_bodies() - 1; }
  int rank() const override { return rank_; }
  std::int64_t operations() const override {
    const std::vector<NamedCount> counts = formulation_->solver().Counters();
    const auto at = std::ranges::find(counts, "rhs_operations", &NamedCount::name);
    return at == counts.end() ? -1 : at->value;
  }

 private:
  Mechanism<Space, double> mechanism_;
  std::unique_ptr<System<Space, double>> formulation_;
  IntegratorOptions options_;
  std::unique_ptr<GuardedOde> guarded_;
  std::unique_ptr<Stepper> stepper_;
  std::vector<double> y_, ydot_;
  int rank_ = 0;
};

}  // namespace

BenchmarkState ComputeState(const MechanismDescription& description, Coordinates coordinates) {
  return description.space == SpaceKind::kPlanar
             ? ComputeStateIn<Planar>(description, coordinates)
             : ComputeStateIn<Spatial>(description, coordinates);
}

std::string HashRounded(std::span<const double> numbers) {
  std::vector<std::int64_t> rounded;
  for (const double number : numbers) rounded.push_back(std::llround(number * 1e6));
  return Fnv1a(
      {reinterpret_cast<const char*>(rounded.data()), rounded.size() * sizeof(std::int64_t)});
}

std::string HashExact(std::span<const double> numbers) {
  return Fnv1a({reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
}

std::unique_ptr<BenchmarkSubject> MakeSubject(const MechanismDescription& description,
                                              const Method& method, const BenchmarkState& state,
                                              const std::string& integrator, double step) {
  if (state.outcome != Outcome::kFinished) {
    throw std::invalid_argument(
        fmt::format("no state to measure at: {} {}", ToString(state.outcome), state.message));
  }
  if (description.space == SpaceKind::kPlanar) {
    return std::make_unique<SubjectIn<Planar>>(description, method, state, integrator, step);
  }
  return std::make_unique<SubjectIn<Spatial>>(description, method, state, integrator, step);
}

std::int64_t CallgrindInstructions(std::string_view text, const std::string& file) {
  constexpr std::string_view kEvents = "events: ", kTotals = "totals: ";
  std::optional<std::string> events, totals;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    if (!events && line.starts_with(kEvents)) events = line.substr(kEvents.size());
    if (!totals && line.starts_with(kTotals)) totals = line.substr(kTotals.size());
  }
  std::int64_t count = 0;
  bool is_count = false;
  if (totals) {
    const char* const line_end = totals->data() + totals->size();
    const auto [end, error] = std::from_chars(totals->data(), line_end, count);
    // other events may follow
    is_count = error == std::errc() && count >= 0 && (end == line_end || *end == ' ');
  }
  if (!is_count || !events || !events->starts_with("Ir")) {
    throw std::runtime_error(fmt::format(
        "{}: no \"events: Ir\" and \"totals: NUMBER\", expected a file of Callgrind", file));
  }
  return count;
}

}  // namespace loopbench::harness
