// Enforcement weight of each direction of the loop constraints, from geometry alone.
//
// For the geometric response of loop_solver.h, with eigenvalues lambda_1 <= lambda_2 <= ...,
//
//   K_g^-1 X_g K_g^-T = U diag(lambda) U^T
//   w_i = 1 - exp(-r_i^2),      r_i = min(p_i / theta, (lambda_i / lambda_least)^2)
//
// with theta = (2e-4)^2 and lambda_least = (2e-6)^2 of the largest eigenvalue, which counts as 1e-2
// at least because within a rigid part all of X_g is round-off. Both are smaller at positions that
// are known to be regular (Kinematics::regularization()).
//
// The p_1 <= p_2 <= ... are the responses left to each joint once the joints before it are closed:
// the eigenvalues of its block in the block Cholesky factorisation. They fall with the square of
// the distance from a singular configuration, like the lambda, and have the same product, but lie
// closer together. A row of n windows has an eigenvalue of 2 / n^2 in its best position; its p,
// closed along the row, do not depend on n. A single joint has p_i = lambda_i. If lambda
// is small but p is not, lambda_least regularizes it while a hundredth of lambda is accurate.
#pragma once

#include <span>
#include <vector>

#include "mechanism/algebra/space.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class S>
class DirectionWeights {
 public:
  /// theta, or 64 eps if more: a narrow scalar's eigenvalues are round-off already above 4e-8.
  /// docs/theory/singular-configurations.md has the trials.
  static constexpr double kTheta = kRegularization;
  /// lambda_least, or 4 eps if more; at most a hundredth of theta.
  static constexpr double kMinEigenvalue = 4e-12;
  /// Free bodies respond with one, and round-off of some 100 eps stays far below kTheta of this.
  static constexpr double kMinResponse = 1e-2;
  /// Directions of less weight are left out: their eigenvalues are round-off.
  static constexpr double kLeast = 1e-16;

  /// Joints contribute `rows[k]` rows each, in order.
  explicit DirectionWeights(std::span<const int> rows);

  /// Finds the p_i of the scaled geometric response in `X`, which is destroyed; `work` has its
  /// size. No allocation.
  void FindPivots(Eigen::Ref<MatrixX<S>> X, Eigen::Ref<MatrixX<S>> work);
  /// The weights for theta, a share of the largest eigenvalue, after FindPivots; `lambda` ascends.
  void Weigh(const VectorX<S>& lambda, S share = S(kTheta));

  S operator[](Eigen::Index i) const { return weights_[i]; }
  bool IsLeftOut(Eigen::Index i) const { return !(weights_[i] >= S(kLeast)); }
  /// Directions enforced with a weight of at least one half.
  int rank() const { return rank_; }
  S smallest() const { return smallest_; }
  /// Returns the largest eigenvalue, bounded below.
  S largest() const { return largest_; }

 private:
  std::vector<int> rows_;
  VectorX<S> pivots_, weights_;
  int rank_ = 0;
  S smallest_ = S(1), largest_ = S(1);
};

}  // namespace loopbench
