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

// Conversion of coordinates and speeds.

/// Motion of a chain of joints at its coordinates, in drawn body axes.
struct ChainMotion {
  Placement X;                    ///< the product of their motions
  Vector3d w = Vector3d::Zero();  ///< angular velocity
  Vector3d v = Vector3d::Zero();  ///< velocity of the point `at` in the moved body
};

ChainMotion Move(const std::vector<SerialJoint>& series, const ComposedJoint& composed,
                 const double* q, const double* u) {
  std::vector<Placement> before;
  ChainMotion motion;
  const double* position = q;
  for (const SerialJoint& joint : series) {
    before.push_back(motion.X);
    motion.X = motion.X * MotionOf(joint, position);
    position += joint.num_q();
  }
  const Vector3d Mo = motion.X.At(composed.X_BJ.p);
  for (std::size_t i = 0; i < series.size(); ++i) {
    const SerialJoint& joint = series[i];
    const Placement& after = i + 1 < before.size() ? before[i + 1] : motion.X;
    if (joint.kind == SerialKind::kSlide) {
      motion.v += before[i].q * joint.axis * u[0];
    } else {
      const Vector3d w = joint.kind == SerialKind::kBall ? after.q * Vector3d(u[0], u[1], u[2])
                                                         : before[i].q * joint.axis * u[0];
      motion.w += w;
      motion.v += w.cross(Mo - before[i].At(joint.position));
    }
    u += joint.num_u();
  }
  return motion;
}

}  // namespace

