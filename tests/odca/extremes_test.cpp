// Mechanisms of extreme structure: the accelerations satisfy every joint and every body's equation
// of motion, and cost what the plan promises.
#include "mechanism/description/library.h"
#include "mechanism/loops/tree_dynamics.h"
#include "odca/odca.h"
#include "tests/contract/builder.h"
#include "tests/contract/comparison.h"
#include "tests/contract/system_with.h"

namespace loopbench::odca::extremes_test {

constexpr SpaceKind kPlane = SpaceKind::kPlanar, kSpace = SpaceKind::kSpatial;
struct Residuals {
  double joints = 0.0;  ///< of D^T (A_Q - A_P - g), against the largest acceleration
  double bodies = 0.0;  ///< of M A + gyroscopic - applied - joint forces, against the largest force
  double rcond = 1.0;
  long operations = 0;
};

/// Returns the residuals of the equations at the described position with random speeds. A comes
/// from udot along the tree, not from the sweep. Only the correct A makes all residuals zero.
template <class Space>
Residuals ResidualsOf(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  testing::SystemWith<Odca, Space, double> odca(mechanism);
  testing::Random random(5);
  VectorX<double> u(mechanism.num_u()), udot;
  for (int i = 0; i < u.size(); ++i) u[i] = random.Uniform(-1.0, 1.0) / std::sqrt(u.size());
  const VectorX<double> q = testing::DescribedCoordinates(description, mechanism);
  EXPECT_EQ(odca->Evaluate(0.0, q, u, udot), Outcome::kFinished);
  const Kinematics<Space, double>& kinematics = odca->kinematics();
  std::vector<Acceleration<Space, double>> A(mechanism.num_bodies(),
                                             Acceleration<Space, double>::Zero());
  TreeDynamics<Space, double>(mechanism).BodyAccelerations(kinematics, udot, A);

  Residuals result;
  double largest_A = 0.0, largest_F = 0.0;
  for (const Acceleration<Space, double>& a : A) largest_A = std::max(largest_A, a.norm());
  std::vector<Wrench<Space, double>> missing(mechanism.num_bodies());
  AppliedForces<Space, double>(kinematics, missing);
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const Inertia<Space, double>& inertia = mechanism.bodies()[body];
    const auto I = kinematics.RotationalInertia(inertia, body);
    const Angular<Space, double>& w = kinematics.motions()[body].angular;
    largest_F = std::max(largest_F, missing[body].norm());
    missing[body] -=
        {I * A[body].angular + CrossAngular<double>(w, I * w), inertia.mass * A[body].linear};
  }
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, double>& joint = mechanism.joints()[j];
    const JointState<Space, double>& state = kinematics.joints()[j];
    const Components<Space, double> miss = JointAcceleration<Space, double>(kinematics, j, A);
    result.joints = std::max(result.joints, miss.head(state.rows()).norm());
    if (state.rows() == 0) continue;
    const Wrench<Space, double> F = odca.solver().JointForce(j);
    largest_F = std::max(largest_F, F.norm());
    missing[joint.to] += ShiftForce<Space, double>(F, state.r_Q);
    missing[joint.from] -= ShiftForce<Space, double>(F, state.r_P);
  }
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    result.bodies = std::max(result.bodies, missing[body].norm());
  }
  result.joints /= largest_A;
  result.bodies /= largest_F;
  result.rcond = odca->diagnostics().rcond;
  result.operations = odca.solver().sweep().operations();
  std::printf("%-24s n %5d: joints %.1e bodies %.1e of their scales, rcond %.1e, %ld operations\n",
              description.name.c_str(), mechanism.num_bodies() - 1, result.joints, result.bodies,
              result.rcond, result.operations);
  EXPECT_EQ(result.operations, odca.solver().plan().operations());
  return result;
}

/// Round-off of a sum along n bodies.
void ExpectRoundOff(const Residuals& residuals, std::size_t bodies) {
  EXPECT_LE(residuals.joints, 100 * kEps * static_cast<double>(bodies));
  EXPECT_LE(residuals.bodies, 100 * kEps * static_cast<double>(bodies));
}

template <class Space>
Residuals Hold(const MechanismDescription& description) {
  const Residuals residuals = ResidualsOf<Space>(description);
  ExpectRoundOff(residuals, description.bodies.size());
  return residuals;
}

TEST(ExtremesTest, LongChainsOfEveryKindOfJointAreExactAndLinear) {
  const auto small = Hold<Planar>(testing::ChainOfEveryKind(1000, kPlane, 1));
  const auto large = Hold<Planar>(testing::ChainOfEveryKind(10000, kPlane, 1));
  EXPECT_LE(large.operations, 11 * small.operations);
  const auto small_in_space = Hold<Spatial>(testing::ChainOfEveryKind(1000, kSpace, 1));
  const auto large_in_space = Hold<Spatial>(testing::ChainOfEveryKind(10000, kSpace, 1));
  EXPECT_LE(large_in_space.operations, 11 * small_in_space.operations);
}

TEST(ExtremesTest, HubsOfAThousandArmsAreExactAndLinear) {
  for (bool closed : {false, true}) {
    const auto small = Hold<Planar>(Hub(100, 3, closed));
    const auto large = Hold<Planar>(Hub(1000, 3, closed));
    EXPECT_LE(large.operations, 11 * small.operations);
  }
}

TEST(ExtremesTest, NestedLoopsAreExactAndLinear) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Hold<Planar>(testing::NestedLoops(50, kPlane, seed));
    Hold<Spatial>(testing::NestedLoops(50, kSpace, seed));
  }
  const auto small = Hold<Planar>(testing::NestedLoops(30, kPlane, 1));
  const auto large = Hold<Planar>(testing::NestedLoops(300, kPlane, 1));
  EXPECT_LE(large.operations, 11 * small.operations);
}

TEST(ExtremesTest, AGridOfThirtyByThirtyIsExact) {
  // storey r stands at 0.12 + 0.1 (r - 1): none is flat, where its windows would be singular
  Hold<Planar>(Grid(30, 30, 0.12, 0.0));
}

TEST(ExtremesTest, SmallOnesAgreeWithTheOracle) {
  testing::Family chains("chains of every kind", 0.0), loops("nested loops", 0.0);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (int n : {10, 20, 40}) {
      const MechanismDescription plane = testing::ChainOfEveryKind(n, kPlane, seed);
      chains.Hold(testing::Sample<Planar>(plane, seed), true);
      const MechanismDescription space = testing::ChainOfEveryKind(n, kSpace, seed);
      chains.Hold(testing::Sample<Spatial>(space, seed), true);
    }
    for (int n : {1, 2, 5, 8}) {
      loops.Hold(testing::Sample<Planar>(testing::NestedLoops(n, kPlane, seed), seed), true);
    }
    loops.Hold(testing::Sample<Spatial>(testing::NestedLoops(2, kSpace, seed), seed), true);
  }
  chains.Finish();
  loops.Finish();
}

}  // namespace loopbench::odca::extremes_test
