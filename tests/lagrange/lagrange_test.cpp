// Sparse multipliers of all joints against dense ones of the cut joints, and which are chosen.
#include "lagrange/lagrange.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <numbers>
#include <string>

#include "mechanism/description/library.h"
#include "odca/odca.h"
#include "tests/contract/placed.h"
#include "tests/contract/system_with.h"

namespace loopbench {
namespace {

using testing::ConsistentState;
using testing::Random;
using testing::RandomNumbers;
using testing::State;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kNoLimit = 1e9;

/// Random forces and targets on both; solutions agree within the contract's bound, sums along n
/// bodies magnified by the condition of what is inverted.
template <class Space>
void ExpectAlike(const MechanismDescription& description, Coordinates coordinates,
                 std::uint64_t seed) {
  const testing::Placed<Space> placed(description, coordinates, seed);
  const auto& mechanism = placed.mechanism;
  const auto& kinematics = placed.kinematics;
  const auto sparse = JointResponse<Space>::Make(mechanism, kNoLimit);
  ASSERT_NE(sparse, nullptr);
  lagrange::DenseEquations<Space, double> dense(mechanism, SolverKind::kRankRevealing);
  Conditioning found;
  ASSERT_EQ(dense.Factor(kinematics, found), Outcome::kFinished);
  if (!sparse->Factor(kinematics)) {
    EXPECT_LT(found.rcond, 0.1) << description.name << ": what is uncertain is near that for both";
    return;
  }
  EXPECT_EQ(found.smallest_weight, 1.0) << description.name;
  Random random(seed);
  const VectorX<double> force = RandomNumbers(random, mechanism.num_u());
  const VectorX<double> target = RandomNumbers(random, mechanism.num_rows());
  VectorX<double> x_dense, lambda_dense, x = force, lambda = target;
  dense.Solve(force, target, x_dense, &lambda_dense);
  BodyEquations<Space, double> equations(mechanism);
  equations.SetForce(kinematics, force, target);
  sparse->Solve(equations.b(), equations.c0(), equations.A());
  equations.Read(kinematics, x);
  equations.Read(sparse->phi(), lambda);
  const double bound =
      100.0 * kEps * mechanism.num_bodies() / std::min(found.rcond, sparse->rcond());
  EXPECT_LE((x - x_dense).norm(), bound * std::max(1.0, x_dense.norm())) << description.name;
  if (lambda.size() == 0) return;
  EXPECT_LE((lambda - lambda_dense).norm(), bound * std::max(1.0, lambda_dense.norm()))
      << description.name;
}

template <class Space>
void ExpectAlikeInAll(SpaceKind space) {
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    // the cost of dense equations is the cube of their number, in absolute coordinates 6 per body
    const std::uint64_t seeds = coordinates == Coordinates::kAbsolute ? 5 : 8;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const int n = 2 + static_cast<int>(seed);
      ExpectAlike<Space>(testing::RandomChain(n + 6, space, seed), coordinates, seed);
      ExpectAlike<Space>(testing::RandomTree(3 * n, space, seed), coordinates, seed);
      ExpectAlike<Space>(testing::RandomLadder(n, space, seed), coordinates, seed);
      ExpectAlike<Space>(testing::MixedGraph(n, space, seed, 2), coordinates, seed);
      ExpectAlike<Space>(testing::NestedLoops(n, space, seed), coordinates, seed);
    }
  }
}

TEST(JointResponse, SolvesTheEquationsOfTheForestInThePlane) {
  ExpectAlikeInAll<Planar>(SpaceKind::kPlanar);
}

TEST(JointResponse, SolvesTheEquationsOfTheForestInSpace) {
  ExpectAlikeInAll<Spatial>(SpaceKind::kSpatial);
}

/// The factors at the description's own coordinates.
struct Factored {
  explicit Factored(const MechanismDescription& description, double angle)
      : mechanism(description, Coordinates::kJoint),
        kinematics(mechanism),
        response(JointResponse<Planar>::Make(mechanism, kNoLimit)) {
    kinematics.UpdatePosition(testing::LadderAt(mechanism, angle));
    is_certain = response->Factor(kinematics);
  }

  const Mechanism<Planar, double> mechanism;
  Kinematics<Planar, double> kinematics;
  std::unique_ptr<JointResponse<Planar>> response;
  bool is_certain = false;
};

