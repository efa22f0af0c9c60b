#include "harness/suite/advise.h"

#include <cmath>

#include "harness/base/text.h"
#include "harness/config/formulations.h"
#include "harness/config/options.h"
#include "harness/integrator/arkode.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

/// Minimum duration: disturbances are a small part of longer runs.
constexpr double kShortTrial_s = 2e-3;
/// Neighbours come and go within one, and repeating it would take the pilot's time.
constexpr double kLongTrial_s = 0.1;

/// One subsystem, so that energy and steps are those of the full mechanism.
CompileOptions InOnePiece() { return {.islands = false}; }

template <class Space>
class BenchIn final : public TrialBench {
 public:
  BenchIn(const TrialProblem& problem, Compiled compiled)
      : problem_(problem),
        compiled_(std::move(compiled)),
        description_(compiled_.parts.front().description),
        joint_(description_, Coordinates::kJoint),
        absolute_(description_, Coordinates::kAbsolute) {
    for (auto* one : {&joint_, &absolute_}) {
      one->start = Assemble<Space>(description_, one->mechanism);
      if (one->start.outcome == Outcome::kFinished) continue;
      throw std::runtime_error(fmt::format("the initial assembly fails: {}", one->start.message));
    }
  }

  Trial Try(const Choice& choice, double cpu_s) override {
    Trial trial;
    trial.choice = choice;
    const IntegratorResult bare = RunBare(choice, cpu_s);
    trial.outcome = bare.outcome;
    trial.wall_s = bare.wall_s;
    trial.steps = bare.steps;
    trial.rhs_evaluations = bare.rhs_evaluations + bare.jacobian_rhs_evaluations;
    if (bare.outcome != Outcome::kFinished) return trial;
    // a short run is soon disturbed, and searches go by its time
    if (bare.wall_s < kShortTrial_s) Remeasure(&trial);
    auto meter = MakeMeter({problem_.user, compiled_, problem_.points}, 0, problem_.reference);
    // interpolation doubles the cost of a run, and more at many times of a short one
    if (Run(choice, std::max(10 * cpu_s, kLongTrial_s), meter.get()).outcome != Outcome::kFinished)
      return trial;
    Record record;
    meter->Write(record);
    trial.error = record.Number("error_position_max");
    trial.late = record.Number("error_phase_max");
    trial.shape = record.Number("error_path_max");
    return trial;
  }

  void Remeasure(Trial* trial) override {
    const IntegratorResult again = RunBare(trial->choice, 1e9);
    if (again.outcome == Outcome::kFinished) trial->wall_s = std::min(trial->wall_s, again.wall_s);
  }

 private:
  struct Coordinated {
    Coordinated(const MechanismDescription& description, Coordinates coordinates)
        : mechanism(description, coordinates) {}
    Mechanism<Space, double> mechanism;
    Start<double> start;
  };

  /// A run without other load on the machine, or the fastest of some disturbed ones.
  IntegratorResult RunBare(const Choice& choice, double cpu_s) {
    constexpr int kMaxDisturbed = 6;
    IntegratorResult fastest;
    for (int i = 0; i < kMaxDisturbed; ++i) {
      const double before = CalibrationNs();
      const IntegratorResult result = Run(choice, cpu_s, nullptr);
      const double slower = std::max(before, CalibrationNs());
      if (i == 0 || result.wall_s < fastest.wall_s) fastest = result;
      if (result.outcome != Outcome::kFinished || result.wall_s > kLongTrial_s ||
          slower < kOtherSpeed * CalibrationBaselineNs()) {
        break;
      }
    }
    return fastest;
  }

