#include "tests/contract/generators.h"

#include <stdexcept>

#include "mechanism/model/kinematics.h"
#include "tests/contract/builder.h"

namespace loopbench::testing {

namespace {

/// A bar that hangs from the tip of a body.
int Append(Builder& b, JointType type, int parent) {
  const int body = b.AddBody(1.0);
  const Eigen::Vector3d at = b.Tip();
  b.AddJoint(type, parent, at, body, b.random.Vector(0.2, b.spatial), b.random.Uniform(-2.0, 2.0));
  return body;
}

/// A body on a joint within `size` of both centres.
void HangAnywhere(Builder& b, JointType type, int parent, double size) {
  const Eigen::Vector3d at_parent = b.random.Vector(size, b.spatial);
  const int body = b.AddBody(1.0);
  b.AddJoint(type, parent, at_parent, body, b.random.Vector(size, b.spatial),
             b.random.Uniform(-2.0, 2.0));
}

/// A branch of n bars from a body; the last bar.
int Grow(Builder& b, int root, int n) {
  for (int i = 0; i < n; ++i) {
    const int body = b.AddBody(1.0);
    const JointType type = b.random.Chance(0.8) ? JointType::kRevolute : JointType::kPrismatic;
    const Eigen::Vector3d at = b.Tip();
    b.AddJoint(type, root, at, body, b.random.Vector(0.2, b.spatial), b.random.Uniform(-2.0, 2.0));
    root = body;
  }
  return root;
}

/// A joint of any of these kinds that the space has.
JointType AnyJoint(Builder& b, DrawnKinds kinds) {
  for (;;) {
    const JointType type = DrawKind(b.random, kinds);
    if (b.spatial || TraitsOf(type).in_plane) return type;
  }
}

MechanismDescription DrawGraph(int n, int loops, SpaceKind space, std::uint64_t seed,
                               int least_freedom) {
  Builder b("graph-" + std::to_string(n) + "-" + std::to_string(loops), space, seed);
  for (int i = 1; i <= n; ++i) {
    const int parent = b.random.Chance(0.85) ? i - 1 : b.random.Below(i);  // long branches
    const double draw = b.random.Uniform(0.0, 1.0);
    const JointType type = draw < 0.65   ? JointType::kRevolute
                           : draw < 0.95 ? JointType::kPrismatic
                                         : JointType::kWeld;
    HangAnywhere(b, type, parent, 0.7);
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
  const RealMatrix J = oracle
                           .Form(ToReal(DescribedCoordinates(description, mechanism)),
                                 RealVector::Zero(mechanism.num_u()))
                           .J;
  const RealVector lambda = SymmetricEigenvalues(J * J.transpose());
  // squares of lengths; the state is rounded to double: what is zero on paper is below 1e-30 here
  return lambda[0] > Real(1e-12) * lambda[lambda.size() - 1];
}

}  // namespace

JointType DrawKind(Random& random, DrawnKinds kinds) {
  const std::size_t up_to_helical = static_cast<std::size_t>(JointType::kHelical) + 1;
  const std::size_t all = AllJointTraits().size();
  return static_cast<JointType>(
      random.Below(static_cast<int>(kinds == DrawnKinds::kAll ? all : up_to_helical)));
}

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
    HangAnywhere(b, type, parent, 1.0);
  }
  b.AddBody(1.0);
  return b.Finish();
}

MechanismDescription RandomGraph(int loops, SpaceKind space, std::uint64_t seed) {
  Builder b("graph-" + std::to_string(loops), space, seed);
  const int half = b.spatial ? 9 : 3;
  Grow(b, 0, 2);
  for (int i = 0; i < loops; ++i) {
    const int bodies = static_cast<int>(b.description.bodies.size());
    const int from = b.random.Below(bodies), to = b.random.Below(bodies);
    const int left = Grow(b, from, half), right = Grow(b, to, half);
    const double draw = b.random.Uniform(0.0, 1.0);
    const JointType type = draw < 0.7   ? JointType::kRevolute
                           : draw < 0.9 ? JointType::kPrismatic
                                        : JointType::kWeld;
    b.Close(type, left, right, b.Tip(), b.random.Uniform(-1.0, 1.0));
  }
  Grow(b, b.random.Below(static_cast<int>(b.description.bodies.size())), 2);
  return b.Finish();
}

MechanismDescription MixedGraph(int loops, SpaceKind space, std::uint64_t seed, int motions,
                                DrawnKinds kinds) {
  Builder b("mixed-" + std::to_string(loops), space, seed);
  const auto any = [&] {
    for (;;) {
      const JointType type = AnyJoint(b, kinds);
      if (type != JointType::kFree) return type;
    }
  };
  const auto grow = [&](int root, int least_freedom) {
    for (int freedom = 0; freedom < least_freedom;) {
      const JointType type = any();
      if (type == JointType::kRod) continue;  // not in a tree
      root = Append(b, type, root);
      freedom += NumValues(type, space, true);
    }
    return root;
  };
  // either side of a loop alone has more freedom than a joint takes
  const int enough = b.spatial ? 9 : 4;
  grow(0, 2);
  for (int i = 0; i < loops; ++i) {
    const int bodies = static_cast<int>(b.description.bodies.size());
    const int from = b.random.Below(bodies), to = b.random.Below(bodies);
    const int left = grow(from, enough), right = grow(to, enough);
    b.Close(any(), left, right, b.Tip(), b.random.Uniform(-1.0, 1.0));
  }
  b.AddMotions(motions);
  return b.Finish();
}

