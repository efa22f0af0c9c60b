#include "tests/contract/generators.h"

#include <stdexcept>

#include "mechanism/kinematics.h"
#include "tests/contract/builder.h"

namespace loopbench::testing {

namespace {

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
      const JointType type = free_joints && k % 3 < 2 ? JointType::kFree
                             : b.spatial && k == 2    ? JointType::kPrismatic
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

#define LOOPBENCH_INSTANTIATE(Space)                                                            \
  template State ConsistentState(const MechanismDescription&, const Mechanism<Space, double>&,  \
                                 std::uint64_t);                                                \
  template State WithRandomSpeeds(const MechanismDescription&, const Mechanism<Space, double>&, \
                                  const VectorX<double>&, std::uint64_t);                       \
  template State StateIn(const Mechanism<Space, double>&, const Mechanism<Space, double>&,      \
                         const State&);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::testing
