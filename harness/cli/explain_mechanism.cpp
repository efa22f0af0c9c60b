// explain: model, start and structure of a mechanism.
#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "mechanism/model/kinematics.h"
#include "odca/odca.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kMaxNames = 12;

/// Returns the names in order; of many only the first and the last, unless all are requested.
std::string Names(const std::vector<std::string>& names, const ExplainView& view) {
  if (view.all || names.size() <= kMaxNames) return fmt::format("{}", fmt::join(names, " "));
  const std::vector<std::string> first(names.begin(), names.begin() + kMaxNames - 2);
  return fmt::format("{} ... ({} omitted) {}", fmt::join(first, " "), names.size() - kMaxNames + 1,
                     names.back());
}

/// Returns the names of the joints and of the bodies of a loop.
std::pair<std::vector<std::string>, std::vector<std::string>> NamesIn(
    const LoopPath& loop, const MechanismDescription& description) {
  std::pair<std::vector<std::string>, std::vector<std::string>> names;
  for (const int j : loop.joints) names.first.push_back(description.joints[j].name);
  for (const int b : loop.bodies) names.second.push_back(description.bodies[b].name);
  return names;
}

Table LoopTable(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view) {
  Table table{
      .columns = Columns(
          "cut=cut joint, shift=gap [m]:scientific, turn=gap [rad]:scientific, what=of, through")};
  for (const LoopPath& loop : structure.loops) {
    const auto [joints, bodies] = NamesIn(loop, description);
    AddRow({description.joints[loop.cut_joint].name, loop.open_shift, loop.open_rotation, "joints",
            Names(joints, view)},
           &table);
    AddRow({"", Value(), Value(), "bodies", Names(bodies, view)}, &table);
  }
  return table;
}

void PrintFreedom(const Structure& s, const std::vector<std::string>& idle,
                  const ExplainView& view) {
  const int each = s.space == SpaceKind::kPlanar ? 3 : 6;
  view.Print("\nDegrees of freedom\n");
  view.Print("  {} by counting (Gruebler, Kutzbach): {} bodies x {} - {} constraints\n",
             s.counted_freedom, s.bodies, each, s.rows);
  if (!s.analysed) return;
  view.Print("  {} by rank: {} speeds of the tree - rank {} of the {} constraints of loops{}\n",
             s.joint_u - s.rank_nearby, s.joint_u, s.rank_nearby, s.loop_rows,
             s.couplings > 0 ? " and couplings" : "");
  for (const std::string& one : idle) view.Print("  1 of them idle: {}\n", one);
  if (s.locked() && s.freedom_at_start() > 0) {
    view.Print(
        "  0 finite motions: the start is singular, and its first-order motions\n"
        "  lead back to it\n");
    return;
  }
  if (s.freedom_of_parts) {
    view.Print("  {} finite motions: a part cannot move, see Warnings\n", *s.freedom_of_parts);
    return;
  }
  if (s.freedom_at_start() != s.freedom()) {
    view.Print("  {} at the start, a singular configuration of rank {}\n", s.freedom_at_start(),
               s.rank);
  }
  if (s.rank > 0 && s.singular_values.size() == 0) {
    view.Print("  all constraints are independent at the start, by sparse pivots\n");
  } else if (s.rank > 0) {
    view.Print("  scaled singular values at the start: {:.3g} largest, {:.3g} smallest nonzero\n",
               s.singular_values[0], s.singular_values[s.rank - 1]);
  }
}

void PrintRedundant(const MechanismDescription& description, const Structure& structure,
                    const ExplainView& view) {
  if (!structure.analysed) return;
  const int listed = static_cast<int>(structure.redundant.size());
  const int rest = structure.loop_rows - structure.rank_nearby - listed;
  const int implied = structure.couplings > 0 ? std::max(rest, 0) : 0;
  view.Print("\nRedundant constraints: {}\n", listed + implied);
  if (implied > 0) {
    view.Print("  couplings: {} of them follow from other constraints at the start\n", implied);
  }
  bool released = false, has_coupling = false;
  for (const RedundantDirection& one : structure.redundant) {
    has_coupling = has_coupling || one.coupling >= 0;
    view.Print("  {}: {}{}\n", description.joints[one.joint].name, one.name,
               one.released ? "" : " (at the start)");
    released = released || one.released;
  }
  if (!released) return;
  view.Print("  {} can be removed at once; the motion stays the same.\n",
             has_coupling ? "All directions of joints" : "All of them");
  if (structure.rounding > 0.0) {
    view.Print("  They are redundant within {:.2g} lengths: a run removes them (\"accuracy\").\n",
               structure.rounding);
  } else {
    view.Print(
        "  They are redundant at every position: a run keeps the rank of the constraints and "
        "observes all\n  (\"preprocess\": \"redundancy\").\n");
  }
}

