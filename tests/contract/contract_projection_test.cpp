// Level `projection`: requirements beyond the common contract.
#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

bool IsAtPosition(const Case& c) { return c.enforcement == Enforcement::kPosition; }

bool HasImpulses(const Case& c) { return IsAtPosition(c) && c.formulation != "reduction"; }

class PositionContractTest : public ContractTest {};
class ImpulseContractTest : public ContractTest {};

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

INSTANTIATE_TEST_SUITE_P(PositionLevel, PositionContractTest,
                         ::testing::ValuesIn(CasesThat(IsAtPosition)), NameOf);
INSTANTIATE_TEST_SUITE_P(PositionLevel, ImpulseContractTest,
                         ::testing::ValuesIn(CasesThat(HasImpulses)), NameOf);

}  // namespace
}  // namespace loopbench::testing
