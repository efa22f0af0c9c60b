#include "harness/exchange/export_simbody.h"

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/exchange/export_names.h"

namespace loopbench::exchange {
namespace {

constexpr const char* kHead = R"(//
// Debian's libsimbody-dev has Simbody. To compile and run:
//   g++ -std=c++17 -O2 -isystem /usr/include/simbody FILE.cpp -o FILE -lSimTKsimbody -lSimTKmath -lSimTKcommon
//   ./FILE              JSON: the start with its accelerations
//   ./FILE 1            the same after 1 s
//   ./FILE 1 1e-10      by a smaller error of a step (1e-8 where it is not said)
//
)";

using Type = SimbodyConstraintType;

/// Returns the class of a tree joint; "" if unsupported.
std::string MobilizerOf(const Joint& joint) {
  static const std::map<std::string, std::string> kMobilizers = {
      {"translation", "Translation"}, {"prismatic", "Slider"}, {"revolute", "Pin"},
      {"pin-in-slot", "BendStretch"}, {"planar", "Planar"},    {"weld", "Weld"},
      {"spherical", "Ball"},          {"free", "Free"},        {"universal", "Universal"},
      {"cylindrical", "Cylinder"},    {"helical", "Screw"}};
  if (joint.kind == "free" && joint.coordinates.size() == 3) return "Planar";
  const auto found = kMobilizers.find(joint.kind);
  return found == kMobilizers.end() ? "" : found->second;
}

constexpr int kX = 0, kY = 1, kZ = 2;

/// Constraint with axes on F and M.
struct Row {
  Type type;
  int axis_on_F = 0, axis_on_M = 0;
};
using Rows = std::vector<Row>;

/// Closures of joints. In the plane the tree keeps z = 0, so that points stay free along z.
struct Closure {
  Rows in_plane, in_space;
};

const std::map<std::string, Closure>& Closures() {
  const Row ball = {Type::kBall}, on_x = {Type::kPointOnLine, kX}, on_z = {Type::kPointOnLine, kZ};
  const Row across_y = {Type::kPointInPlane, kY}, across_z = {Type::kPointInPlane, kZ};
  const Row angle = {Type::kConstantAngle, kX, kY}, orientation = {Type::kConstantOrientation};
  // keep z of F and z of M parallel
  const Row x = {Type::kConstantAngle, kZ, kX}, y = {Type::kConstantAngle, kZ, kY};
  static const std::map<std::string, Closure> kClosures = {
      {"revolute", {{on_z}, {ball, x, y}}},
      {"prismatic", {{across_y, angle}, {on_x, orientation}}},
      {"weld", {{on_z, angle}, {{Type::kWeld}}}},
      {"pin-in-slot", {{across_y}, {on_x, x, y}}},
      {"cylindrical", {{}, {on_z, x, y}}},
      {"spherical", {{}, {ball}}},
      {"planar", {{}, {across_z, x, y}}},
      {"universal", {{}, {ball, angle}}},
      {"translation", {{}, {orientation}}},
      {"schoenflies", {{}, {x, y}}},
      {"point-on-line", {{}, {on_x}}},
      {"point-in-plane", {{}, {across_z}}}};
  return kClosures;
}

/// Returns constraints of one cut joint; nothing for a joint that Simbody does not support there.
std::optional<Rows> ClosureOf(const Joint& joint, bool planar) {
  if (joint.kind == "free") return Rows();
  if (joint.kind == "rod") return Rows{{Type::kRod}};
  if (!planar && !joint.imposed.empty()) {
    // Rotations about x and y of F by z of M; about z if it is not free.
    constexpr Row kRotations[] = {{Type::kConstantAngle, kY, kZ},
                                  {Type::kConstantAngle, kX, kZ},
                                  {Type::kConstantAngle, kX, kY}};
    Rows rows;
    for (const int component : joint.imposed) {
      rows.push_back(component < 3 ? kRotations[component]
                                   : Row{Type::kPointInPlane, component - 3});
    }
    return rows;
  }
  const auto found = Closures().find(joint.kind);
  if (found == Closures().end()) return std::nullopt;
  const Rows& rows = planar ? found->second.in_plane : found->second.in_space;
  return rows.empty() ? std::nullopt : std::optional(rows);
}

/// Makes a mobilizer. If P is the child of Q, MobilizedBody::Reverse keeps the Model's coordinates.
SimbodyMobilizer MakeMobilizer(const Model& model, std::size_t index) {
  const Joint& joint = model.tree[index];
  const Body& body = model.bodies[joint.child()];
  SimbodyMobilizer made;
  made.type = MobilizerOf(joint);
  made.joint = index;
  made.parent = joint.parent();
  made.child = joint.child();
  made.on_parent = joint.from_is_child ? joint.M : joint.F;
  made.on_child = joint.from_is_child ? joint.F : joint.M;
  made.reverse = joint.from_is_child;
  made.pitch = joint.parameter;
  if (made.type == "BendStretch") {
    // M slides in F and turns; relative to M, F turns back and slides back along the turned axis.
    // This is BendStretch in the other direction, with the opposite coordinates.
    made.reverse = !made.reverse;
    made.sign = -1.0;
  }
  made.mass = body.mass;
  const Matrix& I = body.inertia;
  // A planar body has a moment about z only; Simbody requires the other two, without effect.
  made.inertia = {I[0], I[4], I[8], I[1], I[2], I[5]};
  if (model.planar) made.inertia = {I[8], I[8], I[8], 0.0, 0.0, 0.0};
  return made;
}

void AddCouplers(const Model& model, SimbodyParts* parts) {
  for (const Coupling& coupling : model.couplings) {
    SimbodyCoupler& made = parts->couplers.emplace_back();
    for (const auto& [joint, ratio] : coupling.parts) {
      made.terms.emplace_back(model.tree[joint].child(), ratio * parts->mobilizers[joint].sign);
    }
    made.constant = 0.0 - coupling.offset;  // not -0
  }
  int flywheel = static_cast<int>(model.bodies.size());
  for (std::size_t i = 0; i < model.tree.size(); ++i) {
    const double J = model.tree[i].rotor_inertia;
    if (J == 0.0) continue;
    SimbodyMobilizer made;
    made.type = "Pin";
    made.joint = i;
    made.is_flywheel = true;
    made.child = flywheel;
    made.mass = 1.0;  // of no effect
    made.inertia = {J, J, J, 0.0, 0.0, 0.0};
    parts->couplers.push_back(
        {{{flywheel++, 1.0}, {model.tree[i].child(), -parts->mobilizers[i].sign}}, 0.0});
    parts->mobilizers.push_back(made);
  }
}

void AddForces(const Model& model, std::vector<SimbodyForce>* forces) {
  using Force = SimbodyForceType;
  for (const JointForce& force : model.joint_forces) {
    const int body = model.tree[force.joint].child();
    const auto add = [&](Force type, double first, double second) {
      if (first != 0.0) forces->push_back({type, body, 0, {}, {}, {first, second}});
    };
    add(Force::kMobilityConstantForce, force.constant, 0.0);
    add(Force::kMobilityLinearSpring, force.stiffness, force.rest);
    add(Force::kMobilityLinearDamper, force.damping, 0.0);
  }
  for (const PointForce& force : model.point_forces) {
    forces->push_back(
        {Force::kConstantForce, force.point.body, 0, force.point.at, force.force, {}});
  }
  for (const SpringDamper& force : model.spring_dampers) {
    const Point &from = force.from, &to = force.to;
    const auto add = [&](Force type, double first, double second) {
      if (first == 0.0) return;
      forces->push_back({type, from.body, to.body, from.at, to.at, {first, second}});
    };
    add(Force::kTwoPointLinearSpring, force.stiffness, force.length);
    add(Force::kTwoPointLinearDamper, force.damping, 0.0);
    add(Force::kTwoPointConstantForce, -force.preload, 0.0);
  }
}

using fmt::format;

template <class Range>
std::string Numbers(const Range& values) {
  return harness::Joined(values, ", ", NumberText);
}

std::string Point(const Vec& v) { return format("Vec3({})", Numbers(v)); }

std::string FrameText(const Frame& frame) {
  if (frame.R == Frame().R) return format("Transform({})", Point(frame.p));
  return format("Transform(Rotation(Mat33({}), true), {})", Numbers(frame.R), Point(frame.p));
}

std::string Axis(const Frame& frame, int axis) {
  return format("UnitVec3({})", Numbers(Vec{frame.R[axis], frame.R[3 + axis], frame.R[6 + axis]}));
}

/// Returns a name as the member "name" of a JSON object.
std::string Member(const std::string& key, const std::string& name) {
  const std::string object = harness::JsonObject().Add(key, name).Text();
  return QuoteCpp(object.substr(1, object.size() - 2));
}

/// Writes the program. Bodies are numbered as in Simbody, in tree order.
class Writer {
 public:
  explicit Writer(const Model& model) : model_(model), parts_(MakeSimbodyParts(model)) {
    number_.assign(parts_.mobilizers.size() + 1, 0);
    for (std::size_t i = 0; i < parts_.mobilizers.size(); ++i) {
      number_[parts_.mobilizers[i].child] = i + 1;
    }
  }

