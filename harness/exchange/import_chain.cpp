// Joints in series without mass between them, and the one joint that they form.
//
// Each joint of a series acts in axes moved by the previous ones. With X_i(q_i) the motion of joint
// i in drawn axes of the last body C, the pose of C in the first body P is X_PC X_1 .. X_n. The set
// of reachable poses determines the type of the joint.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

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
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return Eigen::Quaterniond(R);
}

bool Independent(const std::vector<SerialJoint>& joints) {
  Eigen::Matrix3d axes;
  axes << joints[0].axis, joints[1].axis, joints[2].axis;
  return std::abs(axes.determinant()) > kAligned;
}

/// Returns the joint that several joints form; `all`: in their order, by kind.
std::optional<ComposedJoint> JointOf(const std::vector<SerialJoint>& joints,
                                     const std::map<SerialKind, std::vector<SerialJoint>>& all) {
  const auto of = [&](SerialKind kind) {
    const auto found = all.find(kind);
    return found == all.end() ? std::vector<SerialJoint>() : found->second;
  };
  const std::vector<SerialJoint> hinges = of(SerialKind::kHinge), slides = of(SerialKind::kSlide),
                                 balls = of(SerialKind::kBall);
  if (joints.size() == 2 && hinges.size() == 2) {
    const Vector3d &a = hinges[0].axis, &b = hinges[1].axis;
    const auto point = Perpendicular(a, b) ? MeetingPoint(hinges) : std::nullopt;
    // about x of F, then about y of M
    if (point) return ComposedJoint{JointType::kUniversal, {Axes(a, a.cross(b)), *point}};
  }
  if (joints.size() == 2 && slides.size() == 2) {
    const Vector3d &a = slides[0].axis, &b = slides[1].axis;
    if (Parallel(a, b)) return std::nullopt;
    return ComposedJoint{.type = JointType::kPlanar,
                         .X_BJ = {Axes(a, a.cross(b)), Vector3d::Zero()},
                         .keeps_angle = true};
  }
  if (joints.size() == 2 && hinges.size() == 1 && slides.size() == 1) {
    const Vector3d &turn = hinges[0].axis, &slide = slides[0].axis, &at = hinges[0].position;
    if (Parallel(turn, slide)) return ComposedJoint{JointType::kCylindrical, {TurnOfZ(turn), at}};
    // the slot is on the parent when the slide comes first, else on the child
    const bool from_is_child = joints[0].kind == SerialKind::kHinge;
    if (Perpendicular(turn, slide)) {
      return ComposedJoint{JointType::kPinInSlot, {Axes(slide, turn), at}, from_is_child};
    }
  }
  if (slides.size() == 2 && hinges.size() == 1) {
    const Vector3d &z = hinges[0].axis, &a = slides[0].axis, &b = slides[1].axis;
    if (Perpendicular(z, a) && Perpendicular(z, b) && !Parallel(a, b)) {
      return ComposedJoint{JointType::kPlanar, {Axes(a, z), hinges[0].position}};
    }
  }
  const bool spans = slides.size() == 3 && Independent(slides);
  if (spans && joints.size() == 3) {
    const Vector3d &a = slides[0].axis, &b = slides[1].axis;
    return ComposedJoint{JointType::kTranslation, {Axes(a, a.cross(b)), Vector3d::Zero()}};
  }
  if (spans && joints.size() == 4 && hinges.size() == 1) {
    return ComposedJoint{JointType::kSchoenflies, {TurnOfZ(hinges[0].axis), hinges[0].position}};
  }
  std::optional<Vector3d> centre;
  if (balls.size() == 1 && hinges.empty()) centre = balls[0].position;
  if (balls.empty() && hinges.size() == 3 && Independent(hinges)) centre = MeetingPoint(hinges);
  if (centre && slides.empty()) return ComposedJoint{JointType::kSpherical, Placement(*centre)};
  if (centre && spans) return ComposedJoint{JointType::kFree, Placement(*centre)};
  // the line or plane is on the parent when the slides come first, on the child when they come last
  const bool from_is_child = joints.front().kind != SerialKind::kSlide;
  const bool is_mixed = !std::ranges::is_partitioned(joints, [&](const SerialJoint& joint) {
    return (joint.kind == SerialKind::kSlide) != from_is_child;
  });
  if (!centre || is_mixed) return std::nullopt;
  const Vector3d& x = slides[0].axis;
  if (slides.size() == 1) {
    const Vector3d other = std::abs(x.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    return ComposedJoint{JointType::kPointOnLine, {Axes(x, other), *centre}, from_is_child};
  }
  if (slides.size() == 2 && !Parallel(x, slides[1].axis)) {
    const Vector3d z = x.cross(slides[1].axis);
    return ComposedJoint{JointType::kPointInPlane, {Axes(x, z), *centre}, from_is_child};
  }
  return std::nullopt;
}

}  // namespace

