// Links without mass between two joints, as in URDF, SDF and bodies of MuJoCo with several joints.
//
// Joints in series through such links become one joint if a joint type has their motions and
// nothing acts on one of them alone. Each joint acts in axes moved by the previous ones. With
// X_i(q_i) the motion of joint i in drawn axes of the last body C, the pose of C in the first body
// P is X_PC X_1 .. X_n. The set of reachable poses determines the type of the joint.
//
// The remaining links get a mass, because the solvers divide by it. If possible, it is taken from
// the bodies beside a link without a change of the motion. For example, a point mass on the axis of
// a hinge moves equally with both bodies of the hinge.
#include <limits>

#include "harness/exchange/import_draft.h"
#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

/// Joints in series from body `parent` to body `child`, and the bodies without mass between them.
struct MasslessChain {
  int parent = kGround, child = kGround;
  std::vector<int> joints, between;
  // in the drawn axes of the child (Place()):
  std::vector<SerialJoint> series = {};
  std::vector<Placement> places = {};  ///< of the parent and the bodies between

  std::size_t size() const { return joints.size(); }
  /// Returns the joints [first, end).
  MasslessChain Part(std::size_t first, std::size_t end) const {
    const auto joint = joints.begin(), body = between.begin();
    const auto at = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
    return {.parent = first == 0 ? parent : between[first - 1],
            .child = end == size() ? child : between[end - 1],
            .joints = {joint + at(first), joint + at(end)},
            .between = {body + at(first), body + at(end) - 1}};
  }
};