  ExportedFile Write() {
    std::string constructor = "Mechanism::Mechanism() {\n  body.push_back(matter.Ground());\n";
    for (const SimbodyMobilizer& one : parts_.mobilizers) constructor += Text(one);
    for (const SimbodyConstraint& one : parts_.constraints) constructor += Text(one);
    for (std::size_t i = 0; i < parts_.couplers.size(); ++i) constructor += CouplerText(i);
    constructor += format("  Force::Gravity(forces, matter, {});\n", Point(model_.gravity));
    for (const SimbodyForce& one : parts_.forces) constructor += Text(one);
    constructor += "}\n\n";
    AddNotes();
    made_.text =
        CommentLines("// ", "\"" + model_.name +
                                "\", a mechanism of Loopbench at its assembled start, as a program "
                                "for Simbody 3.7. SI units, angles in rad.") +
        kHead + CommentOfNotes("// ", made_.notes) +
        Filled("simbody.cpp", {{"MECHANISM", constructor + Start() + Names()}});
    return std::move(made_);
  }

 private:
  template <class... Values>
  void AddNote(fmt::format_string<Values...> text, Values&&... values) {
    made_.notes.push_back({false, fmt::format(text, std::forward<Values>(values)...)});
  }

  std::string BodyText(int body) const { return format("body[{}]", number_[body]); }