MechanismDescription TightGraph(int n, int loops, SpaceKind space, std::uint64_t seed) {
  const bool spatial = space == SpaceKind::kSpatial;
  for (std::uint64_t draw = 0; draw < 100; ++draw) {
    MechanismDescription graph = DrawGraph(n, loops, space, seed + 1000 * draw, spatial ? 12 : 7);
    if (static_cast<int>(graph.joints.size()) < n + loops) continue;
    if (spatial ? LoopsAreIndependent<Spatial>(graph) : LoopsAreIndependent<Planar>(graph)) {
      return graph;
    }
  }
  throw std::logic_error("no room for so many independent loops");
}

MechanismDescription RedundantGraph(int n, int loops, SpaceKind space, std::uint64_t seed) {
  return DrawGraph(n, loops, space, seed, space == SpaceKind::kSpatial ? 4 : 2);
}

MechanismDescription AnyMechanism(int n, int closures, int motions, SpaceKind space,
                                  std::uint64_t seed, DrawnKinds kinds) {
  Builder b("any-" + std::to_string(n) + "-" + std::to_string(closures), space, seed);
  for (int i = 1; i <= n; ++i) {
    JointType type = AnyJoint(b, kinds);
    while (type == JointType::kRod) type = AnyJoint(b, kinds);  // not in a tree
    const int parent = b.random.Chance(0.6) ? i - 1 : b.random.Below(i);
    HangAnywhere(b, type, parent, 0.7);
  }
  for (int k = 0; k < closures; ++k) {
    const int to = 1 + b.random.Below(n), from = (to + 1 + b.random.Below(n)) % (n + 1);
    b.Close(AnyJoint(b, kinds), from, to, b.random.Vector(0.7, b.spatial),
            b.random.Uniform(-1.0, 1.0));
  }
  if (!b.description.initial.coordinates.empty()) b.AddMotions(motions);
  return b.Finish();
}

MechanismDescription RandomLadder(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("ladder-" + std::to_string(n), space, seed);
  // In the plane one crank drives all others: only near the parallelogram does motion not grow from
  // window to window. In space couplers are of 18 links and close in their middle.
  const double slope = b.random.Uniform(-2.0, -1.0);
  const auto angle = [&](double near, double by) { return near + b.random.Uniform(-by, by); };
  const auto tip = [&] { return Eigen::Vector3d(b.random.Uniform(0.97, 1.03), 0.0, 0.0); };
  int last = 0;
  for (int i = 0; i <= n; ++i) {
    const int crank = b.AddBody(1.0);
    b.AddJoint(JointType::kRevolute, 0, Eigen::Vector3d(i, 0.0, 0.0), crank,
               b.random.Vector(0.02, b.spatial), angle(slope, 0.03), b.spatial);
    if (i > 0 && b.spatial) {
      const int left = Grow(b, last, 9), right = Grow(b, crank, 9);
      b.Close(JointType::kRevolute, left, right, b.Tip(), 0.0);
    } else if (i > 0) {
      const int coupler = b.AddBody(1.0);
      b.AddJoint(JointType::kRevolute, last, tip(), coupler, b.random.Vector(0.02, b.spatial),
                 angle(-slope, 0.03), false);
      b.Close(JointType::kRevolute, crank, coupler, tip(), 0.0);
    }
    last = crank;
  }
  return b.Finish();
}

MechanismDescription ChainOfEveryKind(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("every-kind-" + std::to_string(n), space, seed);
  std::vector<JointType> kinds;
  for (int k = 0; k < std::ssize(AllJointTraits()); ++k) {
    const auto type = static_cast<JointType>(k);
    if (type == JointType::kFree || type == JointType::kRod) continue;
    if (b.spatial || TraitsOf(type).in_plane) kinds.push_back(type);
  }
  int last = 0;
  for (int i = 0; i < n; ++i) last = Append(b, kinds[i % kinds.size()], last);
  b.Close(JointType::kRevolute, 0, last, b.Tip(), 0.0);
  b.Close(JointType::kRod, n / 2 - 4, n / 2 + 4, b.Tip(), 0.0);
  Append(b, JointType::kFree, last);
  return b.Finish();
}

MechanismDescription NestedLoops(int loops, SpaceKind space, std::uint64_t seed) {
  Builder b("nested-" + std::to_string(loops), space, seed);
  const int half = b.spatial ? 9 : 3;
  int from_left = 0, from_right = 0;
  for (int i = 0; i < loops; ++i) {
    int left = from_left, right = from_right;
    for (int k = 0; k < half; ++k) {
      left = Append(b, JointType::kRevolute, left);
      right = Append(b, JointType::kRevolute, right);
      if (k == half / 2) {
        from_left = left;
        from_right = right;
      }
    }
    b.Close(JointType::kRevolute, left, right, b.Tip(), b.random.Uniform(-1.0, 1.0));
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
