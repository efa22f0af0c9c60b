// A solver that the project does not know: two functions, and every level, coordinate set, Jacobian
// and power comes with them.
#include "mechanism/formulation/forward_jacobian.h"
#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

/// M x - J^T lambda = f, J x = c as one matrix, by LU with full pivoting.
template <class Space, class S>
class WholeMatrix final : public ConstraintSolver<Space, S> {
 public:
  WholeMatrix(const Mechanism<Space, S>& mechanism, const FormulationOptions&)
      : mechanism_(mechanism), dynamics_(mechanism), J_(mechanism.num_rows(), mechanism.num_u()) {}

  Outcome Factor(const Kinematics<Space, S>& kinematics) override {
    dynamics_.MassMatrix(kinematics, Masses::kPhysical, M_);
    dynamics_.Jacobian(kinematics, J_);
    const Eigen::Index n = M_.rows(), m = J_.rows();
    MatrixX<S> whole(n + m, n + m);
    whole << M_, -J_.transpose(), J_, MatrixX<S>::Zero(m, m);
    if (!whole.allFinite()) return Outcome::kNonFinite;
    lu_.compute(whole);
    this->conditioning_.rank = LoopRank(mechanism_, 0);
    return lu_.isInvertible() ? Outcome::kFinished : Outcome::kSingular;
  }

  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override {
    const Eigen::Index n = M_.rows(), m = J_.rows();
    VectorX<S> right = VectorX<S>::Zero(n + m);
    if (force.size() > 0) right.head(n) = force;
    right.tail(m) = target;
    const VectorX<S> both = lu_.solve(right);
    x = both.head(n);
    if (lambda != nullptr) *lambda = both.tail(m);
  }

 private:
  const Mechanism<Space, S>& mechanism_;
  TreeDynamics<Space, S> dynamics_;
  MatrixX<S> M_, J_;
  Eigen::FullPivLU<MatrixX<S>> lu_;
};

/// Multipliers of the project are the other side: the same mathematics, level by level.
std::vector<Case> LagrangeCases() {
  std::vector<Case> cases = CasesThat([](const Case& c) {
    return c.formulation == "lagrange" && c.solver == SolverKind::kAsPublished;
  });
  for (Case& c : cases) {
    if (c.enforcement == Enforcement::kBaumgarte) c.gains = BaumgarteGains{3.0, 4.0};
  }
  return cases;
}

double Distance(std::span<const double> a, std::span<const double> b) {
  double distance = 0.0, size = 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    distance = std::max(distance, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return distance / size;
}

class OutsideSolverTest : public ContractTest {};

/// Seed 8 has joints of every kind, seed 10 prescribed motions.
TEST_P(OutsideSolverTest, IsAFormulationWithEveryLevel) {
  for (std::uint64_t seed : {5, 8, 10}) {
    Run(Description(seed), seed, [&]<class Space>(Bench<Space> bench) {
      const auto outside = MakeSystem<WholeMatrix>(bench.mechanism, bench.formulation->options());
      ASSERT_EQ(outside->Start(0.0, bench.state.q, bench.state.u), Outcome::kFinished);
      std::vector<double> y = bench.y, ydot(y.size());
      for (std::size_t i = 0; i < y.size(); ++i) y[i] += 1e-4 * std::sin(2.0 * double(i + 1));
      bench.y = y;
      EXPECT_EQ(outside->BeginStep(0.0, y), bench.formulation->BeginStep(0.0, bench.y));
      // a projection leaves what rounding does, magnified as accelerations are
      const double bound = 1e3 * bench.Bound();
      EXPECT_LE(Distance(y, bench.y), bound);
      ASSERT_EQ(outside->Derivative(0.0, y, ydot), Outcome::kFinished);
      ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
      EXPECT_LE(Distance(ydot, bench.ydot), bound);
      EXPECT_EQ(outside->diagnostics().rank, bench.sample.answer().rank);
      const double power = bench.formulation->DrivePower();
      EXPECT_NEAR(outside->DrivePower(), power, bound * (1.0 + std::abs(power)));

      const Eigen::Index n = outside->state_size();
      Eigen::MatrixXd own(n, n), theirs(n, n);
      ForwardJacobian<Space>(bench.sample.description(), *outside).Evaluate(own);
      ForwardJacobian<Space>(bench.sample.description(), *bench.formulation).Evaluate(theirs);
      EXPECT_LE((own - theirs).norm(), bound * theirs.norm());
    });
  }
}

INSTANTIATE_TEST_SUITE_P(All, OutsideSolverTest, ::testing::ValuesIn(LagrangeCases()), NameOf);

}  // namespace
}  // namespace loopbench::testing
