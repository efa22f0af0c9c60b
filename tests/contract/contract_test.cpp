// What every formulation owes, whatever its method: one suite for all combinations of formulation,
// level of enforcement, solver, coordinate set and space.
#include "tests/contract/contract.h"

#include <cmath>
#include <cstring>

#include "lagrange/lagrange.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/contract/allocations.h"
#include "tests/contract/system_with.h"

namespace loopbench::testing {
namespace {

TEST_P(ContractTest, AccelerationsAgreeWithTheOracle) {
  double worst = 0.0;
  const auto hold = [&](const MechanismDescription& description, std::uint64_t seed) {
    Run(description, seed, [&](auto bench) {
      ASSERT_EQ(bench.Examine(bench.y), Outcome::kFinished);
      const double error =
          RelativeError(bench.formulation->udot(), bench.sample.udot(GetParam().coordinates));
      EXPECT_LE(error, bench.Bound()) << "rcond " << bench.sample.answer().rcond;
      EXPECT_EQ(bench.formulation->diagnostics().rank, bench.sample.answer().rank);
      worst = std::max(worst, error / bench.Bound());
    });
  };
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    hold(Description(seed), seed);
    if (GetParam().space == SpaceKind::kSpatial) hold(LoopOfAllKinds(seed), seed);
  }
  RecordProperty("worst_part_of_bound", std::to_string(worst));
}

TEST_P(ContractTest, DerivativeIsAPureFunction) {
  Run(Description(5), 5, [&](auto bench) {
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    const std::vector<double> first = bench.ydot;
    std::vector<double> other = bench.y;
    for (std::size_t i = 0; i < other.size(); ++i) other[i] += 1e-3 * std::sin(double(i + 1));
    bench.Derivative(other);
    VectorX<double> udot;
    bench.formulation->Evaluate(1.0, bench.state.q, -bench.state.u, udot);
    bench.formulation->FromState(0.0, std::span<const double>(other));
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    EXPECT_EQ(std::memcmp(first.data(), bench.ydot.data(), first.size() * sizeof(double)), 0);
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished) << "the same position once more";
    EXPECT_EQ(std::memcmp(first.data(), bench.ydot.data(), first.size() * sizeof(double)), 0);
  });
}

TEST_P(ContractTest, StateKeepsConsistentPositionsAndSpeeds) {
  Run(Description(7), 7, [&](auto bench) {
    ASSERT_EQ(bench.formulation->FromState(0.0, std::span<const double>(bench.y)),
              Outcome::kFinished);
    EXPECT_EQ(bench.formulation->q(), bench.state.q);
    const double difference =
        (bench.formulation->u() - bench.state.u).template lpNorm<Eigen::Infinity>();
    // at acceleration level speeds are handed through, at velocity level projected
    const bool projected = GetParam().enforcement == Enforcement::kVelocity;
    const double size = bench.state.u.template lpNorm<Eigen::Infinity>();
    EXPECT_LE(difference, projected ? bench.Bound() * size : 0.0);
    std::vector<double> again(bench.y.size());
    bench.formulation->ToState(bench.formulation->q(), bench.formulation->u(), again);
    for (int i = 0; i < bench.mechanism.num_q(); ++i) EXPECT_EQ(again[i], bench.y[i]);
  });
}

TEST_P(ContractTest, NotANumberEndsWithANamedOutcome) {
  Run(Description(8), 8, [&](auto bench) {
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    const std::vector<double> good = bench.ydot;
    const std::size_t first_speed = bench.mechanism.num_q();
    for (double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      for (std::size_t i : {std::size_t{0}, first_speed - 1, first_speed, bench.y.size() - 1}) {
        std::vector<double> y = bench.y;
        y[i] = bad;
        const Outcome outcome = bench.Derivative(y);
        EXPECT_TRUE(outcome == Outcome::kNonFinite || outcome == Outcome::kSingular)
            << "y[" << i << "] = " << bad << " ended as " << ToString(outcome);
      }
    }
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished) << "nothing is left of the bad state";
    EXPECT_EQ(good, bench.ydot);
  });
}

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

/// The energy's rate by differences of the oracle's, the power by the formulation: of drives alone
/// (seed 10 has some), of forces alone (seed 11) and of both.
TEST_P(ContractTest, EnergyChangesByThePowerOfForcesAndDrives) {
  const MechanismDescription driven = Description(10);
  for (const MechanismDescription& description :
       {driven, Conservative(driven), Description(11), Conservative(Description(12))}) {
    Run(description, 10, [&](auto bench) {
      SCOPED_TRACE(description.name);
      ASSERT_EQ(bench.Examine(bench.y), Outcome::kFinished);
      Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
      const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
      const RealVector udot = ToReal(bench.formulation->udot());
      const Eigen::Map<const VectorX<double>> qdot(bench.ydot.data(), q.size());
      const Real step = 1e-6L;  // long double: truncation 1e-12, round-off 1e-13
      const auto energy = [&](Real t) {
        oracle.SetTime(t);
        return oracle.TotalEnergy(q + t * ToReal(qdot), u + t * udot);
      };
      const Real rate = (energy(step) - energy(-step)) / (2 * step);
      const Power<double> forces = AppliedPower(bench.formulation->kinematics());
      const double drives = bench.formulation->DrivePower();
      const bool conservative = IsConservative(description);
      EXPECT_EQ(drives != 0.0, !bench.mechanism.drives().empty());
      EXPECT_EQ(forces.supplied == 0.0 && forces.dissipated == 0.0, conservative);
      EXPECT_EQ(bench.mechanism.has_power(), drives != 0.0 || !conservative);
      // what the rate is small against: the energies' own rates, at least their size per second
      const Real scale = 1 + std::abs(energy(0)) + udot.template lpNorm<Eigen::Infinity>();
      EXPECT_LE(std::abs(rate - (forces.supplied - forces.dissipated + drives)),
                (1e-10L + bench.Bound()) * scale);
      const Energy<double> own = ComputeEnergy(bench.formulation->kinematics());
      EXPECT_NEAR(own.total(), static_cast<double>(energy(0)),
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
