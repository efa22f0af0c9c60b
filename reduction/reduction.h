// Coordinate reduction by whatever is less work: sparse factors of the dependencies between speeds
// (sparse_partition.h), or dense matrices (dense_reduction.h), which are as published, know
// redundant constraints, and decide and soften where rank is in doubt.
//
// At level velocity the state carries the independent speeds: what the start chose stays sparse or
// dense for the whole run, and J_D is judged by its pivots alone. At all other levels nothing hangs
// on which speeds are dependent, and sparse factors have the choice that is best at each position,
// if all joints' pivots leave no doubt there. Where a dense partition is less work, they take its
// place as soon as it is suspicious; the dense null space has what is left.
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
  std::string WhySingular() const override;

  /// Whether the last Factor() was sparse.
  bool is_sparse() const { return is_sparse_; }

 private:
  void MakeDense();
  Outcome FactorDense(const Kinematics<Space, double>& kinematics);
  /// Whether sparse factors leave nothing to dense matrices from the start on.
  bool StartsSparsely(const Kinematics<Space, double>& kinematics);

  const Mechanism<Space, double>& mechanism_;
  FormulationOptions options_;
  bool at_velocity_;
  std::unique_ptr<SparsePartition<Space>> sparse_;        ///< null where it never serves
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
