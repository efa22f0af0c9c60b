#include <deque>
#include <limits>

#include "harness/base/text.h"
#include "harness/integrator/arkode.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

namespace {

constexpr int kStates = 16;  ///< states a batch goes through

/// One method of one mechanism, ready to be timed.
template <class Space>
class Subject {
 public:
  /// `description` must outlive the subject.
  Subject(const MechanismDescription& description, const Case& entry, bool simulate)
      : case_(entry),
        simulate_(simulate),
        description_(description),
        mechanism_(description, entry.method.coordinates),
        start_(Assemble<Space>(description, mechanism_)) {
    result_.outcome = start_.outcome;
    result_.message = start_.message;
    if (start_.outcome != Outcome::kFinished) return;
    peer_ = TryPeer(entry.method.formulation, description, &result_);
  }

  /// Runs the simulation once, keeping states for the right-hand sides. Not timed.
  void Prepare() {
    if (result_.outcome != Outcome::kFinished) return;
    Reset();
    if (result_.outcome != Outcome::kFinished) return;  // nothing is generated
    compile_s_ = CompileSeconds();
    states_.assign(1, y_);
    if (!simulate_) {
      result_.outcome = ode().Derivative(0.0, y_, ydot_);
      CalibrateBatch();
      return;
    }
    std::vector<std::vector<double>> all;
    result_ = Simulate([&](std::span<double> y) { all.emplace_back(y.begin(), y.end()); });
    compile_s_ = CompileSeconds();
    for (int i = 1; i < kStates && !all.empty(); ++i) {
      // a failing run ends near its failure: its last state stays out
      const std::size_t k = i * (all.size() - 1) / kStates;
      if (all[k].size() == states_[0].size()) states_.push_back(all[k]);
    }
    CalibrateBatch();
  }

  /// Times one batch of right-hand sides.
  void TimeDerivative() {
    if (evaluations_ == 0) return;
    const double begin = WallSeconds();
    for (int i = 0; i < evaluations_; ++i) {
      ode().Derivative(0.0, states_[i % states_.size()], ydot_);
    }
    rhs_ns.push_back((WallSeconds() - begin) * 1e9 / evaluations_);
  }

  /// Times one whole simulation.
  void TimeSimulation() {
    if (!simulate_ || result_.outcome != Outcome::kFinished) return;
    Reset();
    result_ = Simulate({});
    wall_s.push_back(result_.wall_s);
  }

  Record Finish(const Record& keys) {
    Record record = keys;
    record.Set("outcome", std::string(ToString(result_.outcome)));
    record.Set("message", result_.message);
    record.Set("t_reached", simulate_ ? Value(result_.t_reached) : Value());
    const int bodies = mechanism_.num_bodies() - 1;
    std::int64_t joints = 0;
    for (const auto& joint : mechanism_.joints()) joints += joint.description >= 0;
    record.Set("bodies", std::int64_t{bodies});
    record.Set("joints", joints);
    record.Set("loops", std::int64_t{mechanism_.num_loops()});
    if (!peer_ && start_.outcome == Outcome::kFinished) {
      WriteOperations(case_.method, description_, start_, record);
    }
    // Derivative() may have taken a fast path without a rank
    if (formulation_ && formulation_->Examine(0.0, y_, ydot_) == Outcome::kFinished) {
      const int dof = mechanism_.num_joint_speeds() - formulation_->diagnostics().rank;
      record.Set("dof", std::int64_t{dof});
    }
    const double rhs = Quantile(rhs_ns, 0.5), wall = Quantile(wall_s, 0.5);
    record.Set("rhs_ns_median", rhs);
    record.Set("rhs_ns_min", Quantile(rhs_ns, 0.0));
    record.Set("rhs_ns_p10", Quantile(rhs_ns, 0.1));
    record.Set("rhs_ns_p90", Quantile(rhs_ns, 0.9));
    record.Set("ns_per_body", rhs / bodies);
    record.Set("series.rhs_ns", rhs_ns);  // raw, for tests of significance (harness/judge)
    record.Set("series.wall_s", wall_s);
    if (!wall_s.empty()) {
      record.Set("step_us_median", wall * 1e6 / static_cast<double>(result_.steps));
      record.Set("wall_s_median", wall);
      record.Set("wall_s_min", Quantile(wall_s, 0.0));
      record.Set("wall_s_p10", Quantile(wall_s, 0.1));
      record.Set("wall_s_p90", Quantile(wall_s, 0.9));
      record.Set("realtime_factor", case_.horizon / wall);
      record.Set("steps", result_.steps);
    }
    record.Set("repeats", static_cast<std::int64_t>(simulate_ ? wall_s.size() : rhs_ns.size()));
    if (!formulation_ || peer_) return record;
    if (const CompiledDerivative* compiled = formulation_->compiled()) {
      record.Set("compile_s", compile_s_);
      record.Set("library_evaluations", compiled->misses());
    }
    for (const auto& [key, count] : formulation_->solver().Counters()) {
      record.Set(std::string(key), count);
    }
    return record;
  }

