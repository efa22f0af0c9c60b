#include "peers/make_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "mechanism/model/mechanism.h"

namespace loopbench::peers {
namespace {

Vec ToVec(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Planar positions and rotations lie in z = 0.
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
  Model Make() {
    const Mechanism<Space, double> mechanism(description_, Coordinates::kJoint);
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
      if (index >= 0)
        tree_of_[static_cast<std::size_t>(index)] = static_cast<int>(model_.tree.size());
      model_.tree.push_back(std::move(joint));
    }
    for (const int index : mechanism.constraints())
      model_.cut.push_back(MakeJoint(mechanism, index));
    for (const ForceDescription& force : description_.forces) {
      std::visit([this](const auto& one) { Add(one); }, force);
    }
    return std::move(model_);
  }

 private:
  void AddBody(const BodyDescription& body) {
    Body& made = model_.bodies.emplace_back();
    made.name = body.name;
    made.mass = body.mass;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) made.inertia[3 * i + j] = body.inertia(i, j);
    }
  }

  template <class Space>
  Joint MakeJoint(const Mechanism<Space, double>& mechanism, int index) const {
    const auto& joint = mechanism.joints()[index];
    Joint made;
    made.name = mechanism.joint_names()[index];
    JointType type = JointType::kFree;  // a virtual one
    if (joint.description >= 0) type = description_.joints[joint.description].type;
    if (joint.num_drives > 0) {
      throw NotThere(fmt::format("joint \"{}\": a prescribed motion", made.name));
    }
    if (!IsBuiltIn(type))
      throw NotThere(fmt::format("joint \"{}\": {}", made.name, ToString(type)));
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
    // where directions are no axes of F, all of them are imposed
    if (!joint.in_tree() && joint.num_released > 0 && joint.kind->basis == nullptr) {
      const std::vector<int>& released = description_.joints[joint.description].released;
      for (int i = 0; i < joint.kind->num_constraints(); ++i) {
        if (std::ranges::find(released, i) != released.end()) continue;
        made.imposed.push_back(joint.kind->axes[joint.kind->num_u + i]);
      }
    }
    return made;
  }

  Point ToPoint(const BodyPoint& point) const {
    return {point.body, ToVec(point.at - description_.bodies[point.body].com)};
  }

  JointForce& AddJointForce(int joint, const char* force) {
    const int tree = tree_of_[static_cast<std::size_t>(joint)];
    if (tree < 0) {
      throw NotThere(fmt::format("{} along joint \"{}\", which closes a loop", force,
                                 description_.joints[joint].name));
    }
    JointForce& made = model_.joint_forces.emplace_back();
    made.joint = tree;
    return made;
  }

  void Add(const JointTorque& force) {
    const auto* polynomial = std::get_if<Polynomial>(&force.value);
    if (polynomial == nullptr || polynomial->coefficients.size() != 1) {
      throw NotThere("joint_torque that depends on time");
    }
    AddJointForce(force.joint, "joint_torque").constant = polynomial->coefficients.front();
  }
  void Add(const JointSpring& force) {
    JointForce& made = AddJointForce(force.joint, "joint_spring");
    made.constant = force.preload;
    made.stiffness = force.stiffness;
    made.rest = force.rest;
  }
  void Add(const JointDamper& force) {
    AddJointForce(force.joint, "joint_damper").damping = force.damping;
  }
  void Add(const loopbench::PointForce& force) {
    if (force.in_body_axes) throw NotThere("point_force in body axes");
    model_.point_forces.push_back({ToPoint(force.point), ToVec(force.force)});
  }
  void Add(const loopbench::SpringDamper& force) {
    model_.spring_dampers.push_back({ToPoint(force.from), ToPoint(force.to), force.stiffness,
                                     force.damping, force.length, force.preload});
  }
  void Add(const Drag&) { throw NotThere("drag"); }
  void Add(const OtherForce& force) {
    OtherForce copy = force;
    throw NotThere(std::string(PartsOf(copy).name));
  }

  const MechanismDescription& description_;
  Model model_;
  std::vector<int> tree_of_;  ///< by joint of the description: index into the tree, or -1
};

}  // namespace

Model MakeModel(const MechanismDescription& description) {
  Maker maker(description);
  return description.space == SpaceKind::kPlanar ? maker.Make<Planar>() : maker.Make<Spatial>();
}

}  // namespace loopbench::peers
