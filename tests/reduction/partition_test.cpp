// Which speeds follow from which constraints: against all other choices, and against known ranks.
#include "reduction/partition.h"

#include "mechanism/algebra/decompositions.h"
#include "mechanism/description/transforms.h"
#include "reduction/dense_reduction.h"
#include "tests/contract/generators.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::reduction::partition_test {

using testing::Random;
using testing::Shipped;

MatrixX<double> RandomMatrix(int rows, int columns, std::uint64_t seed) {
  Random random(seed);
  MatrixX<double> A(rows, columns);
  for (double& a : A.reshaped()) a = random.Uniform(-1.0, 1.0);
  return A;
}

double LeastSingularValue(const MatrixX<double>& A) {
  return Eigen::JacobiSVD<MatrixX<double>>(A).singularValues().minCoeff();
}

MatrixX<double> Restricted(const MatrixX<double>& J, const Partition<double>& partition) {
  return J(partition.rows, partition.dependent);
}

/// Every set of `size` of `count` indices.
std::vector<std::vector<int>> Subsets(int count, int size) {
  std::vector<std::vector<int>> all;
  for (unsigned bits = 0; bits < (1u << count); ++bits) {
    if (std::popcount(bits) != size) continue;
    std::vector<int> one;
    for (int i = 0; i < count; ++i) {
      if ((bits >> i & 1u) != 0) one.push_back(i);
    }
    all.push_back(one);
  }
  return all;
}

TEST(PartitionTest, DependentSpeedsAreWithinTheBoundOfPivotingOfTheBestOnes) {
  constexpr int kRank = 3, kSpeeds = 7;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const MatrixX<double> J = RandomMatrix(kRank, kSpeeds, seed);
    const Partition<double> chosen = BestPartition(J, kRank);
    ASSERT_EQ(chosen.dependent.size(), 3u);
    EXPECT_EQ(chosen.rows, (std::vector<int>{0, 1, 2}));
    EXPECT_TRUE(std::ranges::is_sorted(chosen.dependent));
    double best = 0.0;
    for (const std::vector<int>& columns : Subsets(kSpeeds, kRank)) {
      best = std::max(best, LeastSingularValue(J(Eigen::all, columns)));
    }
    // Golub and Van Loan, section 5.4: pivoting loses at most sqrt(n - r) 2^r
    EXPECT_GE(LeastSingularValue(Restricted(J, chosen)), best / (std::sqrt(4.0) * 8.0)) << seed;
  }
}

TEST(PartitionTest, RowsThatRepeatOthersAreLeftOut) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MatrixX<double> J(4, 6);
    J.topRows(2) = RandomMatrix(2, 6, seed);
    J.row(2) = J.row(0) + J.row(1);
    J.row(3) = 1e-3 * J.row(0);
    const Partition<double> chosen = BestPartition(J, 2);
    ASSERT_EQ(chosen.rows.size(), 2u);
    const double kept = LeastSingularValue(Restricted(J, chosen));
    EXPECT_GT(kept, 1e-2 * J.norm()) << "not the small row beside its likeness";
    // ratios of pivots bound those of singular values within r 2^r and so (r = 2)
    EXPECT_GT(chosen.rcond, 1e-2);
    EXPECT_LE(PartitionCondition(J, chosen), 1.0);
  }
}

TEST(PartitionTest, RoundOffDoesNotChooseBetweenEqualSpeeds) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MatrixX<double> J(3, 6);
    J.leftCols(3) = J.rightCols(3) = RandomMatrix(3, 3, seed);
    const MatrixX<double> off = 1e-15 * RandomMatrix(3, 6, 100 + seed);
    for (const double sign : {-1.0, 1.0}) {
      const Partition<double> chosen = BestPartition<double>(J + sign * off, 3);
      EXPECT_EQ(chosen.dependent, (std::vector<int>{0, 1, 2})) << seed;
    }
  }
}

TEST(PartitionTest, ConditionTellsALostPartition) {
  MatrixX<double> J(2, 4);
  J << 1.0, 0.0, 1.0, 2.0,  //
      0.0, 1.0, 1.0, 2.0;
  EXPECT_DOUBLE_EQ(PartitionCondition(J, {{0, 1}, {0, 1}, 1.0}), 1.0);
  EXPECT_NEAR(PartitionCondition(J, {{2, 3}, {0, 1}, 1.0}), 0.0, 1e-15);  // parallel columns
  const MatrixX<double> one = J.topRows(1);
  EXPECT_DOUBLE_EQ(PartitionCondition(one, {{0}, {0}, 1.0}), 0.5);  // 1 of at most 2
}

TEST(PartitionTest, NothingIsDependentAtRankZero) {
  const Partition<double> none = BestPartition(MatrixX<double>(RandomMatrix(2, 3, 1)), 0);
  EXPECT_TRUE(none.dependent.empty());
  EXPECT_TRUE(none.rows.empty());
  EXPECT_EQ(none.rcond, 1.0);
}

template <class Space>
int RankOf(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  Kinematics<Space, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  TreeDynamics<Space, double> dynamics(mechanism);
  MatrixX<double> J(mechanism.num_rows(), mechanism.num_u());
  dynamics.Jacobian(kinematics, J);
  return GeometricRank(kinematics, dynamics, J);
}

TEST(PartitionTest, RankIsThatOfTheLiterature) {
  EXPECT_EQ(RankOf<Planar>(Shipped("four-bar")), 2);
  EXPECT_EQ(RankOf<Planar>(Shipped("parallelogram-singular-start")), 1);
  EXPECT_EQ(RankOf<Planar>(Shipped("seven-bar")), 4);
  EXPECT_EQ(RankOf<Planar>(Shipped("pendulum")), 0);
  EXPECT_EQ(RankOf<Spatial>(Shipped("bennett")), 2) << "of five constraints";
  EXPECT_EQ(RankOf<Spatial>(Shipped("stewart-platform")), 15);
}

TEST(PartitionTest, RankDoesNotAskForMasses) {
  for (const double mass : {1e-9, 1.0, 1e9}) {
    MechanismDescription description = Shipped("four-bar");
    description.bodies[1].mass = mass;
    description.bodies[1].inertia *= mass;
    EXPECT_EQ(RankOf<Planar>(description), 2) << mass;
  }
}

/// Pivots of rotations [m] and of translations [1] have one unit in the ratio of pivots. Otherwise
/// short links make a partition suspicious: these squeezers have links of 0.7 to 6 cm and of 7
/// to 60.
TEST(PartitionTest, ServesShortLinks) {
  for (const double scale : {1.0, 10.0}) {
    const MechanismDescription description = AtScale(Shipped("andrews-squeezer"), scale);
    const Mechanism<Planar, double> mechanism(description, Coordinates::kAbsolute);
    Kinematics<Planar, double> kinematics(mechanism);
    kinematics.UpdatePosition(Assemble<Planar>(description, mechanism).q);
    DenseReduction<Planar, double> reduction(mechanism, {.enforcement = Enforcement::kAcceleration,
                                                         .solver = SolverKind::kRankRevealing});
    reduction.Start(kinematics);
    EXPECT_TRUE(reduction.FactorPartition(kinematics)) << scale;
  }
}

}  // namespace loopbench::reduction::partition_test
