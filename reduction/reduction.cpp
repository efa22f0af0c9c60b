#include "reduction/reduction.h"

#include <limits>

#include "mechanism/model/dense_memory.h"

namespace loopbench::reduction {

namespace {

/// Numbers up to which dense matrices are kept ready for positions where rank is in doubt: 160 MB.
constexpr double kKeptReady = 2e7;

/// Of M, J, B and what the null space adds, roughly.
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
  if (options.solver == SolverKind::kRankRevealing) {
    sparse_ = SparsePartition<Space>::Make(mechanism, matrices == Matrices::kSparse);
  }
  has_sparse_choice_ = sparse_ != nullptr;
  if (sparse_ == nullptr || DenseNumbers(mechanism) <= kKeptReady) MakeDense();
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
void SparseOrDense<Space>::Start(const Kinematics<Space, double>& kinematics) {
  has_sparse_choice_ =
      sparse_ != nullptr && sparse_->AreIndependent(kinematics) && sparse_->Choose(kinematics);
  if (has_sparse_choice_) return;
  MakeDense();
  dense_->Start(kinematics);
}

/// Without a sparse choice a run at another level than velocity may find one later.
template <class Space>
bool SparseOrDense<Space>::Review(const Kinematics<Space, double>& kinematics) {
  constexpr double kReplaceBelow = DenseReduction<Space, double>::kReplaceBelow;
  if (sparse_ == nullptr || (at_velocity_ && !has_sparse_choice_)) {
    return dense_->Review(kinematics);
  }
  if (at_velocity_) return sparse_->ChooseAgain(kinematics, kReplaceBelow);
  const bool independent = sparse_->AreIndependent(kinematics);
  if (has_sparse_choice_) return independent && sparse_->ChooseAgain(kinematics, kReplaceBelow);
  has_sparse_choice_ = independent && sparse_->Choose(kinematics);
  return has_sparse_choice_ || dense_->Review(kinematics);
}

template <class Space>
Outcome SparseOrDense<Space>::Factor(const Kinematics<Space, double>& kinematics) {
  is_sparse_ = false;
  if (has_sparse_choice_) {
    this->conditioning_ = {.rank = LoopRank(mechanism_, 0)};
    if (at_velocity_ || sparse_->AreIndependent(kinematics)) {
      this->conditioning_.rcond = sparse_->Factor(kinematics);
      // a pivot below a few eps of the largest is round-off of the elimination
      is_sparse_ = this->conditioning_.rcond > 16 * std::numeric_limits<double>::epsilon();
      if (is_sparse_) return Outcome::kFinished;
    }
    if (at_velocity_ || dense_ == nullptr) return Outcome::kSingular;
  }
  const Outcome outcome = dense_->Factor(kinematics);
  this->conditioning_ = dense_->conditioning();
  return outcome;
}

template <class Space>
std::string SparseOrDense<Space>::WhySingular() const {
  if (at_velocity_ || dense_ != nullptr) return {};
  return "rank is in doubt, and the dense matrices that would decide it are too large: " +
         std::to_string(mechanism_.num_rows()) + " constraints and " +
         std::to_string(mechanism_.num_u()) + " speeds";
}

template <class Space>
const std::vector<int>& SparseOrDense<Space>::independent() const {
  return has_sparse_choice_ ? sparse_->choice().independent : dense_->independent();
}

template <class Space>
const std::vector<int>* SparseOrDense<Space>::CarriedSpeeds() const {
  return at_velocity_ ? &independent() : nullptr;
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
  sparse_->Dependent(target, x);
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