void PrintIslands(const MechanismDescription& description, const Structure& structure,
                  const ExplainView& view) {
  Table table{
      .columns = Columns("subsystem:integer, bodies:integer, first=first body, held=connected to")};
  for (std::size_t i = 0; i < structure.islands.size(); ++i) {
    const Island& island = structure.islands[i];
    AddRow({i + 1, island.bodies.size(), description.bodies[island.bodies.front()].name,
            island.grounded ? "ground" : "nothing (floating)"},
           &table);
  }
  PrintSection("Separate subsystems, connected through ground at most", table, view, "subsystems");
}

void PrintCoordinates(const Structure& structure, const ExplainView& view) {
  Table table{.columns = Columns(
                  "set=coordinates, q=positions:integer, u=speeds:integer, "
                  "rows=constraints:integer, rank:integer, free=independent speeds:integer")};
  for (const Coordinates set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const bool joint = set == Coordinates::kJoint;
    const int speeds = joint ? structure.joint_u : structure.absolute_u;
    Record& row = AddRow({set, joint ? structure.joint_q : structure.absolute_q, speeds,
                          joint ? structure.loop_rows : structure.rows},
                         &table);
    if (!structure.analysed) continue;
    row.Set("rank", std::int64_t{speeds - structure.freedom()});
    row.Set("free", std::int64_t{structure.freedom()});
  }
  PrintSection("Coordinates", table, view, "coordinates");
}

template <class Space>
odca::Plan PlanFor(const MechanismDescription& description, SolverKind solver) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  return odca::MakePlan(mechanism, odca::PlanOptionsOf(solver));
}

void PrintPlanOfJoins(const MechanismDescription& description, const ExplainView& view) {
  Table table{.columns =
                  Columns("solver, depth:integer, handles=most handles:integer, largest=largest "
                          "join:integer, loops=joins that close loops:integer")};
  for (const SolverKind solver : {SolverKind::kRankRevealing, SolverKind::kAsPublished}) {
    const odca::Plan plan = description.space == SpaceKind::kPlanar
                                ? PlanFor<Planar>(description, solver)
                                : PlanFor<Spatial>(description, solver);
    AddRow({solver, plan.depth(), plan.most_handles(), plan.largest_join(), plan.loop_joins()},
           &table);
  }
  PrintSection("Plan of O-DCA", table, view, "odca_plan");
}

