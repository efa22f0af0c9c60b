#include <cmath>
#include <limits>

#include "harness/base/text.h"
#include "harness/observers/observer.h"
#include "harness/observers/registry.h"
#include "harness/run/run.h"

namespace loopbench::harness {

IntegratorOptions OptionsOf(const Case& entry, const std::vector<double>& stop_times) {
  IntegratorOptions options;
  static_cast<Integration&>(options) = entry.integration;
  options.profile = entry.integrator;
  options.fixed_step = entry.step;
  const bool is_fixed = entry.step > 0.0;
  options.rtol = is_fixed ? kToleranceOfFixedSteps : entry.rtol;
  options.atol = is_fixed ? kToleranceOfFixedSteps : entry.atol;
  if (is_fixed) options.max_step = options.initial_step = 0.0;
  options.step_limit = entry.limits.steps;
  options.time_limit_s = entry.limits.cpu_s;
  options.stop_times = stop_times;
  return options;
}

template <class Space>
void LimitSteps(const Case& entry, const Mechanism<Space, double>& mechanism,
                IntegratorOptions* options) {
  if (options->fixed_step > 0.0 || options->max_step > 0.0) return;
  if (mechanism.drives().empty()) return;
  if (mechanism.coordinates() != Coordinates::kJoint || mechanism.num_u() == 0) return;
  if (mechanism.num_u() > mechanism.num_equations()) return;
  // Methods of order five take 1.5 to 2 rtol^(1/6) rad a step; twice that limits no others.
  constexpr double kTurn = 4.0;
  constexpr int kTimes = 64;
  Kinematics<Space, double> kinematics(mechanism);
  double fastest = 0.0;  // rad/s, or lengths per second
  for (int k = 0; k <= kTimes; ++k) {
    kinematics.SetTime(entry.horizon * k / kTimes);
    for (std::size_t d = 0; d < mechanism.drives().size(); ++d) {
      const Drive& drive = mechanism.drives()[d];
      const int axis = mechanism.joints()[drive.joint].kind->axes[drive.coordinate];
      const double unit = axis < Space::kRot ? 1.0 : mechanism.length();
      fastest = std::max(fastest, std::abs(kinematics.drives()[d].rate) / unit);
    }
  }
  // ode45 has a limit of its own, a tenth of the horizon
  const double longest = kTurn * std::pow(options->rtol, 1.0 / 6.0) / fastest;
  if (longest < 0.1 * entry.horizon) options->max_step = longest;
}

template void LimitSteps(const Case&, const Mechanism<Planar, double>&, IntegratorOptions*);
template void LimitSteps(const Case&, const Mechanism<Spatial, double>&, IntegratorOptions*);

void SetOperations(const generate::MethodCounts& counts, Record& record) {
  const generate::OperationCounts& of = counts.result;
  record.Set("flops", of.flops());
  record.Set("additions", of.additions);
  record.Set("multiplications", of.multiplications);
  record.Set("divisions", of.divisions);
  record.Set("roots", of.roots);
  record.Set("sines", of.sines);
  record.Set("other", of.other);
  record.Set("depth", std::int64_t{counts.depth});
}

void WriteOperations(const Method& method, const MechanismDescription& description,
                     const Start<double>& start, Record& record) {
  try {
    const generate::RecordingSubject subject{
        .description = description,
        .coordinates = method.coordinates,
        .formulation = method.formulation,
        .options = {
            .enforcement = method.enforcement, .solver = method.solver, .gains = method.gains}};
    const auto recorded = generate::RecordFunction(subject, {.q = start.q, .u = start.u});
    SetOperations(generate::CountsOf(recorded), record);
  } catch (const std::exception&) {  // too long, or another program's; the run goes on
  }
}

namespace {

/// Writes outcome and counters. Newton steps of a projection count as evaluations, too.
void WriteCounts(const IntegratorResult& result, std::int64_t projection_steps, bool is_implicit,
                 Record& record) {
  record.Set("outcome", std::string(ToString(result.outcome)));
  record.Set("message", result.message);
  record.Set("t_reached", result.t_reached);
  record.Set("steps", result.steps);
  record.Set("rejected", result.rejected);
  record.Set("rhs_evaluations", result.rhs_evaluations);
  record.Set("rhs_equivalents", result.rhs_evaluations + projection_steps);
  record.Set("restarts", result.restarts);
  if (is_implicit) {
    record.Set("newton_jacobians", result.jacobians);
    record.Set("newton_rhs_evaluations", result.jacobian_rhs_evaluations);
    record.Set("newton_dual_evaluations", result.dual_evaluations);
    record.Set("newton_iterations", result.newton_iterations);
    record.Set("newton_failures", result.newton_failures);
  }
  record.Set("wall_s", result.wall_s);
  record.Set("cpu_s", result.cpu_s);
}

/// Constraints that differ by 1e-11 lengths still count as redundant
/// (mechanism/loops/excursion.cpp), dropped ones by ten times more (self_stress.h). Projection
/// cannot close them. Warnings allow 25 times the goal.
constexpr double kRedundantOpen = 4e-12;

/// Reference for the motion: one of these, or none.
struct ErrorReference {
  const Reference* reference = nullptr;     ///< with snapshots
  const PublishedSeries* series = nullptr;  ///< with times within the horizon
};

/// The case itself, or a member of its ensemble, which has fewer observers.
enum class RunKind { kCase, kMember };

/// Returns a hash of the last state, without the sign of zeros: equal hashes mean equal runs.
std::string StateHash(std::span<const double> y) {
  std::vector<double> numbers(y.begin(), y.end());
  for (double& number : numbers) number += 0.0;
  return Fnv1a({reinterpret_cast<const char*>(numbers.data()), y.size_bytes()});
}

template <class Space>
class Runner {
 public:
  /// Runs part `part` of `user`, simplified to `problem`.
  Runner(const Experiment& experiment, const Case& entry, const MechanismDescription& user,
         const SimplifiedProblem& problem, int part, RunKind kind, SideBySide* beside,
         const ErrorReference& held, const TrajectoryTask* trajectory)
      : case_(entry),
        kind_(kind),
        user_(user),
        compiled_(problem.compiled),
        part_(part),
        problem_(problem.observe),
        description_(problem.compiled.parts[static_cast<std::size_t>(part)].description),
        mechanism_(description_, entry.method.coordinates),
        stops_(mechanism_.stop_times()),
        beside_(beside) {
    const Measured measured{user_, compiled_};
    if (held.series != nullptr) {
      errors_ = MakeMeter(measured, part, *held.series, entry.horizon);
    } else if (held.reference != nullptr) {
      errors_ = MakeMeter(measured, part, *held.reference);
    }
    if (trajectory != nullptr) PrepareRows(*trajectory);
    const Watched<Space> watched{description_, mechanism_, problem_, experiment.series_points,
                                 stops_};
    observers_ = MakeObservers<Space>(watched, IsMember());
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
      run.branch_start = BranchAt<Space>(problem_, kinematics);
      result = Integrate(start);
      for (const auto& observer : observers_) observer->Write(run.record);
      if (const Value* regularized = run.record.Find("regularized_evaluations")) {
        run.record.Set("regularized_evaluations",
                       std::get<std::int64_t>(*regularized) - looked_by_then_);
      }
      if (errors_) errors_->Write(run.record);
      if (recorder_) recorder_->Finish(run.record);
      for (const auto& [key, pose] : final_poses_.items()) run.record.Set(key, pose);
      run.record.Set("state_hash", StateHash(y_));
    }
    Traces traces;
    for (const auto& observer : observers_) observer->Trace(traces);
    for (const auto& [key, count] : operations_.items()) run.record.Set(key, count);
    WriteCounts(result, traces.projection_steps, FindProfile(case_.integrator)->is_implicit,
                run.record);
    if (IsGenerated(case_.method.execution)) {
      run.record.Set("library_evaluations", library_evaluations_);
      run.record.Set("compile_s", compile_s_);
    }
    run.drift = {traces.drift.t, traces.drift.value};
    run.min_violation = std::max(mechanism_.is_redundant() ? kRedundantOpen : 0.0,
                                 std::numeric_limits<double>::epsilon() * LargestAngle());
    if (!IsMember()) {
      run.correction = {traces.correction.t, traces.correction.value};
      run.energy = {traces.energy.t, traces.energy.value};
      run.kinetic = traces.kinetic;
    }
    return run;
  }

