// Random mechanisms of the contract as peers can express them, and how far a peer's accelerations
// are from the oracle's.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "harness/config/formulations.h"
#include "harness/run/run.h"
#include "tests/contract/sample.h"

namespace loopbench::testing {

/// Removes the forces that no peer has, and makes bodies of matter: with moments of inertia that
/// satisfy the triangle inequality, to which peers hold them.
inline void KeepExpressible(MechanismDescription& description) {
  const Topology topology = BuildTopology(description, Coordinates::kJoint);
  const auto is_cut = [&](int joint) {
    return std::ranges::find(topology.constraints, joint) != topology.constraints.end();
  };
  std::erase_if(description.forces, [&](const ForceDescription& force) {
    if (const auto* spring = std::get_if<JointSpring>(&force)) return is_cut(spring->joint);
    if (const auto* damper = std::get_if<JointDamper>(&force)) return is_cut(damper->joint);
    if (const auto* point = std::get_if<PointForce>(&force)) return point->in_body_axes;
    return !std::holds_alternative<SpringDamper>(force);
  });
  for (BodyDescription& body : description.bodies) {
    body.inertia += 0.5 * body.inertia.trace() * Eigen::Matrix3d::Identity();
  }
}

/// Adds constant efforts along the joints of a tree that have one coordinate, and a force that
/// turns with a body.
inline void AddConstantForces(MechanismDescription& tree, bool in_body_axes) {
  double effort = 0.5;
  for (std::size_t j = 0; j < tree.joints.size(); ++j, effort = -1.5 * effort) {
    if (NumValues(tree.joints[j].type, tree.space, true) != 1) continue;
    tree.forces.push_back(JointTorque{.joint = static_cast<int>(j), .value = Polynomial{{effort}}});
  }
  tree.forces.push_back(PointForce{.point = {.body = 1, .at = {0.3, -0.2, 0.0}},
                                   .force = {0.7, 1.1, 0.0},
                                   .in_body_axes = in_body_axes});
}

/// Error relative to max |udot|, and its bound (Sample::Bound()).
struct AccelerationError {
  double relative = 0.0, bound = 0.0;
};

/// Nothing where the peer does not have a helical joint. `given`: what the peer is made from, where
/// it is another description of the same mechanism.
template <class Space>
std::optional<AccelerationError> PeerError(const std::string& name,
                                           const MechanismDescription& description,
                                           std::uint64_t seed,
                                           const MechanismDescription* given = nullptr) {
  std::unique_ptr<harness::Peer> peer;
  try {
    peer = harness::MakePeer(name, given != nullptr ? *given : description);
  } catch (const harness::Inexpressible& why) {
    EXPECT_NE(std::string(why.what()).find("helical"), std::string::npos) << why.what();
    return {};
  }
  const Sample<Space> sample(description, seed);
  const State& state = sample.state(Coordinates::kJoint);
  std::vector<double> y(state.q.begin(), state.q.end());
  y.insert(y.end(), state.u.begin(), state.u.end());
  std::vector<double> ydot(y.size());
  EXPECT_EQ(peer->Derivative(0.0, y, ydot), Outcome::kFinished);
  const VectorX<double> udot =
      Eigen::Map<VectorX<double>>(ydot.data() + state.q.size(), state.u.size());
  return AccelerationError{RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound()};
}

/// Compares trees with a rotor on each joint of one coordinate. Returns the number of trees with
/// rotors that change accelerations.
template <class Space>
int CompareRotors(const std::string& name, SpaceKind space) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    MechanismDescription tree = AnyMechanism(6, 0, 0, space, seed);
    KeepExpressible(tree);
    double inertia = 0.3;
    for (JointDescription& joint : tree.joints) {
      if (NumValues(joint.type, space, false) == 1) joint.rotor_inertia = inertia *= 1.3;
    }
    std::unique_ptr<harness::Peer> peer;
    try {
      peer = harness::MakePeer(name, tree);
    } catch (const harness::Inexpressible&) {
      continue;  // helical
    }
    const Sample<Space> sample(tree, seed);
    const State& state = sample.state(Coordinates::kJoint);
    const Mechanism<Space, double> mechanism(tree, Coordinates::kJoint);
    const auto system = harness::MakeFormulation<Space>("odca", mechanism, {});
    VectorX<double> udot;
    EXPECT_EQ(system->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
    std::vector<double> y(state.q.begin(), state.q.end());
    y.insert(y.end(), state.u.begin(), state.u.end());
    std::vector<double> ydot(y.size());
    EXPECT_EQ(peer->Derivative(0.0, y, ydot), Outcome::kFinished);
    const VectorX<double> theirs =
        Eigen::Map<VectorX<double>>(ydot.data() + state.q.size(), state.u.size());
    // accelerations without rotors: a peer that adds rotors by constraints changes these
    const VectorX<double> without = sample.udot(Coordinates::kJoint).template cast<double>();
    const double change = without.cwiseAbs().maxCoeff() / udot.cwiseAbs().maxCoeff();
    EXPECT_LE(RelativeError(theirs, udot.template cast<Real>()),
              sample.Bound() * std::max(1.0, change))
        << tree.name;
    // some trees have no joint with one coordinate
    if (RelativeError(theirs, sample.udot(Coordinates::kJoint)) > 1e-3) ++compared;
  }
  return compared;
}

}  // namespace loopbench::testing
