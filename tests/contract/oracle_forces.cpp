// Forces of the oracle: every point of application and every distance is a jet along the curve, so
// that velocities are differentiated positions.
#include "tests/contract/oracle_parts.h"
#include "tests/contract/time_oracle.h"

namespace loopbench::testing {

namespace {

/// A point of a body, given in the user's body axes, along the curve.
JetVector PointOn(const MechanismDescription& description, const std::vector<JetPose>& poses,
                  const BodyPoint& point) {
  JetVector r;
  for (int i = 0; i < 3; ++i) {
    r[i] = Jet(Real(point.at[i]) - Real(description.bodies[point.body].com[i]));
  }
  return poses[point.body].p + poses[point.body].R * r;
}

/// Distance between two points and its rate, from the square of it.
Jet Distance(const JetVector& a, const JetVector& b) {
  const JetVector e = b + -a;
  const Jet square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
  const Real d = std::sqrt(square.f);
  return {d, square.d / (2 * d)};
}

}  // namespace

std::vector<Real6> Oracle::Applied(const std::vector<JetPose>& poses) const {
  std::vector<Real6> F(poses.size(), Real6::Zero());
  for (std::size_t b = 1; b < poses.size(); ++b) {
    F[b].tail<3>() = description_.bodies[b].mass * description_.gravity.cast<Real>();
  }
  const auto joint_force = [&](int index, const auto& tau_of) {
    const JointDescription& joint = description_.joints[index];
    const bool slides = joint.type == JointType::kPrismatic;
    const JetPose X_WF = poses[joint.from.body] * frames_[index].X_PF;
    const JetPose X_WM = poses[joint.to.body] * frames_[index].X_QM;
    const Jet q = Coordinate(index, poses);
    Real6 H = Real6::Zero();  // of a screw: the moment about its axis
    for (int i = 0; i < 3; ++i) H[slides ? 3 + i : i] = X_WF.R(i, slides ? 0 : 2).f;
    const Real3 p = ValueOf(X_WM.p, &Jet::f);
    const Real6 wrench = H * tau_of(q.f, q.d);
    F[joint.to.body] += AtCom(wrench, p - ValueOf(poses[joint.to.body].p, &Jet::f));
    F[joint.from.body] -= AtCom(wrench, p - ValueOf(poses[joint.from.body].p, &Jet::f));
  };
  const auto point_force = [&](const BodyPoint& point, const Real3& f) {
    const Real3 p = ValueOf(PointOn(description_, poses, point), &Jet::f);
    Real6 wrench = Real6::Zero();
    wrench.tail<3>() = f;
    F[point.body] += AtCom(wrench, p - ValueOf(poses[point.body].p, &Jet::f));
  };
  for (const ForceDescription& force : description_.forces) {
    if (const auto* torque = std::get_if<JointTorque>(&force)) {
      joint_force(torque->joint, [&](Real, Real) { return OracleAt(torque->value, time_).f; });
    } else if (const auto* spring = std::get_if<JointSpring>(&force)) {
      joint_force(spring->joint, [&](Real q, Real) {
        return spring->preload + Real(spring->stiffness) * (spring->rest - q);
      });
    } else if (const auto* damper = std::get_if<JointDamper>(&force)) {
      joint_force(damper->joint, [&](Real, Real u) { return -Real(damper->damping) * u; });
    } else if (const auto* point = std::get_if<PointForce>(&force)) {
      const Real3 f = point->force.cast<Real>();
      const Real33 R = ValueOf(poses[point->point.body].R, &Jet::f);
      point_force(point->point, point->in_body_axes ? Real3(R * f) : f);
    } else if (const auto* link = std::get_if<SpringDamper>(&force)) {
      const JetVector a = PointOn(description_, poses, link->from);
      const JetVector b = PointOn(description_, poses, link->to);
      const Jet d = Distance(a, b);
      const Real tension = Real(link->preload) + Real(link->stiffness) * (d.f - link->length) +
                           Real(link->damping) * d.d;
      const Real3 pull = tension / d.f * (ValueOf(b, &Jet::f) - ValueOf(a, &Jet::f));
      point_force(link->from, pull);
      point_force(link->to, -pull);
    } else if (const auto* drag = std::get_if<Drag>(&force)) {
      const Real3 v = ValueOf(PointOn(description_, poses, drag->point), &Jet::d);
      point_force(drag->point, -(Real(drag->linear) + Real(drag->quadratic) * v.norm()) * v);
    }
  }
  return F;
}

std::vector<Real6> Oracle::Applied(const RealVector& q, const RealVector& u) const {
  return Applied(PosesAlong(Curve(q, u, true)));
}

Real Oracle::TotalPower(const RealVector& q, const RealVector& u) const {
  const std::vector<JetPose> poses = PosesAlong(Curve(q, u, true));
  const std::vector<Real6> F = Applied(poses);
  Real power = 0;
  for (std::size_t b = 1; b < poses.size(); ++b) power += F[b].dot(MotionOf(poses[b], &Jet::d));
  return power;
}

Real Oracle::TotalEnergy(const RealVector& q, const RealVector& u) const {
  const std::vector<JetPose> poses = PosesAlong(Curve(q, u, true));
  Real energy = 0;
  for (std::size_t b = 1; b < poses.size(); ++b) {
    const Real6 V = MotionOf(poses[b], &Jet::d);
    const Real m = description_.bodies[b].mass;
    energy += V.head<3>().dot(InertiaInGround(static_cast<int>(b), poses[b]) * V.head<3>()) / 2 +
              m * V.tail<3>().squaredNorm() / 2 -
              m * description_.gravity.cast<Real>().dot(ValueOf(poses[b].p, &Jet::f));
  }
  for (const ForceDescription& force : description_.forces) {
    if (const auto* torque = std::get_if<JointTorque>(&force)) {
      const auto* constant = std::get_if<Polynomial>(&torque->value);
      if (constant == nullptr || constant->coefficients.size() > 1) continue;
      energy -= constant->coefficients[0] * Coordinate(torque->joint, poses).f;
    } else if (const auto* spring = std::get_if<JointSpring>(&force)) {
      const Real at = Coordinate(spring->joint, poses).f, stretch = at - spring->rest;
      energy += spring->stiffness * stretch * stretch / 2 - spring->preload * at;
    } else if (const auto* point = std::get_if<PointForce>(&force); point && !point->in_body_axes) {
      const JetVector p = PointOn(description_, poses, point->point);
      energy -= point->force.cast<Real>().dot(ValueOf(p, &Jet::f));
    } else if (const auto* link = std::get_if<SpringDamper>(&force)) {
      const Real stretch =
          Distance(PointOn(description_, poses, link->from), PointOn(description_, poses, link->to))
              .f -
          link->length;
      energy += link->stiffness * stretch * stretch / 2 + link->preload * stretch;
    }
  }
  return energy;
}

}  // namespace loopbench::testing
