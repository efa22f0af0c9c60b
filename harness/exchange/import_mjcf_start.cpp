// <keyframe>: coordinates and speeds of MuJoCo's joints as those of ours.
#include <fmt/format.h>

#include "harness/exchange/import_mjcf.h"
#include "mechanism/model/joint.h"

namespace loopbench::harness {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The motion of a chain's joints at their coordinates, in body axes as the file draws them.
struct ChainMotion {
  Placement X;                    ///< the product of their motions
  Vector3d w = Vector3d::Zero();  ///< angular velocity
  Vector3d v = Vector3d::Zero();  ///< of the point that is `at` in the moved body
};

Placement MotionOf(const MjcfJoint& joint, const double* q) {
  if (joint.kind == MjcfKind::kSlide) return Placement((q[0] - joint.reference) * joint.axis);
  Placement X;
  X.q = joint.kind == MjcfKind::kBall
            ? Quaterniond(q[0], q[1], q[2], q[3]).normalized()
            : Quaterniond(Eigen::AngleAxisd(q[0] - joint.reference, joint.axis));
  X.p = joint.position - X.q * joint.position;
  return X;
}

ChainMotion Move(const MjcfModel& model, const MjcfChain& chain, const double* q, const double* u) {
  std::vector<Placement> before;
  ChainMotion motion;
  const double* position = q;
  for (const std::size_t part : chain.parts) {
    before.push_back(motion.X);
    motion.X = motion.X * MotionOf(model.joints[part], position);
    position += model.joints[part].num_q();
  }
  const Vector3d Mo = motion.X.At(chain.X_BJ.p);
  for (std::size_t i = 0; i < chain.parts.size(); ++i) {
    const MjcfJoint& joint = model.joints[chain.parts[i]];
    const Placement& after = i + 1 < before.size() ? before[i + 1] : motion.X;
    if (joint.kind == MjcfKind::kSlide) {
      motion.v += before[i].q * joint.axis * u[0];
    } else {
      const Vector3d w = joint.kind == MjcfKind::kBall ? after.q * Vector3d(u[0], u[1], u[2])
                                                       : before[i].q * joint.axis * u[0];
      motion.w += w;
      motion.v += w.cross(Mo - before[i].At(joint.position));
    }
    u += joint.num_u();
  }
  return motion;
}

/// Several joints as one: its coordinates are those of the pose they make, its speeds what is left
/// of the velocity along the free directions, which is all of it.
void SetComposed(const MjcfModel& model, const MjcfChain& chain, JointType type, const double* q,
                 const double* u, std::vector<double>* coordinates, std::vector<double>* speeds) {
  const ChainMotion motion = Move(model, chain, q, u);
  const JointKind<Spatial, double>& kind = KindOf<Spatial, double>(type);
  Placement X_FM = chain.X_BJ.Inverse() * motion.X * chain.X_BJ;
  Vector3d w = chain.X_BJ.q.conjugate() * motion.w, v = chain.X_BJ.q.conjugate() * motion.v;
  if (chain.from_is_child) {
    // seen from the other side: of the origin of the parent's frame, in axes of the child's
    const Placement X_MF = X_FM.Inverse();
    v = X_MF.q * Vector3d(-(v + w.cross(-X_FM.p)));
    w = X_MF.q * Vector3d(-w);
    X_FM = X_MF;
  }
  Pose<Spatial, double> pose;
  pose.R = X_FM.q.toRotationMatrix();
  pose.p = X_FM.p;
  coordinates->resize(static_cast<std::size_t>(kind.num_q));
  kind.coordinates(pose, coordinates->data(), 0.0);
  speeds->resize(static_cast<std::size_t>(kind.num_u));
  Basis<Spatial, double> basis;
  if (kind.basis != nullptr) kind.basis(pose, basis, 0.0);
  for (int i = 0; i < kind.num_u; ++i) {
    double& speed = (*speeds)[static_cast<std::size_t>(i)];
    if (kind.basis != nullptr) {
      const auto column = basis[static_cast<std::size_t>(i)];
      speed = 0.0;
      for (int k = 0; k < 3; ++k) speed += column.angular[k] * w[k] + column.linear[k] * v[k];
    } else {
      const int axis = kind.axes[static_cast<std::size_t>(i)];
      speed = axis < 3 ? w[axis] : v[axis - 3];
    }
  }
}

/// The value at which an <equality> holds the joint, if one does.
std::optional<double> HeldAt(const JointDescription& joint) {
  if (joint.motions.empty()) return std::nullopt;
  return std::get<Polynomial>(joint.motions[0].value).coefficients[0];
}

/// A start that a joint cannot have is dropped.
void NoteHeld(const XmlElement& key, const std::string& name, double held, double coordinate,
              double speed, ImportDraft* draft) {
  const std::string reason =
      fmt::format("of joint \"{}\" dropped: an <equality> holds it at {:.6g}", name, held);
  if (coordinate != held) draft->Note(key, "qpos", reason, true);
  if (speed != 0.0) draft->Note(key, "qvel", reason, true);
}

void RefuseZeroQuaternions(const MjcfModel& model, const XmlValue& qpos, const double* q) {
  for (const MjcfJoint& joint : model.joints) {
    const double* turn = q + (joint.kind == MjcfKind::kFree ? 3 : 0);
    if (joint.num_q() > 1) UnitQuaternion(qpos, {turn[0], turn[1], turn[2], turn[3]});
    q += joint.num_q();
  }
}

/// Coordinates of our joints, and speeds if there are any, from those of MuJoCo.
void SetMjcfStart(MjcfModel* model, const XmlElement& key, const std::vector<double>& qpos,
                  const std::vector<double>& qvel, bool has_speeds) {
  InitialDescription& initial = model->draft->description.initial;
  initial.coordinates.clear();
  const double *q = qpos.data(), *u = qvel.data();
  for (const MjcfChain& chain : model->chains) {
    if (chain.parts.empty()) continue;
    const MjcfJoint& first = model->joints[chain.parts[0]];
    const JointDescription& ours =
        model->draft->description.joints[static_cast<std::size_t>(chain.joint)];
    std::vector<double> coordinates, speeds;
    if (first.alone && first.kind == MjcfKind::kFree) {
      // a place in ground axes, an angular velocity in those of the body
      coordinates = {q[3], q[4], q[5], q[6], q[0], q[1], q[2]};
      const Vector3d w =
          Quaterniond(q[3], q[4], q[5], q[6]).normalized() * Vector3d(u[3], u[4], u[5]);
      speeds = {w.x(), w.y(), w.z(), u[0], u[1], u[2]};
    } else if (first.alone && first.num_q() == 1) {
      coordinates = {q[0] - first.reference};
      speeds = {u[0]};
    } else {
      SetComposed(*model, chain, ours.type, q, u, &coordinates, &speeds);
    }
    if (const auto held = HeldAt(ours)) {
      NoteHeld(key, ours.name, *held, coordinates[0], speeds[0], model->draft);
    } else {
      initial.coordinates.push_back({chain.joint, coordinates});
      if (has_speeds) initial.speeds.push_back({chain.joint, speeds});
    }
    for (const std::size_t part : chain.parts) {
      q += model->joints[part].num_q();
      u += model->joints[part].num_u();
    }
  }
}

}  // namespace