  std::string Text(const SimbodyMobilizer& one) const {
    const Joint& joint = model_.tree[one.joint];
    const char* direction = one.reverse ? "MobilizedBody::Reverse" : "MobilizedBody::Forward";
    std::string last = format(", {}", direction);
    if (one.type == "Weld") last.clear();
    if (one.type == "Screw") last = format(", {}, {}", NumberText(one.pitch), direction);
    const std::string what =
        one.is_flywheel ? "rotor" : "body " + QuoteCpp(model_.bodies[one.child].name);
    return format(
        "  // {} on joint {}\n"
        "  body.push_back(MobilizedBody::{}(\n      {}, {},\n      Rigid({}, {}),\n"
        "      {}{}));\n",
        what, QuoteCpp(joint.name), one.type, BodyText(one.parent), FrameText(one.on_parent),
        NumberText(one.mass), Numbers(one.inertia), FrameText(one.on_child), last);
  }

  std::string Text(const SimbodyConstraint& one) const {
    // by SimbodyConstraintType
    constexpr const char* kCalls[] = {"Ball({P}, {p}, {Q}, {q})",
                                      "PointOnLine({P}, {axis}, {p}, {Q}, {q})",
                                      "PointInPlane({P}, {axis}, dot({axis}, {p}), {Q}, {q})",
                                      "ConstantAngle({P}, {axis}, {Q}, {other}, Pi / 2)",
                                      "ConstantOrientation({P}, {F}.R(), {Q}, {M}.R())",
                                      "Weld({P}, {F}, {Q}, {M})",
                                      "Rod({P}, {p}, {Q}, {q}, {length})"};
    const Joint& joint = model_.cut[one.joint];
    using fmt::arg;
    const std::string text = format(
        fmt::runtime(kCalls[static_cast<int>(one.type)]), arg("P", BodyText(joint.from)),
        arg("Q", BodyText(joint.to)), arg("p", Point(joint.F.p)), arg("q", Point(joint.M.p)),
        arg("F", FrameText(joint.F)), arg("M", FrameText(joint.M)),
        arg("axis", Axis(joint.F, one.axis_on_F)), arg("other", Axis(joint.M, one.axis_on_M)),
        arg("length", NumberText(joint.parameter)));
    return format("  // joint {} closes a loop\n  Constraint::{};\n", QuoteCpp(joint.name), text);
  }

