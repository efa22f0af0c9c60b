// Reduction by sparse factors against dense multipliers, where each is taken, and what becomes of
// suspicious positions.
#include "reduction/sparse_partition.h"

#include "harness/config/experiment_reader.h"
#include "lagrange/lagrange.h"
#include "reduction/reduction.h"
#include "tests/contract/placed.h"
#include "tests/contract/system_with.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::reduction::sparse_partition_test {

using testing::ConsistentState;
using testing::LadderAt;
using testing::Random;
using testing::RandomNumbers;
using testing::State;

/// How many of the mechanisms given could be compared.
struct Tally {
  int solved = 0, suspicious = 0;
};

/// Random forces and targets; x and lambda of both agree within the contract's bound, sums along n
/// bodies magnified by the condition of what is inverted.
template <class Space>
void ExpectAlike(const MechanismDescription& description, Coordinates coordinates, Choice choice,
                 std::uint64_t seed, Tally& tally) {
  SCOPED_TRACE(description.name);
  const testing::Placed<Space> placed(description, coordinates, seed);
  const auto& mechanism = placed.mechanism;
  const auto& kinematics = placed.kinematics;
  const auto sparse = SparsePartition<Space>::Make(mechanism, choice, true);
  ASSERT_NE(sparse, nullptr);
  lagrange::DenseEquations<Space, double> dense(mechanism, SolverKind::kRankRevealing);
  Conditioning found;
  ASSERT_EQ(dense.Factor(kinematics, found), Outcome::kFinished);
  if (!sparse->AreIndependent(kinematics)) {
    ++tally.suspicious;
    EXPECT_LT(found.rcond, 0.1) << "what is uncertain is near that for both";
    return;
  }
  ASSERT_TRUE(sparse->Choose(kinematics));
  const double rcond = sparse->Factor(kinematics);
  if (choice == Choice::kKept) {
    EXPECT_FALSE(sparse->ChooseAgain(kinematics, 0.99)) << "nothing is better than the best";
  }
  EXPECT_EQ(static_cast<int>(sparse->independent().size()),
            mechanism.num_u() - mechanism.num_rows());
  ++tally.solved;
  Random random(seed);
  const VectorX<double> force = RandomNumbers(random, mechanism.num_u());
  const VectorX<double> target = RandomNumbers(random, mechanism.num_rows());
  const double bound = 100.0 * kEps * mechanism.num_bodies() / std::min(found.rcond, rcond);
  for (const VectorX<double>& f : {force, VectorX<double>()}) {
    VectorX<double> x_dense, lambda_dense, x, lambda;
    dense.Solve(f, target, x_dense, &lambda_dense);
    sparse->Solve(f, target, x);
    sparse->Multipliers(f, x, lambda);
    EXPECT_LE((x - x_dense).norm(), bound * std::max(1.0, x_dense.norm()));
    EXPECT_LE((lambda - lambda_dense).norm(), bound * std::max(1.0, lambda_dense.norm()));
  }
  MatrixX<double> J;
  TreeDynamics<Space, double>(mechanism).Jacobian(kinematics, J);
  VectorX<double> u = force;
  sparse->CompleteSpeeds(nullptr, u);
  EXPECT_LE((J * u).norm(), bound * J.norm() * u.norm());
  for (const int speed : sparse->independent()) EXPECT_EQ(u[speed], force[speed]);
  sparse->Dependent(target, u);
  EXPECT_LE((J * u - target).norm(), bound * J.norm() * u.norm());
  for (const int speed : sparse->independent()) EXPECT_EQ(u[speed], 0.0);
}

template <class Space>
class SparsePartitionTest : public ::testing::Test {};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(SparsePartitionTest, Spaces);

TYPED_TEST(SparsePartitionTest, SolvesWhatDenseMultipliersSolve) {
  const SpaceKind space = TypeParam::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;
  Tally tally;
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    // the cost of dense equations is the cube of their number, in absolute coordinates 6 per body
    const std::uint64_t seeds = coordinates == Coordinates::kAbsolute ? 5 : 8;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const int n = 2 + static_cast<int>(seed);
      const Choice choice = seed % 2 == 0 ? Choice::kKept : Choice::kFree;
      ExpectAlike<TypeParam>(testing::RandomChain(n + 6, space, seed), coordinates, choice, seed,
                             tally);
      ExpectAlike<TypeParam>(testing::RandomLadder(n, space, seed), coordinates, choice, seed,
                             tally);
      ExpectAlike<TypeParam>(testing::MixedGraph(n, space, seed, 2), coordinates, choice, seed,
                             tally);
      ExpectAlike<TypeParam>(testing::TightGraph(24, 2, space, seed), coordinates, choice, seed,
                             tally);
    }
  }
  std::printf("%d solved, %d uncertain\n", tally.solved, tally.suspicious);
  EXPECT_GT(tally.solved, 3 * tally.suspicious);
}

