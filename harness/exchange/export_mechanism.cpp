#include <fmt/format.h>

#include <variant>

#include "harness/exchange/export_mjcf.h"
#include "harness/exchange/export_names.h"
#include "harness/exchange/export_simbody.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/start/assembly.h"

namespace loopbench::exchange {
namespace {

/// Converts a pose; planar positions and rotations lie in z = 0.
template <class Space>
Frame ToFrame(const Pose<Space, double>& X) {
  Frame frame;
  for (int i = 0; i < Space::kLin; ++i) {
    frame.p[i] = X.p[i];
    for (int j = 0; j < Space::kLin; ++j) frame.R[3 * i + j] = X.R(i, j);
  }
  return frame;
}

class Maker {
 public:
  explicit Maker(const MechanismDescription& description) : description_(description) {}

  template <class Space>
  Model Make(bool at_start) {
    const Mechanism<Space, double> mechanism(description_, Coordinates::kJoint);
    model_.name = description_.name;
    model_.planar = description_.space == SpaceKind::kPlanar;
    model_.gravity = ToVec(description_.gravity);
    model_.num_q = mechanism.num_q();
    model_.num_u = mechanism.num_u();
    for (const BodyDescription& body : description_.bodies) AddBody(body);
    tree_of_.assign(description_.joints.size(), -1);
    for (const TreeStep& step : mechanism.tree()) {
      Joint joint = MakeJoint(mechanism, step.joint);
      joint.from_is_child = step.sign < 0;
      const int index = mechanism.joints()[step.joint].description;
      if (index >= 0) tree_of_[index] = static_cast<int>(model_.tree.size());
      model_.tree.push_back(std::move(joint));
    }
    for (const int index : mechanism.constraints())
      model_.cut.push_back(MakeJoint(mechanism, index));
    for (const CouplingDescription& coupling : description_.couplings) Add(coupling);
    for (const ForceDescription& force : description_.forces) {
      std::visit([this](const auto& one) { Add(one); }, force);
    }
    model_.q.assign(static_cast<std::size_t>(model_.num_q), 0.0);
    model_.u.assign(static_cast<std::size_t>(model_.num_u), 0.0);
    for (const Joint& joint : model_.tree) {
      if (joint.num_q > joint.num_u) model_.q[joint.q] = 1.0;
    }
    if (!at_start) return std::move(model_);
    const Start<double> start = Assemble<Space>(description_, mechanism);
    if (start.outcome != Outcome::kFinished) {
      throw std::runtime_error("its initial assembly fails: " + start.message);
    }
    model_.q.assign(start.q.begin(), start.q.end());
    model_.u.assign(start.u.begin(), start.u.end());
    return std::move(model_);
  }

 private:
  void AddBody(const BodyDescription& body) {
    Body& made = model_.bodies.emplace_back();
    made.name = body.name;
    made.mass = body.mass;
    made.com = ToVec(body.com);
    for (const auto& [name, at] : body.points) made.points.emplace_back(name, ToVec(at - body.com));
    made.inertia = ToMatrix(body.inertia);
  }

  template <class Space>
  Joint MakeJoint(const Mechanism<Space, double>& mechanism, int index) {
    const auto& joint = mechanism.joints()[index];
    Joint made;
    made.name = mechanism.joint_names()[index];
    JointType type = JointType::kFree;  // default for a virtual joint
    if (joint.description >= 0) {
      type = description_.joints[joint.description].type;
      made.rotor_inertia = description_.joints[joint.description].rotor_inertia;
    }
    if (joint.num_drives > 0) {
      Miss("joint \"{}\": a prescribed motion", made.name);
    } else if (!IsBuiltIn(type)) {
      Miss("joint \"{}\": {}", made.name, ToString(type));
    }
    if (made.rotor_inertia > 0.0 && !joint.in_tree()) {
      Miss("rotor of joint \"{}\", which closes a loop", made.name);
    }
    made.kind = ToString(type);
    made.parameter = joint.kind->parameter;
    made.from = joint.from;
    made.to = joint.to;
    made.F = ToFrame<Space>(joint.X_PF);
    made.M = ToFrame<Space>(joint.X_QM);
    made.num_q = joint.num_q();
    made.num_u = joint.num_u();
    made.q = joint.q_offset;
    made.u = joint.u_offset;
    for (const ValueWord& word : ValueWords(type, description_.space, false)) {
      made.coordinates.emplace_back(word.name);
    }
    // if directions are no axes of F, all of them are imposed
    const JointKind<Space, double>& kind = KindOf<Space, double>(type);
    if (!joint.in_tree() && joint.num_released > 0 && kind.basis == nullptr) {
      const JointDescription& described = description_.joints[joint.description];
      const Released out{joint.description, described.released, described.moving};
      for (int i = 0; i < kind.num_constraints(); ++i) {
        if (!out.Imposes(i)) continue;
        made.imposed.push_back(kind.axes[kind.num_u + i]);
      }
    }
    return made;
  }