/// Prints efforts and reactions at rest; returns 2 if nothing can hold the mechanism.
int PrintStatics(const MechanismDescription& description, const Structure& structure,
                 const ExplainView& view) {
  const Statics statics = FindStatics(description, structure.start);
  if (view.document != nullptr) view.document->Add("statics_message", statics.why);
  if (!statics.why.empty()) {
    view.Print("\nForces at rest: none, {}\n", statics.why);
    return 2;
  }
  double largest = 0.0;
  for (const double value : statics.values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  const auto shown = [&](double value) {
    if (view.document != nullptr) return Value(value);
    if (std::isnan(value)) return Value("not unique");
    constexpr double kRoundOff = 1e-12;
    return Value(ShortNumber(std::abs(value) > kRoundOff * largest ? value : 0.0));
  };
  Table efforts, reactions;
  efforts.columns = Columns("joint, coordinate, effort, unit, held=held by");
  reactions.columns = Columns("joint, on");
  std::map<std::string, const JointDescription*> joints;
  std::map<std::string, std::string> holder_of;  // of columns
  for (const JointDescription& joint : description.joints) joints[LabelName(joint.name)] = &joint;
  for (const CouplingDescription& coupling : description.couplings) {
    for (const auto& [j, ratio] : coupling.parts) {
      const JointDescription& joint = description.joints[j];
      const std::string name = LabelName(coupling.name) + ":" + LabelName(joint.name);
      joints[name] = &joint;
      holder_of[name] = "coupling " + coupling.name;
    }
  }
  for (std::size_t i = 1; i < statics.columns.size(); ++i) {
    const auto& [kind, name, component, unit] = statics.columns[i];
    if (kind != "reaction") {
      const bool is_ours = Contains(statics.held, name + ":" + component);
      const bool is_drive = kind == "drive";
      const std::string coordinate =
          is_drive ? component
                   : std::string(ValueWords(joints[name]->type, description.space, false)[0].name);
      AddRow({joints[name]->name, coordinate, shown(statics.values[i]), unit,
              !is_drive ? holder_of[name]
              : is_ours ? "--statics"
                        : "its motion"},
             &efforts);
      continue;
    }
    if (component == "fx") {
      AddRow({joints[name]->name, description.bodies[joints[name]->to.body].name}, &reactions);
    }
    reactions.rows.back().Set(component, shown(statics.values[i]));
    if (reactions.rows.size() == 1) {
      reactions.columns.push_back({component, fmt::format("{} [{}]", component, unit)});
    }
  }
  PrintSection("Efforts that hold the start at rest", efforts, view, "efforts_at_rest");
  PrintSection("Reactions at rest", reactions, view, "reactions_at_rest");
  view.Print(
      "  Ground axes, on the body \"on\" at the joint's point; efforts and joint forces are not in "
      "them.\n");
  if (std::ranges::any_of(statics.values, [](double value) { return std::isnan(value); })) {
    view.Print("  not unique: redundant constraints share the load in no one way.\n");
  }
  if (statics.free > 0) {
    view.Print("  {} that no force drives {} not held.\n", WithCount(statics.free, "motion"),
               statics.free == 1 ? "is" : "are");
  }
  return 0;
}

/// Prints the limits of a coordinate and the positions there; returns 2 if there are none.
int PrintRange(const MechanismDescription& description, const ExplainView& view) {
  std::vector<std::string> names = Mapped<std::string>(description.joints, &JointDescription::name);
  const auto found = std::ranges::find(names, view.range);
  if (found == names.end()) {
    const std::string nearest = NearestSpelling(view.range, names);
    Reject("--range: found \"{}\", expected a joint{}", view.range,
           nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)");
  }
  const auto joint = static_cast<int>(found - names.begin());
  const CoordinateRange range = FindRange(description, joint);
  if (view.document != nullptr) view.document->Add("range_message", range.why);
  if (!range.why.empty()) {
    view.Print("\nRange of {}: none, {}\n", view.range, range.why);
    return 2;
  }
  const ValueWord word =
      ValueWords(description.joints[joint].type, description.space, false).front();
  Table table;
  table.columns = {{"end", "end"},
                   {"value", fmt::format("{} [{}]", word.name, word.unit)},
                   {"limit", "limit"},
                   {"in_line", "in line"},
                   {"position", "coordinates there"}};
  for (const bool is_low : {true, false}) {
    const RangeEnd& end = is_low ? range.low : range.high;
    std::vector<std::string> position;
    for (const JointValues& values : end.at.initial.coordinates) {
      if (values.joint == joint) continue;
      std::vector<std::string> numbers;
      for (const double number : values.values) numbers.push_back(ShortNumber(number));
      position.push_back(fmt::format("{} {}", names[values.joint], fmt::join(numbers, " ")));
    }
    const char* none = word.is_length() ? "none within ten lengths" : "none within a turn";
    AddRow({is_low ? "low" : "high",
            view.document != nullptr ? Value(end.value) : Value(ShortNumber(end.value)),
            end.binds ? "binds" : none, fmt::format("{}", fmt::join(end.in_line, "; ")),
            fmt::format("{}", fmt::join(position, ", "))},
           &table);
  }
  PrintSection(
      fmt::format("Range of {} from {} {}", view.range, ShortNumber(range.start), word.unit), table,
      view, "range");
  return 0;
}

/// Adds facts that the other sections do not contain.
void DescribeStructure(const MechanismDescription& description, const Structure& s,
                       const std::vector<std::string>& idle, JsonObject* document) {
  const std::vector<JointDescription>& joints = description.joints;
  std::vector<JsonObject> loops = Mapped<JsonObject>(s.loops, [&](const LoopPath& loop) {
    const auto [joint_names, body_names] = NamesIn(loop, description);
    return JsonOf("cut", joints[loop.cut_joint].name, "open_shift", loop.open_shift,
                  "open_rotation", loop.open_rotation, "joints", joint_names, "bodies", body_names);
  });
  std::vector<JsonObject> redundant =
      Mapped<JsonObject>(s.redundant, [&](const RedundantDirection& one) {
        return JsonOf("joint", joints[one.joint].name, "direction", one.name, "at_every_position",
                      one.released);
      });
  const auto known = [&s](int number) {
    return s.analysed ? Value(std::int64_t{number}) : Value();
  };
  const JsonObject freedom =
      JsonOf("by_counting", s.counted_freedom, "by_rank", known(s.freedom()), "at_start",
             known(s.freedom_at_start()), "constraints_of_loops", s.loop_rows, "rank",
             known(s.rank_nearby), "rank_at_start", known(s.rank), "idle", idle);
  Put(*document, "start_outcome", s.start.outcome, "start_message", s.start.message,
      "degrees_of_freedom", freedom, "loops", loops, "redundant", redundant);
}

// The assembled start of a mechanism, joint by joint, and its energy.

using Values = std::array<double, 7>;

/// Coordinates as integrated (tree joints), or as measured between the bodies (other joints).
template <class Space>
Values CoordinatesOf(int index, const InitialDescription& initial, const VectorX<double>& start,
                     const Kinematics<Space, double>& kinematics) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  const Joint<Space, double>& joint = mechanism.joints()[index];
  Values q{};
  if (joint.kind->coordinates == nullptr) return q;
  const Pose<Space, double> X_WF = Compose(kinematics.poses()[joint.from], joint.X_PF),
                            X_WM = Compose(kinematics.poses()[joint.to], joint.X_QM);
  joint.kind->coordinates(Compose(Inverse(X_WF), X_WM), q.data(), joint.kind->parameter);
  for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
    const int drive = mechanism.DriveOf(joint, i);
    if (drive >= 0) {
      q[i] = kinematics.drives()[drive].value;
    } else if (joint.in_tree()) {
      q[i] = start[next++];
    } else if (joint.kind->num_u == 1) {
      q[i] = kinematics.JointCoordinate(index);
    } else if (!joint.kind->has_quaternion() && joint.kind->axes[i] < Space::kRot) {
      const double guess = initial.GuessOf(index, static_cast<std::size_t>(i));
      q[i] = guess + std::remainder(q[i] - guess, 2.0 * std::numbers::pi);
    }
  }
  return q;
}

