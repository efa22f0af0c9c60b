// Joints in series without mass between them, and the joint type that they form.
//
// Each joint of a series acts in axes moved by the previous ones. With X_i(q_i) the motion of joint
// i in drawn axes of the last body C, the pose of C in the first body P is X_PC X_1 .. X_n. The set
// of reachable poses determines the type of the joint.
#include <limits>

#include "harness/exchange/import_draft.h"
#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/model/joint.h"

namespace loopbench::harness {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Tolerance for parallel, perpendicular and intersecting axes: rounding in a file with nine
/// digits.
constexpr double kAligned = 1e-9;

/// Returns the intersection of the axes of hinges; nothing if there is none.
std::optional<Vector3d> MeetingPoint(const std::vector<SerialJoint>& hinges) {
  const auto at_first = [&](const SerialJoint& hinge) {
    return hinge.position == hinges[0].position;
  };
  if (std::ranges::all_of(hinges, at_first)) return hinges[0].position;
  // least-squares point of the distances to all axes
  MatrixX<double> A = MatrixX<double>::Zero(3, 3), U(3, 3);
  VectorX<double> lambda(3);
  Vector3d b = Vector3d::Zero();
  double arms = 1.0;
  for (const SerialJoint& hinge : hinges) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - hinge.axis * hinge.axis.transpose();
    A += across;
    b += across * hinge.position;
    arms += hinge.position.norm();
  }
  SymmetricEigen<double>(A, U, lambda);
  // axes 2e-7 rad apart have an eigenvalue of 2e-14; parallel axes have round-off
  const double least = 16.0 * std::numeric_limits<double>::epsilon() * lambda[2];
  Vector3d point = Vector3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3d u = U.col(k);
    if (lambda[k] > least) point += u.dot(b) / lambda[k] * u;
  }
  for (const SerialJoint& hinge : hinges) {
    const Vector3d way = point - hinge.position;
    if (!((way - way.dot(hinge.axis) * hinge.axis).norm() <= kAligned * arms)) return std::nullopt;
  }
  return point;
}

bool Parallel(const Vector3d& a, const Vector3d& b) { return a.cross(b).norm() <= kAligned; }
bool Perpendicular(const Vector3d& a, const Vector3d& b) { return std::abs(a.dot(b)) <= kAligned; }

/// Returns axes x, y, z from two axes that are perpendicular up to rounding.
Eigen::Quaterniond Axes(const Vector3d& x, const Vector3d& z_near) {
  const Vector3d z = (z_near - x.dot(z_near) * x).normalized();
  return FromAxes(x, z.cross(x), z);
}

bool Independent(const std::vector<SerialJoint>& joints) {
  Eigen::Matrix3d axes;
  axes << joints[0].axis, joints[1].axis, joints[2].axis;
  return std::abs(axes.determinant()) > kAligned;
}

}  // namespace