  std::string CouplerText(std::size_t index) const {
    const SimbodyCoupler& one = parts_.couplers[index];
    const std::string terms = harness::Joined(one.terms, ", ", [&](const auto& term) {
      return format("{{{}, {}}}", BodyText(term.first), NumberText(term.second));
    });
    const std::string what = index < model_.couplings.size()
                                 ? "coupling " + QuoteCpp(model_.couplings[index].name)
                                 : "a rotor and its joint";
    return format("  // {}\n  Couple({{{}}}, {});\n", what, terms, NumberText(one.constant));
  }

  std::string Text(const SimbodyForce& one) const {
    // by SimbodyForceType: {0} {1} bodies, {2} {3} points or vector, {4} {5} numbers
    constexpr const char* kCalls[] = {"MobilityConstantForce(forces, {0}, 0, {4})",
                                      "MobilityLinearSpring(forces, {0}, 0, {4}, {5})",
                                      "MobilityLinearDamper(forces, {0}, 0, {4})",
                                      "ConstantForce(forces, {0}, {2}, {3})",
                                      "TwoPointLinearSpring(forces, {0}, {2}, {1}, {3}, {4}, {5})",
                                      "TwoPointLinearDamper(forces, {0}, {2}, {1}, {3}, {4})",
                                      "TwoPointConstantForce(forces, {0}, {2}, {1}, {3}, {4})"};
    return format("  Force::{};\n",
                  format(fmt::runtime(kCalls[static_cast<int>(one.type)]), BodyText(one.first),
                         BodyText(one.second), Point(one.at_first), Point(one.at_second),
                         NumberText(one.numbers[0]), NumberText(one.numbers[1])));
  }

  std::string Start() const {
    std::string text = "void Mechanism::SetStart(State& state) const {\n";
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      const Joint& joint = model_.tree[one.joint];
      const auto values = [&](const std::vector<double>& all, int first, int count) {
        std::vector<double> own;
        for (int i = first; i < first + count; ++i) own.push_back(one.sign * all[i]);
        return Numbers(own);
      };
      if (joint.num_u == 0) continue;
      text +=
          format("  Set(state, {}, {{{}}}, {{{}}});\n", BodyText(one.child),
                 values(model_.q, joint.q, joint.num_q), values(model_.u, joint.u, joint.num_u));
    }
    return text + "}\n\n";
  }

