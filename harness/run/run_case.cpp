#include "harness/run/run_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "harness/analysis/doubts.h"
#include "harness/analysis/link_length.h"
#include "harness/integrator/arkode.h"
#include "harness/observers/final_poses.h"
#include "harness/observers/observer.h"
#include "harness/reference/error_meter.h"
#include "harness/run/compiled_scene.h"
#include "harness/run/ensemble.h"
#include "harness/run/merge_parts.h"
#include "harness/run/peers.h"
#include "harness/text/hash.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

namespace {

/// Of the last state: equal hashes mean equal runs.
std::string StateHash(std::span<const double> y) {
  return Fnv1a({reinterpret_cast<const char*>(y.data()), y.size_bytes()});
}

template <class Space>
class Runner {
 public:
  /// Part `part` of `user`, simplified to `scene`.
  Runner(const Experiment& experiment, const Case& one, const MechanismDescription& user,
         const CompiledScene& scene, int part, bool with_series, const Reference* reference)
      : case_(one),
        user_(user),
        compiled_(scene.compiled),
        part_(part),
        scene_(scene.observe),
        description_(scene.compiled.parts[static_cast<std::size_t>(part)].description),
        mechanism_(description_, one.column.coordinates),
        observers_(MakeObservers<Space>(
            {description_, mechanism_, scene_, experiment.series_points, with_series})),
        with_series_(with_series) {
    if (reference != nullptr) errors_.emplace(Measured{user_, compiled_}, part, *reference);
  }

  Run Execute() {
    const Start<double> start = Assemble<Space>(description_, mechanism_);
    Run run;
    IntegratorResult result;
    if (start.outcome != Outcome::kFinished) {
      result.outcome = start.outcome;
      result.message = start.message;
    } else {
      Kinematics<Space, double> kinematics(mechanism_);
      kinematics.UpdatePosition(start.q);
      run.branch_start = ExactObserver<Space>(scene_, mechanism_).BranchAt(kinematics);
      result = Integrate(start);
      for (const auto& observer : observers_) observer->Write(run.record);
      if (errors_) errors_->Write(run.record);
      for (const auto& [key, pose] : final_poses_.items()) run.record.Set(key, pose);
      run.record.Set("state_hash", StateHash(y_));
    }
    Traces traces;
    for (const auto& observer : observers_) observer->Trace(traces);
    WriteResult(result, traces.projection_steps, run.record);
    run.drift = {traces.drift.t, traces.drift.value};
    if (with_series_) {
      run.correction = {traces.correction.t, traces.correction.value};
      run.energy = {traces.energy.t, traces.energy.value};
      run.kinetic = traces.kinetic;
    }
    return run;
  }

 private:
  /// What the integrator counted.
  void WriteResult(const IntegratorResult& result, std::int64_t projection_steps,
                   Record& record) const {
    record.Set("outcome", std::string(ToString(result.outcome)));
    record.Set("message", result.message);
    record.Set("t_reached", result.t_reached);
    record.Set("steps", result.steps);
    record.Set("rejected", result.rejected);
    record.Set("rhs_evaluations", result.rhs_evaluations);
    record.Set("rhs_equivalents", result.rhs_evaluations + projection_steps);
    record.Set("restarts", result.restarts);
    if (FindProfile(case_.integrator)->is_implicit) {
      record.Set("newton_jacobians", result.jacobians);
      record.Set("newton_rhs_evaluations", result.jacobian_rhs_evaluations);
      record.Set("newton_dual_evaluations", result.dual_evaluations);
      record.Set("newton_iterations", result.newton_iterations);
      record.Set("newton_failures", result.newton_failures);
    }
    record.Set("wall_s", result.wall_s);
    record.Set("cpu_s", result.cpu_s);
  }

  void Show(const Sample<Space>& sample, Outcome outcome) {
    for (const auto& observer : observers_) {
      if (outcome == Outcome::kFinished) observer->Observe(sample);
      if (outcome == Outcome::kSingular) observer->ObserveSingular(sample);
    }
  }

  /// Holds the state at the k-th time of the reference against it. `lower` is the same with more of
  /// the interpolation's error in it.
  void Compare(System<Space, double>& system, std::size_t k, std::span<const double> y,
               std::span<const double> lower) {
    const auto picture = [&](std::span<const double> state) {
      Snapshot snapshot = EmptySnapshot({user_, compiled_});
      system.FromState(errors_->times()[k], state);
      TakeSnapshot({user_, compiled_}, part_, system.kinematics(), &snapshot);
      return snapshot;
    };
    const Snapshot own = picture(y);
    errors_->Add(k, own, lower.data() == y.data() ? own : picture(lower));
  }