  IntegratorResult Run(const Choice& choice, double cpu_s, Meter* meter) {
    Coordinated& in = choice.method.coordinates == Coordinates::kJoint ? joint_ : absolute_;
    Case entry;
    entry.method = choice.method;
    entry.integrator = choice.integrator;
    entry.rtol = entry.atol = choice.rtol;
    entry.limits.cpu_s = cpu_s;
    IntegratorOptions options = OptionsOf(entry, in.mechanism.stop_times());
    options.fixed_step = choice.step;
    entry.horizon = problem_.horizon;
    LimitSteps(entry, in.mechanism, &options);
    const auto system = MakeFormulation<Space>(choice.method, in.mechanism);
    IntegratorResult result;
    result.outcome = system->Start(0.0, in.start.q, in.start.u);
    if (result.outcome != Outcome::kFinished) return result;
    GiveJacobian(choice.integrator, JacobianKind::kForward, description_, *system);
    GiveExecution(choice.method, description_, *system, &result);
    if (result.outcome != Outcome::kFinished) return result;
    std::vector<double> y(static_cast<std::size_t>(system->size()));
    system->ToState(in.start.q, in.start.u, y);
    const StepObserver observe = [&](double t, std::span<double> state) {
      return system->BeginStep(t, state) ? StepAction::kRestart : StepAction::kContinue;
    };
    const Measured measured{problem_.user, compiled_, {}};
    DenseObserver dense;
    if (meter != nullptr) {
      dense.times = meter->times();
      dense.observe = [&](std::size_t k, std::span<const double> state, std::span<const double>) {
        Snapshot snapshot = EmptySnapshot(measured);
        system->FromState(meter->times()[k], state);
        TakeSnapshot(measured, 0, system->kinematics(), &snapshot);
        meter->Add(k, snapshot, snapshot);
      };
    }
    return Integrate(*system, 0.0, problem_.horizon, y, options, observe,
                     meter != nullptr ? &dense : nullptr);
  }

  const TrialProblem& problem_;
  Compiled compiled_;
  const MechanismDescription& description_;
  Coordinated joint_, absolute_;
};

/// Tolerances of trials: between rounding and the largest useful error estimate.
constexpr double kMinRtol = 3e-15, kLargestRtol = 0.05;
/// For an error bound or a budget: target and lower limit of acceptance, as factors of the request.
constexpr double kAim = 0.7, kContent = 0.4;
/// Trials of a method and level. Errors follow tolerances nearly linearly: three often suffice.
constexpr int kMaxTrials = 5;
/// A trial may cost so much more than the best, for timing's sake, and so much at least [s].
constexpr double kRoom = 1.5, kMinLimit_s = 2e-4;
/// Limits of a sweep: trials beyond these are stopped.
constexpr double kHopeless = 20.0, kHopelessLeast_s = 2e-3;
/// Steps go with rtol^(-1/p) for a method of order p; p is near six.
constexpr double kOrder = 6.0;
/// For a budget: target and accepted lower limit of finalists, and maximum number of trials.
constexpr double kSpent = 0.97, kFull = 0.94;
constexpr int kSqueezes = 5;
/// Pairs of method and level that all formulations are tried in, and runs that decide.
constexpr std::size_t kBestPairs = 4, kFinalists = 6;
constexpr int kRepeats = 7;

/// With two digits, as people write tolerances, and within bounds.
double Tolerance(double wanted) {
  const double unit = std::pow(10.0, std::floor(std::log10(wanted)) - 1);
  return std::clamp(std::floor(wanted / unit) * unit, kMinRtol, kLargestRtol);
}

class Pilot {
 public:
  Pilot(const AdviceRequest& request, TrialBench& bench, double horizon, double length)
      : request_(request), bench_(bench), horizon_(horizon), length_(length) {
    if (request_.error) *request_.error *= kErrorShare;
  }

  Advice Find(const std::function<void(Trial&)>& examine) {
    fastest_ = FastestFormulation();
    for (const bool implicit : {false, true}) {
      for (const std::string& profile : ProfileNames()) {
        if (FindProfile(profile)->is_implicit != implicit) continue;
        for (const Enforcement level :
             {Enforcement::kVelocity, Enforcement::kPosition, Enforcement::kAcceleration}) {
          Look(profile, level);
        }
      }
    }
    advice_.finalists = Finalists();
    for (Trial& trial : advice_.finalists) {
      if (request_.budget) SpendBudget(&trial);
    }
    return Decide(examine);
  }

  Advice FindInAll(const std::function<void(Trial&)>& examine) {
    for (const FormulationRow& row : Formulations()) {
      if (row.is_peer()) continue;
      for (const std::string& profile : ProfileNames()) {
        for (const Enforcement level :
             {Enforcement::kVelocity, Enforcement::kPosition, Enforcement::kAcceleration}) {
          if (row.Has(level)) TryAll(row.name, profile, level);
        }
      }
    }
    Sort(&advice_.looked_at);
    advice_.finalists = advice_.looked_at;
    if (advice_.finalists.size() > kFinalists) advice_.finalists.resize(kFinalists);
    return Decide(examine);
  }

 private:
  Advice Decide(const std::function<void(Trial&)>& examine) {
    for (int i = 0; i < kRepeats; ++i) {
      for (Trial& trial : advice_.finalists) bench_.Remeasure(&trial);
    }
    Sort(&advice_.finalists);
    Examine(examine);
    advice_.reached = !advice_.finalists.empty() && Keeps(advice_.finalists.front());
    advice_.pilot_s = Elapsed();
    return advice_;
  }