std::optional<ComposedJoint> Compose(const std::vector<SerialJoint>& joints) {
  if (joints.size() == 1) {
    constexpr JointType kTypes[] = {JointType::kRevolute, JointType::kPrismatic,
                                    JointType::kSpherical, JointType::kFree};
    return ComposedJoint{kTypes[static_cast<int>(joints[0].kind)], Placement(joints[0].position)};
  }
  std::map<SerialKind, std::vector<SerialJoint>> all;
  for (const SerialJoint& joint : joints) all[joint.kind].push_back(joint);
  return all.contains(SerialKind::kFree) ? std::nullopt : JointOf(joints, all);
}

std::string WordsOf(const std::vector<SerialJoint>& joints) {
  constexpr const char* kWords[] = {"hinge", "slide", "ball", "free"};
  std::vector<std::string> words;
  for (const SerialJoint& joint : joints) words.emplace_back(kWords[static_cast<int>(joint.kind)]);
  return fmt::format("{}", fmt::join(words, ", "));
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

// Conversion of coordinates and speeds.

namespace {

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
  JointDescription& joint = composed.from_is_child
                                ? AddJoint(name, composed.type, child, composed.X_BJ, parent, X_PF)
                                : AddJoint(name, composed.type, parent, X_PF, child, composed.X_BJ);
  if (composed.keeps_angle) joint.motions.push_back({0, Polynomial{{0.0}}});
  return joint;
}

// Chains of links without mass in URDF and SDF.

/// Joints in series from body `parent` to body `child`, and the bodies without mass between them.
struct MasslessChain {
  int parent = kGround, child = kGround;
  std::vector<int> joints, between;
  // in the drawn axes of the child:
  std::vector<SerialJoint> series;
  std::vector<Placement> places;  ///< of the parent and the bodies between
};

namespace {

Placement PlacementOf(const JointSide& side) {
  const double angle = side.rotation.norm();
  if (angle == 0.0) return Placement(side.position);
  return {Quaterniond(Eigen::AngleAxisd(angle, side.rotation / angle)), side.position};
}

/// Returns the direction of the axis of a joint in its frames.
Vector3d DirectionOf(const JointDescription& joint) {
  if (!joint.axis.isZero(0.0)) return joint.axis.normalized();
  return TraitsOf(joint.type).own_axis == 'x' ? Vector3d::UnitX() : Vector3d::UnitZ();
}

/// Returns chains of bodies without mass that have two joints and carry nothing else.
std::vector<MasslessChain> FindChains(const MechanismDescription& d) {
  std::vector<std::vector<int>> joints_of(d.bodies.size());
  for (int j = 0; j < std::ssize(d.joints); ++j) {
    for (const int body : {d.joints[j].from.body, d.joints[j].to.body}) {
      joints_of[body].push_back(j);
    }
  }
  std::vector<bool> is_link(d.bodies.size(), false), seen = is_link;
  for (std::size_t i = 1; i < is_link.size(); ++i) {
    const BodyDescription& body = d.bodies[i];
    is_link[i] = body.mass == 0.0 && body.inertia.isZero(0.0) && body.points.empty() &&
                 joints_of[i].size() == 2;
  }
  for (ForceDescription force : d.forces) {
    for (const BodyPoint* point : PartsOf(force).points) is_link[point->body] = false;
  }
  const auto beyond = [&](int joint, int body) {
    const JointDescription& one = d.joints[joint];
    return one.from.body == body ? one.to.body : one.from.body;
  };
  std::vector<MasslessChain> chains;
  for (int start = 0; start < std::ssize(is_link); ++start) {
    if (is_link[start]) continue;
    for (const int first : joints_of[start]) {
      MasslessChain chain;
      chain.parent = start;
      chain.child = beyond(first, start);
      chain.joints = {first};
      while (is_link[chain.child] && !seen[chain.child]) {
        seen[chain.child] = true;  // each chain is found once
        chain.between.push_back(chain.child);
        const std::vector<int>& two = joints_of[chain.child];
        chain.joints.push_back(two[0] == chain.joints.back() ? two[1] : two[0]);
        chain.child = beyond(chain.joints.back(), chain.child);
      }
      const auto carries = [&](int body) { return body == kGround || d.bodies[body].mass > 0.0; };
      if (chain.between.empty() || chain.parent == chain.child) continue;
      if (!carries(chain.parent) || !carries(chain.child)) continue;
      const bool leads_back = start != kGround && d.joints[first].to.body == start;
      if (leads_back || chain.child == kGround) {
        std::swap(chain.parent, chain.child);
        std::ranges::reverse(chain.joints);
        std::ranges::reverse(chain.between);
      }
      chains.push_back(std::move(chain));
    }
  }
  return chains;
}

/// Computes the poses of a chain. Returns the joint that it forms, if there is one.
std::optional<ComposedJoint> ComposeChain(const MechanismDescription& d, MasslessChain* chain) {
  const std::size_t count = chain->joints.size();
  chain->series.resize(count);
  chain->places.resize(count);
  bool is_series = true;
  Placement X_CB;  // of the outer body of the joint
  for (std::size_t k = count; k-- > 0;) {
    const JointDescription& joint = d.joints[chain->joints[k]];
    const bool leads_out = joint.to.body == (k + 1 < count ? chain->between[k] : chain->child);
    const bool turns = joint.type == JointType::kRevolute;
    is_series = is_series && (turns || joint.type == JointType::kPrismatic);
    const Placement X = X_CB * PlacementOf(leads_out ? joint.to : joint.from);
    chain->series[k].kind = turns ? SerialKind::kHinge : SerialKind::kSlide;
    chain->series[k].position = X.p;
    chain->series[k].axis = (leads_out ? 1.0 : -1.0) * (X.q * DirectionOf(joint));
    X_CB = X * PlacementOf(leads_out ? joint.from : joint.to).Inverse();
    chain->places[k] = X_CB;
  }
  return is_series ? Compose(chain->series) : std::nullopt;
}

/// Moves the values of the joints of a chain out of a list; 0 for joints without one.
std::vector<double> TakeValues(const MasslessChain& chain, std::vector<JointValues>* list,
                               std::size_t* count) {
  std::vector<double> values(chain.joints.size(), 0.0);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto found = std::ranges::find(*list, chain.joints[k], &JointValues::joint);
    if (found == list->end()) continue;
    values[k] = found->values[0];
    list->erase(found);
    ++*count;
  }
  return values;
}

}  // namespace

