// Coordinate reduction for loops of few speeds each: equations (1) to (3) of dense_reduction.h with
//
//   J_D    in sparse factors (sparse_lu.h), which also choose the dependent speeds: they are the
//          pivots of J^T,
//   B^T M B = sum over bodies of V^T M_i V,    V the motions that the columns of B give the body,
//
// so that neither the mass matrix of the forest nor J is ever filled. A right-hand side costs
// O(n (1 + f)^2) for f independent speeds and loops of bounded length; the reduced matrix stays
// dense, f x f, as it is for every reduction.
//
// All constraints must be independent. The pivots of the geometric response decide this
// (mechanism/loops/joint_response.h): they prove it or leave it uncertain.
#pragma once

#include <memory>
#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/tree_dynamics.h"
#include "reduction/sparse_lu.h"

namespace loopbench::reduction {

/// Choice of dependent speeds: from the last Choose() or ChooseAgain(), or the best at each
/// position if the state does not depend on it.
enum class Choice { kKept, kFree };

template <class Space>
class SparsePartition {
 public:
  /// Returns null if constraints must be dependent or, unless `anyway`, dense matrices are less
  /// work. `mechanism` must outlive this. Throws TooDense (dense_memory.h).
  static std::unique_ptr<SparsePartition> Make(const Mechanism<Space, double>& mechanism,
                                               Choice choice, bool anyway);

  /// The judge of positions.
  JointResponse<Space>& response() { return *response_; }
  /// Returns true if all constraints are certainly independent at this position.
  bool AreIndependent(const Kinematics<Space, double>& kinematics) {
    return response_->Factor(kinematics, Masses::kGeometric);
  }

  /// Chooses the best dependent speeds at these positions. Returns false if some constraint has
  /// none.
  bool Choose(const Kinematics<Space, double>& kinematics);
  /// Does the same if the reciprocal condition of the kept ones is below `share` of the best;
  /// returns true if they were replaced.
  bool ChooseAgain(const Kinematics<Space, double>& kinematics, double share);
  /// Returns true if it saves work over dense matrices, with the fill of the last choice, unknown
  /// before; at velocity level half of that fill.
  bool IsWorthwhile() const;
  /// Indices into u, ascending.
  const std::vector<int>& independent() const { return independent_; }

  /// Computes J_D's factors and B. Returns the reciprocal condition, 0 without factors.
  double Factor(const Kinematics<Space, double>& kinematics);
  /// Returns true if B^T M B of the last Factor() is positive definite beyond round-off.
  bool HasMass();
  /// x_D = J_D^-1 target, x_I = 0.
  void Dependent(const VectorX<double>& target, VectorX<double>& x);
  /// (1): u = B u_I, less J_D^-1 b where `bias` is not null.
  void CompleteSpeeds(const VectorX<double>* bias, VectorX<double>& u);
  /// Solves (2) and (3) with `force` (empty: zero) instead of -h and `target` instead of gamma; not
  /// finite if HasMass() is false.
  void Solve(const VectorX<double>& force, const VectorX<double>& target, VectorX<double>& x);
  /// lambda of J_D^T lambda = (M x - force)_D.
  void Multipliers(const VectorX<double>& force, const VectorX<double>& x, VectorX<double>& lambda);

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  SparsePartition(const Mechanism<Space, double>& mechanism, SparseLu lu, Choice choice,
                  std::unique_ptr<JointResponse<Space>> response);

  void FillJacobian(const Kinematics<Space, double>& kinematics);
  /// Sets the lists of independent speeds from the pivots of lu_.
  void SetIndependent();
  /// B^T M B of (3), once per position.
  void FactorMass();
  /// Motions of all bodies for the speeds x, in column `index` of V_.
  void SetMotions(const VectorX<double>& x, int index);

  const Mechanism<Space, double>& mechanism_;
  std::unique_ptr<JointResponse<Space>> response_;
  TreeDynamics<Space, double> dynamics_;
  const Kinematics<Space, double>* kinematics_ = nullptr;  ///< of the last Factor()
  std::vector<double> J_;                                  ///< in the order of lu_'s pattern
  SparseLu lu_;
  std::unique_ptr<SparseLu> best_;  ///< null for a free choice, which uses lu_
  std::vector<int> independent_;
  std::vector<char> is_independent_;  ///< by speed, of the choice that is kept
  std::vector<int> place_;            ///< of a speed among the independent ones
  Columns B_;                         ///< num_u x f
  MatrixX<double> V_, MV_, reduced_;  ///< a column for each of B and one for c
  CholeskyFactor<MatrixX<double>> reduced_factor_;
  bool mass_is_current_ = false;
  std::vector<Acceleration<Space, double>> motions_;
  VectorX<double> c_, z_, column_, residual_, rows_;
};

}  // namespace loopbench::reduction