  /// Tries all tolerances of a method and profile and examines the best.
  void TryAll(const std::string& formulation, const std::string& profile, Enforcement level) {
    for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
      Choice choice;
      choice.method = {
          .formulation = formulation, .enforcement = level, .coordinates = coordinates};
      choice.integrator = profile;
      std::optional<Trial> best;
      const auto take = [&] {
        if (OutOfTime()) {
          ++advice_.untried;
          return;
        }
        const Trial trial = Try(choice, LimitOfSweep());
        if (!best || Better(trial, *best)) best = trial;
      };
      constexpr int kDecades = 13;
      for (int i = 1; i <= kDecades; ++i) {
        choice.rtol = std::pow(10.0, -i);
        take();
      }
      for (int i = 2; request_.budget && i <= 2 * kDecades / 2; ++i) {
        choice.step = horizon_ * std::pow(10.0, -i / 2.0);
        take();
      }
      if (best) advice_.looked_at.push_back(*best);
    }
  }

  double Elapsed() const { return WallSeconds() - begin_; }
  bool OutOfTime() const { return Elapsed() > request_.cpu_s; }
  double Budget() const { return *request_.budget * horizon_; }

  bool Keeps(const Trial& trial) const {
    if (trial.outcome != Outcome::kFinished || !std::isfinite(trial.error)) return false;
    return request_.error ? trial.error <= *request_.error : trial.wall_s <= Budget();
  }

  /// Returns true if a is better advice than b.
  bool Better(const Trial& a, const Trial& b) const {
    if (Keeps(a) != Keeps(b)) return Keeps(a);
    // if both miss the request, the smaller violation wins
    const bool by_time = request_.error.has_value() == Keeps(a);
    return by_time ? a.wall_s < b.wall_s : a.error < b.error;
  }
  void Sort(std::vector<Trial>* trials) const {
    std::ranges::stable_sort(*trials,
                             [this](const Trial& a, const Trial& b) { return Better(a, b); });
  }

  /// Returns the CPU time limit of the next trial, from the remaining time and the best trial.
  double Limit() const {
    const double left = std::max(request_.cpu_s - Elapsed(), 1e-3) / 4;
    if (request_.budget) return std::min(left, std::max(kMinLimit_s, 4 * Budget()));
    if (!best_) return left;
    return std::min(left, std::max(kMinLimit_s, kRoom * best_->wall_s));
  }

  /// Returns the limit for trials of a sweep, as low orders at 1e-13 would take hours.
  double LimitOfSweep() const {
    if (request_.budget) return std::max(kHopeless * Budget(), kHopelessLeast_s);
    return best_ ? std::max(kHopeless * best_->wall_s, kHopelessLeast_s) : request_.cpu_s / 10;
  }

  Trial Try(const Choice& choice) { return Try(choice, Limit()); }
  Trial Try(const Choice& choice, double limit) {
    Trial trial = bench_.Try(choice, limit);
    ++advice_.trials;
    tried_.push_back(choice);
    if (request_.budget && trial.outcome == Outcome::kFinished) bench_.Settle(&trial);
    if (Keeps(trial) && (!best_ || Better(trial, *best_))) best_ = trial;
    return trial;
  }

  /// Returns the formulation with the cheapest evaluation over a coarse run.
  std::string FastestFormulation() {
    std::string fastest;
    double least = 0.0;
    for (const FormulationRow& row : Formulations()) {
      if (row.is_peer() || !row.Has(Enforcement::kVelocity)) continue;
      Choice choice;
      choice.method = {.formulation = row.name, .enforcement = Enforcement::kVelocity};
      choice.rtol = 1e-5;
      Trial trial = bench_.Try(choice, request_.cpu_s / 10);
      ++advice_.trials;
      if (trial.outcome == Outcome::kFinished) bench_.Settle(&trial);
      const double cost =
          trial.wall_s / static_cast<double>(std::max<std::int64_t>(trial.rhs_evaluations, 1));
      if (trial.outcome != Outcome::kFinished && !fastest.empty()) continue;
      if (fastest.empty() || cost < least) fastest = row.name, least = cost;
    }
    return fastest;
  }

  /// The best of a method at a level, as the fastest formulation has it.
  void Look(const std::string& profile, Enforcement level) {
    if (OutOfTime() || !FindFormulation(fastest_)->Has(level)) return;
    Choice choice;
    choice.method = {.formulation = fastest_, .enforcement = level};
    choice.integrator = profile;
    std::optional<Trial> best;
    if (request_.error) {
      // a coarse trial is cheap and guides the search
      choice.rtol = Tolerance(10 * *request_.error / length_);
      Search(choice, &Pilot::ForError, &best);
    } else {
      choice.rtol = 1e-8;
      Search(choice, &Pilot::ForBudget, &best);
      choice.step = horizon_ / 1000;
      if (!FindProfile(profile)->is_implicit) Search(choice, &Pilot::ForBudgetOfSteps, &best);
    }
    if (best) advice_.looked_at.push_back(*best);
  }

  /// Tries choices until `next` gives none.
  void Search(Choice choice, std::optional<Choice> (Pilot::*next)(const Trial&) const,
              std::optional<Trial>* best) {
    for (int i = 0; i < kMaxTrials && !OutOfTime(); ++i) {
      const Trial trial = Try(choice);
      if (!*best || Better(trial, **best)) *best = trial;
      const std::optional<Choice> other = (this->*next)(trial);
      if (!other || Contains(tried_, *other)) return;
      choice = *other;
    }
  }

  /// Returns the choice of a trial with another tolerance, unless that is the same.
  static std::optional<Choice> With(double rtol, const Trial& trial) {
    Choice choice = trial.choice;
    choice.rtol = Tolerance(rtol);
    return choice == trial.choice ? std::nullopt : std::optional(choice);
  }

  std::optional<Choice> ForError(const Trial& trial) const {
    const double asked = *request_.error;
    if (trial.outcome != Outcome::kFinished) {
      // too expensive, or too coarse for its loops
      if (trial.outcome == Outcome::kTimeLimit || trial.outcome == Outcome::kStepLimit) return {};
      Choice choice = trial.choice;
      choice.rtol = Tolerance(choice.rtol / 10);
      return choice;
    }
    if (trial.error <= asked && trial.error >= kContent * asked) return {};
    const double factor = std::clamp(kAim * asked / std::max(trial.error, 1e-300), 1e-4, 1e4);
    return With(trial.choice.rtol * factor, trial);
  }

  static bool HasRun(const Trial& trial) {
    return trial.outcome == Outcome::kFinished || trial.outcome == Outcome::kTimeLimit;
  }

  std::optional<Choice> ForBudget(const Trial& trial) const {
    const double used = trial.wall_s / Budget();
    if (!HasRun(trial) || (Keeps(trial) && used > kAim)) return {};
    return With(trial.choice.rtol * std::clamp(std::pow(used / 0.9, kOrder), 1e-5, 1e5), trial);
  }

  /// Fixed steps have no error estimate and cost the same every time.
  std::optional<Choice> ForBudgetOfSteps(const Trial& trial) const {
    const double used = trial.wall_s / Budget();
    // a run that failed may need shorter steps, if they can be had
    if ((Keeps(trial) && used > kAim) || (!HasRun(trial) && used > 0.5)) return {};
    Choice choice = trial.choice;
    choice.step = std::min(choice.step * std::clamp(used / 0.85, 1e-3, 1e3), horizon_ / 4);
    return choice;
  }

  /// Keeps the most promising trials. With a budget, methods with one integrator err alike at one
  /// tolerance. Cheaper ones have time left: trials are ranked by the error at full budget.
  void Shorten(std::vector<Trial>* trials, std::size_t count) const {
    Sort(trials);
    if (request_.budget) {
      std::ranges::stable_sort(*trials, {}, [this](const Trial& trial) {
        return trial.error * std::pow(trial.wall_s / Budget(), kOrder);
      });
    }
    if (trials->size() > count) trials->resize(count);
  }

  /// The best pairs of method and level in all formulations and coordinates.
  std::vector<Trial> Finalists() {
    std::vector<Trial> pairs = advice_.looked_at;
    Shorten(&pairs, kBestPairs);
    std::vector<Trial> finalists = pairs;
    for (const Trial& pair : pairs) {
      for (const FormulationRow& row : Formulations()) {
        if (row.is_peer() || !row.Has(pair.choice.method.enforcement)) continue;
        for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
          Choice choice = pair.choice;
          choice.method.formulation = row.name;
          choice.method.coordinates = coordinates;
          if (choice == pair.choice || OutOfTime()) continue;
          const Trial trial = Try(choice);
          if (trial.outcome == Outcome::kFinished) finalists.push_back(trial);
        }
      }
    }
    Shorten(&finalists, kFinalists);
    return finalists;
  }

  /// Finalists have the tolerance or step that suited the fastest formulation, or a search that was
  /// content with part of the budget; errors fall with a high power of the time. Brings one near
  /// to the full budget.
  void SpendBudget(Trial* trial) {
    double order = kOrder;
    for (int i = 0; i < kSqueezes && HasRun(*trial) && !OutOfTime(); ++i) {
      bench_.Settle(trial);
      const double used = trial->wall_s / Budget();
      if (used > kFull && used <= 1.0) return;
      Choice choice = trial->choice;
      if (choice.step > 0.0) {
        choice.step *= std::clamp(used / kSpent, 0.1, 10.0);
      } else {
        const double factor = std::clamp(std::pow(used / kSpent, order), 1e-5, 1e5);
        choice.rtol = Tolerance(choice.rtol * factor);
      }
      if (Contains(tried_, choice)) return;
      const Trial next = Try(choice);
      const double longer = std::log(next.wall_s / trial->wall_s);
      if (std::abs(longer) < 0.02) return;
      order = std::clamp(std::log(trial->choice.rtol / choice.rtol) / longer, 1.0, 12.0);
      if (Better(next, *trial)) *trial = next;
    }
  }

  /// Examines the best until one has no warnings and meets the request, and puts it first.
  void Examine(const std::function<void(Trial&)>& examine) {
    for (std::size_t i = 0; i < advice_.finalists.size(); ++i) {
      Trial& trial = advice_.finalists[i];
      examine(trial);
      if (!trial.warnings.empty() || !Keeps(trial)) continue;
      std::rotate(advice_.finalists.begin(),
                  advice_.finalists.begin() + static_cast<std::ptrdiff_t>(i),
                  advice_.finalists.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      return;
    }
    Sort(&advice_.finalists);
  }

  AdviceRequest request_;
  TrialBench& bench_;
  double horizon_, length_;
  double begin_ = WallSeconds();  ///< [s]
  std::string fastest_;
  std::optional<Trial> best_;
  std::vector<Choice> tried_;  ///< by searches and finalists
  Advice advice_;
};

}  // namespace

