#include "harness/exchange/export_mjcf_joints.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanism/algebra/space.h"

namespace loopbench::exchange {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct PartKind {
  char kind;
  int axis;  ///< x, y, z
  int coordinate;
};

/// What a joint of this kind is made of, from F to M, each part in the axes that those before it
/// have moved.
std::vector<PartKind> KindsOf(const Joint& joint) {
  const std::string& kind = joint.kind;
  if (kind == "revolute") return {{'h', 2, 0}};
  if (kind == "prismatic") return {{'s', 0, 0}};
  if (kind == "cylindrical") return {{'h', 2, 0}, {'s', 2, 1}};
  if (kind == "pin-in-slot") return {{'s', 0, 1}, {'h', 2, 0}};
  if (kind == "universal") return {{'h', 0, 0}, {'h', 1, 1}};
  if (kind == "spherical") return {{'b', 0, 0}};
  if (kind == "planar" || (kind == "free" && joint.coordinates.size() == 3)) {
    return {{'s', 0, 1}, {'s', 1, 2}, {'h', 2, 0}};
  }
  if (kind == "free") return {{'s', 0, 4}, {'s', 1, 5}, {'s', 2, 6}, {'b', 0, 0}};
  return {};
}

Vector3d ToEigen(const Vec& v) { return {v[0], v[1], v[2]}; }

/// What one part does, at these coordinates of its joint.
loopbench::Frame Motion(const PartKind& part, const double* q, double sign) {
  loopbench::Frame X;
  if (part.kind == 's') X.p[part.axis] = sign * q[part.coordinate];
  if (part.kind == 'h') {
    X.R = Eigen::AngleAxisd(sign * q[part.coordinate], Vector3d::Unit(part.axis)).matrix();
  }
  if (part.kind == 'b') {
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(q[0], sign * q[1], sign * q[2], sign * q[3]).normalized();
    X.R = turn.toRotationMatrix();
  }
  return X;
}

}  // namespace

bool HasParts(const Joint& joint) { return joint.kind == "weld" || !KindsOf(joint).empty(); }

Vector3d FromOrigin(const Model& model, int body, const Vec& at) {
  return ToEigen(model.bodies[static_cast<std::size_t>(body)].com) + ToEigen(at);
}

loopbench::Frame FromOrigin(const Model& model, int body, const Frame& frame) {
  loopbench::Frame X;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) X.R(i, j) = frame.R[static_cast<std::size_t>(3 * i + j)];
  }
  X.p = FromOrigin(model, body, frame.p);
  return X;
}

std::array<double, 4> QuaternionOf(const Matrix3d& R) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(R).normalized();
  return {q.w(), q.x(), q.y(), q.z()};
}

MjcfChain ChainOf(const Model& model, const Joint& joint) {
  std::vector<PartKind> kinds = KindsOf(joint);
  const double sign = joint.from_is_child ? -1.0 : 1.0;
  if (joint.from_is_child) std::ranges::reverse(kinds);
  const double* q = model.q.data() + joint.q;
  const auto X_PF = FromOrigin(model, joint.from, joint.F);
  const auto X_QM = FromOrigin(model, joint.to, joint.M);
  const loopbench::Frame& on_child = joint.from_is_child ? X_PF : X_QM;

  MjcfChain chain;
  chain.axes = on_child.R;
  chain.parts.resize(kinds.size());
  loopbench::Frame moved;  // the frame on the child, in the frame behind part i
  for (std::size_t i = kinds.size(); i-- > 0;) {
    const PartKind& kind = kinds[i];
    // behind part i, seen from the child
    const loopbench::Frame behind = on_child * moved.Inverse();
    MjcfPart& part = chain.parts[i];
    part.kind = kind.kind;
    part.coordinate = kind.coordinate;
    part.axis = behind.R * Vector3d::Unit(kind.axis);
    part.at = behind.p;
    const loopbench::Frame motion = Motion(kind, q, sign);
    if (kind.kind == 'b') {
      chain.turn = motion.R;
    } else {
      part.value = sign * q[kind.coordinate];
    }
    moved = motion * moved;
  }
  chain.pose = (joint.from_is_child ? X_QM : X_PF) * moved * on_child.Inverse();
  return chain;
}

}  // namespace loopbench::exchange