/// Replaces the first joint of a chain by the joint that the chain forms; the others become welds.
void ImportDraft::ReplaceChain(const MasslessChain& chain, const ComposedJoint& composed) {
  const XmlElement& element = elements_[chain.child];
  std::vector<std::string> names;
  for (const int joint : chain.joints) names.push_back(description.joints[joint].name);
  const std::string all = fmt::format("{}", fmt::join(names, "+"));
  const auto is_in_chain = [&](int joint) { return std::ranges::count(chain.joints, joint) > 0; };
  std::erase_if(description.forces, [&](ForceDescription& force) {
    const ForceParts parts = PartsOf(force);
    if (parts.joint == nullptr || !is_in_chain(*parts.joint)) return false;
    Note(element,
         fmt::format("{} of joint \"{}\" dropped: {}", parts.name,
                     description.joints[*parts.joint].name, kNeedsOneCoordinate),
         true);
    return true;
  });
  std::erase_if(description.couplings, [&](const CouplingDescription& coupling) {
    const auto is_part = [&](const auto& part) { return is_in_chain(part.joint); };
    if (std::ranges::none_of(coupling.parts, is_part)) return false;
    Note(element, fmt::format("coupling \"{}\" {}", coupling.name, kNotCoupled), true);
    return true;
  });
  for (const int joint : chain.joints) {
    if (description.joints[joint].rotor_inertia == 0.0) continue;
    Note(
        element,
        fmt::format("rotor of joint \"{}\" dropped: {}", description.joints[joint].name, kNoRotors),
        true);
    description.joints[joint].rotor_inertia = 0.0;
  }
  InitialDescription& initial = description.initial;
  std::size_t coordinates_given = 0, speeds_given = 0;
  const std::vector<double> q = TakeValues(chain, &initial.coordinates, &coordinates_given),
                            u = TakeValues(chain, &initial.speeds, &speeds_given);
  const std::size_t num_held = std::erase_if(initial.held, is_in_chain);
  for (const auto& [what, given] : {std::pair{"speeds", speeds_given}, {"fixed", num_held}}) {
    if (given == 0 || given == chain.joints.size()) continue;
    element.Fail(fmt::format("\"{}\" of {} of the joints {}, which are one here", what, given, all),
                 "all of them or none");
  }
  const int joint = chain.joints[0];
  std::vector<double> coordinates, speeds;
  SetComposed(chain.series, composed, q.data(), u.data(), &coordinates, &speeds);
  if (coordinates_given > 0 || composed.type == JointType::kFree) {
    initial.coordinates.push_back({joint, coordinates});
  }
  if (speeds_given > 0) initial.speeds.push_back({joint, speeds});
  if (num_held > 0) initial.held.push_back(joint);
  const Placement X_PC = chain.places[0].Inverse();
  AddComposed(all, composed, chain.parent, X_PC * composed.X_BJ, chain.child);
  std::swap(description.joints[joint], description.joints.back());
  description.joints.pop_back();
  for (std::size_t k = 1; k < chain.joints.size(); ++k) {
    description.joints[chain.joints[k]].type = JointType::kWeld;
  }
  Note(element, fmt::format("{} joints through links without mass are one here: {}",
                            chain.joints.size(), ToString(composed.type)));
}

