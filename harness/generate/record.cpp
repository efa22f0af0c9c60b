#include "harness/generate/record.h"

#include <cmath>
#include <set>

#include "harness/base/text.h"
#include "harness/generate/recorded.h"
//
#include "lagrange/lagrange.h"
#include "mechanism/formulation/projection_steps.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "reduction/reduction.h"

namespace loopbench::generate {

namespace {

template <class Space>
std::unique_ptr<System<Space, Recorded>> MakeRecorded(const std::string& formulation,
                                                      const Mechanism<Space, Recorded>& mechanism,
                                                      const FormulationOptions& options) {
  if (formulation == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  if (formulation == "lagrange") return MakeSystem<lagrange::Lagrange>(mechanism, options);
  if (formulation == "reduction") return MakeSystem<reduction::DenseReduction>(mechanism, options);
  throw NotCovered(fmt::format(
      "formulation \"{}\" is compiled for double alone: no operations are recorded", formulation));
}

/// The node of a number in the graph of the current recording.
int NodeOf(const Recorded& x, Graph& graph) {
  return x.node >= 0 ? x.node : graph.Constant(x.number);
}

template <class Space>
class Recorder {
 public:
  Recorder(const RecordingSubject& subject, const RecordingStart& start)
      : subject_(subject), mechanism_(subject.description, subject.coordinates) {
    FormulationOptions options = subject.options;
    options.general = true;
    options.beside = nullptr;
    system_ = MakeRecorded(subject.formulation, mechanism_, options);
    q_ = start.q.cast<Recorded>();
    u_ = start.u.cast<Recorded>();
    if (system_->Start(start.t, q_, u_) != Outcome::kFinished)
      throw NotCovered("it does not start");
    if (!start.mode.empty()) system_->solver().TakeMode(start.mode);
    if (!start.whole_turns.empty()) system_->TakeWholeTurns(start.whole_turns);
    system_->IntegrateWork(subject.with_work);
  }

  /// At time t and `state`, or for null next to the start; `casts` as recorded.h has it.
  RecordedFunction Record(double t, const std::vector<double>* state, CastsAs casts) {
    std::vector<Recorded> y(static_cast<std::size_t>(system_->size()), Recorded(0.0));
    system_->ToState(q_, u_, y);
    if (state != nullptr && state->size() != y.size()) {
      throw NotCovered("the state carries other speeds in the recorded text than in double");
    }
    RecordedFunction recorded;
    recorded.graph = Graph(subject_.keeps_numbers);
    for (int i = 0; i < system_->num_state_speeds(); ++i) {
      recorded.carried_speeds.push_back(system_->state_speed(i));
    }
    Graph& graph = recorded.graph;
    const Recording recording(graph, casts, subject_.most_nodes);
    const Recorded time = Recorded::Input(state != nullptr ? t : t + ShiftOf(y.size()));
    recorded.inputs.push_back(time.node);
    for (std::size_t i = 0; i < y.size(); ++i) {
      y[i] = Recorded::Input(state != nullptr ? (*state)[i] : y[i].number + ShiftOf(i));
      recorded.inputs.push_back(y[i].node);
    }
    for (const Recorded& value : Values(time, y)) {
      recorded.outputs.push_back(NodeOf(value, graph));
      recorded.numbers.push_back(value.number);
    }
    if (subject_.quantity == Quantity::kDerivative) {
      recorded.is_regularized =
          mechanism_.num_u() > 0 && system_->solver().conditioning().is_regularized;
      AddStages(recorded);
    }
    recorded.structure = graph.Structure(recorded.outputs);
    const std::vector<double> constants = ConstantsOf(recorded);
    recorded.key = recorded.structure +
                   harness::Fnv1a(fmt::format("{} {:a} {}", Space::kDim, fmt::join(constants, " "),
                                              fmt::join(mechanism_.body_names(), " ")));
    return recorded;
  }

 private:
  std::vector<Recorded> Values(const Recorded& t, std::vector<Recorded>& y) {
    std::vector<Recorded> values;
    if (subject_.quantity == Quantity::kDerivative) {
      values.assign(y.size(), Recorded(0.0));
      Require(system_->Examine(t, y, values));
      return values;
    }
    Require(system_->FromState(t, y));
    const Kinematics<Space, Recorded>& kinematics = system_->kinematics();
    switch (subject_.quantity) {
      case Quantity::kDerivative:
        break;
      case Quantity::kEnergy: {
        const Energy<Recorded> energy = ComputeEnergy(kinematics);
        return {energy.kinetic, energy.potential};
      }
      case Quantity::kPoses:
        for (int body = 1; body < mechanism_.num_bodies(); ++body) {
          const Pose<Space, Recorded>& pose = kinematics.poses()[body];
          values.insert(values.end(), std::begin(pose.p.at), std::end(pose.p.at));
          if constexpr (Space::kRot == 1) {
            values.insert(values.end(), {pose.R(0, 0), pose.R(1, 0)});
          } else {
            for (int i = 0; i < 9; ++i) values.push_back(pose.R(i / 3, i % 3));
          }
        }
        break;
      case Quantity::kMismatch:
      case Quantity::kViolation: {
        Correction<Recorded> largest;
        VectorX<Recorded> violation = VectorX<Recorded>::Zero(mechanism_.num_equations());
        PositionViolation(kinematics, violation, largest);
        if (subject_.quantity == Quantity::kMismatch) return {largest.rotation, largest.shift};
        values.assign(violation.begin(), violation.end());
        SpeedViolation(kinematics, violation);
        values.insert(values.end(), violation.begin(), violation.end());
        break;
      }
      case Quantity::kCorrection:
      case Quantity::kPositionStep:
      case Quantity::kSpeedStep:
        return Corrected(y.size());
    }
    return values;
  }

  /// The steps of level projection from the system's state: both or one of them.
  std::vector<Recorded> Corrected(std::size_t size) {
    FactoredState<Space, Recorded> state(mechanism_, system_->solver());
    state.Follow(system_->kinematics());
    state.SetPositions(system_->q());
    state.SetSpeeds(system_->u());
    LibrarySteps<Space, Recorded> steps(mechanism_);
    if (steps.has_constraints() && subject_.quantity != Quantity::kSpeedStep) {
      Correction<Recorded> largest;
      Require(steps.Measure(state, largest));
      Require(steps.Step(state));
    }
    if (steps.has_constraints() && subject_.quantity != Quantity::kPositionStep) {
      Require(steps.CorrectSpeeds(state));
    }
    if (subject_.quantity == Quantity::kCorrection) {
      std::vector<Recorded> values(size, Recorded(0.0));
      system_->ToState(state.q(), state.u(), values);
      return values;
    }
    if (system_->solver().conditioning().is_regularized) {
      throw NotCovered("constraints are regularized where a step of the projection is recorded");
    }
    const bool is_speeds = subject_.quantity == Quantity::kSpeedStep;
    const VectorX<Recorded>& result = is_speeds ? state.u() : state.q();
    return {result.begin(), result.end()};
  }

  static void Require(Outcome outcome) {
    if (outcome == Outcome::kFinished) return;
    throw NotCovered(
        fmt::format("the right-hand side ends as {} where it is recorded", ToString(outcome)));
  }

  /// Repeats computations of Examine(), so dy/dt depends on no additional node.
  void AddStages(RecordedFunction& recorded) const {
    Graph& graph = recorded.graph;
    const OperationCounts as_run = graph.as_run;
    const auto add = [&graph](const auto& small, std::vector<int>& nodes) {
      for (const Recorded& number : small.at) nodes.push_back(NodeOf(number, graph));
    };
    const auto add_both = [&](const auto& vector, std::vector<int>& nodes) {
      add(vector.angular, nodes);
      add(vector.linear, nodes);
    };
    const Kinematics<Space, Recorded>& kinematics = system_->kinematics();
    Stages& stages = recorded.stages;
    for (const Recorded& speed : kinematics.u()) stages.speeds.push_back(NodeOf(speed, graph));
    for (const auto& pose : kinematics.poses()) {
      add(pose.R, stages.positions);
      add(pose.p, stages.positions);
    }
    for (const auto& motion : kinematics.motions()) add_both(motion, stages.motions);
    for (const auto& joint : kinematics.joints()) {
      add(joint.r_P, stages.positions);
      add(joint.r_Q, stages.positions);
      for (const auto& direction : joint.basis) add_both(direction, stages.positions);
      add_both(joint.V_rel, stages.motions);
      add_both(joint.g, stages.motions);
    }
    std::vector<Wrench<Space, Recorded>> wrenches(kinematics.poses().size());
    ForcesBesideGravity(kinematics, std::span(wrenches));
    for (const auto& wrench : wrenches) add_both(wrench, stages.forces);
    AppliedForces(kinematics, std::span(wrenches));
    for (const auto& wrench : wrenches) add_both(wrench, stages.forces);
    graph.as_run = as_run;
  }

  const RecordingSubject& subject_;
  Mechanism<Space, Recorded> mechanism_;
  std::unique_ptr<System<Space, Recorded>> system_;
  VectorX<Recorded> q_, u_;
};

/// Comparisons behind casts are not recorded: casts to other numbers must lead to the same graph.
void RequireNoCastDecides(const RecordedFunction& recorded, auto record_with) {
  for (const CastsAs casts : {CastsAs::kInfinity, CastsAs::kMinusInfinity}) {
    std::optional<RecordedFunction> other;
    try {
      other = record_with(casts);
    } catch (const std::exception&) {
    }
    if (!other || recorded.key != other->key) {
      throw NotCovered("a number that was cast to double decides which operations follow");
    }
  }
}

/// A graph does not contain the last accepted step, from which angles in space are counted.
void RequireNoTurns(const RecordedFunction& recorded, SpaceKind space) {
  if (space == SpaceKind::kPlanar) return;
  const std::vector<bool> live = recorded.graph.Live(recorded.outputs, true);
  for (std::size_t node = 0; node < live.size(); ++node) {
    if (live[node] && recorded.graph.nodes()[node].operation == Operation::kRemainder) {
      throw NotCovered("an angle at a joint that closes a loop is counted from the last step");
    }
  }
}

RecordedFunction RecordAt(const RecordingSubject& subject, const RecordingStart& start, double t,
                          const std::vector<double>* state) {
  const Enforcement level = subject.options.enforcement;
  if (!IsBuiltIn(level)) {
    throw NotCovered(fmt::format(
        "level \"{}\" is compiled for double alone: no operations are recorded", ToString(level)));
  }
  const SpaceKind space = subject.description.space;
  const auto record = [&](CastsAs casts) {
    return space == SpaceKind::kPlanar ? Recorder<Planar>(subject, start).Record(t, state, casts)
                                       : Recorder<Spatial>(subject, start).Record(t, state, casts);
  };
  RecordedFunction recorded = record(CastsAs::kNumber);
  // members of an ensemble record equal graphs, of which one is checked
  constexpr std::size_t kMaxChecked = 1000;
  thread_local std::set<std::string> checked;
  if (checked.contains(recorded.key)) return recorded;
  RequireNoCastDecides(recorded, record);
  RequireNoTurns(recorded, space);
  if (checked.size() >= kMaxChecked) checked.clear();
  checked.insert(recorded.key);
  return recorded;
}

}  // namespace

/// Different numbers between -1e-6 and 1e-6, none of them zero: multiples of the golden ratio.
double ShiftOf(std::size_t i) {
  const double multiple = 0.6180339887498949 * static_cast<double>(i + 1);
  return 2e-6 * (multiple - std::floor(multiple)) - 1e-6;
}

RecordedFunction RecordFunction(const RecordingSubject& subject, const RecordingStart& start,
                                double t, const std::vector<double>& state) {
  return RecordAt(subject, start, t, &state);
}

RecordedFunction RecordFunction(const RecordingSubject& subject, const RecordingStart& start) {
  return RecordAt(subject, start, start.t, nullptr);
}

std::int64_t LiveNodes(const RecordedFunction& recorded) {
  return std::ranges::count(recorded.graph.Live(recorded.outputs, true), true);
}

void RequireShort(const RecordedFunction& recorded) {
  constexpr std::int64_t kMaxOperations = 50'000;
  const std::int64_t operations = LiveNodes(recorded);
  if (operations <= kMaxOperations) return;
  throw NotCovered(
      fmt::format("found {} operations, expected at most {}: they would take a compiler too long",
                  operations, kMaxOperations));
}

MethodCounts CountsOf(const RecordedFunction& recorded) {
  const Graph& graph = recorded.graph;
  const std::vector<bool> live = graph.Live(recorded.outputs, false);
  std::vector<bool> before(live.size(), false);
  MethodCounts counts;
  counts.as_run = graph.as_run;
  counts.result = graph.Count(live);
  counts.compared = graph.Count(graph.Live(recorded.outputs, true));
  counts.comparisons = std::ssize(graph.comparisons());
  counts.depth = graph.Depth(live);
  // operations of one stage that dy/dt depends on and no earlier stage has
  const auto own = [&](const std::vector<int>& nodes) {
    std::vector<bool> stage = graph.Live(nodes, false);
    for (std::size_t i = 0; i < stage.size(); ++i) {
      stage[i] = stage[i] && live[i] && !before[i];
      before[i] = before[i] || stage[i];
    }
    return stage;
  };
  const auto& [positions, speeds, motions, forces] = recorded.stages;
  counts.kinematics = graph.Count(own(positions));
  counts.solve = graph.Count(own(speeds));
  counts.kinematics += graph.Count(own(motions));
  counts.forces = graph.Count(own(forces));
  std::vector<bool> rest(live.size());
  for (std::size_t i = 0; i < live.size(); ++i) rest[i] = live[i] && !before[i];
  counts.solve += graph.Count(rest);
  counts.solve_depth = graph.Depth(rest, before);
  return counts;
}

}  // namespace loopbench::generate
