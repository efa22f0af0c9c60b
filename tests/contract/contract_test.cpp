// Requirements on every formulation beyond check.h: one suite for all combinations of formulation,
// level of enforcement, solver, coordinate set and space.
#include "tests/contract/contract.h"

#include "lagrange/lagrange.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/contract/allocations.h"
#include "tests/contract/system_with.h"

namespace loopbench::testing {
namespace {

/// Reduction's null space comes from Eigen's Householder reflections, which from 48 on are applied
/// in blocks with a workspace on the heap (reduction/README.md).
bool InBlocks(const Case& c, int rows) {
  return std::string(c.formulation) == "reduction" && c.solver == SolverKind::kRankRevealing &&
         c.enforcement != Enforcement::kVelocity && rows >= 48;
}

TEST_P(ContractTest, DerivativeDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  Run(Description(9), 9, [&](auto bench) {
    std::vector<double> other = bench.y;
    for (std::size_t i = 0; i < other.size(); ++i) other[i] += 1e-3;
    bench.Derivative(other);
    bench.Derivative(bench.y);
    const long before = CountAllocations();
    for (int i = 0; i < 10; ++i) bench.Derivative(i % 2 == 0 ? other : bench.y);
    const long allocations = CountAllocations() - before;
    if (InBlocks(GetParam(), bench.mechanism.num_rows())) return;
    EXPECT_EQ(allocations, 0);
  });
}

/// It is part of the right-hand side when work is integrated along. Seed 10 has drives.
TEST_P(ContractTest, PowerDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  Run(Description(10), 10, [&](auto bench) {
    bench.Examine(bench.y);
    double sum = bench.formulation->DrivePower();
    const long before = CountAllocations();
    for (int i = 0; i < 10; ++i) {
      bench.Examine(bench.y);
      sum += bench.formulation->DrivePower() +
             AppliedPower(bench.formulation->kinematics()).dissipated;
    }
    const long allocations = CountAllocations() - before;
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(std::isfinite(sum));
  });
}

/// Whether a force supplies or dissipates power, from what users say about it.
struct HasPower {
  bool operator()(const JointTorque& torque) const {  // a constant one has a potential
    const auto* polynomial = std::get_if<Polynomial>(&torque.value);
    return polynomial == nullptr || polynomial->coefficients.size() > 1;
  }
  bool operator()(const JointSpring&) const { return false; }
  bool operator()(const JointDamper& damper) const { return damper.damping != 0.0; }
  bool operator()(const PointForce& force) const { return force.in_body_axes; }
  bool operator()(const SpringDamper& spring) const { return spring.damping != 0.0; }
  bool operator()(const Drag& drag) const { return drag.linear != 0.0 || drag.quadratic != 0.0; }
  bool operator()(const OtherForce&) const { return true; }  // nobody knows
};

bool IsConservative(const MechanismDescription& description) {
  return std::ranges::none_of(description.forces, [](const ForceDescription& force) {
    return std::visit(HasPower(), force);
  });
}

MechanismDescription Conservative(MechanismDescription description) {
  std::erase_if(description.forces,
                [](const ForceDescription& force) { return std::visit(HasPower(), force); });
  return description;
}

TEST_P(ContractTest, AccelerationsFollowTheTime) {
  MechanismDescription description = Description(12);
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    if (description.joints[j].type != JointType::kRevolute) continue;
    description.forces.push_back(
        JointTorque{static_cast<int>(j), Harmonic{.amplitude = 5.0, .omega = 2.0}});
  }
  Run(description, 12, [&](auto bench) {
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    for (const double t : {-0.4, 0.8}) {
      oracle.SetTime(t);
      VectorX<double> udot;
      ASSERT_EQ(bench.formulation->Evaluate(t, bench.state.q, bench.state.u, udot),
                Outcome::kFinished);
      const RealVector expected = oracle.Solve(ToReal(bench.state.q), ToReal(bench.state.u)).udot;
      EXPECT_LE(RelativeError(udot, expected), bench.Bound()) << t;
    }
  });
}

/// Powers of drives alone (seed 10 has some), of forces alone (seed 11) and of both; check.h holds
/// them to the rate of the energy.
TEST_P(ContractTest, OnlyDrivesAndForcesWithoutPotentialHavePower) {
  const MechanismDescription driven = Description(10);
  for (const MechanismDescription& description :
       {driven, Conservative(driven), Description(11), Conservative(Description(12))}) {
    Run(description, 10, [&](auto bench) {
      SCOPED_TRACE(description.name);
      ASSERT_EQ(bench.Examine(bench.y), Outcome::kFinished);
      const Power<double> forces = AppliedPower(bench.formulation->kinematics());
      const double drives = bench.formulation->DrivePower();
      const bool conservative = IsConservative(description);
      EXPECT_EQ(drives != 0.0, !bench.mechanism.drives().empty());
      EXPECT_EQ(forces.supplied == 0.0 && forces.dissipated == 0.0, conservative);
      EXPECT_EQ(bench.mechanism.has_power(), drives != 0.0 || !conservative);
      const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
      const Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
      const Energy<double> own = ComputeEnergy(bench.formulation->kinematics());
      EXPECT_NEAR(own.total(), static_cast<double>(oracle.TotalEnergy(q, u)),
                  100 * kEps * (own.kinetic + std::abs(own.potential) + 10.0));
    });
  }
}

/// Where constraints depend on each other, all rows at once keep what closing loop by loop loses.
TEST(RedundancyTest, MultipliersKeepTheBoundOfOverconstrainedGraphs) {
  for (int loops = 2; loops <= 5; ++loops) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const MechanismDescription graph =
          RedundantGraph(7 * loops, loops, SpaceKind::kSpatial, seed);
      const Sample<Spatial> sample(graph, seed);
      const State& state = sample.state(Coordinates::kJoint);
      const auto lagrange = MakeSystem<lagrange::Lagrange>(sample.mechanism(Coordinates::kJoint));
      VectorX<double> udot;
      ASSERT_EQ(lagrange->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
      EXPECT_LE(RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound())
          << graph.name;
    }
  }
}

