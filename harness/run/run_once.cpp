#include "harness/run/run_once.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "harness/integrator/arkode.h"
#include "harness/observers/final_poses.h"
#include "harness/observers/observer.h"
#include "harness/reference/error_meter.h"
#include "harness/run/compiled_scene.h"
#include "harness/run/peers.h"
#include "harness/run/run_case.h"
#include "harness/run/run_keys.h"
#include "harness/text/hash.h"
#include "harness/trajectory/recorder.h"
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
  /// Part `part` of `user`, simplified to `scene`. A member of an ensemble has others `beside` it,
  /// and less of it is watched.
  Runner(const Experiment& experiment, const Case& one, const MechanismDescription& user,
         const CompiledScene& scene, int part, SideBySide* beside, const HeldAgainst& held,
         const TrajectoryTask* trajectory)
      : case_(one),
        user_(user),
        compiled_(scene.compiled),
        part_(part),
        scene_(scene.observe),
        description_(scene.compiled.parts[static_cast<std::size_t>(part)].description),
        mechanism_(description_, one.column.coordinates),
        stops_(mechanism_.stop_times()),
        beside_(beside) {
    const Measured measured{user_, compiled_};
    if (held.series != nullptr) {
      errors_ = std::make_unique<SeriesMeter>(measured, part, *held.series, one.horizon);
    } else if (held.reference != nullptr) {
      errors_ = std::make_unique<ErrorMeter>(measured, part, *held.reference);
    }
    if (trajectory != nullptr) PrepareRows(*trajectory);
    const Watched<Space> watched{description_, mechanism_, scene_, experiment.series_points,
                                 stops_};
    observers_ = IsMember() ? MakeMemberObservers<Space>(watched) : MakeObservers<Space>(watched);
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
      if (const Value* softened = run.record.Find("softened_evaluations")) {
        run.record.Set("softened_evaluations", std::get<std::int64_t>(*softened) - looked_by_then_);
      }
      if (errors_) errors_->Write(run.record);
      if (recorder_) recorder_->Finish(run.record);
      for (const auto& [key, pose] : final_poses_.items()) run.record.Set(key, pose);
      run.record.Set("state_hash", StateHash(y_));
    }
    Traces traces;
    for (const auto& observer : observers_) observer->Trace(traces);
    WriteCounts(result, traces.projection_steps, FindProfile(case_.integrator)->is_implicit,
                run.record);
    if (case_.column.execution != Execution::kLibrary) {
      run.record.Set("library_evaluations", library_evaluations_);
      run.record.Set("compile_s", compile_s_);
    }
    run.drift = {traces.drift.t, traces.drift.value};
    if (!IsMember()) {
      run.correction = {traces.correction.t, traces.correction.value};
      run.energy = {traces.energy.t, traces.energy.value};
      run.kinetic = traces.kinetic;
    }
    return run;
  }

 private:
  /// Prepares the rows of a trajectory.
  void PrepareRows(const TrajectoryTask& task) {
    recorder_.emplace(user_, compiled_, mechanism_, task);
    by_steps_ = task.output.accepted_steps;
    rows_ = OutputTimes(task.output, case_.horizon);
    if (!task.output.exact) return;
    stops_.insert(stops_.end(), rows_.begin(), rows_.end());
    std::ranges::sort(stops_);
    stops_.erase(std::unique(stops_.begin(), stops_.end()), stops_.end());
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

  /// Runs `look`, which is none of the integrator's, and keeps its evaluations from being counted.
  template <class Look>
  void Uncounted(const System<Space, double>& system, Look look) {
    const std::int64_t before = system.diagnostics().softened_evaluations;
    look();
    looked_ += system.diagnostics().softened_evaluations - before;
  }

  /// The times of the reference and of rows, each once, for the integrator to show.
  DenseObserver Dense(System<Space, double>& system) {
    DenseObserver dense;
    if (errors_) dense.times = errors_->times();
    dense.times.insert(dense.times.end(), rows_.begin(), rows_.end());
    std::ranges::sort(dense.times);
    dense.times.erase(std::unique(dense.times.begin(), dense.times.end()), dense.times.end());
    const std::size_t n = static_cast<std::size_t>(system.state_size());
    dense.observe = [this, &system, n, times = dense.times](
                        std::size_t k, std::span<const double> y, std::span<const double> lower) {
      const auto find = [&](const std::vector<double>& in) -> std::optional<std::size_t> {
        const auto at = std::ranges::lower_bound(in, times[k]);
        if (at == in.end() || *at != times[k]) return std::nullopt;
        return static_cast<std::size_t>(at - in.begin());
      };
      const auto reference = errors_ ? find(errors_->times()) : std::nullopt;
      if (reference) Compare(system, *reference, y.first(n), lower.first(n));
      if (!find(rows_)) return;
      Uncounted(system, [&] { recorder_->TakeAt(times[k], system, y, lower); });
    };
    dense.derivative = [this, &system](double t, std::span<const double> y, std::span<double> f) {
      Outcome outcome;
      Uncounted(system, [&] { outcome = system.Derivative(t, y, f); });
      return outcome == Outcome::kFinished;
    };
    return dense;
  }

  IntegratorResult Integrate(const Start<double>& start) {
    const auto formulation = MakeFormulation<Space>(case_.column, mechanism_, beside_);
    IntegratorResult result;
    const auto peer = TryPeer(case_.column.formulation, description_, &result);
    if (result.outcome != Outcome::kFinished) return result;
    result.outcome = formulation->Start(0.0, start.q, start.u);
    if (result.outcome != Outcome::kFinished) return result;
    formulation->IntegrateWork(mechanism_.has_power() && !peer);  // peers integrate none
    GiveJacobian(case_.integrator, case_.jacobian, description_, *formulation);
    GiveExecution<Space>(case_.column, description_, *formulation, &result);
    if (result.outcome != Outcome::kFinished) return result;
    const std::size_t n = static_cast<std::size_t>(formulation->state_size());
    y_.assign(static_cast<std::size_t>(formulation->size()), 0.0);
    formulation->ToState(start.q, start.u, y_);
    std::vector<double> ydot(n);
    const StepObserver observe = [&](double t, std::span<double> y_and_work) {
      const std::span<double> y = y_and_work.first(n), work = y_and_work.subspan(n);
      const bool restart = formulation->BeginStep(t, y);
      // a derivative that fails here fails in the integrator's next call, with its outcome; only
      // what the failing matrix looked like is worth keeping
      const Outcome outcome =
          IsMember() ? formulation->Look(t, y) : formulation->Examine(t, y, ydot);
      Sample<Space> sample{t, *formulation};
      sample.knows_work = !peer || !mechanism_.has_power();
      if (!work.empty()) sample.supplied = work[0], sample.dissipated = work[1];
      Show(sample, outcome);
      looked_by_then_ = looked_;
      if (recorder_ && by_steps_) {
        recorder_->Take(t, *formulation, outcome == Outcome::kFinished, work);
      }
      // peers have no dense output
      if (peer && errors_ && outcome == Outcome::kFinished && t == errors_->times().back()) {
        Compare(*formulation, errors_->times().size() - 1, y, y);
      }
      return restart ? StepAction::kRestart : StepAction::kContinue;
    };
    const double compiled_before =
        formulation->compiled() != nullptr ? formulation->compiled()->seconds() : 0.0;
    const DenseObserver dense = Dense(*formulation);
    const IntegratorOptions options = OptionsOf(case_, stops_);
    IntegratorResult run =
        peer ? peer->Integrate(case_.horizon, y_, options, observe)
             : harness::Integrate(*formulation, 0.0, case_.horizon, y_, options, observe,
                                  dense.times.empty() ? nullptr : &dense);
    if (const CompiledDerivative* compiled = formulation->compiled()) {
      run.wall_s -= compiled->seconds() - compiled_before;
      library_evaluations_ = compiled->misses();
      compile_s_ = compiled->seconds();
    }
    y_.resize(n);
    if (run.outcome != Outcome::kFinished) {
      const std::string why = formulation->Why();
      if (!why.empty()) run.message += ": " + why;
    }
    if (!IsMember() && run.outcome == Outcome::kFinished &&
        formulation->Examine(run.t_reached, y_, ydot) == Outcome::kFinished) {
      WriteFinalPoses(user_, compiled_, part_, formulation->kinematics(), final_poses_);
    }
    return run;
  }

  bool IsMember() const { return beside_ != nullptr; }

  const Case& case_;
  const MechanismDescription& user_;
  const Compiled& compiled_;
  int part_;
  const SceneObservation& scene_;
  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  std::vector<std::unique_ptr<Observer<Space>>> observers_;
  std::vector<double> stops_;  ///< [s], at which steps end
  SideBySide* beside_;
  std::unique_ptr<Meter> errors_;
  std::optional<Recorder<Space>> recorder_;
  bool by_steps_ = false;                         ///< rows are at the ends of steps
  std::vector<double> rows_;                      ///< else at these times
  std::int64_t looked_ = 0, looked_by_then_ = 0;  ///< softened, for nobody's step; at the last one
  std::int64_t library_evaluations_ = 0;          ///< instead of generated code
  double compile_s_ = 0.0;                        ///< [s], to record and compile
  Record final_poses_;
  std::vector<double> y_;
};

}  // namespace

Run RunOnce(const Experiment& experiment, const Case& one, const MechanismDescription& description,
            SideBySide* beside, const HeldAgainst& held, const TrajectoryTask* trajectory) {
  const SceneObservation& observe = experiment.scenes[one.scene].mechanism.observe;
  const CompiledScene scene = CompileScene(description, observe, experiment.compile);
  std::vector<Run> parts;
  for (int part = 0; part < static_cast<int>(scene.compiled.parts.size()); ++part) {
    const auto run = [&]<class Space>() {
      return Runner<Space>(experiment, one, description, scene, part, beside, held, trajectory)
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

}  // namespace loopbench::harness
