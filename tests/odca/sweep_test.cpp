// The sweep's size and cost, counted, and its round-off, measured with long double.
#include "odca/sweep.h"

#include "mechanism/description/library.h"
#include "mechanism/simplify/redundancy.h"
#include "odca/odca.h"
#include "tests/contract/allocations.h"
#include "tests/contract/builder.h"
#include "tests/contract/comparison.h"
#include "tests/contract/system_with.h"

namespace loopbench::odca::sweep_test {

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

/// The sweep stores an X for each join of the plan, and a Z for each boundary.
TEST(SweepTest, MatricesOfLongChainsStaySmall) {
  const Mechanism<Planar, double> chain(Chain(1000), Coordinates::kJoint);
  const Odca<Planar, double> odca(chain, {});
  EXPECT_LE(odca.plan().largest_join(), 4);
  for (const Leaf& leaf : odca.plan().leaves()) EXPECT_LE(leaf.width, 4) << "two handles";
  for (const PlanNode& node : odca.plan().nodes()) EXPECT_LE(node.kept_numbers, 4);
}

/// Evaluates with small pieces and 1, 2, 3 and 8 threads, and with one piece: the same bits.
/// The sweep allocates nothing.
template <class Space>
void ExpectTheSameBits(const MechanismDescription& description, bool regularizes = false) {
  SCOPED_TRACE(description.name);
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const VectorX<double> q = testing::DescribedCoordinates(description, mechanism);
  const VectorX<double> u = VectorX<double>::LinSpaced(mechanism.num_u(), -1.0, 1.0);
  const auto found = [&](const FormulationOptions& options, long piece) {
    PlanOptions plan = PlanOptionsOf(options.solver);
    plan.piece = piece;
    testing::SystemWith<Odca, Space, double> odca(mechanism, options, plan);
    const Sweep<Space, double>& sweep = odca.solver().sweep();
    const std::size_t pieces = odca.solver().plan().pieces().size();
    EXPECT_EQ(pieces == 1, piece > 2000) << pieces;
    std::vector<double> y(odca->state_size()), all(y.size());
    odca->ToState(q, u, y);
    const Outcome outcome = odca->Examine(0.0, y, all);
    const long before = testing::CountAllocations();
    for (int round = 0; round < 3; ++round) {
      std::ranges::fill(all, 0.0);
      EXPECT_EQ(odca->Examine(0.0, y, all), outcome);
    }
    if (!mechanism.is_redundant()) {  // else SelfStress allocates
      EXPECT_EQ(testing::CountAllocations(), before);
    }
    if (options.solver == SolverKind::kRankRevealing) {
      EXPECT_EQ(outcome, Outcome::kFinished);
      EXPECT_EQ(sweep.regularized(), regularizes);
    }
    for (const Components<Space, double>& phi : sweep.multipliers()) {
      for (int i = 0; i < Space::kDim; ++i) all.push_back(phi[i]);
    }
    all.insert(all.end(), {sweep.rcond(), sweep.smallest_weight(), double(sweep.worst_joint()),
                           double(sweep.dependent_rows()), double(outcome)});
    return std::pair(all, sweep.operations());
  };
  for (const SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    for (const auto level : {Enforcement::kAcceleration, Enforcement::kVelocity}) {
      FormulationOptions options = {.enforcement = level, .solver = solver};
      const auto alone = found(options, 2000);
      EXPECT_TRUE(found(options, 1L << 40).first == alone.first);
      for (const int threads : {2, 3, 8}) {
        options.threads = threads;
        EXPECT_TRUE(found(options, 2000) == alone) << threads << " threads";
      }
    }
  }
}

TEST(SweepTest, HasTheSameBitsForAnyNumberOfThreads) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    ExpectTheSameBits<Spatial>(testing::RandomTree(60, SpaceKind::kSpatial, seed));
    ExpectTheSameBits<Spatial>(testing::RandomGraph(8, SpaceKind::kSpatial, seed));
    ExpectTheSameBits<Spatial>(testing::RedundantGraph(40, 12, SpaceKind::kSpatial, seed), true);
    ExpectTheSameBits<Planar>(testing::MixedGraph(20, SpaceKind::kPlanar, seed, 3));
    ExpectTheSameBits<Spatial>(testing::MixedGraph(8, SpaceKind::kSpatial, seed, 3));
  }
  ExpectTheSameBits<Planar>(Grid(8, 8, -1.0, 0.5));
  ExpectTheSameBits<Planar>(Ladder(60, 0.0, 0.5), true);
  MechanismDescription ladder = Ladder(30, -1.0, 0.5);
  ladder.space = SpaceKind::kSpatial;
  ExpectTheSameBits<Spatial>(ladder, true);
  ExpectTheSameBits<Spatial>(Release(ladder, FindRedundancy(ladder)));
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
    EXPECT_LE(error, 10.0L * n * kEps / sample.answer().rcond);
    testing::SystemWith<Odca, Planar, double> in_double(sample.mechanism(Coordinates::kJoint));
    VectorX<double> udot_double;
    in_double->Evaluate(0.0, state.q, state.u, udot_double);
    EXPECT_LE(testing::RelativeError(udot_double, udot), sample.Bound());
  }
}
#endif

}  // namespace loopbench::odca::sweep_test
