#include "harness/advise/trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "harness/integrator/arkode.h"
#include "harness/record/noise.h"
#include "harness/reference/error_meter.h"
#include "harness/run/run_case.h"
#include "harness/timing/yardstick.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

/// Of a longer run a disturbance is a small part.
constexpr double kShortTrial_s = 2e-3;
/// Neighbours come and go within one, and repeating it would take the pilot's time.
constexpr double kLongTrial_s = 0.1;

/// One part, so that its energy and its steps are those of all.
CompileOptions InOnePiece() { return {.islands = false}; }

template <class Space>
class BenchIn final : public TrialBench {
 public:
  BenchIn(const TrialScene& scene, Compiled compiled)
      : scene_(scene),
        compiled_(std::move(compiled)),
        description_(compiled_.parts.front().description),
        joint_(description_, Coordinates::kJoint),
        absolute_(description_, Coordinates::kAbsolute) {
    for (auto* one : {&joint_, &absolute_}) {
      one->start = Assemble<Space>(description_, one->mechanism);
      if (one->start.outcome == Outcome::kFinished) continue;
      throw std::runtime_error(
          fmt::format("the start cannot be assembled: {}", one->start.message));
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
    if (bare.wall_s < kShortTrial_s) TimeAgain(&trial);
    ErrorMeter meter({scene_.user, compiled_, scene_.points}, 0, scene_.reference);
    // interpolation doubles what a run costs
    if (Run(choice, 10 * cpu_s, &meter).outcome != Outcome::kFinished) return trial;
    Record record;
    meter.Write(record);
    trial.error = record.Number("error_position_max");
    trial.late = record.Number("error_phase_max");
    trial.shape = record.Number("error_shape_max");
    return trial;
  }

  void TimeAgain(Trial* trial) override {
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

  /// A run at the speed that the machine has when it is alone, or the fastest of some that were all
  /// disturbed.
  IntegratorResult RunBare(const Choice& choice, double cpu_s) {
    constexpr int kMostDisturbed = 6;
    IntegratorResult fastest;
    for (int i = 0; i < kMostDisturbed; ++i) {
      const double before = YardstickNs();
      const IntegratorResult one = Run(choice, cpu_s, nullptr);
      const double slower = std::max(before, YardstickNs());
      if (i == 0 || one.wall_s < fastest.wall_s) fastest = one;
      if (one.outcome != Outcome::kFinished || one.wall_s > kLongTrial_s ||
          slower < kOtherSpeed * YardstickAloneNs()) {
        break;
      }
    }
    return fastest;
  }

  IntegratorResult Run(const Choice& choice, double cpu_s, ErrorMeter* meter) {
    Coordinated& in = choice.column.coordinates == Coordinates::kJoint ? joint_ : absolute_;
    Case one;
    one.column = choice.column;
    one.integrator = choice.integrator;
    one.rtol = one.atol = choice.rtol;
    one.limits.cpu_s = cpu_s;
    IntegratorOptions options = OptionsOf(one, in.mechanism.stop_times());
    options.fixed_step = choice.step;
    const auto system = MakeFormulation<Space>(choice.column, in.mechanism);
    IntegratorResult result;
    result.outcome = system->Start(0.0, in.start.q, in.start.u);
    if (result.outcome != Outcome::kFinished) return result;
    GiveJacobian(choice.integrator, JacobianKind::kForward, description_, *system);
    GiveExecution(choice.column, description_, *system, &result);
    if (result.outcome != Outcome::kFinished) return result;
    const auto compile_s = [&] {
      return system->compiled() != nullptr ? system->compiled()->seconds() : 0.0;
    };
    const double compiled_before = compile_s();
    std::vector<double> y(static_cast<std::size_t>(system->size()));
    system->ToState(in.start.q, in.start.u, y);
    const StepObserver observe = [&](double t, std::span<double> state) {
      return system->BeginStep(t, state) ? StepAction::kRestart : StepAction::kContinue;
    };
    const Measured measured{scene_.user, compiled_, {}};
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
    result = Integrate(*system, 0.0, scene_.horizon, y, options, observe,
                       meter != nullptr ? &dense : nullptr);
    result.wall_s -= compile_s() - compiled_before;
    return result;
  }

  const TrialScene& scene_;
  Compiled compiled_;
  const MechanismDescription& description_;
  Coordinated joint_, absolute_;
};

}  // namespace

void TrialBench::Settle(Trial* trial) {
  // twice and more what is short by itself: it may be short and disturbed
  constexpr double kMaybeShort_s = 2.5 * kShortTrial_s;
  constexpr int kSame = 3, kMostTimings = 12;
  for (int same = 0, i = 0; same < kSame && i < kMostTimings && trial->wall_s < kMaybeShort_s;
       ++i) {
    const double before = trial->wall_s;
    TimeAgain(trial);
    same = trial->wall_s < 0.97 * before ? 0 : same + 1;
  }
}

std::string ToString(const Choice& choice) {
  const std::string how = choice.step > 0.0 ? fmt::format("in steps of {:.3g} s", choice.step)
                                            : fmt::format("at rtol {:.2g}", choice.rtol);
  return fmt::format("{}/{}/{}, {} {}", choice.column.formulation,
                     ToString(choice.column.enforcement), ToString(choice.column.coordinates),
                     choice.integrator, how);
}

std::unique_ptr<TrialBench> MakeTrialBench(const TrialScene& scene) {
  Compiled compiled = Compile(scene.user, InOnePiece());
  if (compiled.parts.front().description.space == SpaceKind::kPlanar) {
    return std::make_unique<BenchIn<Planar>>(scene, std::move(compiled));
  }
  return std::make_unique<BenchIn<Spatial>>(scene, std::move(compiled));
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

}  // namespace loopbench::harness