std::vector<Placement> MjcfModel::WhereSpringsAreFree() const {
  std::vector<Placement> poses(draft->at_rest.size());
  for (const MjcfChain& chain : chains) {
    Placement X = poses[static_cast<std::size_t>(chain.parent)] * chain.X_PB;
    for (const std::size_t part : chain.parts) {
      const MjcfJoint& one = joints[part];
      if (one.num_q() == 1) X = X * MotionOf(one, &one.spring_reference);
    }
    poses[static_cast<std::size_t>(chain.child)] = X;
  }
  return poses;
}

void ReadMjcfKeys(const XmlElement& root, MjcfModel* model) {
  std::vector<XmlElement> keys;
  for (const XmlElement& section : root.Children("keyframe")) {
    for (const XmlElement& key : section.Children("key")) keys.push_back(key);
  }
  std::optional<XmlValue> controls;
  if (!keys.empty()) {
    std::vector<double> qpos, qvel;
    for (const MjcfJoint& joint : model->joints) {
      qpos.insert(qpos.end(), static_cast<std::size_t>(joint.num_q()), 0.0);
      qvel.insert(qvel.end(), static_cast<std::size_t>(joint.num_u()), 0.0);
    }
    const auto positions = keys[0].Attribute("qpos");
    const auto speeds = keys[0].Attribute("qvel");
    if (speeds && !positions) keys[0].Fail("qvel without qpos", "both");
    if (speeds) qvel = speeds->Numbers(qvel.size(), qvel.size());
    if (positions) {
      qpos = positions->Numbers(qpos.size(), qpos.size());
      RefuseZeroQuaternions(*model, *positions, qpos.data());
      SetMjcfStart(model, keys[0], qpos, qvel, speeds.has_value());
    }
    controls = keys[0].Attribute("ctrl");
    keys[0].Attribute("name");
    keys[0].Attribute("time");
  }
  for (std::size_t i = 1; i < keys.size(); ++i) {
    keys[i].Ignore();
    model->draft->Note(keys[i], "dropped: the first <key> is the start");
  }
  ReadMjcfActuators(root, controls, model);
}

}  // namespace loopbench::harness