template <class Space>
Values SpeedsOf(int index, const Kinematics<Space, double>& kinematics) {
  Values u{};
  const Joint<Space, double>& joint = kinematics.mechanism().joints()[index];
  const JointState<Space, double>& state = kinematics.joints()[index];
  for (int i = 0, next = 0; i < joint.kind->num_u; ++i) {
    const int drive = kinematics.mechanism().DriveOf(joint, i);
    u[i] = drive >= 0 ? kinematics.drives()[drive].rate
                      : joint.kind->inverse_H_squared * state.H(next++).dot(state.V_rel);
  }
  return u;
}

std::string GivenBy(const MechanismDescription& description, int joint) {
  const InitialDescription& initial = description.initial;
  if (!description.joints[joint].motions.empty()) return "prescribed";
  std::string text;
  const auto has = [joint](const std::vector<JointValues>& list) {
    return Contains(list, joint, &JointValues::joint);
  };
  if (Contains(initial.held, joint)) {
    text = "fixed";
  } else if (has(initial.coordinates)) {
    text = "guessed";
  }
  if (has(initial.speeds)) text += text.empty() ? "speed" : ", speed";
  return text;
}

/// Prints the assembled start: coordinates and speeds of all joints, energy.
template <class Space>
void PrintStart(const MechanismDescription& description, const Start<double>& start,
                const ExplainView& view) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  Kinematics<Space, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  kinematics.UpdateVelocity(start.u);
  Table table{.columns = Columns("name=joint, coordinate, q=value, speed, u=value, given")};
  const auto with_unit = [](double value, std::string_view unit) {
    return fmt::format("{}{}{}", ShortNumber(value), unit.empty() ? "" : " ", unit);
  };
  for (int j = 0; j < static_cast<int>(description.joints.size()); ++j) {
    const JointDescription& joint = description.joints[j];
    const std::vector<ValueWord> positions = ValueWords(joint.type, description.space, false),
                                 speeds = ValueWords(joint.type, description.space, true);
    const Values q = CoordinatesOf(j, description.initial, start.q, kinematics),
                 u = SpeedsOf(j, kinematics);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      Record& row = table.rows.emplace_back();
      Put(row, "joint", joint.name);  // for programs, in every row
      if (i == 0) Put(row, "name", joint.name, "given", GivenBy(description, j));
      Put(row, "coordinate", positions[i].name, "q", with_unit(q[i], positions[i].unit));
      if (i >= speeds.size()) continue;
      Put(row, "speed", speeds[i].name, "u", with_unit(u[i], speeds[i].unit));
    }
  }
  const bool closed = start.outcome != Outcome::kInconsistentStart;
  PrintSection(closed ? "Start as assembled, t = 0" : "Start, not assembled", table, view, "start");
  if (!closed) return;
  const Energy<double> energy = ComputeEnergy(kinematics);
  if (view.document != nullptr) {
    view.document->Add("energy", JsonOf("kinetic", energy.kinetic, "potential", energy.potential,
                                        "total", energy.total()));
  }
  view.Print("  Energy: kinetic {} J + potential {} J = {} J\n", ShortNumber(energy.kinetic),
             ShortNumber(energy.potential), ShortNumber(energy.total()));
  view.Print(
      "  Zero potential: centres of mass and constant forces at the ground's origin, springs at "
      "rest,\n  joint torques at coordinate 0.\n");
}

