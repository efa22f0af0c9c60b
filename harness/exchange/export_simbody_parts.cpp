#include "harness/exchange/export_simbody_parts.h"

#include "harness/exchange/export_body.h"

namespace loopbench::exchange {
namespace {

using Type = SimbodyConstraintType;

/// The class of a tree joint; "" for none.
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

/// The conditions of one joint that closes a loop.
class Closure {
 public:
  Closure(std::size_t joint, std::vector<SimbodyConstraint>* made) : joint_(joint), made_(made) {}

  void Add(Type type, int axis_on_F = 0, int axis_on_M = 0) {
    made_->push_back({type, joint_, axis_on_F, axis_on_M});
  }
  void Perpendicular(int axis_on_F, int axis_on_M) {
    Add(Type::kConstantAngle, axis_on_F, axis_on_M);
  }
  /// z of F and z of M stay parallel.
  void ParallelZ() {
    Perpendicular(kZ, kX);
    Perpendicular(kZ, kY);
  }
  /// Within z = 0, which the tree keeps: along z every point is free to be where it is.
  bool InPlane(const std::string& kind);
  bool InSpace(const std::string& kind);
  /// Rotations about x and y of F, by z of M, which a free turn about z leaves; about z where there
  /// is none.
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

/// False for a joint that Simbody does not have there.
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

/// Where P hangs on Q, Simbody defines the coordinates in reverse: then they are ours again.
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
    // M slides in F and turns; seen from M, F turns back and slides back along the turned axis,
    // which is BendStretch in the other direction, with the opposite coordinates
    made.reverse = !made.reverse;
    made.sign = -1.0;
  }
  made.mass = body.mass;
  const Matrix& I = body.inertia;
  // A planar body has a moment about z only; Simbody asks for the other two, of which the motion
  // says nothing.
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

}  // namespace loopbench::exchange
