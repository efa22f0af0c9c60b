// Poses and constraint functions of the oracle, along curves.
#include <optional>

#include "tests/contract/oracle.h"
#include "tests/contract/time_oracle.h"

namespace loopbench::testing {

namespace {

Real33 Skew(const Real3& v) {
  Real33 A;
  A << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return A;
}

/// Rotation about the unit axis by an angle (Rodrigues).
Real33 Turn(const Real3& axis, Real angle) {
  const Real33 K = Skew(axis);
  return Real33::Identity() + std::sin(angle) * K + (1 - std::cos(angle)) * K * K;
}

/// Shortest rotation that takes the joint's own axis to the described one.
Real33 Alignment(const JointDescription& joint) {
  if (joint.axis.isZero()) return Real33::Identity();
  const bool along_x = joint.type == JointType::kPrismatic || joint.type == JointType::kPinInSlot;
  const Real3 own = along_x ? Real3::UnitX() : Real3::UnitZ();
  const Real3 axis = joint.axis.cast<Real>().normalized();
  const Real33 K = Skew(own.cross(axis));
  return Real33::Identity() + K + K * K / (1 + own.dot(axis));
}

JetPose FramePose(const JointSide& side, const JointDescription& joint, const Real3& com) {
  Real33 R = Alignment(joint);
  const Real3 turn = side.rotation.cast<Real>();
  if (turn.norm() > 0) R = Turn(turn.normalized(), turn.norm()) * R;
  JetPose X;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) X.R(i, j) = Jet(R(i, j));
    X.p[i] = Jet(static_cast<Real>(side.position[i]) - com[i]);
  }
  return X;
}

JetMatrix AboutZ(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(0, 0) = R(1, 1) = Cos(angle);
  R(1, 0) = Sin(angle);
  R(0, 1) = -R(1, 0);
  return R;
}

JetMatrix AboutX(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(1, 1) = R(2, 2) = Cos(angle);
  R(2, 1) = Sin(angle);
  R(1, 2) = -R(2, 1);
  return R;
}

JetMatrix AboutY(const Jet& angle) {
  JetMatrix R = JetIdentity();
  R(0, 0) = R(2, 2) = Cos(angle);
  R(0, 2) = Sin(angle);
  R(2, 0) = -R(0, 2);
  return R;
}

/// Of a quaternion of any length.
JetMatrix FromQuaternion(const Jet* e) {
  const Jet &w = e[0], &x = e[1], &y = e[2], &z = e[3];
  const Jet s = Reciprocal(w * w + x * x + y * y + z * z), two(2);
  const std::array<Jet, 9> m = {
      w * w + x * x - y * y - z * z, two * (x * y - w * z),         two * (x * z + w * y),
      two * (x * y + w * z),         w * w - x * x + y * y - z * z, two * (y * z - w * x),
      two * (x * z - w * y),         two * (y * z + w * x),         w * w - x * x - y * y + z * z};
  JetMatrix R;
  for (int i = 0; i < 9; ++i) R.m[i] = s * m[i];
  return R;
}

struct Sizes {
  int q, u;
};
Sizes SizesOf(JointType type, bool spatial) {
  switch (type) {
    case JointType::kWeld:
    case JointType::kRod:
      return {0, 0};
    case JointType::kFree:
      return spatial ? Sizes{7, 6} : Sizes{3, 3};
    case JointType::kPinInSlot:
    case JointType::kCylindrical:
    case JointType::kUniversal:
      return {2, 2};
    case JointType::kSpherical:
      return {4, 3};
    case JointType::kPlanar:
      return {3, 3};
    default:
      return {1, 1};
  }
}

/// Vector of a rotation matrix near the identity: half its skew part.
JetVector SmallTurn(const JetMatrix& R) {
  const Jet half(Real(1) / 2);
  return {half * (R(2, 1) - R(1, 2)), half * (R(0, 2) - R(2, 0)), half * (R(1, 0) - R(0, 1))};
}

/// A number that is zero while the joint holds, and the direction [w; v] in F in which it grows.
struct Mismatch {
  Real6 along;
  Jet value;
};

/// Of a prescribed coordinate with the value s.
Mismatch DriveMismatch(const JointDescription& joint, int coordinate, const JetPose& X,
                       const Jet& s) {
  // the sine of the difference of two angles grows as the difference does
  const auto beyond = [&s](const Jet& cosine, const Jet& sine) {
    return sine * Cos(s) - cosine * Sin(s);
  };
  if (joint.type == JointType::kUniversal) {
    Real6 along = Real6::Zero();
    for (int i = 0; i < 3; ++i) along[i] = coordinate == 0 ? Real(i == 0) : X.R(i, 1).f;
    return {along, coordinate == 0 ? beyond(X.R(1, 1), X.R(2, 1)) : beyond(X.R(0, 0), X.R(0, 2))};
  }
  if (joint.type == JointType::kPrismatic) return {Real6::Unit(3), X.p[0] - s};
  const Jet angle = beyond(X.R(0, 0), X.R(1, 0));
  if (joint.type == JointType::kHelical) {
    const Real pitch = joint.pitch;
    return {Real6::Unit(2) + pitch * Real6::Unit(5), Jet(1 + pitch * pitch) * angle};
  }
  if (coordinate == 0) return {Real6::Unit(2), angle};
  const int axis = joint.type == JointType::kCylindrical ? 2 : coordinate - 1;
  return {Real6::Unit(3 + axis), X.p[axis] - s};
}

