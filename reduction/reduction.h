// Coordinate reduction by the cheaper method: sparse factors of the dependencies between speeds
// (sparse_partition.h), or dense matrices (dense_reduction.h). Dense matrices are as published,
// support redundant constraints, and decide and regularize uncertain ranks.
//
// At velocity level the state carries the independent speeds: the choice at the start, sparse or
// dense, holds for the whole run, and pivots alone judge J_D. At all other levels the dependent
// speeds are arbitrary. Sparse factors then use the best choice at each position if the pivots of
// all joints prove full rank. Cheaper dense partitions replace suspicious sparse factors at once;
// the dense null space handles the rest.
#pragma once

#include <memory>
#include <type_traits>

#include "reduction/dense_reduction.h"
#include "reduction/sparse_partition.h"

namespace loopbench::reduction {

/// kSparse takes sparse factors wherever there are some, for tests.
enum class Matrices { kLessWork, kSparse };

template <class Space>
class SparseOrDense final : public ConstraintSolver<Space, double> {
 public:
  /// `mechanism` must outlive the solver. Throws TooDense (dense_memory.h), as does Start().
  SparseOrDense(const Mechanism<Space, double>& mechanism, const FormulationOptions& options,
                Matrices matrices = Matrices::kLessWork);

  Outcome Factor(const Kinematics<Space, double>& kinematics) override;
  void Solve(const VectorX<double>& force, const VectorX<double>& target, VectorX<double>& x,
             VectorX<double>* lambda) override;
  void Correct(const VectorX<double>& target, VectorX<double>& x) override;
  const std::vector<int>* CarriedSpeeds() const override;
  bool CompleteSpeeds(Kinematics<Space, double>& kinematics, VectorX<double>& u) override;
  void Start(const Kinematics<Space, double>& kinematics) override;
  bool Review(const Kinematics<Space, double>& kinematics) override;
  void AppendMode(std::vector<int>& mode) const override {
    if (dense_ != nullptr) dense_->AppendMode(mode);
  }
  std::string WhySingular() const override;

  /// Returns true if the last Factor() was sparse.
  bool is_sparse() const { return is_sparse_; }

 private:
  void MakeDense();
  Outcome FactorDense(const Kinematics<Space, double>& kinematics);
  /// Returns true if sparse factors replace dense matrices from the start.
  bool StartsSparsely(const Kinematics<Space, double>& kinematics);

  const Mechanism<Space, double>& mechanism_;
  FormulationOptions options_;
  bool at_velocity_;
  std::unique_ptr<SparsePartition<Space>> sparse_;        ///< null if never applicable
  std::unique_ptr<DenseReduction<Space, double>> dense_;  ///< null until needed, if too large
  bool uses_sparse_ = false;  ///< since Start(), before dense matrices are asked
  bool may_decline_ = false;  ///< the fill of sparse factors, for dense matrices
  bool is_sparse_ = false;
  VectorX<double> zero_, bias_;
};

template <class Space, class S>
using Reduction =
    std::conditional_t<std::is_same_v<S, double>, SparseOrDense<Space>, DenseReduction<Space, S>>;

}  // namespace loopbench::reduction