/// Prints lines under a title, or "none".
void PrintLines(const char* title, const std::vector<std::string>& lines, const ExplainView& view) {
  view.Print("\n{}\n", title);
  if (lines.empty()) view.Print("  none\n");
  for (const std::string& line : lines) view.Print("  {}\n", line);
}

}  // namespace

int ExplainMechanism(const std::filesystem::path& path, const ExplainView& view) {
  const MechanismFile file = ReadMechanism(path);
  const MechanismDescription& description = file.description;
  const Structure structure = AnalyseStructure(description);
  const std::vector<std::string> warnings = FindWarnings(description, structure),
                                 idle =
                                     NamesOf(description, FindIdleFreedoms(description, structure)),
                                 hints = FindHints(description, structure);
  if (view.document != nullptr) {
    Put(*view.document, "name", description.name, "space", description.space, "gravity",
        std::vector<double>(description.gravity.begin(), description.gravity.end()));
    DescribeStructure(description, structure, idle, view.document);
  }
  view.Print("{} ({})\n  {} mechanism; lengths in m, angles in rad\n", description.name,
             path.string(), ToString(description.space));
  PrintModel(description, structure, view);
  if (description.space == SpaceKind::kPlanar) {
    PrintStart<Planar>(description, structure.start, view);
  } else {
    PrintStart<Spatial>(description, structure.start, view);
  }
  PrintFreedom(structure, idle, view);
  PrintSection("Loops", LoopTable(description, structure, view), view);
  PrintRedundant(description, structure, view);
  PrintIslands(description, structure, view);
  PrintCoordinates(structure, view);
  PrintPlanOfJoins(description, view);
  const Compiled compiled = Compile(description, CompileOptions::All());
  PrintLines("Possible simplifications", compiled.report, view);
  if (compiled.done != CompileOptions::None()) {
    view.Print("  Applicable: {}. Default of a run: {} (\"preprocess\" of an experiment).\n",
               ToString(compiled.done), ToString(CompileOptions()));
  }
  if (view.document != nullptr) {
    Put(*view.document, "simplifications", compiled.report, "warnings", warnings, "hints", hints);
  }
  PrintLines("Warnings", warnings, view);
  if (!hints.empty()) PrintLines("Hints", hints, view);
  int code = structure.start.outcome == Outcome::kInconsistentStart ? 2 : 0;
  const bool is_assembled = code == 0;
  if (view.statics && is_assembled) code = PrintStatics(description, structure, view);
  if (!view.range.empty() && is_assembled) code = std::max(code, PrintRange(description, view));
  const std::string fault = FreedomFault(description, file.observe, structure);
  if (fault.empty()) return code;
  if (view.document == nullptr) throw ConfigError(fault);
  view.document->Add("error", fault);
  PrintError("{}\n", fault);
  return 2;
}

}  // namespace loopbench::harness