  Point ToPoint(const BodyPoint& point) const {
    return {point.body, ToVec(point.at - description_.bodies[point.body].com)};
  }

  template <class... Values>
  void Miss(fmt::format_string<const Values&...> format, const Values&... values) {
    model_.missing.push_back(fmt::format(format, values...));
  }

  std::string NameOf(int joint) const { return description_.joints[joint].name; }

  void Add(const CouplingDescription& coupling) {
    Coupling made{coupling.name, {}, coupling.offset};
    for (const auto& [joint, ratio] : coupling.parts) {
      if (tree_of_[joint] < 0) {
        Miss("coupling \"{}\" of joint \"{}\", which closes a loop", coupling.name, NameOf(joint));
        return;
      }
      made.parts.emplace_back(tree_of_[joint], ratio);
    }
    model_.couplings.push_back(std::move(made));
  }
  void Add(const JointForce& force, int joint, const char* kind) {
    const int tree = tree_of_[joint];
    if (tree < 0) {
      Miss("{} along joint \"{}\", which closes a loop", kind, NameOf(joint));
      return;
    }
    model_.joint_forces.push_back(force);
    model_.joint_forces.back().joint = tree;
  }

  void Add(const JointTorque& force) {
    const auto* polynomial = std::get_if<Polynomial>(&force.value);
    if (polynomial == nullptr || polynomial->coefficients.size() != 1) {
      Miss("joint_torque along joint \"{}\", which depends on time", NameOf(force.joint));
      return;
    }
    Add({.constant = polynomial->coefficients.front()}, force.joint, "joint_torque");
  }
  void Add(const JointSpring& force) {
    Add({.constant = force.preload, .stiffness = force.stiffness, .rest = force.rest}, force.joint,
        "joint_spring");
  }
  void Add(const JointDamper& force) {
    Add({.damping = force.damping}, force.joint, "joint_damper");
  }
  void Add(const loopbench::PointForce& force) {
    model_.point_forces.push_back({ToPoint(force.point), ToVec(force.force), force.in_body_axes});
  }
  void Add(const loopbench::SpringDamper& force) {
    model_.spring_dampers.push_back({ToPoint(force.from), ToPoint(force.to), force.stiffness,
                                     force.damping, force.length, force.preload});
  }
  void Add(const Drag& force) {
    Miss("drag on body \"{}\"", description_.bodies[force.point.body].name);
  }
  void Add(const OtherForce& force) {
    OtherForce copy = force;
    Miss("{}", PartsOf(copy).name);
  }

  const MechanismDescription& description_;
  Model model_;
  std::vector<int> tree_of_;  ///< by joint of the description: index into the tree, or -1
};

Model Make(const MechanismDescription& description, bool at_start) {
  Maker maker(description);
  return description.space == SpaceKind::kPlanar ? maker.Make<Planar>(at_start)
                                                 : maker.Make<Spatial>(at_start);
}

/// Writes MJCF with all constraints, since MuJoCo regularizes redundant ones.
ExportedFile WriteMjcf(const MechanismDescription& description, double time_step) {
  const Mjcf made = MakeMjcf(MakeModelAtStart(description), time_step, true);
  return {"<!--\n" +
              CommentLines("  ", "\"" + description.name +
                                     "\", a mechanism of Loopbench at its assembled start, for "
                                     "MuJoCo. SI units, angles in rad. The keyframe \"start\" has "
                                     "its speeds.") +
              CommentOfNotes("  ", made.notes) + "-->\n" + made.document,
          made.notes};
}

/// Writes a Simbody program without redundant constraints. Simbody determines the rank at each
/// position and sometimes fails with many redundant constraints.
ExportedFile WriteSimbody(const MechanismDescription& description, double) {
  CompileOptions options = CompileOptions::None();
  options.redundancy = true;
  const Compiled compiled = Compile(description, options);
  return WriteSimbodyProgram(MakeModelAtStart(compiled.parts.front().description));
}

}  // namespace

Model MakeModel(const MechanismDescription& description) { return Make(description, false); }

Model MakeModelAtStart(const MechanismDescription& description) { return Make(description, true); }

const std::vector<ExportFormat>& ExportFormats() {
  static const std::vector<ExportFormat> kFormats = {{"mjcf", ".xml", WriteMjcf},
                                                     {"simbody", ".cpp", WriteSimbody}};
  return kFormats;
}

}  // namespace loopbench::exchange