// A link without mass between two hinges that form no joint. A point mass on the axis of a hinge
// has the same motion on both of its bodies. Point masses on both axes, taken from the bodies
// beside the link, therefore give it a mass and an inertia without a change of the motion. Mass on
// the axis of a hinge of the ground does not move at all.

namespace {

/// Adds point masses in the axes of a body; negative ones are taken away.
BodyDescription WithPoints(const BodyDescription& body, double mass,
                           const std::vector<Vector3d>& points) {
  const auto spread = [](const Vector3d& r) -> Eigen::Matrix3d {
    return r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
  };
  BodyDescription sum = body;
  sum.mass += mass * static_cast<double>(points.size());
  sum.com *= body.mass;
  for (const Vector3d& point : points) sum.com += mass * point;
  sum.com /= sum.mass;
  sum.inertia += body.mass * spread(body.com - sum.com);
  for (const Vector3d& point : points) sum.inertia += mass * spread(point - sum.com);
  return sum;
}

/// Takes point masses from both sides of a point on an axis, in the axes of the body: as much as
/// leaves at least half of the smallest moment. Returns the mass of each, 0 if nothing can go.
double TakePoints(const Vector3d& at, const Vector3d& axis, BodyDescription* body,
                  std::vector<Vector3d>* points) {
  const Eigen::Vector3d moments = SymmetricEigenvalues(body->inertia);
  const double radius = std::sqrt(moments[2] / body->mass);
  for (double share = 1.0 / 4.0; share > 1e-4; share /= 2.0) {
    for (const double reach : {1.0, 0.25, 1.0 / 16.0}) {
      *points = {at - reach * radius * axis, at + reach * radius * axis};
      const double mass = share * body->mass / 2.0;
      const BodyDescription rest = WithPoints(*body, -mass, *points);
      const Eigen::Vector3d left = SymmetricEigenvalues(rest.inertia);
      // mechanism files accept moments that are rounded by a hundredth
      if (left[0] < 0.5 * moments[0] || left[2] > 1.005 * (left[0] + left[1])) continue;
      *body = rest;
      return mass;
    }
  }
  return 0.0;
}

}  // namespace

