#include "lagrange/lagrange.h"

#include <type_traits>

#include "mechanism/algebra/dense_memory.h"
#include "mechanism/algebra/instantiate.h"
#include "mechanism/loops/self_stress.h"

namespace loopbench::lagrange {

namespace {

/// Returns true if sparse factors take less time. The dense multiply-adds are for M, W, S and the
/// factors of S. Measured on chains and ladders: a multiply-add in small blocks costs as much as
/// four to ten in large matrices, which have a fixed cost of 2000.
template <class Space>
bool IsLessWork(const JointResponse<Space>& sparse, const Mechanism<Space, double>& mechanism) {
  const double n = mechanism.num_u(), m = mechanism.num_rows();
  const double dense = n * n * n / 6.0 + n * m * (n + m) / 2.0 + m * m * m / 6.0;
  return 4.0 * sparse.operations() < 2000.0 + dense;
}

}  // namespace

template <class Space, class S>
Lagrange<Space, S>::Lagrange(const Mechanism<Space, S>& mechanism,
                             const FormulationOptions& options)
    : mechanism_(mechanism), equations_(mechanism), change_(VectorX<S>::Zero(mechanism.num_u())) {
  if constexpr (std::is_same_v<S, double>) {
    if (options.solver == SolverKind::kRankRevealing && !options.general) {
      joints_ = JointResponse<Space>::Make(mechanism, kMaxOfResponse);
    }
    if (joints_ != nullptr && !IsLessWork(*joints_, mechanism)) joints_ = nullptr;
  }
  const double numbers = DenseEquations<Space, S>::Numbers(mechanism, options.solver);
  if (joints_ != nullptr && numbers > kKeptReady) return;
  RequireDense(mechanism.name() + ": multipliers are dense: matrices of " +
                   std::to_string(mechanism.num_rows()) + " constraints and " +
                   std::to_string(mechanism.num_u()) + " speeds",
               numbers);
  dense_ = std::make_unique<DenseEquations<Space, S>>(mechanism, options.solver);
}

template <class Space, class S>
Outcome Lagrange<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  kinematics_ = &kinematics;
  is_sparse_ = false;
  if constexpr (std::is_same_v<S, double>) {
    if (joints_ != nullptr) {
      is_sparse_ = joints_->Factor(kinematics);
      this->conditioning_ = {.rank = LoopRank(mechanism_, 0),
                             .rcond = joints_->rcond(),
                             .smallest_weight = 1.0,
                             .worst_joint = joints_->worst_joint()};
      // A small pivot outside loops costs digits, not rank. In absolute coordinates the dense
      // matrices contain the same joints and lose the same digits.
      const bool keeps_digits = mechanism_.coordinates() == Coordinates::kAbsolute &&
                                joints_->rcond() >= LoopSolver<double>::kLosesDigits;
      if (dense_ == nullptr || keeps_digits) is_sparse_ = joints_->has_rank();
      if (is_sparse_) return Outcome::kFinished;
      if (dense_ == nullptr) {
        return joints_->IsFinite() ? Outcome::kSingular : Outcome::kNonFinite;
      }
      this->conditioning_.worst_joint = -1;
    }
  }
  return dense_->Factor(kinematics, this->conditioning_);
}

template <class Space, class S>
std::string Lagrange<Space, S>::WhySingular() const {
  return dense_ != nullptr ? std::string() : TooLargeToDecide(mechanism_, this->conditioning_);
}

template <class Space, class S>
void Lagrange<Space, S>::SolveEquations() {
  if constexpr (std::is_same_v<S, double>) {
    joints_->Solve(equations_.b(), equations_.c0(), equations_.A());
  }
}

template <class Space, class S>
void Lagrange<Space, S>::SolveSparsely(VectorX<S>& x, VectorX<S>* lambda) {
  if constexpr (std::is_same_v<S, double>) {
    SolveEquations();
    equations_.Read(*kinematics_, x);
    if (lambda != nullptr) equations_.Read(joints_->phi(), *lambda);
  }
}

template <class Space, class S>
void Lagrange<Space, S>::Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                               VectorX<S>* lambda) {
  if (!is_sparse_) return dense_->Solve(force, target, x, lambda);
  equations_.SetForce(*kinematics_, force, target);
  SolveSparsely(x, lambda);
}

template <class Space, class S>
bool Lagrange<Space, S>::Accelerate(const Kinematics<Space, S>& kinematics,
                                    const VectorX<S>& feedback, VectorX<S>& udot,
                                    VectorX<S>* lambda) {
  if (!is_sparse_) return false;
  equations_.SetState(kinematics, feedback);
  SolveSparsely(udot, lambda);
  return true;
}

template <class Space, class S>
bool Lagrange<Space, S>::AccelerateWithShare(const Kinematics<Space, S>& kinematics,
                                             const VectorX<S>& feedback,
                                             SelfStress<Space, S>& stress, VectorX<S>& udot,
                                             VectorX<S>* lambda) {
  if constexpr (std::is_same_v<S, double>) {
    if (!is_sparse_) return false;
    equations_.AccelerateWithShare(
        kinematics, feedback, stress, udot, lambda, [&] { SolveEquations(); },
        [&] { return joints_->phi(); });
    return true;
  }
  return false;
}

template <class Space, class S>
bool Lagrange<Space, S>::CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) {
  if (!is_sparse_) {
    dense_->CompleteSpeeds(kinematics, u);
    return true;
  }
  kinematics.UpdateVelocity(u);
  equations_.SetMissed(kinematics);
  SolveSparsely(change_, nullptr);
  u += change_;
  return true;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Lagrange<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::lagrange