std::vector<Mismatch> Mismatches(const JointDescription& joint, bool spatial, const JetPose& X) {
  const JointType type = joint.type;
  std::vector<Mismatch> c;
  if (type == JointType::kRod) {
    const Jet distance = Sqrt(X.p[0] * X.p[0] + X.p[1] * X.p[1] + X.p[2] * X.p[2]);
    Real6 along = Real6::Zero();
    for (int i = 0; i < 3; ++i) along[3 + i] = X.p[i].f / distance.f;
    return {{along, distance - Jet(joint.length)}};
  }
  const auto add = [&c](int axis, const Jet& value) { c.push_back({Real6::Unit(axis), value}); };
  const JetVector turn = SmallTurn(X.R);
  const bool in_plane = type == JointType::kRevolute || type == JointType::kPinInSlot ||
                        type == JointType::kCylindrical || type == JointType::kPlanar ||
                        type == JointType::kHelical;
  if (!spatial) {
    if (!in_plane) add(2, turn[2]);
    if (type != JointType::kPrismatic && type != JointType::kPinInSlot) add(3, X.p[0]);
    add(4, X.p[1]);
    return c;
  }
  if (in_plane) {
    // the tip of M's z axis moves with [wy, -wx]
    add(0, -X.R(1, 2));
    add(1, X.R(0, 2));
  } else if (type == JointType::kUniversal) {
    // x of F stays normal to y of M: (x . y_M)' = -w . (x cross y_M)
    Real6 normal = Real6::Zero();
    normal[1] = -X.R(2, 1).f;
    normal[2] = X.R(1, 1).f;
    c.push_back({normal, -X.R(0, 1)});
  } else if (type != JointType::kSpherical) {
    for (int i = 0; i < 3; ++i) add(i, turn[i]);
  }
  const bool free_x =
      type == JointType::kPrismatic || type == JointType::kPinInSlot || type == JointType::kPlanar;
  if (!free_x) add(3, X.p[0]);
  if (type != JointType::kPlanar) add(4, X.p[1]);
  if (type == JointType::kHelical) {
    const Real pitch = joint.pitch, length = std::sqrt(1 + pitch * pitch);
    Real6 along = Real6::Zero();
    along[2] = -pitch / length;
    along[5] = 1 / length;
    Jet ahead = X.p[2] - Jet(pitch) * Angle(X.R(0, 0), X.R(1, 0));
    ahead.f = std::remainder(ahead.f, 2 * std::acos(Real(-1)) * pitch);  // whole turns
    c.push_back({along, ahead * Jet(1 / length)});
  } else if (type != JointType::kCylindrical) {
    add(5, X.p[2]);
  }
  return c;
}

}  // namespace

JetPose Transform(JointType type, bool spatial, const Jet* q, Real pitch) {
  JetPose X;
  switch (type) {
    case JointType::kWeld:
      break;
    case JointType::kRevolute:
      X.R = AboutZ(q[0]);
      break;
    case JointType::kPrismatic:
      X.p[0] = q[0];
      break;
    case JointType::kPinInSlot:
      X.R = AboutZ(q[0]);
      X.p[0] = q[1];
      break;
    case JointType::kCylindrical:
      X.R = AboutZ(q[0]);
      X.p[2] = q[1];
      break;
    case JointType::kRod:
      for (int i = 0; i < (spatial ? 3 : 2); ++i) X.p[i] = q[i];
      break;
    case JointType::kHelical:
      X.R = AboutZ(q[0]);
      X.p[2] = Jet(pitch) * q[0];
      break;
    case JointType::kSpherical:
      X.R = FromQuaternion(q);
      break;
    case JointType::kUniversal:
      X.R = AboutX(q[0]) * AboutY(q[1]);
      break;
    case JointType::kFree:
      if (spatial) {
        X.R = FromQuaternion(q);
        X.p = {q[4], q[5], q[6]};
        break;
      }
      [[fallthrough]];
    case JointType::kPlanar:
      X.R = AboutZ(q[0]);
      X.p = {q[1], q[2], Jet(0)};
  }
  return X;
}

Oracle::Oracle(const MechanismDescription& description, Layout layout)
    : description_(description), layout_(std::move(layout)) {
  for (const JointDescription& joint : description_.joints) {
    const auto com = [&](int body) -> Real3 { return description_.bodies[body].com.cast<Real>(); };
    frames_.push_back({FramePose(joint.from, joint, com(joint.from.body)),
                       FramePose(joint.to, joint, com(joint.to.body))});
  }
  int next = 0;
  for (const Layout::Step& step : layout_.steps) {
    const JointType type = step.joint < 0 ? JointType::kFree : description_.joints[step.joint].type;
    first_.push_back(next);
    next += SizesOf(type, layout_.spatial).q;
  }
}