bool ImportDraft::GiveMassToLink(const MasslessChain& chain) {
  if (chain.series.size() != 2 ||
      std::ranges::count(chain.series, SerialKind::kHinge, &SerialJoint::kind) != 2) {
    return false;
  }
  const SerialJoint &inner = chain.series[0], &outer = chain.series[1];
  auto& bodies = description.bodies;
  BodyDescription parent = bodies[chain.parent], child = bodies[chain.child];
  std::vector<Vector3d> on_inner, on_outer;
  const double outer_mass = TakePoints(outer.position, outer.axis, &child, &on_outer);
  double inner_mass = outer_mass;
  if (outer_mass > 0.0 && chain.parent == kGround) {
    const Vector3d reach = 0.5 * (on_outer[1] - on_outer[0]).norm() * inner.axis;
    on_inner = {inner.position - reach, inner.position + reach};
  } else {
    const Placement X_PC = chain.places[0].Inverse();
    inner_mass = TakePoints(X_PC.At(inner.position), X_PC.q * inner.axis, &parent, &on_inner);
    for (Vector3d& point : on_inner) point = chain.places[0].At(point);
  }
  const Placement X_IC = chain.places[1].Inverse();
  for (auto* points : {&on_inner, &on_outer}) {
    for (Vector3d& point : *points) point = X_IC.At(point);
  }
  BodyDescription& link = bodies[chain.between[0]];
  const BodyDescription filled =
      WithPoints(WithPoints(link, inner_mass, on_inner), outer_mass, on_outer);
  const Vector3d moments = SymmetricEigenvalues(filled.inertia);
  // points on one axis alone turn about it without inertia
  if (!(inner_mass > 0.0 && outer_mass > 0.0 && moments[0] > 1e-6 * moments[2])) return false;
  link = filled;
  bodies[chain.parent] = parent;
  bodies[chain.child] = child;
  Note(
      elements_[chain.between[0]],
      fmt::format("\"{}\" has no mass, between hinges that are no joint together: {:.4g} kg of the "
                  "bodies beside it are moved there, on both axes; the motion is the same",
                  link.name, link.mass));
  return true;
}

void ImportDraft::ComposeChains() {
  std::vector<Attachment> attachments(description.bodies.size());
  std::vector<MasslessChain> chains = FindChains(description);
  for (MasslessChain& chain : chains) {
    const auto composed = ComposeChain(description, &chain);
    if (!composed && GiveMassToLink(chain)) continue;
    if (!composed) {
      std::vector<std::string_view> types;
      for (const int j : chain.joints) types.push_back(ToString(description.joints[j].type));
      elements_[chain.between[0]].Fail(
          fmt::format("a body without mass that moves, between joints ({}) that are no joint "
                      "together",
                      fmt::join(types, ", ")),
          fmt::format("a mass > 0, or {}", kAxesOfOneJoint));
    }
    ReplaceChain(chain, *composed);
    for (std::size_t k = 0; k < chain.between.size(); ++k) {
      attachments[chain.between[k]] = {
          .carrier = chain.child, .X = chain.places[k + 1].AsFrame(), .attached = true};
    }
  }
  if (!chains.empty()) Attach(attachments);
}

}  // namespace loopbench::harness
