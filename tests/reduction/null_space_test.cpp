// Accelerations by a basis of the free directions against the dense equations of multipliers.
#include "reduction/null_space.h"

#include "mechanism/algebra/decompositions.h"
#include "tests/contract/placed.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::reduction::null_space_test {

using testing::Random;
using testing::Shipped;
using testing::State;

VectorX<double> RandomVector(Eigen::Index size, std::uint64_t seed) {
  Random random(seed);
  return testing::RandomNumbers(random, size);
}

/// The matrices of a mechanism at one position, and its null space factored there.
template <class Space>
struct Scene {
  Scene(const MechanismDescription& description, const VectorX<double>& q)
      : mechanism(description, Coordinates::kJoint),
        kinematics(mechanism),
        dynamics(mechanism),
        J(mechanism.num_rows(), mechanism.num_u()),
        null_space(mechanism) {
    kinematics.UpdatePosition(q);
    kinematics.UpdateVelocity(VectorX<double>::Zero(mechanism.num_u()));
    dynamics.MassMatrix(kinematics, Masses::kPhysical, M);
    dynamics.Jacobian(kinematics, J);
    null_space.Factor(kinematics, dynamics, J);
  }
  Scene(const Scene&) = delete;

  const Mechanism<Space, double> mechanism;
  Kinematics<Space, double> kinematics;
  TreeDynamics<Space, double> dynamics;
  MatrixX<double> M, J;
  NullSpace<Space, double> null_space;
};

template <class Space>
VectorX<double> StartOf(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  return Assemble<Space>(description, mechanism).q;
}

/// Condition of what is solved: of M, and of the closures against it.
double Condition(const MatrixX<double>& M, const MatrixX<double>& J, int rank) {
  const Eigen::JacobiSVD<MatrixX<double>> m(M), j(J);
  return m.singularValues()[0] / m.singularValues().minCoeff() * j.singularValues()[0] /
         j.singularValues()[rank - 1];
}

template <class Space>
class NullSpaceTest : public ::testing::Test {
 protected:
  static constexpr SpaceKind kKind = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;

  template <class Check>
  void ForAll(Check check) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const MechanismDescription description = testing::TightGraph(24, 2, kKind, seed);
      SCOPED_TRACE(description.name);
      const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
      const State state = testing::ConsistentState(description, mechanism, seed);
      Scene<Space> scene(description, state.q);
      ASSERT_EQ(scene.null_space.rank(), scene.mechanism.num_rows());
      check(scene, seed);
    }
  }
};

using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(NullSpaceTest, Spaces);

TYPED_TEST(NullSpaceTest, SolvesTheEquationsOfMultipliers) {
  this->ForAll([](Scene<TypeParam>& scene, std::uint64_t seed) {
    const Eigen::Index n = scene.M.rows(), m = scene.J.rows();
    const VectorX<double> h = RandomVector(n, seed), gamma = RandomVector(m, seed + 100);
    MatrixX<double> all = MatrixX<double>::Zero(n + m, n + m);
    all.topLeftCorner(n, n) = scene.M;
    all.topRightCorner(n, m) = scene.J.transpose();
    all.bottomLeftCorner(m, n) = scene.J;
    VectorX<double> right(n + m);
    right << -h, gamma;
    const VectorX<double> expected = all.fullPivLu().solve(right).head(n);
    VectorX<double> udot(n);
    ASSERT_TRUE(scene.null_space.Accelerate(scene.M, h, gamma, udot));
    // both lose the condition of M and of the closures, n terms in every sum
    const double bound = 10 * kEps * static_cast<double>(n) *
                         Condition(scene.M, scene.J, static_cast<int>(m)) * expected.norm();
    EXPECT_LE((udot - expected).norm(), bound);
    EXPECT_EQ(scene.null_space.smallest_weight(), 1.0);
  });
}

TYPED_TEST(NullSpaceTest, MultipliersReproduceTheirForces) {
  this->ForAll([](Scene<TypeParam>& scene, std::uint64_t seed) {
    const Eigen::Index m = scene.J.rows();
    const VectorX<double> expected = RandomVector(m, seed);
    VectorX<double> lambda(m);
    scene.null_space.Multipliers(scene.J.transpose() * expected, lambda);
    const double bound = 10 * kEps * static_cast<double>(scene.M.rows()) *
                         Condition(scene.M, scene.J, static_cast<int>(m)) * expected.norm();
    EXPECT_LE((lambda - expected).norm(), bound);
  });
}

TEST(NullSpaceTest, RedundantConstraintsAreMetAndCostNothing) {
  const MechanismDescription description = Shipped("bennett");  // 5 constraints of rank 2
  Scene<Spatial> scene(description, StartOf<Spatial>(description));
  ASSERT_EQ(scene.null_space.rank(), 2);
  const VectorX<double> some = RandomVector(3, 3), gamma = scene.J * some;
  VectorX<double> udot(3);
  ASSERT_TRUE(scene.null_space.Accelerate(scene.M, VectorX<double>::Zero(3), gamma, udot));
  // the start closes to 1e-15 or so, which is what the three others may be off the two
  const double bound = 100 * kEps * Condition(scene.M, scene.J, 2);
  EXPECT_LE((scene.J * udot - gamma).norm(), bound);
  // the smallest in the metric M: M-orthogonal to what the constraints leave free
  const MatrixX<double> free =
      Eigen::FullPivLU<MatrixX<double>>(scene.J).setThreshold(1e-9).kernel();
  ASSERT_EQ(free.cols(), 1);
  EXPECT_LE(std::abs(free.col(0).dot(scene.M * udot)), bound * free.norm() * scene.M.norm());
}

TEST(NullSpaceTest, ASingularPositionLosesOneDirectionAndStaysFinite) {
  const MechanismDescription description = Shipped("parallelogram-singular-start");
  Scene<Planar> scene(description, StartOf<Planar>(description));
  EXPECT_EQ(scene.null_space.rank(), 1);
  EXPECT_LT(scene.null_space.smallest_weight(), 1e-6) << "the other one is given up";
  VectorX<double> udot(scene.M.rows());
  const VectorX<double> h = RandomVector(scene.M.rows(), 1);
  ASSERT_TRUE(scene.null_space.Accelerate(scene.M, h, VectorX<double>::Zero(2), udot));
  // no stiffness is left: accelerations are of the order of h over the least inertia
  const double least = Eigen::JacobiSVD<MatrixX<double>>(scene.M).singularValues().minCoeff();
  EXPECT_LE(udot.norm(), h.norm() / least);
}

TEST(NullSpaceTest, DirectionsFadeOutWithoutAJump) {
  const MechanismDescription description = Shipped("parallelogram-singular-start");
  const VectorX<double> flat = StartOf<Planar>(description);
  double before = 1.0;
  for (const double angle : {0.3, 0.03, 0.01, 0.003, 0.001, 0.0}) {
    VectorX<double> q = flat;
    q[0] += angle;  // a parallelogram: the coupler keeps its direction, the rocker follows
    q[1] -= angle;
    q[2] += angle;
    Scene<Planar> scene(description, q);
    const double weight = scene.null_space.smallest_weight();
    EXPECT_GE(weight, 0.0);
    EXPECT_LE(weight, before) << angle;
    before = weight;
  }
  EXPECT_LT(before, 1e-6);
}

}  // namespace loopbench::reduction::null_space_test