std::optional<ComposedJoint> Compose(const std::vector<SerialJoint>& joints) {
  using enum JointType;
  const SerialJoint& first = joints.front();
  if (joints.size() == 1) return ComposedJoint{first.type, Placement(first.position)};
  std::vector<SerialJoint> hinges, slides, balls;
  for (const SerialJoint& joint : joints) {
    if (joint.type == kRevolute) {
      hinges.push_back(joint);
    } else if (joint.type == kPrismatic) {
      slides.push_back(joint);
    } else if (joint.type == kSpherical) {
      balls.push_back(joint);
    } else {
      return std::nullopt;
    }
  }
  // a slot, line or plane is on the parent when the slides come first, else on the child
  const bool from_is_child = first.type != kPrismatic;
  const bool is_mixed = !std::ranges::is_partitioned(joints, [&](const SerialJoint& joint) {
    return (joint.type == kPrismatic) != from_is_child;
  });
  // rotations: 3 about a centre, or as many as hinges
  std::optional<Vector3d> centre;
  if (balls.size() == 1 && hinges.empty()) centre = balls[0].position;
  if (balls.empty() && hinges.size() == 3 && Independent(hinges)) centre = MeetingPoint(hinges);
  const std::size_t turns = centre ? 3 : hinges.size();
  if (!centre && (turns > 2 || !balls.empty())) return std::nullopt;
  const Vector3d z = hinges.empty() ? Vector3d::Zero() : hinges[0].axis;
  const Vector3d at = centre ? *centre : turns > 0 ? hinges[0].position : Vector3d::Zero();
  const Vector3d x = slides.empty() ? Vector3d::Zero() : slides[0].axis;
  const Vector3d y = slides.size() < 2 ? Vector3d::Zero() : slides[1].axis;
  const bool is_line = slides.size() == 1, is_plane = slides.size() == 2 && !Parallel(x, y);
  const bool is_space = slides.size() == 3 && Independent(slides);
  if (turns == 0 && is_plane) return ComposedJoint{kPlanar, {Axes(x, x.cross(y)), at}, false, true};
  if (turns == 0 && is_space) return ComposedJoint{kTranslation, {Axes(x, x.cross(y)), at}};
  if (turns == 1 && is_line && Parallel(z, x)) return ComposedJoint{kCylindrical, {TurnOfZ(z), at}};
  if (turns == 1 && is_line && Perpendicular(z, x)) {
    return ComposedJoint{kPinInSlot, {Axes(x, z), at}, from_is_child};
  }
  if (turns == 1 && is_plane && Perpendicular(z, x) && Perpendicular(z, y)) {
    return ComposedJoint{kPlanar, {Axes(x, z), at}};
  }
  if (turns == 1 && is_space) return ComposedJoint{kSchoenflies, {TurnOfZ(z), at}};
  if (turns == 2 && slides.empty() && Perpendicular(z, hinges[1].axis)) {
    // about x of F, then about y of M
    const auto point = MeetingPoint(hinges);
    if (point) return ComposedJoint{kUniversal, {Axes(z, z.cross(hinges[1].axis)), *point}};
  }
  if (turns == 3 && slides.empty()) return ComposedJoint{kSpherical, Placement(at)};
  if (turns == 3 && is_space) return ComposedJoint{kFree, Placement(at)};
  if (turns == 3 && is_line && !is_mixed) {
    const Vector3d other = std::abs(x.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    return ComposedJoint{kPointOnLine, {Axes(x, other), at}, from_is_child};
  }
  if (turns == 3 && is_plane && !is_mixed) {
    return ComposedJoint{kPointInPlane, {Axes(x, x.cross(y)), at}, from_is_child};
  }
  return std::nullopt;
}

Placement MotionOf(const SerialJoint& joint, const double* q) {
  if (joint.type == JointType::kPrismatic) return Placement((q[0] - joint.reference) * joint.axis);
  Placement X;
  X.q = joint.type == JointType::kSpherical
            ? Quaterniond(q[0], q[1], q[2], q[3]).normalized()
            : Quaterniond(Eigen::AngleAxisd(q[0] - joint.reference, joint.axis));
  X.p = joint.position - X.q * joint.position;
  return X;
}

void SetComposed(const std::vector<SerialJoint>& series, const ComposedJoint& composed,
                 const double* q, const double* u, std::vector<double>* coordinates,
                 std::vector<double>* speeds) {
  std::vector<Placement> moved = {Placement()};  // the product of motions up to each joint
  for (const SerialJoint& joint : series) {
    moved.push_back(moved.back() * MotionOf(joint, q));
    q += joint.num_q();
  }
  // angular velocity of the last body, and velocity of the joint's origin on it, in drawn axes
  const Vector3d Mo = moved.back().At(composed.X_BJ.p);
  Vector3d w = Vector3d::Zero(), v = Vector3d::Zero();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const SerialJoint& joint = series[i];
    if (joint.type == JointType::kPrismatic) {
      v += moved[i].q * joint.axis * u[0];
    } else {
      const Vector3d turn = joint.type == JointType::kSpherical
                                ? moved[i + 1].q * Vector3d(u[0], u[1], u[2])
                                : moved[i].q * joint.axis * u[0];
      w += turn;
      v += turn.cross(Mo - moved[i].At(joint.position));
    }
    u += joint.num_u();
  }
  const JointKind<Spatial, double>& kind = KindOf<Spatial, double>(composed.type);
  Placement X_FM = composed.X_BJ.Inverse() * moved.back() * composed.X_BJ;
  w = composed.X_BJ.q.conjugate() * w;
  v = composed.X_BJ.q.conjugate() * v;
  if (composed.from_is_child) {
    // reversed: velocity of the origin of the parent's frame, in axes of the child's frame
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
  speeds->assign(static_cast<std::size_t>(kind.num_u), 0.0);
  Basis<Spatial, double> basis;
  if (kind.basis != nullptr) kind.basis(pose, basis, 0.0);
  for (int i = 0; i < kind.num_u; ++i) {
    if (kind.basis == nullptr) {
      const int axis = kind.axes[i];
      (*speeds)[i] = axis < 3 ? w[axis] : v[axis - 3];
      continue;
    }
    const auto column = basis[i];
    for (int k = 0; k < 3; ++k) {
      (*speeds)[i] += column.angular[k] * w[k] + column.linear[k] * v[k];
    }
  }
}

}  // namespace loopbench::harness
