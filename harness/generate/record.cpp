#include "harness/generate/record.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <optional>

#include "harness/generate/recorded.h"
//
#include "lagrange/lagrange.h"
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

VectorX<Recorded> Constants(const Eigen::VectorXd& numbers) { return numbers.cast<Recorded>(); }

/// Different numbers between -1e-6 and 1e-6, none of them zero: multiples of the golden ratio.
double ShiftOf(std::size_t i) {
  const double multiple = 0.6180339887498949 * static_cast<double>(i + 1);
  return 2e-6 * (multiple - std::floor(multiple)) - 1e-6;
}

/// One recording; `casts` as recorded.h has it.
template <class Space>
RecordedDerivative RecordOnce(const RecordingSubject& subject, const RecordingStart& start,
                              double t, const std::vector<double>* state, CastsAs casts) {
  FormulationOptions options = subject.options;
  options.general = true;
  options.beside = nullptr;
  const Mechanism<Space, Recorded> mechanism(subject.description, subject.coordinates);
  const auto system = MakeRecorded(subject.formulation, mechanism, options);
  const VectorX<Recorded> q = Constants(start.q), u = Constants(start.u);
  if (system->Start(start.t, q, u) != Outcome::kFinished) throw NotCovered("it does not start");
  system->IntegrateWork(subject.with_work);
  std::vector<Recorded> y(static_cast<std::size_t>(system->size()), Recorded(0.0));
  system->ToState(q, u, y);
  RecordedDerivative recorded;
  if (state != nullptr && state->size() != y.size()) {
    throw NotCovered("the state carries other speeds in the recorded text than in double");
  }
  for (int i = 0; i < system->num_state_speeds(); ++i) {
    recorded.carried_speeds.push_back(system->state_speed(i));
  }
  const Recording recording(recorded.graph, casts);
  const Recorded time = Recorded::Input(state != nullptr ? t : t + ShiftOf(y.size()));
  for (std::size_t i = 0; i < y.size(); ++i) {
    y[i] = Recorded::Input(state != nullptr ? (*state)[i] : y[i].number + ShiftOf(i));
  }
  std::vector<Recorded> ydot(y.size(), Recorded(0.0));
  const Outcome outcome = system->Examine(time, y, ydot);
  if (outcome != Outcome::kFinished) {
    throw NotCovered(
        fmt::format("the right-hand side ends as {} where it is recorded", ToString(outcome)));
  }
  for (const Recorded& rate : ydot) {
    recorded.outputs.push_back(rate.node >= 0 ? rate.node : recorded.graph.Constant(rate.number));
    recorded.numbers.push_back(rate.number);
  }
  return recorded;
}

bool SameGraph(const RecordedDerivative& a, const RecordedDerivative& b) {
  const auto same = [](const Node& x, const Node& y) {
    return x.operation == y.operation && x.a == y.a && x.b == y.b &&
           std::bit_cast<std::uint64_t>(x.value) == std::bit_cast<std::uint64_t>(y.value);
  };
  return a.outputs == b.outputs && a.graph.comparisons() == b.graph.comparisons() &&
         std::ranges::equal(a.graph.nodes(), b.graph.nodes(), same);
}

/// Comparisons behind casts are not recorded: casts to other numbers must lead to the same graph.
void RequireNoCastDecides(const RecordedDerivative& recorded, auto record_with) {
  for (const CastsAs casts : {CastsAs::kInfinity, CastsAs::kMinusInfinity}) {
    std::optional<RecordedDerivative> other;
    try {
      other = record_with(casts);
    } catch (const std::exception&) {
    }
    if (!other || !SameGraph(recorded, *other)) {
      throw NotCovered("a number that was cast to double decides which operations follow");
    }
  }
}

/// A graph does not contain the last accepted step, from which angles in space are counted.
void RequireNoTurns(const RecordedDerivative& recorded, SpaceKind space) {
  if (space == SpaceKind::kPlanar) return;
  const std::vector<bool> live = recorded.graph.Live(recorded.outputs, true);
  for (std::size_t node = 0; node < live.size(); ++node) {
    if (live[node] && recorded.graph.nodes()[node].operation == Operation::kRemainder) {
      throw NotCovered("an angle at a joint that closes a loop is counted from the last step");
    }
  }
}

void RequireCovered(const RecordingSubject& subject) {
  const Enforcement level = subject.options.enforcement;
  if (!IsBuiltIn(level) || level == Enforcement::kPosition) {
    throw NotCovered(
        fmt::format("level \"{}\" is not recorded, only acceleration, velocity and baumgarte",
                    ToString(level)));
  }
}

RecordedDerivative RecordAt(const RecordingSubject& subject, const RecordingStart& start, double t,
                            const std::vector<double>* state) {
  RequireCovered(subject);
  const SpaceKind space = subject.description.space;
  const auto record = [&](CastsAs casts) {
    return space == SpaceKind::kPlanar ? RecordOnce<Planar>(subject, start, t, state, casts)
                                       : RecordOnce<Spatial>(subject, start, t, state, casts);
  };
  RecordedDerivative recorded = record(CastsAs::kNumber);
  RequireNoCastDecides(recorded, record);
  RequireNoTurns(recorded, space);
  return recorded;
}

}  // namespace

RecordedDerivative RecordDerivative(const RecordingSubject& subject, const RecordingStart& start,
                                    double t, const std::vector<double>& state) {
  return RecordAt(subject, start, t, &state);
}

RecordedDerivative RecordDerivative(const RecordingSubject& subject, const RecordingStart& start) {
  return RecordAt(subject, start, start.t, nullptr);
}

MethodCounts CountsOf(const RecordedDerivative& recorded) {
  const Graph& graph = recorded.graph;
  const std::vector<bool> live = graph.Live(recorded.outputs, false);
  return {.as_run = graph.as_run,
          .result = graph.Count(live),
          .compared = graph.Count(graph.Live(recorded.outputs, true)),
          .comparisons = std::ssize(graph.comparisons()),
          .depth = graph.Depth(live)};
}

}  // namespace loopbench::generate