  /// Returns tables of names. C++ has no empty arrays: a row without a name ends each table.
  std::string Names() const {
    std::string joints, bodies, points;
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      if (one.is_flywheel) continue;
      const Joint& joint = model_.tree[one.joint];
      joints += format("    {{{}, {}, {}}},\n", Member("name", joint.name), number_[one.child],
                       NumberText(one.sign));
    }
    for (std::size_t b = 0; b < model_.bodies.size(); ++b) {
      const Body& body = model_.bodies[b];
      const Vec origin = {-body.com[0], -body.com[1], -body.com[2]};
      if (b > 0) {
        bodies += format("    {{{}, {}, {{{}}}}},\n", Member("name", body.name), number_[b],
                         Numbers(origin));
      }
      for (const auto& [point, at] : body.points) {
        points += format("    {{{} \",\" {}, {}, {{{}}}}},\n", Member("body", body.name),
                         Member("name", point), number_[b], Numbers(at));
      }
    }
    const std::string end = "    {nullptr, 0, {}}};\n\n";
    return "// Names are members of JSON objects.\nconst JointName kJoints[] = {\n" + joints +
           "    {nullptr, 0, 0.0}};\n\n" +
           "// Origins of bodies, and named points, from centres of mass [m].\n"
           "const PointName kBodies[] = {\n" +
           bodies + end + "const PointName kPoints[] = {\n" + points + end;
  }

  void AddNotes() {
    if (model_.planar) AddNote(kPlaneNote);
    AddNote("Body frames have the user's axes and lie in centres of mass.");
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      if (one.sign > 0.0) continue;
      AddNote(
          "joint \"{}\" is a {} with coordinates of the opposite sign; what is printed has "
          "the user's.",
          model_.tree[one.joint].name, one.type);
    }
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      if (!one.is_flywheel) continue;
      AddNote(
          "rotor_inertia of joint \"{}\" is a flywheel on Ground, whose angle is the "
          "coordinate of the joint.",
          model_.tree[one.joint].name);
    }
    for (const Joint& joint : model_.cut) {
      if (joint.kind == "free") continue;
      std::string released;
      if (!joint.imposed.empty() && !model_.planar) {
        released = format(", in {} directions; what it holds beyond these follows from the others",
                          joint.imposed.size());
      }
      AddNote("joint \"{}\" ({}) closes a loop: it is made of constraints{}.", joint.name,
              joint.kind, released);
    }
  }

  const Model& model_;
  const SimbodyParts parts_;
  std::vector<std::size_t> number_;  ///< Simbody's number of each body of the model
  ExportedFile made_;
};

}  // namespace

SimbodyParts MakeSimbodyParts(const Model& model) {
  std::vector<std::string> missing = model.missing;
  SimbodyParts parts;
  for (std::size_t i = 0; i < model.tree.size(); ++i) {
    const SimbodyMobilizer& made = parts.mobilizers.emplace_back(MakeMobilizer(model, i));
    if (made.type.empty()) missing.push_back(ShownKind(model.tree[i]));
  }
  for (std::size_t i = 0; i < model.cut.size(); ++i) {
    const auto closure = ClosureOf(model.cut[i], model.planar);
    if (!closure) missing.push_back(ShownKind(model.cut[i]) + ", which closes a loop");
    for (const Row& row : closure.value_or(Rows())) {
      parts.constraints.push_back({row.type, i, row.axis_on_F, row.axis_on_M});
    }
  }
  for (const PointForce& force : model.point_forces) {
    if (!force.in_body_axes) continue;
    const Body& body = model.bodies[force.point.body];
    missing.push_back("point_force on body \"" + body.name + "\", in its axes");
  }
  for (std::size_t i = 1; i < model.bodies.size(); ++i) {
    const std::string fault = FaultOfInertia(model.bodies[i], model.planar);
    if (!fault.empty()) missing.push_back(fault);
  }
  if (!missing.empty()) throw Unsupported(std::move(missing));
  AddCouplers(model, &parts);
  AddForces(model, &parts.forces);
  return parts;
}

ExportedFile WriteSimbodyProgram(const Model& model) { return Writer(model).Write(); }

}  // namespace loopbench::exchange