  IntegratorResult Integrate(const Start<double>& start) {
    const auto formulation = MakeFormulation<Space>(case_.column, mechanism_);
    IntegratorResult result;
    const auto peer = TryPeer(case_.column.formulation, description_, &result);
    if (result.outcome != Outcome::kFinished) return result;
    result.outcome = formulation->Start(0.0, start.q, start.u);
    if (result.outcome != Outcome::kFinished) return result;
    formulation->IntegrateWork(mechanism_.has_power() && !peer);  // peers integrate none
    GiveJacobian(case_.integrator, case_.jacobian, description_, *formulation);
    const std::size_t n = static_cast<std::size_t>(formulation->state_size());
    y_.assign(static_cast<std::size_t>(formulation->size()), 0.0);
    formulation->ToState(start.q, start.u, y_);
    std::vector<double> ydot(n);
    const StepObserver observe = [&](double t, std::span<double> y_and_work) {
      const std::span<double> y = y_and_work.first(n), work = y_and_work.subspan(n);
      const bool restart = formulation->BeginStep(t, y);
      // a derivative that fails here fails in the integrator's next call, with its outcome; only
      // what the failing matrix looked like is worth keeping
      const Outcome outcome = formulation->Examine(t, y, ydot);
      Sample<Space> sample{t, *formulation};
      sample.knows_work = !peer || !mechanism_.has_power();
      if (!work.empty()) sample.supplied = work[0], sample.dissipated = work[1];
      Show(sample, outcome);
      // peers have no dense output
      if (peer && errors_ && outcome == Outcome::kFinished && t == errors_->times().back()) {
        Compare(*formulation, errors_->times().size() - 1, y, y);
      }
      return restart ? StepAction::kRestart : StepAction::kContinue;
    };
    DenseObserver dense;
    if (errors_) {
      dense.times = errors_->times();
      dense.observe = [&](std::size_t k, std::span<const double> y, std::span<const double> lower) {
        Compare(*formulation, k, y.first(n), lower.first(n));
      };
    }
    const IntegratorOptions options = OptionsOf(case_, mechanism_.stop_times());
    IntegratorResult run = peer ? peer->Integrate(case_.horizon, y_, options, observe)
                                : harness::Integrate(*formulation, 0.0, case_.horizon, y_, options,
                                                     observe, errors_ ? &dense : nullptr);
    y_.resize(n);
    if (run.outcome == Outcome::kSingular) {
      const std::string why = formulation->solver().WhySingular();
      if (!why.empty()) run.message += ": " + why;
    }
    if (with_series_ && run.outcome == Outcome::kFinished &&
        formulation->Examine(run.t_reached, y_, ydot) == Outcome::kFinished) {
      WriteFinalPoses(user_, compiled_, part_, formulation->kinematics(), final_poses_);
    }
    return run;
  }

  const Case& case_;
  const MechanismDescription& user_;
  const Compiled& compiled_;
  int part_;
  const SceneObservation& scene_;
  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  std::vector<std::unique_ptr<Observer<Space>>> observers_;
  bool with_series_;
  std::optional<ErrorMeter> errors_;
  Record final_poses_;
  std::vector<double> y_;
};

Run RunOnce(const Experiment& experiment, const Case& one, const MechanismDescription& description,
            bool with_series, const Reference* reference = nullptr) {
  const SceneObservation& observe = experiment.scenes[one.scene].mechanism.observe;
  const CompiledScene scene = CompileScene(description, observe, experiment.compile);
  std::vector<Run> parts;
  for (int part = 0; part < static_cast<int>(scene.compiled.parts.size()); ++part) {
    const auto run = [&]<class Space>() {
      return Runner<Space>(experiment, one, description, scene, part, with_series, reference)
          .Execute();
    };
    const auto& own = scene.compiled.parts[static_cast<std::size_t>(part)].description;
    parts.push_back(own.space == SpaceKind::kPlanar ? run.template operator()<Planar>()
                                                    : run.template operator()<Spatial>());
  }
  Run run = MergeParts(parts);
  if (scene.compiled.done != CompileOptions::None()) {
    run.record.Set("compiled", ToString(scene.compiled.done));
  }
  return run;
}

void WriteGrowth(const Growth& growth, int failed, Record& record) {
  record.Set("growth_exponent", growth.exponent);
  record.Set("growth_spread", growth.spread);
  record.Set("growth_exponent_late", growth.exponent_late);
  record.Set("growth_spread_late", growth.spread_late);
  record.Set("growth_regime", growth.regime);
  record.Set("growth_resolved", growth.resolved && failed == 0);
  record.Set("growth_hypothesis", growth.hypothesis.name);
  record.Set("growth_hypothesis_resolved", growth.hypothesis_resolved && failed == 0);
  record.Set("growth_hypothesis_ratio", growth.hypothesis.ratio);
  record.Set("growth_rate", growth.hypothesis.rate);
  record.Set("growth_from", growth.t_from);
  record.Set("growth_to", growth.t_to);
  record.Set("ensemble", std::int64_t{growth.members});
  record.Set("ensemble_failed", std::int64_t{failed});
}

/// Growth of what is no drift, in the one run that it is known of: its exponent, without a verdict.
void WriteExponent(const std::string& key, const DriftSeries& series, double horizon, double scale,
                   Record& record) {
  if (series.t.empty() || !(scale > 0.0)) return;
  const Growth growth = AnalyseGrowth({&series, 1}, horizon, scale);
  if (std::isfinite(growth.exponent)) record.Set(key, growth.exponent);
}

}  // namespace

