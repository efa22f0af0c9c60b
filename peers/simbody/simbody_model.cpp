// A model as Simbody objects.
#include "peers/simbody/simbody_model.h"

namespace loopbench::peers {
namespace {

using namespace SimTK;

Vec3 ToVec3(const exchange::Vec& v) { return {v[0], v[1], v[2]}; }

/// Converts a frame that is already orthogonal to round-off, without changes.
Transform ToTransform(const exchange::Frame& frame) {
  const exchange::Matrix& R = frame.R;
  const Mat33 matrix(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]);
  return {Rotation(matrix, true), ToVec3(frame.p)};
}

MobilizedBody Mobilize(const exchange::SimbodyMobilizer& one, MobilizedBody& parent) {
  const auto& I = one.inertia;
  const SimTK::Body::Rigid body(
      MassProperties(one.mass, Vec3(0), Inertia(I[0], I[1], I[2], I[3], I[4], I[5])));
  const Transform on_parent = ToTransform(one.on_parent), on_child = ToTransform(one.on_child);
  const auto direction = one.reverse ? MobilizedBody::Reverse : MobilizedBody::Forward;
  const auto make = [&](auto of_type) -> MobilizedBody {
    return decltype(of_type)(parent, on_parent, body, on_child, direction);
  };
  if (one.type == "Pin") return make(MobilizedBody::Pin());
  if (one.type == "Slider") return make(MobilizedBody::Slider());
  if (one.type == "Weld") return MobilizedBody::Weld(parent, on_parent, body, on_child);
  if (one.type == "Cylinder") return make(MobilizedBody::Cylinder());
  if (one.type == "Ball") return make(MobilizedBody::Ball());
  if (one.type == "Universal") return make(MobilizedBody::Universal());
  if (one.type == "Planar") return make(MobilizedBody::Planar());
  if (one.type == "Free") return make(MobilizedBody::Free());
  if (one.type == "Translation") return make(MobilizedBody::Translation());
  if (one.type == "BendStretch") return make(MobilizedBody::BendStretch());
  return MobilizedBody::Screw(parent, on_parent, body, on_child, one.pitch, direction);
}

}  // namespace

void SimbodyModel::Add(const exchange::SimbodyMobilizer& mobilizer, const exchange::Joint& joint) {
  MobilizedBody body = Mobilize(mobilizer, BodyAt(mobilizer.parent));
  mobilized_[static_cast<std::size_t>(mobilizer.child)] = body.getMobilizedBodyIndex();
  mobilizers.insert(mobilizer.is_flywheel ? mobilizers.begin() : mobilizers.end(),
                    {body, joint.q, joint.num_q, joint.u, joint.num_u, mobilizer.sign});
}

void SimbodyModel::Add(const exchange::SimbodyConstraint& constraint,
                       const exchange::Joint& joint) {
  using Type = exchange::SimbodyConstraintType;
  MobilizedBody &P = BodyAt(joint.from), &Q = BodyAt(joint.to);
  const Transform F = ToTransform(joint.F), M = ToTransform(joint.M);
  const UnitVec3 on_F = F.R()(constraint.axis_on_F), on_M = M.R()(constraint.axis_on_M);
  switch (constraint.type) {
    case Type::kBall:
      Constraint::Ball(P, F.p(), Q, M.p());
      break;
    case Type::kPointOnLine:
      Constraint::PointOnLine(P, on_F, F.p(), Q, M.p());
      break;
    case Type::kPointInPlane:
      Constraint::PointInPlane(P, on_F, dot(on_F, F.p()), Q, M.p());
      break;
    case Type::kConstantAngle:
      Constraint::ConstantAngle(P, on_F, Q, on_M, Pi / 2);
      break;
    case Type::kConstantOrientation:
      Constraint::ConstantOrientation(P, F.R(), Q, M.R());
      break;
    case Type::kWeld:
      Constraint::Weld(P, F, Q, M);
      break;
    case Type::kRod:
      Constraint::Rod(P, F.p(), Q, M.p(), joint.parameter);
      break;
  }
}

void SimbodyModel::Add(const exchange::SimbodyCoupler& coupler) {
  Array_<MobilizedBodyIndex> bodies;
  Vector coefficients(static_cast<int>(coupler.terms.size()) + 1, coupler.constant);
  for (const auto& [body, factor] : coupler.terms) {
    coefficients[static_cast<int>(bodies.size())] = factor;
    bodies.push_back(mobilized_[static_cast<std::size_t>(body)]);
  }
  const Array_<MobilizerQIndex> first(bodies.size(), MobilizerQIndex(0));
  Constraint::CoordinateCoupler(matter, new Function::Linear(coefficients), bodies, first);
}

void SimbodyModel::Add(const exchange::SimbodyForce& force) {
  using Type = exchange::SimbodyForceType;
  const MobilizedBody &A = BodyAt(force.first), &B = BodyAt(force.second);
  const Vec3 p = ToVec3(force.at_first), q = ToVec3(force.at_second);
  const auto [first, second] = force.numbers;
  switch (force.type) {
    case Type::kMobilityConstantForce:
      Force::MobilityConstantForce(forces, A, 0, first);
      break;
    case Type::kMobilityLinearSpring:
      Force::MobilityLinearSpring(forces, A, 0, first, second);
      break;
    case Type::kMobilityLinearDamper:
      Force::MobilityLinearDamper(forces, A, 0, first);
      break;
    case Type::kConstantForce:
      Force::ConstantForce(forces, A, p, q);
      break;
    case Type::kTwoPointLinearSpring:
      Force::TwoPointLinearSpring(forces, A, p, B, q, first, second);
      break;
    case Type::kTwoPointLinearDamper:
      Force::TwoPointLinearDamper(forces, A, p, B, q, first);
      break;
    case Type::kTwoPointConstantForce:
      Force::TwoPointConstantForce(forces, A, p, B, q, first);
      break;
  }
}

SimbodyModel::SimbodyModel(const exchange::Model& model) {
  const exchange::SimbodyParts parts = exchange::MakeSimbodyParts(model);
  mobilized_.assign(parts.mobilizers.size() + 1, MobilizedBodyIndex(0));
  for (const auto& one : parts.mobilizers) Add(one, model.tree[one.joint]);
  for (const auto& one : parts.constraints) Add(one, model.cut[one.joint]);
  for (const auto& one : parts.couplers) Add(one);
  Force::Gravity(forces, matter, ToVec3(model.gravity));
  for (const auto& one : parts.forces) Add(one);
}

}  // namespace loopbench::peers