Jet Oracle::Prescribed(const PrescribedMotion& motion) const {
  return OracleAt(motion.value, time_);
}

std::vector<Jet> Oracle::Curve(const RealVector& q, const RealVector& u, bool driven) const {
  std::vector<Jet> curve;
  for (const Layout::Step& step : layout_.steps) {
    const JointType type = step.joint < 0 ? JointType::kFree : description_.joints[step.joint].type;
    const Sizes sizes = SizesOf(type, layout_.spatial);
    const int turned = sizes.q - sizes.u;  // a quaternion has one number more than its speed
    if (turned > 0) {
      // e' = w e / 2 and, w being constant, e'' = -|w|^2 e / 4 (quaternion product from the left)
      const Real *e = &q[step.q], *w = &u[step.u];
      const Real rate[4] = {
          -w[0] * e[1] - w[1] * e[2] - w[2] * e[3], w[0] * e[0] + w[1] * e[3] - w[2] * e[2],
          w[1] * e[0] + w[2] * e[1] - w[0] * e[3], w[2] * e[0] + w[0] * e[2] - w[1] * e[1]};
      const Real ww = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
      for (int i = 0; i < 4; ++i) curve.push_back(Jet(e[i], rate[i] / 2, -ww * e[i] / 4));
    }
    std::vector<std::optional<Jet>> given(sizes.u);
    if (step.joint >= 0) {
      for (const PrescribedMotion& motion : description_.joints[step.joint].motions) {
        const Jet s = Prescribed(motion);
        given[motion.coordinate] = driven ? s : Jet(s.f);
      }
    }
    for (int i = turned > 0 ? 3 : 0, free = i; i < sizes.u; ++i) {
      if (given[i]) {
        curve.push_back(*given[i]);
      } else {
        curve.push_back(Jet(q[step.q + turned + free], u[step.u + free]));
        ++free;
      }
    }
  }
  return curve;
}

std::vector<JetPose> Oracle::PosesAlong(const std::vector<Jet>& q) const {
  std::vector<JetPose> poses(description_.bodies.size());
  for (std::size_t k = 0; k < layout_.steps.size(); ++k) {
    const Layout::Step& step = layout_.steps[k];
    const Jet* at = q.data() + first_[k];
    if (step.joint < 0) {
      poses[step.child] = Transform(JointType::kFree, layout_.spatial, at);
      continue;
    }
    const JointDescription& joint = description_.joints[step.joint];
    const Frames& X = frames_[step.joint];
    const JetPose X_PQ =
        X.X_PF * Transform(joint.type, layout_.spatial, at, joint.pitch) * Inverted(X.X_QM);
    poses[step.child] = poses[step.parent] * (joint.to.body == step.child ? X_PQ : Inverted(X_PQ));
  }
  return poses;
}

std::vector<JetPose> Oracle::Poses(const RealVector& q) const {
  return PosesAlong(Curve(q, RealVector::Zero(layout_.num_u), false));
}

JetPose Oracle::JointPose(int index, const std::vector<JetPose>& poses) const {
  const JointDescription& joint = description_.joints[index];
  return Inverted(poses[joint.from.body] * frames_[index].X_PF) *
         (poses[joint.to.body] * frames_[index].X_QM);
}

std::vector<Jet> Oracle::Closures(const std::vector<JetPose>& poses, bool driven) const {
  std::vector<Jet> c;
  for (int index : layout_.constraints) {
    const JointDescription& joint = description_.joints[index];
    const JetPose X_FM = JointPose(index, poses);
    for (const PrescribedMotion& motion : joint.motions) {
      Jet s = Prescribed(motion);
      if (!driven) s = Jet(s.f);
      c.push_back(DriveMismatch(joint, motion.coordinate, X_FM, s).value);
    }
    if (joint.type == JointType::kFree) continue;
    for (const Mismatch& one : Mismatches(joint, layout_.spatial, X_FM)) c.push_back(one.value);
  }
  return c;
}

std::vector<Oracle::Row> Oracle::Rows(const std::vector<JetPose>& poses) const {
  std::vector<Row> rows;
  for (int index : layout_.constraints) {
    const JointDescription& joint = description_.joints[index];
    const JetPose X_WF = poses[joint.from.body] * frames_[index].X_PF;
    const JetPose X_FM = JointPose(index, poses);
    std::vector<Mismatch> all;
    for (const PrescribedMotion& motion : joint.motions) {
      all.push_back(DriveMismatch(joint, motion.coordinate, X_FM, Prescribed(motion)));
    }
    if (joint.type != JointType::kFree) {
      for (const Mismatch& one : Mismatches(joint, layout_.spatial, X_FM)) all.push_back(one);
    }
    for (const Mismatch& one : all) {
      Row row{index, Real6::Zero()};
      for (int i = 0; i < 6; ++i) {
        for (int k = 0; k < 3; ++k) row.wrench[i] += X_WF.R(i % 3, k).f * one.along[i / 3 * 3 + k];
      }
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace loopbench::testing
