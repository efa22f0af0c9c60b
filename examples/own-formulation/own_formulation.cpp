// A formulation that Loopbench does not have, and the program loopbench with it: in tables, figures
// and commands its name stands beside the others.
//
//   loopbench_own contract            holds it to the contract of all formulations
//   loopbench_own run experiment.json and everything else that loopbench does
#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cstdio>
#include <string_view>

#include "harness/cli/program.h"
#include "harness/config/formulations.h"
#include "mechanism/loops/tree_dynamics.h"
#include "tests/contract/check.h"

namespace own {

using namespace loopbench;

/// The fundamental equation of Udwadia and Kalaba (Proc. R. Soc. Lond. A 439, 1992): of all
/// accelerations that the constraints allow, the mechanism takes those nearest to the ones without
/// constraints, in the metric of its masses. For M x - J^T lambda = f, J x = c, with M = L L^T:
///
///   A = J L^-T,   y = L^-1 f,   r = c - A y,
///   x = L^-T (y + A^+ r),       lambda = (A A^T)^+ r.
///
/// A^+ is Moore and Penrose's inverse, here by a complete orthogonal decomposition of A: redundant
/// constraints need no care, and A A^T is never formed. Near singular positions, where the rank of
/// A drops, x is not smooth: nothing is regularized there.
template <class Space, class S>
class UdwadiaKalaba final : public ConstraintSolver<Space, S> {
 public:
  UdwadiaKalaba(const Mechanism<Space, S>& mechanism, const FormulationOptions&)
      : mechanism_(mechanism),
        dynamics_(mechanism),
        M_(mechanism.num_u(), mechanism.num_u()),
        A_(mechanism.num_rows(), mechanism.num_u()) {}

  /// L and the decomposition of A.
  Outcome Factor(const Kinematics<Space, S>& kinematics) override {
    this->conditioning_ = {.rank = LoopRank(mechanism_, 0)};
    dynamics_.MassMatrix(kinematics, Masses::kPhysical, M_);
    mass_.compute(M_);
    if (mass_.info() != Eigen::Success) return Outcome::kNonFinite;
    if (A_.rows() == 0) return Outcome::kFinished;  // a tree
    dynamics_.Jacobian(kinematics, A_);
    mass_.matrixL().transpose().template solveInPlace<Eigen::OnTheRight>(A_);
    if (!A_.allFinite()) return Outcome::kNonFinite;
    pseudo_.compute(A_);
    const auto pivots = pseudo_.matrixT().diagonal().head(pseudo_.rank()).cwiseAbs();
    if (pivots.size() == 0) return Outcome::kSingular;
    const int dependent = static_cast<int>(A_.rows() - pseudo_.rank());
    this->conditioning_.rank = LoopRank(mechanism_, dependent);
    this->conditioning_.rcond = static_cast<double>(pivots.minCoeff() / pivots.maxCoeff());
    return Outcome::kFinished;
  }

  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override {
    x = force.size() > 0 ? force : VectorX<S>::Zero(M_.rows());
    mass_.matrixL().solveInPlace(x);  // y
    if (A_.rows() > 0) {
      const VectorX<S> pulled = pseudo_.solve(target - A_ * x);  // A^+ r
      x += pulled;
      if (lambda != nullptr) *lambda = pseudo_.transpose().solve(pulled);  // (A^T)^+ A^+ r
    }
    mass_.matrixU().solveInPlace(x);
  }

 private:
  const Mechanism<Space, S>& mechanism_;
  TreeDynamics<Space, S> dynamics_;
  MatrixX<S> M_, A_;  ///< first J, then A
  Eigen::LLT<MatrixX<S>> mass_;
  Eigen::CompleteOrthogonalDecomposition<MatrixX<S>> pseudo_;
};

}  // namespace own

int main(int argc, char** argv) {
  loopbench::harness::RegisterFormulation(loopbench::harness::Row<own::UdwadiaKalaba>(
      "udwadia-kalaba", "the accelerations nearest to those without loops, by a pseudo-inverse."));
  if (argc != 2 || std::string_view(argv[1]) != "contract") return loopbench::Main(argc, argv);
  const auto violations = loopbench::contract::Check("udwadia-kalaba");
  for (const std::string& violation : violations) std::printf("%s\n", violation.c_str());
  std::printf("udwadia-kalaba: %zu violations of the contract\n", violations.size());
  return violations.empty() ? 0 : 1;
}
