#include "harness/exchange/export_simbody.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "harness/exchange/export_names.h"
#include "harness/record/record.h"

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

// The texts are separate files, because a program prints differently from Loopbench.
constexpr const char* kDeclarations =
#include "harness/exchange/export_simbody_begin.inc"
    ;
constexpr const char* kTail =
#include "harness/exchange/export_simbody_end.inc"
    ;

}  // namespace

std::string SimbodyHead(const std::string& name, const std::vector<Note>& notes) {
  return CommentLines("// ",
                      "\"" + name +
                          "\", a mechanism of Loopbench at its assembled start, as a program "
                          "for Simbody 3.7. SI units, angles in rad.") +
         kHead + CommentOfNotes("// ", notes) + kDeclarations;
}

std::string SimbodyTail() { return kTail; }
namespace {

using Type = SimbodyConstraintType;

/// Returns the class of a tree joint; "" if unsupported.
std::string MobilizerOf(const Joint& joint) {
  const std::string& kind = joint.kind;
  if (kind == "revolute") return "Pin";
  if (kind == "prismatic") return "Slider";
  if (kind == "weld") return "Weld";
  if (kind == "cylindrical") return "Cylinder";
  if (kind == "spherical") return "Ball";
  if (kind == "universal") return "Universal";
  if (kind == "planar" || (kind == "free" && joint.coordinates.size() == 3)) return "Planar";
  if (kind == "free") return "Free";
  if (kind == "helical") return "Screw";
  return kind == "pin-in-slot" ? "BendStretch" : "";
}

/// Adds the constraints of one cut joint.
class Closure {
 public:
  Closure(std::size_t joint, std::vector<SimbodyConstraint>* made) : joint_(joint), made_(made) {}

  void Add(Type type, int axis_on_F = 0, int axis_on_M = 0) {
    made_->push_back({type, joint_, axis_on_F, axis_on_M});
  }
  void Perpendicular(int axis_on_F, int axis_on_M) {
    Add(Type::kConstantAngle, axis_on_F, axis_on_M);
  }
  /// Keeps z of F and z of M parallel.
  void ParallelZ() {
    Perpendicular(kZ, kX);
    Perpendicular(kZ, kY);
  }
  /// Closes a planar joint; the tree keeps z = 0, so that points stay free along z.
  bool InPlane(const std::string& kind);
  bool InSpace(const std::string& kind);
  /// Constrains rotations about x and y of F by z of M, independent of a free rotation about z;
  /// about z if there is none.
  void Along(const std::vector<int>& components);

