// The contract as a function: kept by every built-in formulation, and broken promises are found.
#include "tests/contract/check.h"

#include "harness/config/formulations.h"
#include "mechanism/loops/tree_dynamics.h"
#include "tests/standard.h"

namespace loopbench::contract {
namespace {

/// Planted faults of a solver.
enum class Flaw { kNone, kNoSpeeds, kMemory, kForces, kRank, kNotFinite };

/// The dense equations by LU, with a flaw.
template <class Space>
class Planted final : public ConstraintSolver<Space, double> {
 public:
  Planted(const Mechanism<Space, double>& mechanism, Flaw flaw)
      : mechanism_(mechanism),
        flaw_(flaw),
        dynamics_(mechanism),
        M_(mechanism.num_u(), mechanism.num_u()),
        J_(mechanism.num_rows(), mechanism.num_u()) {}

  Outcome Factor(const Kinematics<Space, double>& kinematics) override {
    dynamics_.MassMatrix(kinematics, Masses::kPhysical, M_);
    dynamics_.Jacobian(kinematics, J_);
    const Eigen::Index n = M_.rows(), m = J_.rows();
    MatrixX<double> all(n + m, n + m);
    all << M_, -J_.transpose(), J_, MatrixX<double>::Zero(m, m);
    this->conditioning_.rank = LoopRank(mechanism_, flaw_ == Flaw::kRank ? 1 : 0);
    lu_.compute(all);
    return all.allFinite() || flaw_ == Flaw::kNotFinite ? Outcome::kFinished : Outcome::kNonFinite;
  }
  void Solve(const VectorX<double>& force, const VectorX<double>& target, VectorX<double>& x,
             VectorX<double>* lambda) override {
    const Eigen::Index n = M_.rows(), m = J_.rows();
    VectorX<double> right = VectorX<double>::Zero(n + m);
    if (force.size() > 0) right.head(n) = force;
    if (force.size() > 0 || flaw_ != Flaw::kNoSpeeds) right.tail(m) = target;
    const VectorX<double> both = lu_.solve(right);
    x = both.head(n);
    if (flaw_ == Flaw::kMemory) x *= 1.0 + 1e-15 * ++calls_;
    if (flaw_ == Flaw::kNotFinite && !x.allFinite()) x.setZero();
    if (lambda != nullptr) *lambda = both.tail(m) * (flaw_ == Flaw::kForces ? -1.0 : 1.0);
  }

 private:
  const Mechanism<Space, double>& mechanism_;
  Flaw flaw_;
  TreeDynamics<Space, double> dynamics_;
  MatrixX<double> M_, J_;
  Eigen::PartialPivLU<MatrixX<double>> lu_;
  int calls_ = 0;
};

/// The promises that a formulation with this flaw and these levels breaks; no levels: all.
std::vector<std::string> Broken(const std::string& name, Flaw flaw,
                                const std::vector<Enforcement>& levels = {}) {
  const auto make = [flaw]<class Space>(const Mechanism<Space, double>& mechanism,
                                        const FormulationOptions&) {
    return std::unique_ptr<ConstraintSolver<Space, double>>(
        std::make_unique<Planted<Space>>(mechanism, flaw));
  };
  harness::RegisterFormulation(
      {.name = name, .sentence = "planted.", .planar = make, .spatial = make, .levels = levels});
  std::vector<std::string> promises;
  for (const std::string& violation : Check(name)) {
    const std::string promise = violation.substr(0, violation.find(':'));
    if (std::ranges::find(promises, promise) == promises.end()) promises.push_back(promise);
  }
  std::ranges::sort(promises);
  return promises;
}

using Promises = std::vector<std::string>;

class ContractCheckOf : public ::testing::TestWithParam<std::string> {};

/// Seeds 6 and 10 have prescribed motions, seed 8 joints of every kind.
TEST_P(ContractCheckOf, BuiltInFormulationIsKept) {
  EXPECT_EQ(Check(GetParam(), {1, 2, 3, 4, 5, 6, 7, 8, 10, 11}, true), Promises());
}

INSTANTIATE_TEST_SUITE_P(All, ContractCheckOf, ::testing::Values("odca", "lagrange", "reduction"),
                         [](const auto& name) { return name.param; });

TEST(ContractCheck, KnowsNoNameThatIsNotRegistered) {
  EXPECT_THROW(Check("nobody"), std::invalid_argument);
}

/// Each flaw at the levels that show it: most of them show at every level.
TEST(ContractCheck, FindsWhatIsBroken) {
  const std::vector<Enforcement> any = {Enforcement::kAcceleration};
  EXPECT_EQ(Broken("sound", Flaw::kNone), Promises());
  EXPECT_EQ(
      Broken("without-speeds", Flaw::kNoSpeeds, {Enforcement::kVelocity, Enforcement::kPosition}),
      (Promises{"projection", "speeds"}));
  EXPECT_EQ(Broken("with-memory", Flaw::kMemory, any),
            (Promises{"determinism", "endings", "purity"}));
  EXPECT_EQ(Broken("wrong-forces", Flaw::kForces, any), (Promises{"energy", "forces"}));
  EXPECT_EQ(Broken("wrong-rank", Flaw::kRank, any), Promises{"rank"});
  EXPECT_EQ(Broken("never-fails", Flaw::kNotFinite, any), Promises{"endings"});
}

}  // namespace
}  // namespace loopbench::contract
