// M, h, J and gamma of the spanning forest against the oracle's.
#include "mechanism/loops/tree_dynamics.h"

#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "tests/contract/generators.h"
#include "tests/standard.h"

namespace loopbench::tree_dynamics_test {

using testing::Equations;
using testing::Oracle;
using testing::State;
using testing::ToReal;

template <class Space>
class TreeDynamicsTest : public ::testing::Test {
 protected:
  static constexpr SpaceKind kKind = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;

  /// Calls check(mechanism, kinematics, dynamics, the oracle's equations, state).
  template <class Check>
  void ForAll(Check check) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      for (const MechanismDescription& d :
           {testing::RandomTree(12, kKind, seed), testing::TightGraph(24, 2, kKind, seed)}) {
        SCOPED_TRACE(d.name);
        const Mechanism<Space, double> mechanism(d, Coordinates::kJoint);
        const State state = testing::ConsistentState(d, mechanism, seed);
        Kinematics<Space, double> kinematics(mechanism);
        kinematics.UpdatePosition(state.q);
        kinematics.UpdateVelocity(state.u);
        TreeDynamics<Space, double> dynamics(mechanism);
        Oracle oracle(d, testing::LayoutOf(mechanism));
        check(mechanism, kinematics, dynamics, oracle.Form(ToReal(state.q), ToReal(state.u)),
              state);
      }
    }
  }
};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(TreeDynamicsTest, Spaces);

TYPED_TEST(TreeDynamicsTest, MassMatrixIsTheOraclesSymmetricAndPositiveDefinite) {
  this->ForAll([](const auto& mechanism, const auto& kinematics, auto& dynamics,
                  const Equations& expected, const State&) {
    MatrixX<double> M;
    dynamics.MassMatrix(kinematics, Masses::kPhysical, M);
    EXPECT_EQ(M, M.transpose());
    EXPECT_EQ(Eigen::LLT<MatrixX<double>>(M).info(), Eigen::Success);
    // entries are sums over at most n bodies of terms no larger than the largest entry
    const double scale = M.cwiseAbs().maxCoeff();
    EXPECT_LE((M - expected.M.cast<double>()).cwiseAbs().maxCoeff(),
              16 * kEps * mechanism.num_bodies() * scale);
  });
}

TYPED_TEST(TreeDynamicsTest, BiasIsTheOracles) {
  this->ForAll([](const auto& mechanism, const auto& kinematics, auto& dynamics,
                  const Equations& expected, const State&) {
    VectorX<double> h;
    dynamics.Bias(kinematics, h);
    const double scale = 1.0 + h.cwiseAbs().maxCoeff();
    EXPECT_LE((h - expected.h.cast<double>()).cwiseAbs().maxCoeff(),
              64 * kEps * mechanism.num_bodies() * scale);
  });
}

TYPED_TEST(TreeDynamicsTest, ConstraintsDemandWhatTheOraclesDo) {
  this->ForAll([](const auto& mechanism, const auto& kinematics, auto& dynamics,
                  const Equations& expected, const State&) {
    if (mechanism.num_rows() == 0) return;
    MatrixX<double> J;
    VectorX<double> h, gamma;
    dynamics.Jacobian(kinematics, J);
    dynamics.Bias(kinematics, h);
    dynamics.JacobianBias(kinematics, gamma);
    // rows may be combined differently: what is compared is the set of admissible udot
    const Eigen::CompleteOrthogonalDecomposition<MatrixX<double>> least(J);
    const testing::RealVector particular = ToReal(VectorX<double>(least.solve(gamma)));
    const testing::RealVector rest = expected.J * particular - expected.gamma;
    const testing::Real scale = 1 + particular.cwiseAbs().maxCoeff();
    const testing::RealVector lambda = testing::SymmetricEigenvalues(ToReal(J * J.transpose()));
    const testing::Real condition = lambda[lambda.size() - 1] / lambda[0];
    EXPECT_LE(rest.cwiseAbs().maxCoeff(), 16 * kEps * mechanism.num_bodies() * condition * scale);
  });
}

TYPED_TEST(TreeDynamicsTest, JacobianIsTheDerivativeOfTheMismatch) {
  this->ForAll([](const auto& mechanism, const auto& kinematics, auto& dynamics, const Equations&,
                  const State& state) {
    MatrixX<double> J;
    dynamics.Jacobian(kinematics, J);
    const double h = 1e-5;  // truncation h^2, round-off eps / h: both about 1e-10
    const auto mismatch = [&](const VectorX<double>& u, double t) {
      VectorX<double> qdot(mechanism.num_q());
      mechanism.Rates(state.q, u, qdot);
      Kinematics<TypeParam, double> moved(mechanism);
      moved.UpdatePosition(state.q + t * qdot);
      VectorX<double> e(mechanism.num_rows());
      for (int index : mechanism.constraints()) {
        const auto& joint = mechanism.joints()[index];
        const int rows = joint.kind->num_constraints();
        e.segment(joint.row, rows) =
            moved.joints()[index].Along(moved.ConstraintMismatch(index), rows).head(rows);
      }
      return e;
    };
    for (int i = 0; i < mechanism.num_u(); ++i) {
      const VectorX<double> unit = VectorX<double>::Unit(mechanism.num_u(), i);
      const VectorX<double> column = (mismatch(unit, h) - mismatch(unit, -h)) / (2 * h);
      const double scale = 1.0 + J.col(i).norm();
      EXPECT_LE((J.col(i) - column).norm(), 1e-8 * mechanism.num_bodies() * scale);
    }
  });
}

}  // namespace loopbench::tree_dynamics_test