/// Body `light` and its inertia 1e-9 times as large.
MechanismDescription With(MechanismDescription description, std::size_t light) {
  description.bodies[light].mass *= 1e-9;
  description.bodies[light].inertia *= 1e-9;
  return description;
}

TEST(JointResponse, TellsLostRankFromLostDigits) {
  const Factored flat(Ladder(3, 1.0, 0.0), 0.0);
  EXPECT_FALSE(flat.is_certain);
  EXPECT_FALSE(flat.response->has_rank());
  const Factored open(Tree(7, 0.0), 0.5);
  EXPECT_TRUE(open.is_certain);
  EXPECT_TRUE(open.response->has_rank());
  // bodies hang on a light one
  const Factored heavy(With(Tree(7, 0.0), 2), 0.5);
  EXPECT_FALSE(heavy.is_certain);
  EXPECT_TRUE(heavy.response->has_rank());
  // the same on a ladder: what hangs there is on no loop, whatever the loops do
  MechanismDescription both = Ladder(3, 1.0, 0.0);
  const std::size_t coupler = both.bodies.size() - 1;
  for (int i = 0; i < 2; ++i) {
    both.bodies.push_back(both.bodies[coupler]);
    both.bodies.back().name = "hung" + std::to_string(i);
    JointDescription pin = both.joints.front();
    pin.name = "H" + std::to_string(i);
    pin.from.body = i == 0 ? static_cast<int>(coupler) : static_cast<int>(both.bodies.size()) - 2;
    pin.to.body = static_cast<int>(both.bodies.size()) - 1;
    both.joints.push_back(pin);
  }
  both = With(both, both.bodies.size() - 2);
  EXPECT_FALSE(Factored(both, 1.0).is_certain);
  EXPECT_TRUE(Factored(both, 1.0).response->has_rank());
  EXPECT_FALSE(Factored(both, 0.0).response->has_rank());
}

/// There no joint belongs to a tree of the mechanism.
TEST(JointResponse, FindsLoopsInAbsoluteCoordinatesToo) {
  const auto factored = [](const MechanismDescription& description) {
    const testing::Placed<Planar> placed(description, Coordinates::kAbsolute, 1);
    auto response = JointResponse<Planar>::Make(placed.mechanism, kMaxOfResponse);
    const bool is_certain = response->Factor(placed.kinematics);
    return std::pair(is_certain, response->has_rank());
  };
  EXPECT_EQ(factored(Tree(7, 0.0)), std::pair(true, true));
  EXPECT_EQ(factored(With(Tree(7, 0.0), 2)), std::pair(false, true));
  EXPECT_EQ(factored(Ladder(3, 1.0, 0.0)).second, true);
  EXPECT_EQ(factored(With(Ladder(3, 1.0, 0.0), 2)).second, false) << "cranks are on loops";
}

using Sparse = testing::SystemWith<lagrange::Lagrange, Planar, double>;

/// A ladder of three windows with its cranks at `angle`, all speeds zero.
Outcome Evaluate(Sparse& system, const Mechanism<Planar, double>& mechanism, double angle) {
  const VectorX<double> u = VectorX<double>::Zero(mechanism.num_u());
  VectorX<double> udot;
  return system->Evaluate(0.0, testing::LadderAt(mechanism, angle), u, udot);
}

TEST(Lagrange, LeavesSuspiciousPositionsToTheDenseEquations) {
  const Mechanism<Planar, double> mechanism(Ladder(3, 1.0, 0.0), Coordinates::kJoint);
  Sparse system(mechanism);
  EXPECT_EQ(Evaluate(system, mechanism, 1.0), Outcome::kFinished);
  EXPECT_TRUE(system.solver().is_sparse());
  EXPECT_EQ(system->diagnostics().smallest_weight, 1.0);
  for (const double angle : {1e-5, 0.0}) {
    EXPECT_EQ(Evaluate(system, mechanism, angle), Outcome::kFinished);
    EXPECT_FALSE(system.solver().is_sparse());
    EXPECT_LT(system->diagnostics().smallest_weight, 0.5);
  }
  EXPECT_EQ(Evaluate(system, mechanism, 1.0), Outcome::kFinished);
  EXPECT_TRUE(system.solver().is_sparse());
}

