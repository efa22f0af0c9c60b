// Where rank is decided: regular closures are plainly inverted, redundant ones keep their rank, and
// neither masses nor units have a say.
#include "mechanism/loops/loop_solver.h"

#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "tests/contract/comparison.h"

namespace loopbench::loop_solver_test {

using testing::Random;

const std::vector<int> kRows = {2, 3};

MatrixX<double> RandomMatrix(int rows, int columns, std::uint64_t seed) {
  Random random(seed);
  MatrixX<double> A(rows, columns);
  for (double& a : A.reshaped()) a = random.Uniform(-1.0, 1.0);
  return A;
}

/// X^+ = T^T T as the solver applies it.
MatrixX<double> Inverse(LoopSolver<double>& solver) {
  MatrixX<double> T = MatrixX<double>::Identity(solver.size(), solver.size());
  solver.Apply(T);
  return T.transpose() * T;
}

/// Free responses that dominate X, as those of a joint's own bodies do.
void SetScales(LoopSolver<double>& solver, const MatrixX<double>& X) {
  solver.SetScale(0, 2.0 * X.topLeftCorner<2, 2>() + 0.1 * Eigen::Matrix2d::Identity());
  solver.SetScale(1, 2.0 * X.bottomRightCorner<3, 3>() + 0.1 * Eigen::Matrix3d::Identity());
}

TEST(LoopSolverTest, AtFullRankEveryFormIsTheInverse) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const MatrixX<double> A = RandomMatrix(5, 8, seed);
    const MatrixX<double> X = A * A.transpose(), inverse = X.inverse();
    // inverting loses cond(X) eps of its largest entry
    const double bound = 100 * kEps * X.norm() * inverse.norm() * inverse.norm();
    LoopSolver<double> solver(kRows);
    SetScales(solver, X);
    ASSERT_TRUE(solver.FactorPlain(X, X.diagonal().maxCoeff(), 1e-14));
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound);
    ASSERT_TRUE(solver.FactorScaled(X));
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound);
    solver.FactorGeometric(X);
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound);
    EXPECT_EQ(solver.rank(), 5);
    EXPECT_EQ(solver.smallest_weight(), 1.0);
    ASSERT_TRUE(solver.FactorRegularized(X));
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound);
  }
}

/// On both sides of where Eigen's blocks take over (lower_triangle.h), with joints of all sizes.
TEST(LoopSolverTest, EverySizeIsInverted) {
  for (const int size : {1, 2, 3, 5, 6, 15, 16, 17, 21, 40}) {
    std::vector<int> rows;
    for (int left = size; left > 0; left -= rows.back()) {
      rows.push_back(std::min<int>(left, 1 + static_cast<int>(rows.size()) % 6));
    }
    const MatrixX<double> A = RandomMatrix(size, 2 * size, static_cast<std::uint64_t>(size));
    const MatrixX<double> X = A * A.transpose(), inverse = X.inverse();
    LoopSolver<double> solver(rows);
    int first = 0;
    for (std::size_t j = 0; j < rows.size(); ++j) {
      solver.SetScale(static_cast<int>(j), 2.0 * X.block(first, first, rows[j], rows[j]));
      first += rows[j];
    }
    ASSERT_TRUE(solver.FactorScaled(X)) << size;
    // inverting loses cond(X) eps of its largest entry
    const double bound = 100 * kEps * X.norm() * inverse.norm() * inverse.norm();
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound) << size;
    MatrixX<double> T = MatrixX<double>::Identity(size, size);
    solver.Apply(T);
    VectorX<double> v = VectorX<double>::LinSpaced(size, -1.0, 2.0);
    const VectorX<double> expected = T.transpose() * v;
    solver.ApplyTransposed(v);
    EXPECT_LE((v - expected).norm(), 100 * kEps * T.norm() * size) << size;
    ASSERT_TRUE(solver.FactorPlain(X, X.diagonal().maxCoeff(), 1e-14));
    EXPECT_LE((Inverse(solver) - inverse).norm(), bound) << size;
  }
}

TEST(LoopSolverTest, ApplyTransposedIsTheTransposeOfApply) {
  const MatrixX<double> A = RandomMatrix(5, 8, 1), X = A * A.transpose();
  LoopSolver<double> solver(kRows);
  SetScales(solver, X);
  const auto check = [&] {
    MatrixX<double> T = MatrixX<double>::Identity(5, 5);
    solver.Apply(T);
    VectorX<double> v = VectorX<double>::LinSpaced(5, -1.0, 2.0);
    const VectorX<double> expected = T.transpose() * v;
    solver.ApplyTransposed(v);
    EXPECT_LE((v - expected).norm(), 100 * kEps * T.norm() * 5);
  };
  ASSERT_TRUE(solver.FactorPlain(X, X.diagonal().maxCoeff(), 1e-14));
  check();
  ASSERT_TRUE(solver.FactorScaled(X));
  check();
  solver.FactorGeometric(X);
  check();
  ASSERT_TRUE(solver.FactorRegularized(X));
  check();
}