  std::vector<double> rhs_ns;  ///< one value per batch
  std::vector<double> wall_s;  ///< one value per simulation, empty on failure

 private:
  /// Returns the timed object.
  Ode& ode() {
    if (peer_) return *peer_;
    return *formulation_;
  }

  void Reset() {
    formulation_ = MakeFormulation<Space>(case_.method, mechanism_);
    formulation_->Start(0.0, start_.q, start_.u);
    // where prescribed motions leave no state, only the work is integrated
    formulation_->IntegrateWork(formulation_->state_size() == 0);
    y_.assign(static_cast<std::size_t>(formulation_->size()), 0.0);
    ydot_.resize(y_.size());
    formulation_->ToState(start_.q, start_.u, y_);
    if (!peer_) GiveExecution<Space>(case_.method, description_, *formulation_, &result_);
  }

  double CompileSeconds() const {
    const CompiledDerivative* compiled = formulation_->compiled();
    return compiled != nullptr ? compiled->seconds() : 0.0;
  }

  IntegratorResult Simulate(const std::function<void(std::span<double>)>& keep) {
    IntegratorOptions options = OptionsOf(case_, mechanism_.stop_times());
    if (peer_) {
      StepObserver observe;
      if (keep)
        observe = [&](double, std::span<double> y) { return keep(y), StepAction::kContinue; };
      return peer_->Integrate(case_.horizon, y_, options, observe);
    }
    LimitSteps(case_, mechanism_, &options);
    GiveJacobian(case_.integrator, case_.jacobian, description_, *formulation_);
    options.atols = AtolsOf(case_, description_, *formulation_);
    const auto observe = [&](double t, std::span<double> y) {
      if (keep) keep(y);
      if (!formulation_->BeginStep(t, y)) return StepAction::kContinue;
      options.atols = AtolsOf(case_, description_, *formulation_);
      return StepAction::kRestart;
    };
    return Integrate(*formulation_, 0.0, case_.horizon, y_, options, observe);
  }

  /// Evaluations per batch, from the time of a first few (which also warm up).
  void CalibrateBatch() {
    evaluations_ = 1;
    for (double spent = 0.0; spent < kBatchSeconds / 4; evaluations_ *= 2) {
      const double begin = WallSeconds();
      for (int i = 0; i < evaluations_; ++i) {
        const auto& state = states_[i % states_.size()];
        if (ode().Derivative(0.0, state, ydot_) != Outcome::kFinished) {
          evaluations_ = 0;  // failures are not timed
          return;
        }
      }
      spent = WallSeconds() - begin;
    }
    evaluations_ *= 2;
  }