/// Accelerations of the sparse equations are right: O-DCA, which judges joint by joint, regularizes
/// nothing there and has the same accelerations. Dense equations judge all loops at once, whose
/// responses are the wider apart the more there are: from some 50 windows on they regularize where
/// sparse ones answer.
TEST(Lagrange, AnswersNothingSparselyThatHasLostRank) {
  for (const int windows : {1, 3, 10, 40}) {
    const Mechanism<Planar, double> mechanism(Ladder(windows, 1.0, 0.0), Coordinates::kJoint);
    Sparse system(mechanism);
    testing::SystemWith<odca::Odca, Planar, double> odca(mechanism);
    VectorX<double> udot, expected;
    const VectorX<double> u = VectorX<double>::Zero(mechanism.num_u());
    double regularized_to = 0.0, sparse_from = 1.0, worst = 0.0;
    for (double angle = 1e-6; angle < 1.0; angle *= 1.3) {
      ASSERT_EQ(Evaluate(system, mechanism, angle), Outcome::kFinished);
      if (!system.solver().is_sparse()) {
        if (system->diagnostics().smallest_weight < 1.0) regularized_to = angle;
        continue;
      }
      sparse_from = std::min(sparse_from, angle);
      ASSERT_EQ(system->Evaluate(0.0, system->q(), u, udot), Outcome::kFinished);
      ASSERT_EQ(odca->Evaluate(0.0, system->q(), u, expected), Outcome::kFinished);
      const Diagnostics found = odca->diagnostics();
      EXPECT_EQ(found.smallest_weight, 1.0) << windows << " windows at " << angle;
      const double bound = 100.0 * kEps * mechanism.num_bodies() /
                           std::min(found.rcond, system->diagnostics().rcond);
      worst = std::max(worst, (udot - expected).norm() / expected.norm() / bound);
    }
    std::printf(
        "%3d windows: dense equations regularize to %.1e rad, sparse from %.1e; %.2g of bound\n",
        windows, regularized_to, sparse_from, worst);
    EXPECT_LE(worst, 1.0);
    EXPECT_LT(sparse_from, 0.1);
  }
}

TEST(Lagrange, IsSingularWhereDenseEquationsWouldBeTooLarge) {
  const Mechanism<Planar, double> mechanism(Ladder(2000, 1.0, 0.0), Coordinates::kJoint);
  Sparse system(mechanism);
  EXPECT_EQ(Evaluate(system, mechanism, 1.0), Outcome::kFinished);
  EXPECT_EQ(Evaluate(system, mechanism, 0.0), Outcome::kSingular);
  EXPECT_NE(system.solver().WhySingular().find("rank is uncertain at joint \""), std::string::npos)
      << system.solver().WhySingular();
  EXPECT_EQ(Evaluate(system, mechanism, std::numeric_limits<double>::quiet_NaN()),
            Outcome::kNonFinite);
  EXPECT_EQ(Evaluate(system, mechanism, 1.0), Outcome::kFinished);
}

/// Where a closed chain meets, half of it hangs on either side: that is no loss of rank.
TEST(Lagrange, AnswersLongChains) {
  const Mechanism<Planar, double> mechanism(Chain(100000), Coordinates::kJoint);
  Sparse system(mechanism);
  const double turn = 2.0 * std::numbers::pi / 100001.0;
  VectorX<double> q = VectorX<double>::Constant(mechanism.num_q(), turn), udot;
  q[0] = turn - std::numbers::pi;
  const VectorX<double> u = VectorX<double>::Zero(mechanism.num_u());
  EXPECT_EQ(system->Evaluate(0.0, q, u, udot), Outcome::kFinished);
  EXPECT_TRUE(system.solver().is_sparse());
}

/// A body with three hundred joints makes a block for every two of them.
TEST(Lagrange, IsDenseWhereThatIsLessWork) {
  MechanismDescription hub;
  hub.name = "hub";
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), tip = Eigen::Vector3d::UnitX();
  hub.bodies.push_back(Bar("hub", 1.0, 1.0, 1.0));
  hub.joints.push_back(Revolute("axle", 0, origin, 1, origin));
  for (int i = 0; i < 300; ++i) {
    hub.bodies.push_back(Bar("spoke" + std::to_string(i), 1.0, 1.0, 1.0));
    hub.joints.push_back(Revolute("J" + std::to_string(i), 1, tip, i + 2, origin));
  }
  const Mechanism<Planar, double> mechanism(hub, Coordinates::kJoint);
  Sparse system(mechanism);
  EXPECT_EQ(Evaluate(system, mechanism, 1.0), Outcome::kFinished);
  EXPECT_FALSE(system.solver().is_sparse());
}

}  // namespace
}  // namespace loopbench