 private:
  static constexpr int kX = 0, kY = 1, kZ = 2;
  std::size_t joint_;
  std::vector<SimbodyConstraint>* made_;
};

bool Closure::InPlane(const std::string& kind) {
  if (kind == "revolute") {
    Add(Type::kPointOnLine, kZ);
  } else if (kind == "pin-in-slot") {
    Add(Type::kPointInPlane, kY);
  } else if (kind == "prismatic") {
    Add(Type::kPointInPlane, kY);
    Perpendicular(kX, kY);
  } else if (kind == "weld") {
    Add(Type::kPointOnLine, kZ);
    Perpendicular(kX, kY);
  } else {
    return false;
  }
  return true;
}

bool Closure::InSpace(const std::string& kind) {
  if (kind == "revolute") {
    Add(Type::kBall);
    ParallelZ();
  } else if (kind == "prismatic") {
    Add(Type::kPointOnLine, kX);
    Add(Type::kConstantOrientation);
  } else if (kind == "weld") {
    Add(Type::kWeld);
  } else if (kind == "pin-in-slot") {
    Add(Type::kPointOnLine, kX);
    ParallelZ();
  } else if (kind == "cylindrical") {
    Add(Type::kPointOnLine, kZ);
    ParallelZ();
  } else if (kind == "spherical") {
    Add(Type::kBall);
  } else if (kind == "planar") {
    Add(Type::kPointInPlane, kZ);
    ParallelZ();
  } else if (kind == "universal") {
    Add(Type::kBall);
    Perpendicular(kX, kY);
  } else {
    return false;
  }
  return true;
}

void Closure::Along(const std::vector<int>& components) {
  for (const int component : components) {
    if (component == 0) Perpendicular(kY, kZ);
    if (component == 1) Perpendicular(kX, kZ);
    if (component == 2) Perpendicular(kX, kY);
    if (component >= 3) Add(Type::kPointInPlane, component - 3);
  }
}

/// Returns false for a joint that Simbody does not support there.
bool AddConstraints(const Model& model, std::size_t index, SimbodyParts* parts) {
  const Joint& joint = model.cut[index];
  Closure closure(index, &parts->constraints);
  if (joint.kind == "free") return true;
  if (joint.kind == "rod") {
    closure.Add(Type::kRod);
    return true;
  }
  if (model.planar) return closure.InPlane(joint.kind);
  if (joint.imposed.empty()) return closure.InSpace(joint.kind);
  closure.Along(joint.imposed);
  return true;
}

/// Makes a mobilizer. If P is the child of Q, MobilizedBody::Reverse keeps the Model's coordinates.
SimbodyMobilizer MakeMobilizer(const Model& model, std::size_t index) {
  const Joint& joint = model.tree[index];
  const Body& body = model.bodies[static_cast<std::size_t>(joint.child())];
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
  // A planar body has a moment about z only; Simbody requires the other two, which have no effect
  // on the motion.
  made.inertia = {I[0], I[4], I[8], I[1], I[2], I[5]};
  if (model.planar) made.inertia = {I[8], I[8], I[8], 0.0, 0.0, 0.0};
  return made;
}

void AddForces(const Model& model, std::vector<SimbodyForce>* forces) {
  using Force = SimbodyForceType;
  for (const JointForce& force : model.joint_forces) {
    const int body = model.tree[static_cast<std::size_t>(force.joint)].child();
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

}  // namespace

SimbodyParts MakeSimbodyParts(const Model& model) {
  std::vector<std::string> missing = model.missing;
  SimbodyParts parts;
  for (std::size_t i = 0; i < model.tree.size(); ++i) {
    const Joint& joint = model.tree[i];
    const SimbodyMobilizer& made = parts.mobilizers.emplace_back(MakeMobilizer(model, i));
    if (made.type.empty()) missing.push_back("joint \"" + joint.name + "\": " + joint.kind);
  }
  for (std::size_t i = 0; i < model.cut.size(); ++i) {
    if (AddConstraints(model, i, &parts)) continue;
    const Joint& joint = model.cut[i];
    missing.push_back("joint \"" + joint.name + "\": " + joint.kind + ", which closes a loop");
  }
  for (const PointForce& force : model.point_forces) {
    if (!force.in_body_axes) continue;
    const Body& body = model.bodies[static_cast<std::size_t>(force.point.body)];
    missing.push_back("point_force on body \"" + body.name + "\", in its axes");
  }
  for (std::size_t i = 1; i < model.bodies.size(); ++i) {
    const std::string fault = FaultOfInertia(model.bodies[i], model.planar);
    if (!fault.empty()) missing.push_back(fault);
  }
  if (!missing.empty()) throw NotThere(std::move(missing));
  AddForces(model, &parts.forces);
  return parts;
}
namespace {

using fmt::format;

std::size_t At(int index) { return static_cast<std::size_t>(index); }

template <class Range>
std::string Numbers(const Range& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + NumberText(value);
  return text;
}

std::string Point(const Vec& v) { return format("Vec3({})", Numbers(v)); }

std::string FrameText(const Frame& frame) {
  if (frame.R == Frame().R) return format("Transform({})", Point(frame.p));
  return format("Transform(Rotation(Mat33({}), true), {})", Numbers(frame.R), Point(frame.p));
}

std::string Axis(const Frame& frame, int axis) {
  const auto a = At(axis);
  return format("UnitVec3({})", Numbers(Vec{frame.R[a], frame.R[3 + a], frame.R[6 + a]}));
}

/// Returns a name as the member "name" of a JSON object.
std::string Member(const std::string& key, const std::string& name) {
  const std::string object = harness::JsonObject().Add(key, name).Text();
  return QuoteCpp(object.substr(1, object.size() - 2));
}

/// Writes the statements of the program. Bodies are numbered as in Simbody, in tree order.
class Writer {
 public:
  explicit Writer(const Model& model) : model_(model), parts_(MakeSimbodyParts(model)) {
    number_.assign(model.bodies.size(), 0);
    for (std::size_t i = 0; i < parts_.mobilizers.size(); ++i) {
      number_[At(parts_.mobilizers[i].child)] = i + 1;
    }
  }

  SimbodyProgramText Write() {
    std::string tree, closures, forces;
    for (const SimbodyMobilizer& one : parts_.mobilizers) tree += Text(one);
    for (const SimbodyConstraint& one : parts_.constraints) closures += Text(one);
    for (const SimbodyForce& one : parts_.forces) forces += Text(one);
    AddNotes();
    made_.program = SimbodyHead(model_.name, made_.notes) +
                    "Mechanism::Mechanism() {\n  body.push_back(matter.Ground());\n" + tree +
                    closures +
                    format("  Force::Gravity(forces, matter, {});\n", Point(model_.gravity)) +
                    forces + "}\n\n" + Start() + Names() + SimbodyTail();
    return std::move(made_);
  }

 private:
  void Say(const std::string& text) { made_.notes.push_back({false, text}); }

  std::string BodyText(int body) const { return format("body[{}]", number_[At(body)]); }

  std::string Text(const SimbodyMobilizer& one) const {
    const Joint& joint = model_.tree[one.joint];
    const char* direction = one.reverse ? "MobilizedBody::Reverse" : "MobilizedBody::Forward";
    std::string last = format(", {}", direction);
    if (one.type == "Weld") last.clear();
    if (one.type == "Screw") last = format(", {}, {}", NumberText(one.pitch), direction);
    return format(
        "  // body {} on joint {}\n"
        "  body.push_back(MobilizedBody::{}(\n      {}, {},\n      Rigid({}, {}),\n"
        "      {}{}));\n",
        QuoteCpp(model_.bodies[At(one.child)].name), QuoteCpp(joint.name), one.type,
        BodyText(one.parent), FrameText(one.on_parent), NumberText(one.mass), Numbers(one.inertia),
        FrameText(one.on_child), last);
  }

  std::string Text(const SimbodyConstraint& one) const {
    const Joint& joint = model_.cut[one.joint];
    const auto &F = joint.F, &M = joint.M;
    const std::string P = BodyText(joint.from), Q = BodyText(joint.to),
                      on_F = Axis(F, one.axis_on_F), p = Point(F.p), q = Point(M.p);
    std::string text;
    switch (one.type) {
      case SimbodyConstraintType::kBall:
        text = format("Ball({}, {}, {}, {})", P, p, Q, q);
        break;
      case SimbodyConstraintType::kPointOnLine:
        text = format("PointOnLine({}, {}, {}, {}, {})", P, on_F, p, Q, q);
        break;
      case SimbodyConstraintType::kPointInPlane:
        text = format("PointInPlane({}, {}, dot({}, {}), {}, {})", P, on_F, on_F, p, Q, q);
        break;
      case SimbodyConstraintType::kConstantAngle:
        text = format("ConstantAngle({}, {}, {}, {}, Pi / 2)", P, on_F, Q, Axis(M, one.axis_on_M));
        break;
      case SimbodyConstraintType::kConstantOrientation:
        text =
            format("ConstantOrientation({}, {}.R(), {}, {}.R())", P, FrameText(F), Q, FrameText(M));
        break;
      case SimbodyConstraintType::kWeld:
        text = format("Weld({}, {}, {}, {})", P, FrameText(F), Q, FrameText(M));
        break;
      case SimbodyConstraintType::kRod:
        text = format("Rod({}, {}, {}, {}, {})", P, p, Q, q, NumberText(joint.parameter));
        break;
    }
    return format("  // joint {} closes a loop\n  Constraint::{};\n", QuoteCpp(joint.name), text);
  }

  std::string Text(const SimbodyForce& one) const {
    const std::string A = BodyText(one.first), B = BodyText(one.second), p = Point(one.at_first),
                      q = Point(one.at_second), first = NumberText(one.numbers[0]),
                      second = NumberText(one.numbers[1]);
    std::string text;
    switch (one.type) {
      case SimbodyForceType::kMobilityConstantForce:
        text = format("MobilityConstantForce(forces, {}, 0, {})", A, first);
        break;
      case SimbodyForceType::kMobilityLinearSpring:
        text = format("MobilityLinearSpring(forces, {}, 0, {}, {})", A, first, second);
        break;
      case SimbodyForceType::kMobilityLinearDamper:
        text = format("MobilityLinearDamper(forces, {}, 0, {})", A, first);
        break;
      case SimbodyForceType::kConstantForce:
        text = format("ConstantForce(forces, {}, {}, {})", A, p, q);
        break;
      case SimbodyForceType::kTwoPointLinearSpring:
        text = format("TwoPointLinearSpring(forces, {}, {}, {}, {}, {}, {})", A, p, B, q, first,
                      second);
        break;
      case SimbodyForceType::kTwoPointLinearDamper:
        text = format("TwoPointLinearDamper(forces, {}, {}, {}, {}, {})", A, p, B, q, first);
        break;
      case SimbodyForceType::kTwoPointConstantForce:
        text = format("TwoPointConstantForce(forces, {}, {}, {}, {}, {})", A, p, B, q, first);
        break;
    }
    return format("  Force::{};\n", text);
  }

  std::string Start() const {
    std::string text = "void Mechanism::SetStart(State& state) const {\n";
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      const Joint& joint = model_.tree[one.joint];
      const auto values = [&](const std::vector<double>& all, int first, int count) {
        std::vector<double> own;
        for (int i = first; i < first + count; ++i) own.push_back(one.sign * all[At(i)]);
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
      const Joint& joint = model_.tree[one.joint];
      joints += format("    {{{}, {}, {}}},\n", Member("name", joint.name), number_[At(one.child)],
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
    if (model_.planar) {
      Say("The plane is z = 0 of space. Moments of inertia about x and y, of which the motion says "
          "nothing, are those about z.");
    }
    Say("Body frames have the user's axes and lie in centres of mass.");
    for (const SimbodyMobilizer& one : parts_.mobilizers) {
      if (one.sign > 0.0) continue;
      Say(
          format("joint \"{}\" is a {} with coordinates of the opposite sign; what is printed has "
                 "the user's.",
                 model_.tree[one.joint].name, one.type));
    }
    for (const Joint& joint : model_.cut) {
      if (joint.kind == "free") continue;
      std::string released;
      if (!joint.imposed.empty() && !model_.planar) {
        released = format(", in {} directions; what it holds beyond these follows from the others",
                          joint.imposed.size());
      }
      Say(format("joint \"{}\" ({}) closes a loop: it is made of constraints{}.", joint.name,
                 joint.kind, released));
    }
  }

  const Model& model_;
  const SimbodyParts parts_;
  std::vector<std::size_t> number_;  ///< Simbody's number of each body of the model
  SimbodyProgramText made_;
};

}  // namespace

SimbodyProgramText WriteSimbodyProgram(const Model& model) { return Writer(model).Write(); }

}  // namespace loopbench::exchange