namespace {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;

/// Tolerance for parallel, perpendicular and intersecting axes: rounding at nine digits.
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
    const Matrix3d across = Matrix3d::Identity() - hinge.axis * hinge.axis.transpose();
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
  Matrix3d axes;
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

namespace {

Placement PlacementOf(const JointSide& side) {
  const double angle = side.rotation.norm();
  if (angle == 0.0) return Placement(side.position);
  return {Quaterniond(Eigen::AngleAxisd(angle, side.rotation / angle)), side.position};
}

/// Returns the direction of a slide, or else of the axis of rotation, in the frames of a joint.
Vector3d DirectionOf(const JointDescription& joint) {
  if (joint.type == JointType::kPinInSlot) return AxisAlignment(joint) * Vector3d::UnitZ();
  if (!joint.axis.isZero(0.0)) return joint.axis.normalized();
  return TraitsOf(joint.type).own_axis == 'x' ? Vector3d::UnitX() : Vector3d::UnitZ();
}

/// Returns chains of bodies without mass that have two joints and carry nothing else.
std::vector<MasslessChain> FindChains(const MechanismDescription& d) {
  const BodyLoads loads(d);
  std::vector<bool> is_link(d.bodies.size(), false), seen = is_link;
  for (std::size_t i = 1; i < is_link.size(); ++i) {
    const auto carries_only_force = [&](int joint) {
      const JointType type = d.joints[joint].type;
      return type == JointType::kFree || type == JointType::kRod;
    };
    is_link[i] = !loads.has_load[i] && d.bodies[i].points.empty() && loads.joints[i].size() == 2 &&
                 std::ranges::none_of(loads.joints[i], carries_only_force);
  }
  const auto carries = [&](int body) { return body == kGround || d.bodies[body].mass > 0.0; };
  std::vector<MasslessChain> chains;
  for (int start = 0; start < std::ssize(is_link); ++start) {
    if (is_link[start]) continue;
    for (const int first : loads.joints[start]) {
      MasslessChain chain;
      chain.parent = start;
      chain.child = Beyond(d.joints[first], start);
      chain.joints = {first};
      while (is_link[chain.child] && !seen[chain.child]) {
        seen[chain.child] = true;  // each chain is found once
        chain.between.push_back(chain.child);
        const std::vector<int>& two = loads.joints[chain.child];
        chain.joints.push_back(two[0] == chain.joints.back() ? two[1] : two[0]);
        chain.child = Beyond(d.joints[chain.joints.back()], chain.child);
      }
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

/// Computes the joints and bodies of a chain in the drawn axes of its child.
void Place(const MechanismDescription& d, MasslessChain* chain) {
  chain->series.resize(chain->size());
  chain->places.resize(chain->size());
  Placement X_CB;  // of the outer body of the joint
  for (std::size_t k = chain->size(); k-- > 0;) {
    const JointDescription& joint = d.joints[chain->joints[k]];
    SerialJoint& placed = chain->series[k];
    placed.leads_out = joint.to.body == (k + 1 < chain->size() ? chain->between[k] : chain->child);
    const Placement X = X_CB * PlacementOf(placed.leads_out ? joint.to : joint.from);
    placed.type = joint.type;
    placed.position = X.p;
    placed.axis = (placed.leads_out ? 1.0 : -1.0) * (X.q * DirectionOf(joint));
    placed.q_CJ = X.q;
    X_CB = X * PlacementOf(placed.leads_out ? joint.from : joint.to).Inverse();
    chain->places[k] = X_CB;
  }
}

/// Returns joints whose motion is determined without mass: by a rotor, a coupling or a motion.
std::vector<bool> FindDetermined(const MechanismDescription& d) {
  std::vector<bool> determined = Mapped<bool>(d.joints, [](const JointDescription& joint) {
    return joint.rotor_inertia != 0.0 || !joint.motions.empty();
  });
  for (const CouplingDescription& coupling : d.couplings) {
    for (const auto& part : coupling.parts) determined[part.joint] = true;
  }
  return determined;
}

/// Returns the type of joint that all joints of a placed chain form, if there is one. Values that
/// are given for some of them belong to single joints.
std::optional<ComposedJoint> ComposeChain(const MasslessChain& chain,
                                          const std::vector<bool>& single,
                                          const InitialDescription& initial) {
  std::ptrdiff_t held = 0, moving = 0;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const int joint = chain.joints[k];
    if (single[joint]) return std::nullopt;
    held += std::ranges::count(initial.held, joint);
    moving += std::ranges::count(initial.speeds, joint, &JointValues::joint);
  }
  for (const std::ptrdiff_t count : {held, moving}) {
    if (count != 0 && count != std::ssize(chain.joints)) return std::nullopt;
  }
  return Compose(chain.series);
}

/// Start of the joints of a chain, as numbers of SerialJoint; 0 where the start has no value.
struct ChainStart {
  std::vector<double> q, u;
  bool has_q = false, has_u = false, is_held = false;
  double weight = 1.0;
};

/// Moves the start of the joints of a chain out of the start of a mechanism.
ChainStart TakeStart(const MasslessChain& chain, InitialDescription* initial) {
  ChainStart start;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const SerialJoint& joint = chain.series[k];
    const auto given =
        std::ranges::find(initial->coordinates, chain.joints[k], &JointValues::joint);
    const auto moving = std::ranges::find(initial->speeds, chain.joints[k], &JointValues::joint);
    std::vector<double> q(joint.num_q(), 0.0), u(joint.num_u(), 0.0);
    if (joint.type == JointType::kSpherical) q[0] = 1.0;
    if (moving != initial->speeds.end()) u = moving->values;
    if (given != initial->coordinates.end()) {
      q = given->values;
      start.weight = std::max(start.weight, given->weight);
    }
    if (joint.type == JointType::kSpherical) {
      // of M in F, to the outer body in drawn axes, with velocities in its moved axes
      Quaterniond turn(q[0], q[1], q[2], q[3]);
      Vector3d w(u[0], u[1], u[2]);
      w = joint.q_CJ * (joint.leads_out ? turn.conjugate() * w : Vector3d(-w));
      turn = joint.q_CJ * (joint.leads_out ? turn : turn.conjugate()) * joint.q_CJ.conjugate();
      q = {turn.w(), turn.x(), turn.y(), turn.z()};
      u = {w.x(), w.y(), w.z()};
    }
    start.q.insert(start.q.end(), q.begin(), q.end());
    start.u.insert(start.u.end(), u.begin(), u.end());
  }
  const auto is_of_chain = [&](int joint) { return std::ranges::count(chain.joints, joint) > 0; };
  const auto has_values = [&](const JointValues& one) { return is_of_chain(one.joint); };
  start.has_q = std::erase_if(initial->coordinates, has_values) > 0;
  start.has_u = std::erase_if(initial->speeds, has_values) > 0;
  start.is_held = std::erase_if(initial->held, is_of_chain) > 0;
  return start;
}

// Masses of the remaining links.

/// Returns a lump of mass or inertia that moves equally with both bodies of a joint of this type;
/// empty if there is none. `size`: its extent [m].
BodyDescription LumpAt(const JointDescription& joint, const Vector3d& at, const Vector3d& axis,
                       double mass, double size) {
  const Matrix3d all = mass * size * size * Matrix3d::Identity();
  const Matrix3d across = all - mass * size * size * axis * axis.transpose();
  switch (joint.type) {
    case JointType::kRevolute:  // two points on the axis
      return {"", mass, at, across, {}};
    case JointType::kUniversal:
    case JointType::kSpherical:
      return {"", mass, at, Matrix3d::Zero(), {}};
    case JointType::kPrismatic:
    case JointType::kTranslation:
      return {"", 0.0, Vector3d::Zero(), all, {}};
    case JointType::kPlanar:
    case JointType::kCylindrical:
    case JointType::kHelical:
    case JointType::kPinInSlot:
    case JointType::kSchoenflies:  // the bodies rotate relative to each other about the axis
      return {"", 0.0, Vector3d::Zero(), across, {}};
    default:
      return {};
  }
}

double RadiusOf(const BodyDescription& body) {
  return std::sqrt(SymmetricEigenvalues(body.inertia).cwiseAbs().maxCoeff() / body.mass);
}

/// Takes a small lump from a body, which keeps most of its smallest moment, and moments of which
/// none exceeds the sum of the others. Empty if there is none.
BodyDescription Take(const JointDescription& joint, const Vector3d& at, const Vector3d& axis,
                     BodyDescription* body) {
  const Vector3d moments = SymmetricEigenvalues(body->inertia);
  // small shares, so that many links can be beside one body
  for (double share = 1.0 / 64.0; share > 1e-5; share /= 4.0) {
    for (const double reach : {1.0, 0.25, 1.0 / 16.0}) {
      const auto lump = LumpAt(joint, at, axis, share * body->mass, reach * RadiusOf(*body));
      BodyDescription rest = *body;
      AddMass({"", -lump.mass, lump.com, -lump.inertia, {}}, Frame(), &rest);
      const Vector3d left = SymmetricEigenvalues(rest.inertia);
      constexpr double kMost = 1.0 + exchange::kMomentRoundOff;
      if (!(left[0] > 0.9 * moments[0] && left[2] <= kMost * (left[0] + left[1]))) continue;
      *body = rest;
      return lump;
    }
  }
  return {};
}

}  // namespace

/// Replaces the first joint of a chain by the joint that the chain forms; the others become welds.
void ImportDraft::ReplaceChain(const MasslessChain& chain, const ComposedJoint& composed) {
  std::vector<std::string> names;
  for (const int joint : chain.joints) {
    const std::string& name = description.joints[joint].name;
    if (!found_names_.contains(name)) names.push_back(name);
  }
  // without names in the file: the one that its last joint got from the body
  if (names.empty()) names.push_back(description.joints[chain.joints.back()].name);
  const std::string name =
      names.size() == 1 ? names[0] : joints_.Take(fmt::format("{}", fmt::join(names, "+")));
  InitialDescription& initial = description.initial;
  const ChainStart start = TakeStart(chain, &initial);
  const bool is_cut =
      std::ranges::any_of(chain.joints, [&](int part) { return description.joints[part].cut; });
  const int joint = chain.joints[0];
  std::vector<double> coordinates, speeds;
  SetComposed(chain.series, composed, start.q.data(), start.u.data(), &coordinates, &speeds);
  if (start.has_q || composed.type == JointType::kFree) {
    initial.coordinates.push_back({joint, coordinates, start.weight});
  }
  if (start.has_u) initial.speeds.push_back({joint, speeds});
  if (start.is_held) initial.held.push_back(joint);
  FrameOn F{chain.parent, chain.places[0].Inverse() * composed.X_BJ};
  FrameOn M{chain.child, composed.X_BJ};
  if (composed.from_is_child) std::swap(F, M);
  JointDescription& made = AddJoint(name, composed.type, F, M);
  made.cut = is_cut;
  if (composed.keeps_angle) made.motions.push_back({0, Polynomial{{0.0}}});
  std::swap(description.joints[joint], description.joints.back());
  description.joints.pop_back();
  for (std::size_t k = 1; k < chain.size(); ++k) {
    description.joints[chain.joints[k]].type = JointType::kWeld;
  }
  Note(elements_[chain.child],
       fmt::format("{} joints are one here: {}", chain.size(), ToString(composed.type)));
}

void ImportDraft::GiveMassToLinks(const MasslessChain& chain) {
  constexpr double kSmall = 1e-6;  // of the mass of the child, where nothing can be taken
  auto& bodies = description.bodies;
  const BodyDescription child = bodies[chain.child];
  for (std::size_t i = 0; i < chain.between.size(); ++i) {
    BodyDescription link = bodies[chain.between[i]];
    const Placement X_LC = chain.places[i + 1].Inverse();
    const auto add = [&](std::size_t k, int body, const Placement& X_CB) {
      const SerialJoint& at = chain.series[k];
      const JointDescription& joint = description.joints[chain.joints[k]];
      const Placement X_BC = X_CB.Inverse();
      const Vector3d position = X_BC.At(at.position), axis = X_BC.q * at.axis;
      // mass of the ground moves as little there
      const auto lump = body == kGround
                            ? LumpAt(joint, position, axis, child.mass / 8.0, RadiusOf(child))
                            : Take(joint, position, axis, &bodies[body]);
      AddMass(lump, (X_LC * X_CB).AsFrame(), &link);
    };
    if (i == 0) add(0, chain.parent, chain.places[0]);
    if (i + 1 == chain.between.size()) add(i + 1, chain.child, {});
    const Vector3d moments = SymmetricEigenvalues(link.inertia);
    const bool is_whole = link.mass > 0.0 && moments[0] > kSmall * moments[2];
    if (!is_whole) {
      const double mass = kSmall * child.mass, radius = RadiusOf(child);
      const Vector3d at = link.mass > 0.0 ? link.com : X_LC.At(chain.series[i + 1].position);
      const Matrix3d inertia = mass * radius * radius * Matrix3d::Identity();
      AddMass({"", mass, at, inertia, {}}, Frame(), &link);
    }
    bodies[chain.between[i]] = link;
    Note(elements_[chain.between[i]],
         is_whole ? "a link without mass between joints: it gets mass of the bodies beside it; the "
                    "motion is the same"
                  : fmt::format("a link without mass between joints: {:.2g} kg are added, {:g} of "
                                "the mass of \"{}\"",
                                kSmall * child.mass, kSmall, child.name),
         !is_whole);
  }
}

void ImportDraft::RejectRepeated(const MasslessChain& chain,
                                 const std::vector<bool>& determined) const {
  // the chain as a mechanism on the ground
  MechanismDescription d;
  d.name = "chain";
  d.space = SpaceKind::kSpatial;
  std::map<int, int> numbers = {{chain.parent, kGround}};
  int freedoms = 0;
  double length = 0.0;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const int child = k + 1 < chain.size() ? chain.between[k] : chain.child;
    numbers.emplace(child, static_cast<int>(d.bodies.size()));
    d.bodies.push_back({fmt::format("{}", k), 1.0, Vector3d::Zero(), Matrix3d::Identity(), {}});
    JointDescription joint = description.joints[chain.joints[k]];
    if (determined[chain.joints[k]]) joint.type = JointType::kWeld;
    for (JointSide* side : {&joint.from, &joint.to}) side->body = numbers.at(side->body);
    joint.motions.clear();
    joint.rotor_inertia = 0.0;
    joint.cut = false;
    freedoms += NumValues(joint.type, d.space, true);
    d.joints.push_back(joint);
    length = std::max(length, (chain.series[k].position - chain.series[0].position).norm());
  }
  const auto reject = [&] {
    elements_[chain.between[0]].Fail(
        fmt::format("a body without mass that moves, between {} joints ({}, ...) that repeat "
                    "motions of each other",
                    chain.size(), ToString(description.joints[chain.joints[0]].type)),
        "a mass > 0, or joints with independent motions");
  };
  if (freedoms > 6) reject();
  d.bodies.back().com = chain.series.back().position;  // where velocities are taken
  if (freedoms == 0 || !Validate(d).empty()) return;
  const Mechanism<Spatial, double> mechanism(d, Coordinates::kJoint);
  Kinematics<Spatial, double> kinematics(mechanism);
  VectorX<double> q(mechanism.num_q());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = std::sin(1.0 + static_cast<double>(i));
  mechanism.Normalise(q);  // a position without symmetry
  kinematics.UpdatePosition(q);
  const auto last = static_cast<std::size_t>(std::ssize(d.bodies) - 1);
  MatrixX<double> J(6, freedoms);
  for (int i = 0; i < freedoms; ++i) {
    kinematics.UpdateVelocity(VectorX<double>::Unit(freedoms, i));
    const Velocity<Spatial, double>& V = kinematics.motions()[last];
    J.col(i) << V.angular.eigen(), V.linear.eigen() / (length > 0.0 ? length : 1.0);
    J.col(i).normalize();
  }
  const VectorX<double> lambda = SymmetricEigenvalues(J.transpose() * J);
  // squares of singular values: round-off of sums of six products if they depend on each other
  if (lambda[0] <= 64.0 * std::numeric_limits<double>::epsilon() * lambda[freedoms - 1]) reject();
}

void ImportDraft::ComposeChains() {
  std::vector<Attachment> attachments(description.bodies.size());
  const std::vector<bool> determined = FindDetermined(description);
  std::vector<bool> single = determined;  // something acts on their coordinate
  for (ForceDescription force : description.forces) {
    const int* joint = PartsOf(force).joint;
    if (joint != nullptr) single[*joint] = true;
  }
  for (MasslessChain& chain : FindChains(description)) {
    Place(description, &chain);
    RejectRepeated(chain, determined);
    for (std::size_t first = 0, end = chain.size(); end > 0; end = first) {
      // the longest series that ends here; last joints first, because they move the body with mass
      constexpr std::size_t kMost = 6;  // joints that one joint has the motions of
      for (first = end > kMost ? end - kMost : 0; first + 1 < end; ++first) {
        MasslessChain part = chain.Part(first, end);
        Place(description, &part);
        const auto composed = ComposeChain(part, single, description.initial);
        if (!composed) continue;
        ReplaceChain(part, *composed);
        for (std::size_t k = 0; k < part.between.size(); ++k) {
          attachments[part.between[k]] = {part.child, part.places[k + 1].AsFrame(), 0.0, true};
        }
        break;
      }
    }
  }
  Attach(attachments);
  std::vector<MasslessChain> left = FindChains(description);
  std::set<int> links;
  for (const MasslessChain& chain : left) links.insert(chain.between.begin(), chain.between.end());
  exchange::UniqueNames names;
  for (int i = 0; i < std::ssize(description.bodies); ++i) {
    if (!links.contains(i)) names.Add(description.bodies[i].name);
  }
  for (const int link : links) {
    description.bodies[link].name = names.Take(description.bodies[link].name);
  }
  for (MasslessChain& chain : left) {
    Place(description, &chain);
    GiveMassToLinks(chain);
  }
}

}  // namespace loopbench::harness