IntegratorOptions OptionsOf(const Case& one, const std::vector<double>& stop_times) {
  IntegratorOptions options;
  options.profile = one.integrator;
  options.fixed_step = one.step;
  const bool is_fixed = one.step > 0.0;
  options.rtol = is_fixed ? kToleranceOfFixedSteps : one.rtol;
  options.atol = is_fixed ? kToleranceOfFixedSteps : one.atol;
  options.step_limit = one.limits.steps;
  options.time_limit_s = one.limits.cpu_s;
  options.stop_times = stop_times;
  return options;
}

Record RunCase(const Experiment& experiment, const Case& one, const Reference* reference) {
  const ExperimentScene& scene = experiment.scenes[one.scene];
  Record record = one.keys;
  record.Set("scene_id", Fnv1a(scene.mechanism.canonical));
  const double link = LinkLength(scene.mechanism.description);
  record.Set("link_length", link);
  record.Set("position_goal",
             4 * std::numeric_limits<double>::epsilon() * link *
                 static_cast<double>(scene.mechanism.description.bodies.size() - 1));
  if (reference != nullptr) WriteCertificate(*reference, record);
  const bool usable = reference != nullptr && reference->NumTrusted() > 0;
  Run nominal =
      RunOnce(experiment, one, scene.mechanism.description, true, usable ? reference : nullptr);
  for (const auto& [key, value] : nominal.record.items()) record.Set(key, value);

  std::vector<DriftSeries> runs;
  EnsembleTally tally(nominal, one.branch_bound);
  int failed = 0;
  for (int member = 0; member < (one.ensemble > 1 ? one.ensemble : 0); ++member) {
    const MechanismDescription start = MemberStart(scene.mechanism.description, one, member);
    Run run = RunOnce(experiment, one, start, false);
    tally.Add(run, start);
    if (run.record.Text("outcome") != ToString(Outcome::kFinished)) {
      ++failed;
    } else {
      runs.push_back(std::move(run.drift));
    }
  }
  if (one.ensemble <= 1) runs.push_back(nominal.drift);
  std::erase_if(runs, [](const DriftSeries& run) { return run.t.empty(); });
  if (!runs.empty()) {
    const double length = scene.mechanism.observe.length;
    GrowthOptions options;
    // the bound for round-off holds for some ten lengths of path; paths grow with the horizon
    options.round_off *= std::max(1.0, one.horizon / 10.0);
    WriteGrowth(AnalyseGrowth(runs, one.horizon, length, options), failed, record);
  }
  WriteExponent("energy_growth_exponent", nominal.energy, one.horizon, nominal.kinetic, record);
  WriteExponent("correction_growth_exponent", nominal.correction, one.horizon,
                scene.mechanism.observe.length, record);
  if (one.ensemble > 1) tally.Write(record);
  const DriftSeries envelope = Envelope(nominal.drift, experiment.series_points);
  record.Set("series.drift_t", envelope.t);
  record.Set("series.drift", envelope.value);
  if (record.Text("outcome") == ToString(Outcome::kFinished)) {
    record.Set("doubts", OwnDoubts(record));
  }
  return record;
}

}  // namespace loopbench::harness