using InPlane = testing::SystemWith<Reduction, Planar, double>;

struct LadderRun {
  LadderRun(int windows, Enforcement level, Matrices matrices = Matrices::kSparse)
      : mechanism(Ladder(windows, 1.0, 0.0), Coordinates::kJoint),
        system(mechanism, {level, SolverKind::kRankRevealing}, matrices) {}
  Outcome Start(double angle) {
    system->Start(0.0, LadderAt(mechanism, angle), zero());
    return Evaluate(angle);
  }
  Outcome Evaluate(double angle) {
    VectorX<double> udot;
    return system->Evaluate(0.0, LadderAt(mechanism, angle), zero(), udot);
  }
  VectorX<double> zero() const { return VectorX<double>::Zero(mechanism.num_u()); }
  bool is_sparse() { return system.solver().is_sparse(); }

  const Mechanism<Planar, double> mechanism;
  InPlane system;
};

/// A bob on a rod: the one dependent speed has no other to be compared with.
TEST(SparsePartition, OneConstraintChangesItsDependentSpeed) {
  const Mechanism<Planar, double> mechanism(testing::Shipped("rod-pendulum"), Coordinates::kJoint);
  Kinematics<Planar, double> kinematics(mechanism);
  const auto at = [&](double angle) {
    VectorX<double> q(3);
    q << 0.0, std::cos(angle), std::sin(angle);
    kinematics.UpdatePosition(q);
  };
  const auto partition = SparsePartition<Planar>::Make(mechanism, Choice::kKept, true);
  ASSERT_NE(partition, nullptr);
  at(0.0);
  ASSERT_TRUE(partition->Choose(kinematics));
  EXPECT_EQ(partition->independent(), (std::vector<int>{0, 2})) << "x hangs on the rod";
  at(1.0);
  EXPECT_NEAR(partition->Factor(kinematics), 1.0 / std::tan(1.0), 10 * kEps);
  EXPECT_FALSE(partition->ChooseAgain(kinematics, 0.1));
  at(1.5);
  EXPECT_TRUE(partition->ChooseAgain(kinematics, 0.1));
  EXPECT_EQ(partition->independent(), (std::vector<int>{0, 1}));
  at(0.0);
  EXPECT_EQ(partition->Factor(kinematics), 0.0) << "nor is y there to follow from it";
}

/// Accelerations far from the start's positions, where speeds chosen there would not do.
TEST(Reduction, WhereNothingHangsOnTheChoiceItIsTheBestOfEachPosition) {
  for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kPosition}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const MechanismDescription chain = testing::RandomChain(8, SpaceKind::kPlanar, seed);
      const Mechanism<Planar, double> mechanism(chain, Coordinates::kJoint);
      const State start = ConsistentState(chain, mechanism, seed);
      InPlane system(mechanism, {level, SolverKind::kRankRevealing}, Matrices::kSparse);
      testing::SystemWith<lagrange::Lagrange, Planar, double> other(
          mechanism, FormulationOptions{level, SolverKind::kRankRevealing});
      system->Start(0.0, start.q, start.u);
      other->Start(0.0, start.q, start.u);
      for (int k = 0; k <= 40; ++k) {
        VectorX<double> q = start.q, udot, expected;
        for (Eigen::Index i = 0; i < q.size(); ++i) q[i] += 0.1 * k * std::sin(double(i + 1));
        ASSERT_EQ(system->Evaluate(0.0, q, start.u, udot), Outcome::kFinished);
        ASSERT_EQ(other->Evaluate(0.0, q, start.u, expected), Outcome::kFinished);
        if (!system.solver().is_sparse() || other->diagnostics().smallest_weight < 1.0) continue;
        const double rcond = std::min(system->diagnostics().rcond, other->diagnostics().rcond);
        EXPECT_LE((udot - expected).norm(),
                  100.0 * kEps * mechanism.num_bodies() / rcond * expected.norm())
            << chain.name << " at " << k;
      }
    }
  }
}

