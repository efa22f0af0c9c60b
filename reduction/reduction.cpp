#include "reduction/reduction.h"

#include <limits>

#include "mechanism/algebra/dense_memory.h"

namespace loopbench::reduction {

namespace {

/// Approximate memory of M, J, B and the null space.
template <class Space>
double DenseNumbers(const Mechanism<Space, double>& mechanism) {
  const double n = mechanism.num_u(), m = mechanism.num_rows();
  return 7.0 * n * n + 3.0 * n * m;
}

}  // namespace

template <class Space>
SparseOrDense<Space>::SparseOrDense(const Mechanism<Space, double>& mechanism,
                                    const FormulationOptions& options, Matrices matrices)
    : mechanism_(mechanism),
      options_(options),
      at_velocity_(options.enforcement == Enforcement::kVelocity),
      zero_(VectorX<double>::Zero(mechanism.num_u())),
      bias_(VectorX<double>::Zero(mechanism.num_rows())) {
  const bool fits = DenseNumbers(mechanism) <= kKeptReady;
  may_decline_ = matrices == Matrices::kLessWork && fits;
  if (options.solver == SolverKind::kRankRevealing && !options.general) {
    sparse_ =
        SparsePartition<Space>::Make(mechanism, at_velocity_ ? Choice::kKept : Choice::kFree,
                                     matrices == Matrices::kSparse || (!at_velocity_ && fits));
  }
  // for uncertain positions within a right-hand side
  if (sparse_ == nullptr || (!at_velocity_ && fits)) MakeDense();
}

template <class Space>
void SparseOrDense<Space>::MakeDense() {
  if (dense_ != nullptr) return;
  RequireDense(mechanism_.name() + ": reduction is dense: matrices of " +
                   std::to_string(mechanism_.num_rows()) + " constraints and " +
                   std::to_string(mechanism_.num_u()) + " speeds",
               DenseNumbers(mechanism_));
  dense_ = std::make_unique<DenseReduction<Space, double>>(mechanism_, options_);
}

template <class Space>
bool SparseOrDense<Space>::StartsSparsely(const Kinematics<Space, double>& kinematics) {
  if (sparse_ == nullptr) return false;
  const bool independent = sparse_->AreIndependent(kinematics);
  const bool chosen = sparse_->Choose(kinematics);  // allocates in advance
  if (at_velocity_ && !(independent && chosen)) return false;
  return !may_decline_ || sparse_->IsWorthwhile();
}

template <class Space>
void SparseOrDense<Space>::Start(const Kinematics<Space, double>& kinematics) {
  uses_sparse_ = StartsSparsely(kinematics);
  if (uses_sparse_) return;
  MakeDense();
  dense_->Start(kinematics);
}

template <class Space>
bool SparseOrDense<Space>::Review(const Kinematics<Space, double>& kinematics) {
  if (!uses_sparse_) return dense_->Review(kinematics);
  return at_velocity_ &&
         sparse_->ChooseAgain(kinematics, DenseReduction<Space, double>::kReplaceBelow);
}

template <class Space>
Outcome SparseOrDense<Space>::FactorDense(const Kinematics<Space, double>& kinematics) {
  const Outcome outcome = dense_->Factor(kinematics);
  this->conditioning_ = dense_->conditioning();
  return outcome;
}

template <class Space>
Outcome SparseOrDense<Space>::Factor(const Kinematics<Space, double>& kinematics) {
  Conditioning& found = this->conditioning_;
  is_sparse_ = false;
  if (!uses_sparse_) {
    if (at_velocity_ || sparse_ == nullptr) return FactorDense(kinematics);
    if (dense_->FactorPartition(kinematics)) {
      found = dense_->conditioning();
      return Outcome::kFinished;
    }
  }
  found = {.rank = LoopRank(mechanism_, 0)};
  if (at_velocity_ || sparse_->AreIndependent(kinematics)) {
    found.rcond = sparse_->Factor(kinematics);
    // a pivot below a few eps of the largest is round-off of the elimination
    is_sparse_ = found.rcond > 16 * std::numeric_limits<double>::epsilon();
    // far from the constraints, at a trial step, bodies have arms of any length
    if (!at_velocity_ && dense_ != nullptr) is_sparse_ = is_sparse_ && sparse_->HasMass();
    if (is_sparse_) return Outcome::kFinished;
    if (at_velocity_) return Outcome::kSingular;
  }
  if (dense_ != nullptr) return FactorDense(kinematics);
  found.rcond = sparse_->response().rcond();
  found.worst_joint = sparse_->response().worst_joint();
  return sparse_->response().IsFinite() ? Outcome::kSingular : Outcome::kNonFinite;
}

template <class Space>
std::string SparseOrDense<Space>::WhySingular() const {
  const bool decides = at_velocity_ || dense_ != nullptr;
  return decides ? std::string() : TooLargeToDecide(mechanism_, this->conditioning_);
}

template <class Space>
const std::vector<int>* SparseOrDense<Space>::CarriedSpeeds() const {
  if (!at_velocity_) return nullptr;
  return uses_sparse_ ? &sparse_->independent() : dense_->CarriedSpeeds();
}

template <class Space>
bool SparseOrDense<Space>::CompleteSpeeds(Kinematics<Space, double>& kinematics,
                                          VectorX<double>& u) {
  if (!is_sparse_) return dense_->CompleteSpeeds(kinematics, u);
  const bool is_driven = !mechanism_.drives().empty();
  if (is_driven) SpeedBias(kinematics, zero_, bias_);
  sparse_->CompleteSpeeds(is_driven ? &bias_ : nullptr, u);
  return true;
}

template <class Space>
void SparseOrDense<Space>::Correct(const VectorX<double>& target, VectorX<double>& x) {
  if (!is_sparse_) return dense_->Correct(target, x);
  if (at_velocity_) return sparse_->Dependent(target, x);
  ConstraintSolver<Space, double>::Correct(target, x);
}

template <class Space>
void SparseOrDense<Space>::Solve(const VectorX<double>& force, const VectorX<double>& target,
                                 VectorX<double>& x, VectorX<double>* lambda) {
  if (!is_sparse_) return dense_->Solve(force, target, x, lambda);
  sparse_->Solve(force, target, x);
  if (lambda != nullptr) sparse_->Multipliers(force, x, *lambda);
}

template class SparseOrDense<Planar>;
template class SparseOrDense<Spatial>;

}  // namespace loopbench::reduction
