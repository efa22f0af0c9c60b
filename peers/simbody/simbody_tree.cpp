// Bodies, tree joints and forces of a model in Simbody.
#include "peers/simbody/simbody_constraints.h"
#include "peers/simbody/simbody_model.h"

namespace loopbench::peers {
namespace {

using namespace SimTK;

/// About the centre of mass, which is the origin of our body frames. A planar body has a moment
/// about z only; Simbody asks for the other two, of which the motion says nothing.
SimTK::Body::Rigid RigidBody(const peers::Body& body, bool planar) {
  const Matrix& I = body.inertia;
  if (planar)
    return SimTK::Body::Rigid(MassProperties(body.mass, Vec3(0), Inertia(I[8], I[8], I[8])));
  return SimTK::Body::Rigid(
      MassProperties(body.mass, Vec3(0), Inertia(I[0], I[4], I[8], I[1], I[2], I[5])));
}

/// The mobilizer of a tree joint. Where P hangs on Q, Simbody defines the coordinates in reverse:
/// then they are ours again.
MobilizedBody Mobilize(const Joint& joint, MobilizedBody& parent, const SimTK::Body::Rigid& body) {
  const bool reverse = joint.from_is_child;
  const auto direction = reverse ? MobilizedBody::Reverse : MobilizedBody::Forward;
  const Transform on_parent = ToTransform(reverse ? joint.M : joint.F);
  const Transform on_child = ToTransform(reverse ? joint.F : joint.M);
  const std::string& kind = joint.kind;
  const auto make = [&](auto of_kind) -> MobilizedBody {
    using Kind = decltype(of_kind);
    return Kind(parent, on_parent, body, on_child, direction);
  };
  if (kind == "revolute") return make(MobilizedBody::Pin());
  if (kind == "prismatic") return make(MobilizedBody::Slider());
  if (kind == "weld") return MobilizedBody::Weld(parent, on_parent, body, on_child);
  if (kind == "cylindrical") return make(MobilizedBody::Cylinder());
  if (kind == "spherical") return make(MobilizedBody::Ball());
  if (kind == "universal") return make(MobilizedBody::Universal());
  if (kind == "planar") return make(MobilizedBody::Planar());
  if (kind == "free" && joint.num_q == 3) return make(MobilizedBody::Planar());
  if (kind == "free") return make(MobilizedBody::Free());
  if (kind == "helical") {
    return MobilizedBody::Screw(parent, on_parent, body, on_child, joint.parameter, direction);
  }
  if (kind == "pin-in-slot") {
    // M slides in F and turns; seen from M, F turns back and slides back along the turned axis,
    // which is BendStretch in the other direction, with the opposite coordinates
    const auto other = reverse ? MobilizedBody::Forward : MobilizedBody::Reverse;
    return MobilizedBody::BendStretch(parent, on_parent, body, on_child, other);
  }
  throw NotThere("joint \"" + joint.name + "\": " + kind);
}

}  // namespace

void SimbodyModel::AddTree(const Model& model) {
  mobilized_.assign(model.bodies.size(), MobilizedBodyIndex(0));
  for (const Joint& joint : model.tree) {
    const int parent = joint.from_is_child ? joint.to : joint.from;
    const int child = joint.from_is_child ? joint.from : joint.to;
    MobilizedBody body =
        Mobilize(joint, BodyAt(parent),
                 RigidBody(model.bodies[static_cast<std::size_t>(child)], model.planar));
    mobilized_[static_cast<std::size_t>(child)] = body.getMobilizedBodyIndex();
    const double sign = joint.kind == "pin-in-slot" ? -1.0 : 1.0;
    mobilizers.push_back({body, joint.q, joint.num_q, joint.u, joint.num_u, sign});
  }
}

void SimbodyModel::AddForces(const Model& model) {
  Force::Gravity(forces, matter, ToVec3(model.gravity));
  for (const JointForce& force : model.joint_forces) {
    const MobilizedBody& body = mobilizers[static_cast<std::size_t>(force.joint)].body;
    if (force.constant != 0.0) Force::MobilityConstantForce(forces, body, 0, force.constant);
    if (force.stiffness != 0.0) {
      Force::MobilityLinearSpring(forces, body, 0, force.stiffness, force.rest);
    }
    if (force.damping != 0.0) Force::MobilityLinearDamper(forces, body, 0, force.damping);
  }
  for (const PointForce& force : model.point_forces) {
    Force::ConstantForce(forces, BodyAt(force.point.body), ToVec3(force.point.at),
                         ToVec3(force.force));
  }
  for (const SpringDamper& force : model.spring_dampers) {
    const MobilizedBody &from = BodyAt(force.from.body), &to = BodyAt(force.to.body);
    const Vec3 p = ToVec3(force.from.at), q = ToVec3(force.to.at);
    if (force.stiffness != 0.0) {
      Force::TwoPointLinearSpring(forces, from, p, to, q, force.stiffness, force.length);
    }
    if (force.damping != 0.0) Force::TwoPointLinearDamper(forces, from, p, to, q, force.damping);
    // positive ones push apart
    if (force.preload != 0.0) Force::TwoPointConstantForce(forces, from, p, to, q, -force.preload);
  }
}

SimbodyModel::SimbodyModel(const Model& model) {
  AddTree(model);
  for (const Joint& joint : model.cut) {
    AddConstraint(joint, model.planar, BodyAt(joint.from), BodyAt(joint.to));
  }
  AddForces(model);
}

}  // namespace loopbench::peers