TEST(Reduction, LeavesSuspiciousPositionsToDenseMatrices) {
  LadderRun run(3, Enforcement::kAcceleration);
  ASSERT_EQ(run.Start(1.0), Outcome::kFinished);
  EXPECT_TRUE(run.is_sparse());
  for (const double angle : {1e-5, 0.0}) {
    EXPECT_EQ(run.Evaluate(angle), Outcome::kFinished);
    EXPECT_FALSE(run.is_sparse());
    EXPECT_LT(run.system->diagnostics().smallest_weight, 0.5);
  }
  EXPECT_EQ(run.Evaluate(1.0), Outcome::kFinished);
  EXPECT_TRUE(run.is_sparse());
}

TEST(Reduction, StartsInASingularPositionAndGoesOnSparsely) {
  LadderRun run(3, Enforcement::kAcceleration);
  ASSERT_EQ(run.Start(0.0), Outcome::kFinished);
  EXPECT_FALSE(run.is_sparse());
  ASSERT_EQ(run.Evaluate(1.0), Outcome::kFinished);
  EXPECT_TRUE(run.is_sparse());
  LadderRun at_velocity(3, Enforcement::kVelocity);
  at_velocity.Start(0.0);
  EXPECT_EQ(at_velocity.Evaluate(1.0), Outcome::kFinished);
  EXPECT_FALSE(at_velocity.is_sparse()) << "the speeds that the state carries are the start's";
  ASSERT_EQ(at_velocity.Start(1.0), Outcome::kFinished);
  EXPECT_TRUE(at_velocity.is_sparse()) << "and another start has its own";
}

TEST(Reduction, IsSingularWhereDenseMatricesWouldBeTooLarge) {
  LadderRun run(2000, Enforcement::kAcceleration, Matrices::kLessWork);
  ASSERT_EQ(run.Start(1.0), Outcome::kFinished);
  EXPECT_TRUE(run.is_sparse());
  EXPECT_EQ(run.Evaluate(0.0), Outcome::kSingular);
  EXPECT_NE(run.system.solver().WhySingular().find("rank is uncertain at joint \""),
            std::string::npos);
  EXPECT_EQ(run.Evaluate(std::numeric_limits<double>::quiet_NaN()), Outcome::kNonFinite);
  EXPECT_EQ(run.Evaluate(1.0), Outcome::kFinished);
}

/// Pivots below a tenth of each other say little of loops that hang together: where these are
/// clearly independent, sparse factors cost less than the null space.
TEST(Reduction, LeavesSuspiciousPartitionsToSparseFactors) {
  const MechanismDescription graph = testing::TightGraph(24, 8, SpaceKind::kPlanar, 1);
  const testing::Placed<Planar> placed(graph, Coordinates::kJoint, 1);
  const auto& [mechanism, kinematics, state] = placed;
  const FormulationOptions options{Enforcement::kAcceleration, SolverKind::kRankRevealing};
  testing::SystemWith<DenseReduction, Planar, double> dense(mechanism, options);
  InPlane system(mechanism, options);
  VectorX<double> udot, expected;
  dense->Start(0.0, state.q, state.u);
  system->Start(0.0, state.q, state.u);
  ASSERT_EQ(dense->Evaluate(0.0, state.q, state.u, expected), Outcome::kFinished);
  ASSERT_EQ(system->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
  EXPECT_TRUE(system.solver().is_sparse());
  EXPECT_EQ(system->diagnostics().smallest_weight, 1.0);
  EXPECT_LE((udot - expected).norm(),
            100.0 * kEps * mechanism.num_bodies() /
                std::min(system->diagnostics().rcond, dense->diagnostics().rcond) *
                expected.norm());
}

/// Sparse factors have no speeds that stay but those which a state carries.
TEST(Reduction, ChangesLeastInTheMetricOfMassesWhereItIsSparse) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const testing::Placed<Planar> placed(testing::RandomLadder(4, SpaceKind::kPlanar, seed),
                                         Coordinates::kJoint, seed);
    const auto& mechanism = placed.mechanism;
    lagrange::DenseEquations<Planar, double> multipliers(mechanism, SolverKind::kRankRevealing);
    Conditioning found;
    ASSERT_EQ(multipliers.Factor(placed.kinematics, found), Outcome::kFinished);
    Random random(seed);
    const VectorX<double> target = RandomNumbers(random, mechanism.num_rows());
    VectorX<double> least, x(mechanism.num_u());
    multipliers.Solve(VectorX<double>(), target, least, nullptr);
    for (const Enforcement level : {Enforcement::kPosition, Enforcement::kVelocity}) {
      Reduction<Planar, double> reduction(mechanism, {level, SolverKind::kRankRevealing},
                                          Matrices::kSparse);
      reduction.Start(placed.kinematics);
      ASSERT_EQ(reduction.Factor(placed.kinematics), Outcome::kFinished);
      if (!reduction.is_sparse()) continue;  // not clearly independent
      ++compared;
      reduction.Correct(target, x);
      const double bound = 100.0 * kEps * mechanism.num_bodies() /
                           std::min(found.rcond, reduction.conditioning().rcond) * least.norm();
      if (level == Enforcement::kPosition) {
        EXPECT_LE((x - least).norm(), bound);
      } else {
        EXPECT_GT((x - least).norm(), bound) << "what the state carries stays";
        for (const int speed : *reduction.CarriedSpeeds()) EXPECT_EQ(x[speed], 0.0);
      }
    }
  }
  EXPECT_GT(compared, 10);
}

