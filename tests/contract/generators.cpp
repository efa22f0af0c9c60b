#include "tests/contract/generators.h"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "mechanism/kinematics.h"

namespace loopbench::testing {

namespace {

/// A description under construction.
class Builder {
 public:
  Builder(const std::string& name, SpaceKind space, std::uint64_t seed)
      : random(seed), spatial(space == SpaceKind::kSpatial) {
    description.name = name + "-" + std::to_string(seed);
    description.space = space;
    description.gravity = random.Vector(10.0, spatial);
  }

  int AddBody(double size) {
    BodyDescription body;
    body.name = "b" + std::to_string(description.bodies.size());
    body.mass = std::exp(random.Uniform(-1.0, 1.0));
    body.com = random.Vector(0.5 * size, spatial);
    // radii of gyration near the paper's (1 m for bars of 1 m)
    const Eigen::Vector3d gyration(random.Uniform(0.5, 1.0), random.Uniform(0.5, 1.0),
                                   random.Uniform(0.5, 1.0));
    const Eigen::Matrix3d R = TurnMatrix(RandomTurn());
    const Eigen::Vector3d moments = body.mass * size * size * gyration.cwiseAbs2();
    body.inertia = R * moments.asDiagonal() * R.transpose();
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    description.bodies.push_back(body);
    parent_.push_back(0);
    dof_.push_back(0);
    return static_cast<int>(description.bodies.size()) - 1;
  }

  Eigen::Vector3d RandomTurn() {
    if (!spatial) return {0.0, 0.0, random.Uniform(-3.0, 3.0)};
    return random.Vector(1.5, true);
  }

  /// Tree joint from `parent` to `child`; `turned`: in any frames, the other way round at times.
  int AddJoint(JointType type, int parent, const Eigen::Vector3d& at_parent, int child,
               const Eigen::Vector3d& at_child, double q, bool turned = true) {
    const int index = static_cast<int>(description.joints.size());
    JointDescription joint;
    joint.name = "j" + std::to_string(index);
    joint.type = type;
    joint.from = {parent, at_parent, Eigen::Vector3d::Zero()};
    joint.to = {child, at_child, Eigen::Vector3d::Zero()};
    if (turned) joint.from.rotation = RandomTurn(), joint.to.rotation = RandomTurn();
    if (type == JointType::kPrismatic && random.Chance(0.5)) {
      joint.axis = random.Vector(1.0, spatial) + 1.5 * Eigen::Vector3d::UnitX();
    }
    if (type == JointType::kRevolute && spatial && random.Chance(0.5)) {
      joint.axis = random.Vector(1.0, spatial) + 1.5 * Eigen::Vector3d::UnitZ();
    }
    if (turned && random.Chance(0.3)) std::swap(joint.from, joint.to);
    description.joints.push_back(joint);
    parent_[child] = parent;
    dof_[child] = type == JointType::kWeld ? 0 : 1;
    if (type == JointType::kFree) dof_[child] = spatial ? 6 : 3;
    std::vector<double> values(dof_[child], q);
    if (type == JointType::kFree) {
      values.resize(spatial ? 7 : 3);
      for (double& value : values) value = random.Uniform(-1.0, 1.0);
    }
    if (!values.empty()) description.initial.coordinates.push_back({index, values});
    return index;
  }