TEST(LoopSolverTest, ExactRedundancyLowersTheRankAndSolvesWhatIsConsistent) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const MatrixX<double> C = RandomMatrix(5, 3, seed), M = RandomMatrix(3, 6, seed + 100);
    const MatrixX<double> X_geometric = C * C.transpose();
    const MatrixX<double> X = C * (M * M.transpose()) * C.transpose();
    LoopSolver<double> solver(kRows);
    SetScales(solver, X_geometric);
    EXPECT_FALSE(solver.FactorScaled(X_geometric));
    solver.FactorGeometric(X_geometric);
    EXPECT_EQ(solver.rank(), 3);
    EXPECT_LT(solver.smallest_weight(), 1e-10);
    ASSERT_TRUE(solver.FactorRegularized(X));
    const VectorX<double> rhs = X * RandomMatrix(5, 1, seed + 200);
    const VectorX<double> x = Inverse(solver) * rhs;
    // the regular part of X has a condition of up to 1e5 in these draws
    EXPECT_LE((X * x - rhs).norm(), 1e5 * 100 * kEps * rhs.norm());
  }
}

TEST(LoopSolverTest, RegularizationRefusesWhatRoundingMadeIndefinite) {
  const MatrixX<double> A = RandomMatrix(5, 8, 1), X = A * A.transpose();
  LoopSolver<double> solver(kRows);
  SetScales(solver, X);
  solver.FactorGeometric(X);
  // one heavy direction, its response given to 16 digits, and nothing left for the others
  const VectorX<double> a = RandomMatrix(5, 1, 2);
  MatrixX<double> lost = a * a.transpose();
  lost.diagonal() *= 1.0 - 4 * kEps;
  EXPECT_FALSE(solver.FactorRegularized(lost));
}

TEST(LoopSolverTest, PlainFactorisationRefusesALostPivot) {
  const MatrixX<double> C = RandomMatrix(5, 4, 1);
  LoopSolver<double> solver(kRows);
  EXPECT_FALSE(solver.FactorPlain(C * C.transpose(), 1.0, 100 * kEps));
}

/// A four-bar without symmetry, of the given length, its coupler `ratio` times heavier.
MechanismDescription FourBar(double length, double ratio) {
  MechanismDescription d = testing::RandomChain(3, SpaceKind::kPlanar, 1);
  d.forces.clear();
  for (std::size_t b = 1; b < d.bodies.size(); ++b) {
    const double factor = b == 2 ? ratio : 1.0;
    d.bodies[b].com *= length;
    d.bodies[b].mass *= factor;
    d.bodies[b].inertia *= factor * length * length;
  }
  for (JointDescription& joint : d.joints) {
    joint.from.position *= length;
    joint.to.position *= length;
  }
  return d;
}

template <class Space>
void ExpectRankAndAccelerations(const MechanismDescription& d, int rank, double factor = 1.0) {
  const testing::Sample<Space> sample(d, 1);
  EXPECT_EQ(sample.answer().rank, rank);
  for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const testing::State& state = sample.state(coordinates);
    const Mechanism<Space, double>& mechanism = sample.mechanism(coordinates);
    const auto odca = MakeSystem<odca::Odca>(mechanism);
    const auto lagrange = MakeSystem<lagrange::Lagrange>(mechanism);
    for (System<Space, double>* formulation : {odca.get(), lagrange.get()}) {
      VectorX<double> udot;
      ASSERT_EQ(formulation->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
      // rank in the joint set: that of the loop
      EXPECT_EQ(formulation->diagnostics().rank, rank);
      EXPECT_LE(testing::RelativeError(udot, sample.udot(coordinates)), factor * sample.Bound());
    }
  }
}

TEST(LoopSolverTest, AHeavyCouplerChangesNeitherRankNorSolution) {
  for (double ratio : {1.0, 1e3, 1e9}) {
    SCOPED_TRACE(ratio);
    ExpectRankAndAccelerations<Planar>(FourBar(1.0, ratio), 2);
    ExpectRankAndAccelerations<Spatial>(FourBar(1.0, ratio), 2);
  }
}

TEST(LoopSolverTest, ALightCouplerKeepsTheRankAndLosesItsMassRatioInDigits) {
  for (double ratio : {1e-3, 1e-9}) {
    SCOPED_TRACE(ratio);
    // The round-off of its neighbours' forces meets a body that answers 1 / ratio times as much.
    ExpectRankAndAccelerations<Planar>(FourBar(1.0, ratio), 2, 1 / ratio);
    ExpectRankAndAccelerations<Spatial>(FourBar(1.0, ratio), 2, 1 / ratio);
  }
}

TEST(LoopSolverTest, UnitsChangeNeitherRankNorSolution) {
  for (double length : {1e-6, 1e-3, 1e3, 1e6}) {
    SCOPED_TRACE(length);
    ExpectRankAndAccelerations<Planar>(FourBar(length, 1.0), 2);
    ExpectRankAndAccelerations<Spatial>(FourBar(length, 1.0), 2);
  }
}

}  // namespace loopbench::loop_solver_test
