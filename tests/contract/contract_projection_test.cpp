// What the levels velocity and position owe on top of the contract: states on the constraints.
#include <cmath>

#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

std::vector<Case> VelocityCases() {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [](const Case& c) { return c.enforcement != Enforcement::kVelocity; });
  return cases;
}

std::vector<Case> PositionCases() {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [](const Case& c) { return c.enforcement != Enforcement::kPosition; });
  return cases;
}

std::vector<Case> ImpulseCases() {
  std::vector<Case> cases = PositionCases();
  std::erase_if(cases, [](const Case& c) { return std::string(c.formulation) == "reduction"; });
  return cases;
}

class VelocityContractTest : public ContractTest {};
class PositionContractTest : public ContractTest {};
class ImpulseContractTest : public ContractTest {};

TEST_P(VelocityContractTest, SpeedsSatisfyTheLoops) {
  Run(Description(6), 6, [&](auto bench) {
    std::vector<double> off = bench.y;
    for (std::size_t i = bench.mechanism.num_q(); i < off.size(); ++i) off[i] += 0.1;
    ASSERT_EQ(bench.Examine(off), Outcome::kFinished);
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
    const RealMatrix J = oracle.Form(q, u).J;
    const Real at_rest = oracle.ClosureRates(q, 0 * u).template lpNorm<Eigen::Infinity>();
    const Real scale =
        at_rest + J.cwiseAbs().rowwise().sum().maxCoeff() * u.template lpNorm<Eigen::Infinity>();
    EXPECT_LE(oracle.ClosureRates(q, u).template lpNorm<Eigen::Infinity>(), bench.Bound() * scale);
  });
}

/// Seeds 6 and 10 have prescribed motions.
TEST_P(PositionContractTest, AcceptedStepsAreProjectedToTheConstraints) {
  const auto hold = [&](const MechanismDescription& description, std::uint64_t seed) {
    Run(description, seed, [&](auto bench) {
      for (std::size_t i = 0; i < bench.y.size(); ++i) {
        bench.y[i] += 1e-4 * std::sin(2.0 * static_cast<double>(i + 1));
      }
      ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(bench.y)));
      const auto& correction = bench.formulation->level().correction();
      EXPECT_GT(correction.shift + correction.rotation, 0.0);
      Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
      const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
      // rows of lengths and speeds of some metres, through as many bodies
      const double scale = 1.0 + static_cast<double>(q.norm() + u.norm());
      EXPECT_LE(oracle.ClosureMismatches(q).template lpNorm<Eigen::Infinity>(),
                bench.Bound() * scale);
      EXPECT_LE(oracle.ClosureRates(q, u).template lpNorm<Eigen::Infinity>(),
                bench.Bound() * scale * scale);
      // once more: nothing is left to do
      const std::vector<double> first = bench.y;
      bench.formulation->BeginStep(0.0, std::span<double>(bench.y));
      for (std::size_t i = 0; i < first.size(); ++i) {
        EXPECT_NEAR(bench.y[i], first[i], bench.Bound() * scale);
      }
    });
  };
  for (std::uint64_t seed : {5, 6, 8, 10}) hold(Description(seed), seed);
  if (GetParam().space == SpaceKind::kPlanar) return;
  for (std::uint64_t seed : {1, 2, 3}) hold(LoopOfAllKinds(seed), seed);
}

/// The last stage of a step, its projection and the next evaluation share what belongs to the same
/// positions, and nothing comes out differently for it.
TEST_P(PositionContractTest, ProjectionsBeginWithWhatTheLastStageKnows) {
  Run(Description(8), 8, [&](auto bench) {
    for (std::size_t i = 0; i < bench.y.size(); ++i) {
      bench.y[i] += 1e-4 * std::sin(2.0 * static_cast<double>(i + 1));
    }
    const auto version = [&] { return bench.formulation->kinematics().position_version(); };
    std::vector<double> other = bench.y, ydot(bench.y.size());
    ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(other)));  // knows nothing

    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    const long before = version();
    ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(bench.y)));
    EXPECT_EQ(bench.y, other);
    // one update a Newton step, and one to take the last of them back
    const int steps = bench.formulation->level().correction().iterations;
    EXPECT_GE(version() - before, steps);
    EXPECT_LE(version() - before, steps + 1);
    const long after = version();
    ASSERT_EQ(bench.formulation->Derivative(0.0, bench.y, ydot), Outcome::kFinished);
    EXPECT_EQ(version(), after);
    // an evaluation that follows no step is a whole one
    const std::vector<double> first = ydot;
    ASSERT_EQ(bench.formulation->Derivative(0.0, bench.y, ydot), Outcome::kFinished);
    EXPECT_EQ(version(), after + 1);
    EXPECT_EQ(ydot, first);
  });
}

/// Impulses of constraints alone change the speeds: M (u' - u) = J^T lambda. Reduction keeps its
/// independent speeds instead.
TEST_P(ImpulseContractTest, SpeedsChangeByImpulsesOfConstraints) {
  Run(Description(8), 8, [&](auto bench) {
    for (std::size_t i = bench.mechanism.num_q(); i < bench.y.size(); ++i) {
      bench.y[i] += 0.1 * std::sin(2.0 * static_cast<double>(i + 1));
    }
    const int n = bench.mechanism.num_q();
    const RealVector before =
        ToReal(Eigen::Map<const VectorX<double>>(bench.y.data() + n, bench.mechanism.num_u()));
    ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(bench.y)));
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    const Equations e = oracle.Form(ToReal(bench.formulation->q()), ToReal(bench.formulation->u()));
    const RealVector impulse = e.M * (ToReal(bench.formulation->u()) - before);
    // what is left of it beside the range of J^T
    const RealMatrix S = e.J * e.J.transpose();
    const RealVector lambda = SolveFullPivot(S, e.J * impulse, Real(1e-15L));
    const RealVector rest = impulse - e.J.transpose() * lambda;
    EXPECT_LE(rest.norm(), bench.Bound() * impulse.norm());
  });
}

INSTANTIATE_TEST_SUITE_P(PositionLevel, PositionContractTest, ::testing::ValuesIn(PositionCases()),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(PositionLevel, ImpulseContractTest, ::testing::ValuesIn(ImpulseCases()),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(VelocityLevel, VelocityContractTest, ::testing::ValuesIn(VelocityCases()),
                         NameOf);

}  // namespace
}  // namespace loopbench::testing