  /// A joint between bodies that already have poses: F is put where M is, less the joint's q.
  void Close(JointType type, int from, int to, const Eigen::Vector3d& at_to, double q) {
    JointDescription joint;
    joint.name = "c" + std::to_string(description.joints.size());
    joint.type = type;
    joint.to = {to, at_to, RandomTurn()};
    // `from` carries its frame in the ground for now; FinishClosures() turns it into body axes
    joint.from = {from, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    joint.cut = random.Chance(0.5);  // the others are cut for having no initial value
    closures_.push_back({joint, q});
  }

  /// Free speeds of the tree path between two bodies.
  int PathFreedom(int a, int b) const {
    std::vector<int> up(parent_.size(), -1);
    int freedom = 0;
    for (int body = a, sum = 0; body >= 0; body = body == 0 ? -1 : parent_[body]) {
      up[body] = sum;
      sum += dof_[body];
    }
    for (int body = b; up[body] < 0; body = parent_[body]) freedom += dof_[body];
    int meet = b;
    while (up[meet] < 0) meet = parent_[meet];
    return freedom + up[meet];
  }

  void AddForces(int count) {
    const int joints = static_cast<int>(description.joints.size());
    for (int k = 0; k < count; ++k) {
      const int joint = random.Below(joints);
      const JointType type = description.joints[joint].type;
      const bool single = type == JointType::kRevolute || type == JointType::kPrismatic;
      const int kind = single ? random.Below(4) : 3;
      if (kind == 0) description.forces.push_back(JointTorque{joint, random.Uniform(-5.0, 5.0)});
      if (kind == 1) {
        description.forces.push_back(
            JointSpring{joint, random.Uniform(1.0, 10.0), random.Uniform(-1.0, 1.0)});
      }
      if (kind == 2) description.forces.push_back(JointDamper{joint, random.Uniform(0.1, 1.0)});
      if (kind == 3) {
        const int body = 1 + random.Below(static_cast<int>(description.bodies.size()) - 1);
        description.forces.push_back(PointForce{body, random.Vector(1.0, spatial),
                                                random.Vector(10.0, spatial), random.Chance(0.5)});
      }
    }
  }

  /// Forces on the tree joints, then the loops.
  MechanismDescription Finish() {
    AddForces(1 + static_cast<int>(description.joints.size()) / 3);
    FinishClosures();
    return description;
  }

  Random random;
  bool spatial;
  MechanismDescription description;

 private:
  static Eigen::Matrix3d TurnMatrix(const Eigen::Vector3d& turn) {
    return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }

  std::vector<JetPose> Poses() const;
  void FinishClosures();

  std::vector<int> parent_ = {0}, dof_ = {0};
  std::vector<std::pair<JointDescription, double>> closures_;
};

/// The description's own coordinates; joints without one are at rest in the ground's frame.
template <class Space>
VectorX<double> DescribedCoordinates(const MechanismDescription& description,
                                     const Mechanism<Space, double>& mechanism) {
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  for (const Joint<Space, double>& joint : mechanism.joints()) {
    if (joint.in_tree() && joint.kind->num_q == 7) q[joint.q_offset] = 1.0;
  }
  for (const JointValues& values : description.initial.coordinates) {
    const int offset = mechanism.joints()[values.joint].q_offset;
    for (std::size_t i = 0; i < values.values.size(); ++i) q[offset + i] = values.values[i];
  }
  return q;
}

template <class Space>
std::vector<JetPose> DescribedPoses(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  return Oracle(description, LayoutOf(mechanism))
      .Poses(ToReal(DescribedCoordinates(description, mechanism)));
}

std::vector<JetPose> Builder::Poses() const {
  return spatial ? DescribedPoses<Spatial>(description) : DescribedPoses<Planar>(description);
}

void Builder::FinishClosures() {
  if (closures_.empty()) return;
  const std::vector<JetPose> poses = Poses();
  Layout layout;
  layout.spatial = spatial;
  MechanismDescription frames = description;  // to let the oracle place M
  for (auto& [joint, q] : closures_) {
    frames.joints = {joint};
    const Jet coordinate(q);
    // with F at the body's com, JointPose() is M seen from there
    frames.joints[0].from.position = frames.bodies[joint.from.body].com;
    const JetPose X_PM = Oracle(frames, layout).JointPose(0, poses);
    const JetPose X_PF = X_PM * Inverted(Transform(joint.type, spatial, &coordinate));
    Real33 R;
    for (int i = 0; i < 3; ++i) {
      joint.from.position[i] =
          static_cast<double>(X_PF.p[i].f + Real(frames.bodies[joint.from.body].com[i]));
      for (int j = 0; j < 3; ++j) R(i, j) = X_PF.R(i, j).f;
    }
    const Eigen::AngleAxis<Real> turn(R);
    joint.from.rotation = (turn.angle() * turn.axis()).cast<double>();
    description.joints.push_back(joint);
  }
}

MechanismDescription DrawGraph(int n, int loops, SpaceKind space, std::uint64_t seed,
                               double free_joints, int least_freedom) {
  Builder b("graph-" + std::to_string(n) + "-" + std::to_string(loops), space, seed);
  for (int i = 1; i <= n; ++i) {
    const int parent = b.random.Chance(0.85) ? i - 1 : b.random.Below(i);  // long branches
    const double draw = b.random.Uniform(0.0, 1.0);
    const JointType type = draw < free_joints ? JointType::kFree
                           : draw < 0.75      ? JointType::kRevolute
                           : draw < 0.95      ? JointType::kPrismatic
                                              : JointType::kWeld;
    const Eigen::Vector3d at_parent = b.random.Vector(0.7, b.spatial);
    const int body = b.AddBody(1.0);
    b.AddJoint(type, parent, at_parent, body, b.random.Vector(0.7, b.spatial),
               b.random.Uniform(-2.0, 2.0));
  }
  for (int tries = 0, closed = 0; tries < 1000 && closed < loops; ++tries) {
    const int to = 1 + b.random.Below(n), from = b.random.Below(n + 1);
    if (from == to || b.PathFreedom(from, to) < least_freedom) continue;
    const JointType type = b.random.Chance(0.7) ? JointType::kRevolute : JointType::kPrismatic;
    b.Close(type, from, to, b.random.Vector(0.7, b.spatial), b.random.Uniform(-1.0, 1.0));
    ++closed;
  }
  return b.Finish();
}

template <class Space>
bool LoopsAreIndependent(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  Oracle oracle(description, LayoutOf(mechanism));
  return oracle
      .Solve(ToReal(DescribedCoordinates(description, mechanism)),
             RealVector::Zero(mechanism.num_u()))
      .full_rank();
}

}  // namespace

MechanismDescription RandomChain(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("chain-" + std::to_string(n), space, seed);
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (int i = 1; i <= n; ++i) {
    const double length = b.random.Uniform(0.6, 1.4);
    const int body = b.AddBody(length);
    b.AddJoint(JointType::kRevolute, i - 1, at, body, b.random.Vector(0.2, b.spatial),
               b.random.Uniform(-2.5, 2.5));
    at = b.random.Vector(0.2, b.spatial) + length * Eigen::Vector3d::UnitX();
  }
  b.Close(JointType::kRevolute, 0, n, at, b.random.Uniform(-2.0, 2.0));
  return b.Finish();
}

MechanismDescription SphericalChain(int n, std::uint64_t seed) {
  Builder b("spherical-" + std::to_string(n), SpaceKind::kSpatial, seed);
  const Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (int i = 1; i <= n; ++i) {
    b.AddJoint(JointType::kRevolute, i - 1, center, b.AddBody(1.0), center,
               b.random.Uniform(-2.5, 2.5));
  }
  b.Close(JointType::kRevolute, 0, n, center, 0.0);
  return b.Finish();
}

MechanismDescription RandomTree(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("tree-" + std::to_string(n), space, seed);
  for (int i = 1; i < n; ++i) {
    const double draw = b.random.Uniform(0.0, 1.0);
    const JointType type = draw < 0.65   ? JointType::kRevolute
                           : draw < 0.85 ? JointType::kPrismatic
                           : draw < 0.95 ? JointType::kWeld
                                         : JointType::kFree;
    const int parent = b.random.Below(i);
    const Eigen::Vector3d at_parent = b.random.Vector(1.0, b.spatial);
    const int body = b.AddBody(1.0);
    b.AddJoint(type, parent, at_parent, body, b.random.Vector(1.0, b.spatial),
               b.random.Uniform(-2.0, 2.0));
  }
  b.AddBody(1.0);
  return b.Finish();
}

MechanismDescription RandomGraph(int n, int loops, SpaceKind space, double free_joints,
                                 std::uint64_t seed) {
  const bool spatial = space == SpaceKind::kSpatial;
  for (std::uint64_t draw = 0; draw < 100; ++draw) {
    MechanismDescription graph =
        DrawGraph(n, loops, space, seed + 1000 * draw, free_joints, spatial ? 12 : 7);
    if (static_cast<int>(graph.joints.size()) < n + loops) continue;
    if (spatial ? LoopsAreIndependent<Spatial>(graph) : LoopsAreIndependent<Planar>(graph)) {
      return graph;
    }
  }
  throw std::logic_error("no room for so many independent loops");
}

MechanismDescription RedundantGraph(int n, int loops, SpaceKind space, std::uint64_t seed) {
  return DrawGraph(n, loops, space, seed, 0.0, space == SpaceKind::kSpatial ? 4 : 2);
}

MechanismDescription RandomLadder(int n, SpaceKind space, bool free_joints, std::uint64_t seed) {
  Builder b("ladder-" + std::to_string(n), space, seed);
  // In the plane one crank drives all others: only near the parallelogram does motion not grow from
  // window to window. In space a coupler has six links.
  const double slope = b.random.Uniform(-2.0, -1.0);
  const auto angle = [&](double near, double by) { return near + b.random.Uniform(-by, by); };
  const auto tip = [&] { return Eigen::Vector3d(b.random.Uniform(0.97, 1.03), 0.0, 0.0); };
  int crank = 0;
  for (int i = 0; i <= n; ++i) {
    int end = crank;
    for (int k = 0; i > 0 && k < (b.spatial ? 6 : 1); ++k) {
      const int link = b.AddBody(1.0);
      const double q = b.spatial ? angle(0.0, 2.0) : angle(-slope, 0.03);
      const JointType type = free_joints && k % 3 < 2  ? JointType::kFree
                             : b.spatial && k == 2       ? JointType::kPrismatic
                                                       : JointType::kRevolute;
      b.AddJoint(type, end, tip(), link, b.random.Vector(0.02, b.spatial), q, b.spatial);
      end = link;
    }
    crank = b.AddBody(1.0);
    b.AddJoint(JointType::kRevolute, 0, Eigen::Vector3d(i, 0.0, 0.0), crank,
               b.random.Vector(0.02, b.spatial), angle(slope, b.spatial ? 2.0 : 0.03), b.spatial);
    if (i > 0) b.Close(JointType::kRevolute, crank, end, tip(), 0.0);
  }
  return b.Finish();
}

template <class Space>
State WithRandomSpeeds(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                       std::uint64_t seed) {
  Random random(seed + 17);
  RealVector u(mechanism.num_u());
  for (int i = 0; i < mechanism.num_u(); ++i) u[i] = random.Uniform(-1.0, 1.0);
  u = Oracle(description, LayoutOf(mechanism)).Consistent(ToReal(q), u);
  return {q, u.cast<double>()};
}

template <class Space>
State ConsistentState(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, std::uint64_t seed) {
  return WithRandomSpeeds(description, mechanism, DescribedCoordinates(description, mechanism),
                          seed);
}

template <class Space>
State StateIn(const Mechanism<Space, double>& other, const Mechanism<Space, double>& mechanism,
              const State& state) {
  Kinematics<Space, double> from(mechanism), to(other);
  from.UpdatePosition(state.q);
  from.UpdateVelocity(state.u);
  State result;
  result.q = from.CoordinatesIn(other);
  to.UpdatePosition(result.q);
  result.u = from.SpeedsIn(to);
  return result;
}

#define LOOPBENCH_INSTANTIATE(Space)                                                          \
  template State ConsistentState(const MechanismDescription&, const Mechanism<Space, double>&, \
                                 std::uint64_t);                                              \
  template State WithRandomSpeeds(const MechanismDescription&, const Mechanism<Space, double>&, \
                                  const VectorX<double>&, std::uint64_t);                     \
  template State StateIn(const Mechanism<Space, double>&, const Mechanism<Space, double>&,     \
                         const State&);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::testing