/// Trial steps of an explicit integrator on a stiff spring end anywhere, and are taken back by
/// their error if there is one.
TEST(Reduction, HasAccelerationsFarFromTheConstraints) {
  const MechanismDescription rod =
      harness::ReadExperiments(std::string(LOOPBENCH_SOURCE_DIR) +
                               "/configs/experiments/extremes/stiff-rod.json")
          .back()
          .problems.front()
          .mechanism.description;
  const Mechanism<Planar, double> mechanism(rod, Coordinates::kJoint);
  const State start = ConsistentState(rod, mechanism, 1);
  InPlane system(mechanism, {Enforcement::kAcceleration, SolverKind::kRankRevealing});
  ASSERT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  Random random(1);
  int sparse = 0;
  for (double far = 1.0; far < 1e15; far *= 2.0) {
    const VectorX<double> q = start.q + far * RandomNumbers(random, start.q.size());
    VectorX<double> udot;
    ASSERT_EQ(system->Evaluate(0.0, q, start.u, udot), Outcome::kFinished) << far;
    EXPECT_TRUE(udot.allFinite()) << far;
    sparse += system.solver().is_sparse();
  }
  EXPECT_GT(sparse, 0);
}

TEST(Reduction, TakesWhatIsLessWork) {
  for (const Enforcement level : {Enforcement::kVelocity, Enforcement::kAcceleration}) {
    int windows = 1;
    for (bool is_sparse = false; !is_sparse && windows < 100; windows += !is_sparse) {
      LadderRun run(windows, level, Matrices::kLessWork);
      ASSERT_EQ(run.Start(1.0), Outcome::kFinished);
      is_sparse = run.is_sparse();
    }
    std::printf("sparse from %d windows on at level %s\n", windows,
                std::string(ToString(level)).c_str());
    EXPECT_GT(windows, 3);
    EXPECT_LT(windows, 40);
  }
}

/// One independent speed for all windows, and accelerations of the one degree of freedom: those of
/// a parallelogram of the same bars, whose cranks all turn alike.
TEST(Reduction, IsRightForTenThousandWindows) {
  LadderRun run(10000, Enforcement::kVelocity, Matrices::kLessWork);
  ASSERT_EQ(run.Start(1.0), Outcome::kFinished);
  EXPECT_TRUE(run.is_sparse());
  EXPECT_EQ(run.system.solver().CarriedSpeeds()->size(), 1u);
  VectorX<double> udot;
  run.system->Evaluate(0.0, LadderAt(run.mechanism, 1.0), run.zero(), udot);
  double least = 1e300, most = -1e300;
  for (const TreeStep& step : run.mechanism.tree()) {
    if (step.parent != kGround) continue;
    const double crank = udot[run.mechanism.joints()[step.joint].u_offset];
    least = std::min(least, crank);
    most = std::max(most, crank);
  }
  // a chain of 10^4 windows, each of which passes on the round-off of the one before
  EXPECT_LE(most - least, 10.0 * kEps * 10000 * std::abs(most));
  EXPECT_GT(std::abs(most), 1.0);
}

}  // namespace loopbench::reduction::sparse_partition_test