void TrialBench::Settle(Trial* trial) {
  // re-times runs up to this long: a disturbance may hide a shorter one
  constexpr double kMaybeShort_s = 2.5 * kShortTrial_s;
  constexpr int kSame = 3, kMaxTimings = 12;
  for (int same = 0, i = 0; same < kSame && i < kMaxTimings && trial->wall_s < kMaybeShort_s; ++i) {
    const double before = trial->wall_s;
    Remeasure(trial);
    same = trial->wall_s < 0.97 * before ? 0 : same + 1;
  }
}

std::string ToString(const Choice& choice) {
  const std::string how = choice.step > 0.0 ? fmt::format("in steps of {:.3g} s", choice.step)
                                            : fmt::format("at rtol {:.2g}", choice.rtol);
  return fmt::format("{}/{}/{}, {} {}", choice.method.formulation,
                     ToString(choice.method.enforcement), ToString(choice.method.coordinates),
                     choice.integrator, how);
}

std::unique_ptr<TrialBench> MakeTrialBench(const TrialProblem& problem) {
  Compiled compiled = Compile(problem.user, InOnePiece());
  if (compiled.parts.front().description.space == SpaceKind::kPlanar) {
    return std::make_unique<BenchIn<Planar>>(problem, std::move(compiled));
  }
  return std::make_unique<BenchIn<Spatial>>(problem, std::move(compiled));
}

std::string WhatLimits(const Trial& trial, double reference_error) {
  if (!std::isfinite(trial.error)) return "it did not finish";
  if (trial.error <= 10 * reference_error) {
    return "unknown, because the reference is not certified much below it";
  }
  if (trial.shape < 0.2 * trial.error) {
    return fmt::format("phase error {:.1e} s; path error {:.1e} m", trial.late, trial.shape);
  }
  return fmt::format("path error {:.1e} m; phase error {:.1e} s", trial.shape, trial.late);
}

Advice Advise(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
              const std::function<void(Trial&)>& examine) {
  return Pilot(request, bench, horizon, length).Find(examine);
}

Advice Sweep(const AdviceRequest& request, TrialBench& bench, double horizon, double length,
             const std::function<void(Trial&)>& examine) {
  return Pilot(request, bench, horizon, length).FindInAll(examine);
}

}  // namespace loopbench::harness
