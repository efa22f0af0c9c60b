// Coordinate reduction where loops have few speeds each: equations (1) to (3) of dense_reduction.h
// with
//
//   J_D    in sparse factors (sparse_lu.h), which also choose the dependent speeds: they are the
//          pivots of J^T,
//   B^T M B = sum over bodies of V^T M_i V,    V the motions that the columns of B give the body,
//
// so that neither the mass matrix of the forest nor J is ever filled. A right-hand side costs
// O(n (1 + f)^2) for f independent speeds and loops of bounded length; the reduced matrix stays
// dense, f x f, as it is for every reduction.
//
// All constraints must be independent. Whether they are is asked of the pivots of the geometric
// response (mechanism/loops/joint_response.h), which leave no doubt or say that there is some.
#pragma once

#include <Eigen/Cholesky>
#include <memory>
#include <vector>

#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/tree_dynamics.h"
#include "reduction/sparse_lu.h"

namespace loopbench::reduction {

/// Which speeds are dependent: the choice of the last Choose() or ChooseAgain(), or the best at
/// each position, where nothing hangs on the choice.
enum class Choice { kKept, kFree };

template <class Space>
class SparsePartition {
 public:
  /// Null where constraints must be dependent and, unless `anyway`, where dense matrices are less
  /// work. `mechanism` must outlive this. Throws TooDense (dense_memory.h).
  static std::unique_ptr<SparsePartition> Make(const Mechanism<Space, double>& mechanism,
                                               Choice choice, bool anyway);

  /// The judge of positions.
  JointResponse<Space>& response() { return *response_; }
  /// Whether all constraints are independent at this position, beyond doubt.
  bool AreIndependent(const Kinematics<Space, double>& kinematics) {
    return response_->Factor(kinematics, Masses::kGeometric);
  }

  /// Takes the dependent speeds that are best at these positions. False where there are none for
  /// each constraint.
  bool Choose(const Kinematics<Space, double>& kinematics);
  /// The same where the kept ones have a reciprocal condition below `share` of the best; whether
  /// they were replaced.
  bool ChooseAgain(const Kinematics<Space, double>& kinematics, double share);
  /// Whether it saves work over dense matrices, with the fill of the last choice, which nobody
  /// knows before; at level velocity half of it.
  bool IsWorthwhile() const;
  /// Indices into u, ascending.
  const std::vector<int>& independent() const { return independent_; }

  /// J_D = factors, and B. Its reciprocal condition, 0 where it has no factors.
  double Factor(const Kinematics<Space, double>& kinematics);
  /// Whether B^T M B of the last Factor() is positive definite: wherever that is no round-off.
  bool HasMass();
  /// x_D = J_D^-1 target, x_I = 0.
  void Dependent(const VectorX<double>& target, VectorX<double>& x);
  /// (1): u = B u_I, less J_D^-1 b where `bias` is not null.
  void CompleteSpeeds(const VectorX<double>* bias, VectorX<double>& u);
  /// (2) and (3) with `force` (empty: zero) in the place of -h and `target` in that of gamma; not
  /// finite where HasMass() is false.
  void Solve(const VectorX<double>& force, const VectorX<double>& target, VectorX<double>& x);
  /// lambda of J_D^T lambda = (M x - force)_D.
  void Multipliers(const VectorX<double>& force, const VectorX<double>& x, VectorX<double>& lambda);

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  SparsePartition(const Mechanism<Space, double>& mechanism, SparseLu lu, Choice choice,
                  std::unique_ptr<JointResponse<Space>> response);

  void FillJacobian(const Kinematics<Space, double>& kinematics);
  /// The lists of what is independent, from the pivots of lu_.
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
  std::unique_ptr<SparseLu> best_;  ///< null where the choice is free: lu_ is it
  std::vector<int> independent_;
  std::vector<char> is_independent_;  ///< by speed, of the choice that is kept
  std::vector<int> place_;            ///< of a speed among the independent ones
  Columns B_;                         ///< num_u x f
  MatrixX<double> V_, MV_, reduced_;  ///< a column for each of B and one for c
  Eigen::LLT<MatrixX<double>> reduced_factor_;
  bool mass_is_current_ = false;
  std::vector<Acceleration<Space, double>> motions_;
  VectorX<double> c_, z_, column_, residual_, rows_;
};

}  // namespace loopbench::reduction