std::optional<ComposedJoint> Compose(const std::vector<SerialJoint>& joints) {
  using enum JointType;
  const SerialJoint& first = joints.front();
  if (joints.size() == 1) {
    return ComposedJoint{kSerialTypes[static_cast<int>(first.kind)], Placement(first.position)};
  }
  std::vector<SerialJoint> hinges, slides, balls;
  for (const SerialJoint& joint : joints) {
    if (joint.kind == SerialKind::kFree) return std::nullopt;
    const bool turns = joint.kind == SerialKind::kHinge, slips = joint.kind == SerialKind::kSlide;
    (turns ? hinges : slips ? slides : balls).push_back(joint);
  }
  const bool is_pair = joints.size() == 2;
  // a slot, line or plane is on the parent when the slides come first, else on the child
  const bool from_is_child = first.kind != SerialKind::kSlide;
  if (is_pair && hinges.size() == 2) {
    const Vector3d &a = hinges[0].axis, &b = hinges[1].axis;
    const auto point = Perpendicular(a, b) ? MeetingPoint(hinges) : std::nullopt;
    // about x of F, then about y of M
    if (point) return ComposedJoint{kUniversal, {Axes(a, a.cross(b)), *point}};
  }
  if (is_pair && slides.size() == 2) {
    const Vector3d &a = slides[0].axis, &b = slides[1].axis;
    if (Parallel(a, b)) return std::nullopt;
    return ComposedJoint{kPlanar, {Axes(a, a.cross(b)), Vector3d::Zero()}, false, true};
  }
  if (is_pair && hinges.size() == 1 && slides.size() == 1) {
    const Vector3d &turn = hinges[0].axis, &slide = slides[0].axis, &at = hinges[0].position;
    if (Parallel(turn, slide)) return ComposedJoint{kCylindrical, {TurnOfZ(turn), at}};
    if (Perpendicular(turn, slide)) {
      return ComposedJoint{kPinInSlot, {Axes(slide, turn), at}, from_is_child};
    }
  }
  if (slides.size() == 2 && hinges.size() == 1) {
    const Vector3d &z = hinges[0].axis, &a = slides[0].axis, &b = slides[1].axis;
    if (Perpendicular(z, a) && Perpendicular(z, b) && !Parallel(a, b)) {
      return ComposedJoint{kPlanar, {Axes(a, z), hinges[0].position}};
    }
  }
  const bool spans = slides.size() == 3 && Independent(slides);
  if (spans && joints.size() == 3) {
    const Vector3d &a = slides[0].axis, &b = slides[1].axis;
    return ComposedJoint{kTranslation, {Axes(a, a.cross(b)), Vector3d::Zero()}};
  }
  if (spans && joints.size() == 4 && hinges.size() == 1) {
    return ComposedJoint{kSchoenflies, {TurnOfZ(hinges[0].axis), hinges[0].position}};
  }
  std::optional<Vector3d> centre;
  if (balls.size() == 1 && hinges.empty()) centre = balls[0].position;
  if (balls.empty() && hinges.size() == 3 && Independent(hinges)) centre = MeetingPoint(hinges);
  if (centre && slides.empty()) return ComposedJoint{kSpherical, Placement(*centre)};
  if (centre && spans) return ComposedJoint{kFree, Placement(*centre)};
  const bool is_mixed = !std::ranges::is_partitioned(joints, [&](const SerialJoint& joint) {
    return (joint.kind == SerialKind::kSlide) != from_is_child;
  });
  if (!centre || is_mixed) return std::nullopt;
  const Vector3d& x = slides[0].axis;
  if (slides.size() == 1) {
    const Vector3d other = std::abs(x.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    return ComposedJoint{kPointOnLine, {Axes(x, other), *centre}, from_is_child};
  }
  if (slides.size() == 2 && !Parallel(x, slides[1].axis)) {
    const Vector3d z = x.cross(slides[1].axis);
    return ComposedJoint{kPointInPlane, {Axes(x, z), *centre}, from_is_child};
  }
  return std::nullopt;
}

Placement MotionOf(const SerialJoint& joint, const double* q) {
  if (joint.kind == SerialKind::kSlide) return Placement((q[0] - joint.reference) * joint.axis);
  Placement X;
  X.q = joint.kind == SerialKind::kBall
            ? Quaterniond(q[0], q[1], q[2], q[3]).normalized()
            : Quaterniond(Eigen::AngleAxisd(q[0] - joint.reference, joint.axis));
  X.p = joint.position - X.q * joint.position;
  return X;
}

void SetComposed(const std::vector<SerialJoint>& series, const ComposedJoint& composed,
                 const double* q, const double* u, std::vector<double>* coordinates,
                 std::vector<double>* speeds) {
  const ChainMotion motion = Move(series, composed, q, u);
  const JointKind<Spatial, double>& kind = KindOf<Spatial, double>(composed.type);
  Placement X_FM = composed.X_BJ.Inverse() * motion.X * composed.X_BJ;
  Vector3d w = composed.X_BJ.q.conjugate() * motion.w, v = composed.X_BJ.q.conjugate() * motion.v;
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
  speeds->resize(static_cast<std::size_t>(kind.num_u));
  Basis<Spatial, double> basis;
  if (kind.basis != nullptr) kind.basis(pose, basis, 0.0);
  for (int i = 0; i < kind.num_u; ++i) {
    double& speed = (*speeds)[i];
    if (kind.basis != nullptr) {
      const auto column = basis[i];
      speed = 0.0;
      for (int k = 0; k < 3; ++k) speed += column.angular[k] * w[k] + column.linear[k] * v[k];
    } else {
      const int axis = kind.axes[i];
      speed = axis < 3 ? w[axis] : v[axis - 3];
    }
  }
}

JointDescription& ImportDraft::AddComposed(const std::string& name, const ComposedJoint& composed,
                                           int parent, const Placement& X_PF, int child) {
  FrameOn F{parent, X_PF}, M{child, composed.X_BJ};
  if (composed.from_is_child) std::swap(F, M);
  JointDescription& joint = AddJoint(name, composed.type, F, M);
  if (composed.keeps_angle) joint.motions.push_back({0, Polynomial{{0.0}}});
  return joint;
}

}  // namespace loopbench::harness
