// The sweep's size and cost, counted, and its round-off, measured with long double.
#include "odca/sweep.h"

#include <gtest/gtest.h>

#include <limits>

#include "mechanism/description/library.h"
#include "odca/odca.h"
#include "tests/contract/builder.h"
#include "tests/contract/comparison.h"
#include "tests/contract/system_with.h"

namespace loopbench::odca {
namespace sweep_test {

/// Operations of one evaluation; any position will do.
long Operations(const MechanismDescription& description, SolverKind solver) {
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  testing::SystemWith<Odca, Planar, double> odca(mechanism, {.solver = solver});
  const VectorX<double> q = testing::DescribedCoordinates(description, mechanism);
  VectorX<double> udot;
  const VectorX<double> u = VectorX<double>::Zero(mechanism.num_u());
  EXPECT_EQ(odca->Evaluate(0.0, q, u, udot), Outcome::kFinished);
  return odca.solver().sweep().operations();
}

TEST(SweepTest, TenTimesTheBodiesCostAtMostTwelveTimesTheOperations) {
  for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    EXPECT_LE(Operations(Chain(1000), solver), 12 * Operations(Chain(100), solver));
    EXPECT_LE(Operations(Ladder(1000, -1.0, 0.5), solver),
              12 * Operations(Ladder(100, -1.0, 0.5), solver));
  }
}

TEST(SweepTest, NoMatrixIsLargerThanThePlansLargestJoin) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const MechanismDescription graph = testing::RandomGraph(4, SpaceKind::kPlanar, seed);
    const Mechanism<Planar, double> mechanism(graph, Coordinates::kJoint);
    const Odca<Planar, double> odca(mechanism, {});
    const int rows = odca.plan().largest_join();
    int boundary = 0;
    for (const Leaf& leaf : odca.plan().leaves()) boundary = std::max(boundary, leaf.width);
    for (const PlanNode& node : odca.plan().nodes()) {
      boundary = std::max(boundary, node.kept_numbers);
    }
    EXPECT_LE(odca.sweep().largest_matrix(), std::max(rows * rows, boundary * boundary));
  }
  const Mechanism<Planar, double> chain(Chain(1000), Coordinates::kJoint);
  EXPECT_LE((Odca<Planar, double>(chain, {}).sweep().largest_matrix()), 16)
      << "two handles of two rows";
}

#ifdef LOOPBENCH_PRECISIONS
TEST(SweepTest, LongDoubleAgreesWithDouble) {
  for (int n : {5, 20, 60}) {
    const MechanismDescription chain = testing::RandomChain(n, SpaceKind::kPlanar, 3);
    const testing::Sample<Planar> sample(chain, 3);
    const testing::State& state = sample.state(Coordinates::kJoint);
    const Mechanism<Planar, long double> mechanism(chain, Coordinates::kJoint);
    testing::SystemWith<Odca, Planar, long double> odca(mechanism);
    VectorX<long double> udot;
    ASSERT_EQ(odca->Evaluate(0.0L, testing::ToReal(state.q), testing::ToReal(state.u), udot),
              Outcome::kFinished);
    const long double scale = udot.lpNorm<Eigen::Infinity>();
    const long double error =
        (udot - sample.udot(Coordinates::kJoint)).lpNorm<Eigen::Infinity>() / scale;
    // joint frames reach the mechanism in double, hence a few eps of double and not of long double
    EXPECT_LE(error, 10.0L * n * std::numeric_limits<double>::epsilon() / sample.answer().rcond);
    testing::SystemWith<Odca, Planar, double> in_double(sample.mechanism(Coordinates::kJoint));
    VectorX<double> udot_double;
    in_double->Evaluate(0.0, state.q, state.u, udot_double);
    EXPECT_LE(testing::RelativeError(udot_double, udot), sample.Bound());
  }
}
#endif

}  // namespace sweep_test
}  // namespace loopbench::odca