TEST(AllocationTest, RegularizationDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  const MechanismDescription ladder = RandomLadder(4, SpaceKind::kPlanar, 1);
  const Mechanism<Spatial, double> mechanism(ladder, Coordinates::kJoint);
  const State state = ConsistentState(ladder, mechanism, 1);
  const auto odca = MakeSystem<odca::Odca>(mechanism);
  VectorX<double> udot(mechanism.num_u());
  odca->Evaluate(0.0, state.q, state.u, udot);
  ASSERT_LT(odca->diagnostics().smallest_weight, 1.0);
  const long before = CountAllocations();
  for (int i = 0; i < 10; ++i) odca->Evaluate(0.0, state.q, state.u, udot);
  EXPECT_EQ(CountAllocations() - before, 0);
}

TEST(AllocationTest, SparseReductionDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  const MechanismDescription ladder = RandomLadder(12, SpaceKind::kPlanar, 1);
  const Mechanism<Planar, double> mechanism(ladder, Coordinates::kJoint);
  const State state = ConsistentState(ladder, mechanism, 1);
  for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kVelocity}) {
    SystemWith<reduction::Reduction, Planar, double> system(
        mechanism, {level, SolverKind::kRankRevealing}, reduction::Matrices::kSparse);
    VectorX<double> udot(mechanism.num_u()), q = state.q;
    system->Start(0.0, state.q, state.u);
    const long before = CountAllocations();
    for (int i = 0; i < 10; ++i) {
      q[0] += 1e-3;  // off the constraints, where pivots may be others
      system->Evaluate(0.0, q, state.u, udot);
      system->Multipliers();
    }
    EXPECT_EQ(CountAllocations() - before, 0) << ToString(level);
    EXPECT_TRUE(system.solver().is_sparse());
  }
}

INSTANTIATE_TEST_SUITE_P(All, ContractTest, ::testing::ValuesIn(AllCases()), NameOf);

}  // namespace
}  // namespace loopbench::testing