 private:
  /// Returns the largest angle of the last state [rad]. Angles count turns, so rounding grows.
  double LargestAngle() const {
    double largest = 0.0;
    for (const TreeStep& step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
      const bool is_simple = joint.num_q() == joint.num_u() && joint.num_drives == 0;
      if (!is_simple || y_.empty()) continue;  // quaternions
      for (int i = 0; i < joint.num_q(); ++i) {
        if (joint.kind->axes[i] >= Space::kRot) continue;
        largest = std::max(largest, std::abs(y_[static_cast<std::size_t>(joint.q_offset + i)]));
      }
    }
    return largest;
  }

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

  /// Compares the state at the reference's k-th time. `lower`: with a larger interpolation error.
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
    const std::int64_t before = system.diagnostics().regularized_evaluations;
    look();
    looked_ += system.diagnostics().regularized_evaluations - before;
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
    const auto formulation = MakeFormulation<Space>(case_.method, mechanism_, beside_);
    IntegratorResult result;
    const auto peer = TryPeer(case_.method.formulation, description_, &result);
    if (result.outcome != Outcome::kFinished) return result;
    result.outcome = formulation->Start(0.0, start.q, start.u);
    if (result.outcome != Outcome::kFinished) return result;
    formulation->IntegrateWork(mechanism_.has_power() && !peer);  // peers integrate none
    GiveJacobian(case_.integrator, case_.jacobian, description_, *formulation);
    GiveExecution<Space>(case_.method, description_, *formulation, &result,
                         IsMember() ? &problem_ : nullptr);
    if (result.outcome != Outcome::kFinished) return result;
    const std::size_t n = static_cast<std::size_t>(formulation->state_size());
    y_.assign(static_cast<std::size_t>(formulation->size()), 0.0);
    formulation->ToState(start.q, start.u, y_);
    std::vector<double> ydot(n);
    IntegratorOptions options = OptionsOf(case_, stops_);
    if (!peer) LimitSteps(case_, mechanism_, &options);
    options.atols = AtolsOf(case_, description_, *formulation);
    const StepObserver observe = [&](double t, std::span<double> y_and_work) {
      const std::span<double> y = y_and_work.first(n), work = y_and_work.subspan(n);
      const bool restart = formulation->BeginStep(t, y_and_work);
      // components may have another meaning
      if (restart) options.atols = AtolsOf(case_, description_, *formulation);
      // a failing derivative fails again in the integrator's next call, which gives the outcome;
      // this keeps only the diagnostics of the failing matrix
      const Outcome outcome =
          IsMember() ? formulation->Look(t, y) : formulation->Examine(t, y, ydot);
      Sample<Space> sample{t, *formulation};
      sample.knows_work = !peer || !mechanism_.has_power();
      if (!work.empty()) sample.supplied = work[0], sample.dissipated = work[1];
      for (const auto& observer : observers_) {
        if (outcome == Outcome::kFinished) observer->Observe(sample);
        if (outcome == Outcome::kSingular) observer->ObserveSingular(sample);
      }
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
    const DenseObserver dense = Dense(*formulation);
    IntegratorResult run =
        peer ? peer->Integrate(case_.horizon, y_, options, observe)
             : harness::Integrate(*formulation, 0.0, case_.horizon, y_, options, observe,
                                  dense.times.empty() ? nullptr : &dense);
    if (const CompiledDerivative* compiled = formulation->compiled()) {
      library_evaluations_ = compiled->misses();
      compile_s_ = compiled->seconds();
    }
    if (!IsMember() && !peer) WriteOperations(case_.method, description_, start, operations_);
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

  bool IsMember() const { return kind_ == RunKind::kMember; }

  const Case& case_;
  const RunKind kind_;
  const MechanismDescription& user_;
  const Compiled& compiled_;
  int part_;
  const ObservedQuantities& problem_;
  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  std::vector<std::unique_ptr<Observer<Space>>> observers_;
  std::vector<double> stops_;  ///< [s], at which steps end
  SideBySide* beside_;
  std::unique_ptr<Meter> errors_;
  std::optional<Recorder<Space>> recorder_;
  bool by_steps_ = false;                         ///< rows are at the ends of steps
  std::vector<double> rows_;                      ///< else at these times
  std::int64_t looked_ = 0, looked_by_then_ = 0;  ///< regularized, outside steps; at last step
  std::int64_t library_evaluations_ = 0;          ///< instead of generated code
  double compile_s_ = 0.0;                        ///< [s], to record and compile
  Record final_poses_, operations_;
  std::vector<double> y_;
};

/// One motion of a case. `description` is the case's or the start of an ensemble member. Other runs
/// may be `beside` it. Parts connected through ground alone run one after another.
Run RunOnce(const Experiment& experiment, const Case& entry,
            const MechanismDescription& description, RunKind kind, SideBySide* beside,
            const ErrorReference& held = {}, const TrajectoryTask* trajectory = nullptr) {
  const ObservedQuantities& observe = experiment.problems[entry.problem].mechanism.observe;
  const SimplifiedProblem problem = SimplifyProblem(description, observe, experiment.compile);
  std::vector<Run> parts;
  for (int part = 0; part < static_cast<int>(problem.compiled.parts.size()); ++part) {
    const auto run = [&]<class Space>() {
      return Runner<Space>(experiment, entry, description, problem, part, kind, beside, held,
                           trajectory)
          .Execute();
    };
    const auto& own = problem.compiled.parts[static_cast<std::size_t>(part)].description;
    parts.push_back(own.space == SpaceKind::kPlanar ? run.template operator()<Planar>()
                                                    : run.template operator()<Spatial>());
  }
  Run run = MergeParts(parts);
  if (problem.compiled.done != CompileOptions::None()) {
    run.record.Set("preprocessed", ToString(problem.compiled.done));
  }
  return run;
}

/// Growth of drift over an ensemble, of which `failed` did not finish.
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

/// Writes the exponent of a growth other than drift, known only in this run, without a verdict.
void WriteExponent(const std::string& key, const DriftSeries& series, double horizon, double scale,
                   Record& record) {
  if (series.t.empty() || !(scale > 0.0)) return;
  const Growth growth = AnalyseGrowth({&series, 1}, horizon, scale);
  if (std::isfinite(growth.exponent)) record.Set(key, growth.exponent);
}

/// Runs the members of a case's ensemble and hands them over in their order, with their starts.
template <class Keep>
void ForEachMember(const Experiment& experiment, const Case& entry, int threads, const Keep& keep) {
  constexpr int kHeld = 1024;  // at most, of which runs wait to be handed over
  const int members = entry.ensemble > 1 ? entry.ensemble : 0;
  struct Member {
    MechanismDescription start;
    Run run;
  };
  std::vector<Member> held;
  for (int first = 0; first < members; first += kHeld) {
    held.assign(static_cast<std::size_t>(std::min(kHeld, members - first)), {});
    const auto run_member = [&](int i, SideBySide& beside) {
      Member& member = held[static_cast<std::size_t>(i)];
      member.start =
          MemberStart(experiment.problems[entry.problem].mechanism.description, entry, first + i);
      member.run = RunOnce(experiment, entry, member.start, RunKind::kMember, &beside);
    };
    RunSideBySide(static_cast<int>(held.size()), threads, run_member);
    for (Member& member : held) keep(std::move(member.run), member.start);
  }
}

/// Returns the reference for the case's errors, and writes its certified error to the record.
ErrorReference WriteCertificateOf(const ExperimentProblem& problem, const Case& entry,
                                  const Reference* reference, Record& record) {
  ErrorReference held;
  if (problem.series) {
    WriteCertificate(problem.mechanism.description, *problem.series, entry.horizon, record);
    if (problem.series->NumWithin(entry.horizon) > 0) held.series = &*problem.series;
  } else if (reference != nullptr) {
    WriteCertificate(*reference, record);
    if (reference->NumTrusted() > 0) held.reference = reference;
  }
  return held;
}

bool HasFinished(const Record& run) { return run.Text("outcome") == ToString(Outcome::kFinished); }

/// The largest difference of final poses from a run at a tenth of the tolerance, or at half the
/// fixed step; infinite where that run does not finish.
void WriteRefinement(const Experiment& experiment, Case entry, SideBySide* beside, Record& record) {
  entry.step /= 2.0;
  if (entry.step > 0.0) entry.limits.steps *= 2;
  entry.rtol /= 10.0;
  entry.atol /= 10.0;
  if (entry.atols) {
    for (double* tolerance : entry.atols->All()) *tolerance /= 10.0;
  }
  const Run finer =
      RunOnce(experiment, entry, experiment.problems[entry.problem].mechanism.description,
              RunKind::kCase, beside);
  record.Set("refinement_difference", HasFinished(finer.record)
                                          ? DifferenceOf(record, finer.record).largest
                                          : std::numeric_limits<double>::infinity());
}

}  // namespace

Record RunCase(const Experiment& experiment, const Case& entry, const Reference* reference,
               const std::filesystem::path& trajectory, int threads, SideBySide* beside) {
  const ExperimentProblem& problem = experiment.problems[entry.problem];
  Record record = entry.keys;
  record.Set("problem_id", Fnv1a(problem.mechanism.canonical));
  const double link = LinkLength(problem.mechanism.description);
  record.Set("link_length", link);
  const double goal = 4 * std::numeric_limits<double>::epsilon() * link *
                      static_cast<double>(problem.mechanism.description.bodies.size() - 1);
  record.Set("position_goal", goal);
  const ErrorReference held = WriteCertificateOf(problem, entry, reference, record);
  std::optional<TrajectoryTask> task;
  if (experiment.output && !trajectory.empty()) {
    task.emplace(*experiment.output, trajectory,
                 fmt::format("{} {} {} {}", entry.mechanism, ToString(entry.method),
                             entry.integrator, SettingOf(entry)));
  }
  Run nominal = RunOnce(experiment, entry, problem.mechanism.description, RunKind::kCase, beside,
                        held, task ? &*task : nullptr);
  for (const auto& [key, value] : nominal.record.items()) record.Set(key, value);
  record.Set("position_goal", std::max(goal, nominal.min_violation * link));

  // fixed steps have no tolerance to be judged by; pilots lack the reference of their experiment
  const bool is_unjudged = entry.step > 0.0 && held.series == nullptr &&
                           held.reference == nullptr &&
                           (reference != nullptr || !experiment.reference);
  if ((experiment.refine || is_unjudged) && !IsPeer(record) && HasFinished(record)) {
    WriteRefinement(experiment, entry, beside, record);
  }

  std::vector<DriftSeries> runs;
  EnsembleTally tally(nominal, entry.branch_bound);
  int failed = 0;
  ForEachMember(experiment, entry, threads, [&](Run run, const MechanismDescription& start) {
    tally.Add(run, start);
    if (!HasFinished(run.record)) {
      ++failed;
    } else {
      runs.push_back(std::move(run.drift));
    }
  });
  if (entry.ensemble <= 1) runs.push_back(nominal.drift);
  std::erase_if(runs, [](const DriftSeries& run) { return run.t.empty(); });
  if (!runs.empty()) {
    const double length = problem.mechanism.observe.length;
    // the bound for round-off holds for some ten lengths of path; paths grow with the horizon
    const double round_off = kRoundOffDrift * std::max(1.0, entry.horizon / 10.0);
    WriteGrowth(AnalyseGrowth(runs, entry.horizon, length, round_off), failed, record);
  }
  WriteExponent("energy_growth_exponent", nominal.energy, entry.horizon, nominal.kinetic, record);
  WriteExponent("correction_growth_exponent", nominal.correction, entry.horizon,
                problem.mechanism.observe.length, record);
  if (entry.ensemble > 1) tally.Write(record);
  const DriftSeries envelope = Envelope(nominal.drift, experiment.series_points);
  record.Set("series.drift_t", envelope.t);
  record.Set("series.drift", envelope.value);
  if (HasFinished(record)) {
    record.Set("warnings", OwnWarnings(record));
  }
  return record;
}

}  // namespace loopbench::harness
