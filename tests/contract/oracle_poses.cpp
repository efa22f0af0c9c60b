// Poses and constraint functions of the oracle, along curves.
#include <Eigen/Geometry>
#include <optional>

#include "tests/contract/oracle_parts.h"
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
  const bool along_x = joint.type == JointType::kPrismatic || joint.type == JointType::kPinInSlot ||
                       joint.type == JointType::kPointOnLine;
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

}  // namespace

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
        X.X_PF * Transform(joint.type, layout_.spatial, at, joint.parameter) * Inverted(X.X_QM);
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
