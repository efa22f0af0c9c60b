#include "harness/exchange/export_simbody.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "harness/exchange/export_names.h"
#include "harness/exchange/export_simbody_parts.h"
#include "harness/exchange/export_simbody_text.h"
#include "harness/record/json_object.h"

namespace loopbench::exchange {
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

/// A name as the member "name" of a JSON object.
std::string Member(const std::string& key, const std::string& name) {
  const std::string object = harness::JsonObject().Add(key, name).Text();
  return QuoteCpp(object.substr(1, object.size() - 2));
}

/// Statements of the program. Bodies are counted as Simbody does, in the order of the tree.
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

  /// Tables of names. None of them is empty in C++: a row without a name ends each.
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
  std::vector<std::size_t> number_;  ///< Simbody's of each body of the model
  SimbodyProgramText made_;
};

}  // namespace

SimbodyProgramText WriteSimbodyProgram(const Model& model) { return Writer(model).Write(); }

}  // namespace loopbench::exchange