  Case case_;
  bool simulate_;
  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  Start<double> start_;
  std::unique_ptr<System<Space, double>> formulation_;
  std::unique_ptr<Peer> peer_;  ///< instead of the formulation, which then only counts
  std::vector<double> y_, ydot_;
  std::vector<std::vector<double>> states_;
  int evaluations_ = 0;
  double compile_s_ = 0.0;  ///< [s], the first time; later cases reuse the compiled code
  IntegratorResult result_;
};

/// Calibration values of the kept rounds, and the number of discarded rounds.
struct Rounds {
  double calibration = std::numeric_limits<double>::quiet_NaN();
  std::int64_t disturbed = 0;
};

/// Times rounds of one kind, the subjects in turn, the calibration between them. If other load
/// disturbs the machine, more rounds are taken and the quietest are kept.
template <class Subject>
Rounds TimeInTurn(int number, std::deque<Subject>& subjects, void (Subject::*time)(),
                  std::vector<double> Subject::*times) {
  const auto wanted = static_cast<std::size_t>(number);
  constexpr double kPatience_s = 1.0;  // as long as a neighbour's burst of work; some stay longer
  std::vector<std::vector<double>> calibrations;
  std::vector<double> slowest;
  std::vector<std::size_t> kept;
  const auto is_quiet = [&](std::size_t round) {
    return slowest[round] <= kOtherSpeed * CalibrationBaselineNs();
  };
  double enough = WallSeconds();
  do {
    std::vector<double>& round = calibrations.emplace_back();
    for (Subject& subject : subjects) {
      round.push_back(CalibrationNs());
      (subject.*time)();
    }
    round.push_back(CalibrationNs());
    slowest.push_back(std::ranges::max(round));
    if (slowest.size() <= wanted) enough = WallSeconds();
    kept = QuietRounds(slowest, CalibrationBaselineNs(), wanted);
  } while (slowest.size() < wanted ||
           (!std::ranges::all_of(kept, is_quiet) && WallSeconds() - enough < kPatience_s));
  std::vector<double> of_kept;
  for (const std::size_t round : kept) {
    of_kept.insert(of_kept.end(), calibrations[round].begin(), calibrations[round].end());
  }
  for (Subject& subject : subjects) {
    std::vector<double>& all = subject.*times;
    if (all.size() != slowest.size()) continue;  // a failed simulation
    for (std::size_t i = 0; i < kept.size(); ++i) all[i] = all[kept[i]];
    all.resize(kept.size());
  }
  return {Quantile(std::move(of_kept), 0.5), std::ssize(slowest) - std::ssize(kept)};
}

template <class Space>
std::vector<Record> TimeIn(const MechanismDescription& description, const Experiment& experiment,
                           const TimingGroup& group, int batches) {
  std::deque<Subject<Space>> subjects;
  for (const Case& entry : group.cases) subjects.emplace_back(description, entry, group.simulate);
  // the A/A pair is first and last: maximum distance between two methods
  subjects.emplace_back(description, group.cases.front(), group.simulate);
  for (Subject<Space>& subject : subjects) subject.Prepare();
  const MachineState machine = ReadMachineState();
  const Rounds rhs =
      TimeInTurn(batches, subjects, &Subject<Space>::TimeDerivative, &Subject<Space>::rhs_ns);
  const Rounds wall = TimeInTurn(experiment.timing.repeats, subjects,
                                 &Subject<Space>::TimeSimulation, &Subject<Space>::wall_s);
  const Subject<Space>&first = subjects.front(), &again = subjects.back();
  const double aa_rhs = AaSpread(first.rhs_ns, again.rhs_ns);
  const double aa_wall = AaSpread(first.wall_s, again.wall_s);
  Record noise;
  noise.Set("aa_spread", aa_rhs);
  noise.Set("aa_spread_wall", aa_wall);
  noise.Set("load1", machine.load1);
  noise.Set("processors", std::int64_t{machine.processors});
  noise.Set("governor", machine.governor);
  noise.Set("noise", NoiseReasons(machine, aa_rhs, aa_wall));
  noise.Set("calibration_ns", rhs.calibration);
  noise.Set("calibration_wall_ns", wall.calibration);
  noise.Set("discarded_repetitions", rhs.disturbed + wall.disturbed);
  std::vector<Record> records;
  for (std::size_t i = 0; i < group.cases.size(); ++i) {
    records.push_back(subjects[i].Finish(group.cases[i].keys));
    for (const auto& [key, value] : noise.items()) records.back().Set(key, value);
  }
  return records;
}

/// Returns one system per timing: parts are not timed separately.
MechanismDescription OneSystem(const Experiment& experiment, std::size_t problem) {
  CompileOptions options = experiment.compile;
  options.islands = false;
  const MechanismFile& file = experiment.problems[problem].mechanism;
  return SimplifyProblem(file.description, file.observe, options)
      .compiled.parts.front()
      .description;
}

void SetTimingId(const std::string& content, Record* keys) {
  keys->Set("kind", std::string("timing"));
  SetCaseId(keys, content);
}

}  // namespace

std::vector<Record> TimeTogether(const Experiment& experiment, const TimingGroup& group,
                                 int batches) {
  const MechanismDescription description = group.describe();
  return description.space == SpaceKind::kPlanar
             ? TimeIn<Planar>(description, experiment, group, batches)
             : TimeIn<Spatial>(description, experiment, group, batches);
}

std::vector<TimingGroup> TimingGroups(const Experiment& experiment, const Selection& filter) {
  std::vector<TimingGroup> groups;
  // cases are ordered by problem and, within it, by horizon
  for (const Case& entry : ExpandTiming(experiment)) {
    if (!Matches(entry.keys, filter)) continue;
    const bool is_next = groups.empty() || groups.back().cases.back().problem != entry.problem ||
                         groups.back().cases.back().horizon != entry.horizon;
    if (is_next) {
      groups.push_back(
          {entry.mechanism,
           [&experiment, problem = entry.problem] { return OneSystem(experiment, problem); },
           {},
           true});
    }
    groups.back().cases.push_back(entry);
    SetTimingId(ProblemTimingContent(experiment, entry), &groups.back().cases.back().keys);
  }
  if (experiment.timing.repeats == 0) return groups;
  for (const TimingFamily& family : experiment.timing.families) {
    for (const int size : family.sizes) {
      TimingGroup group{fmt::format("{}-{}", family.family, size),
                        [make = SizedFamilyOf(family.family).make, size] { return make(size); },
                        {},
                        false};
      for (const Method& method : family.methods) {
        Case entry;
        entry.mechanism = group.name;
        entry.method = method;
        entry.keys = CaseKeys(experiment, entry);
        // a right-hand side has no tolerance and no horizon
        for (const char* key : {"integrator", "rtol", "atol", "horizon"}) {
          entry.keys.Set(key, Value());
        }
        if (!Matches(entry.keys, filter)) continue;
        SetTimingId(FamilyTimingContent(experiment), &entry.keys);
        group.cases.push_back(entry);
      }
      if (!group.cases.empty()) groups.push_back(std::move(group));
    }
  }
  return groups;
}

std::size_t CountTimings(const Experiment& experiment, const Selection& filter) {
  std::size_t count = 0;
  for (const TimingGroup& group : TimingGroups(experiment, filter)) count += group.cases.size();
  return count;
}

}  // namespace loopbench::harness
