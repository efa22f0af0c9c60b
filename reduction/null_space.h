// Coordinate reduction without a choice of coordinates: uses a basis of the free directions if no
// set of independent speeds is suitable (near singular configurations) or known (redundant
// constraints).
//
// With the mass matrix of unit bodies M_g = L L^T and the free responses K K^T of loop_solver.h,
//
//   B = K^-1 J L^-T = U diag(sigma) V^T,                                                     (4)
//
// and weights w_i from B B^T (direction_weights.h), the speeds are u = L^-T V z. A direction with
// w_i = 1 within kHard is dependent, its z_i given: sigma_i z_i = (U^T K^-1 gamma)_i =: c_i. All
// others are independent,
//
//   (V_N^T Mh V_N + diag(k)) z_N = -V_N^T (L^-1 h + Mh V_D z_D) + diag(k) c_N / sigma_N,      (5)
//   Mh = L^-1 M L^-T,   k_i = w_i / ((1 - w_i) v_i^T Mh^-1 v_i),
//
// and k_i is the stiffness that still holds a degenerating direction. It makes (5) equal to the
// regularized equations of loop_solver.h: there 1 / k_i is added to the response.
//
// Basis by singular values: Singh and Likins, J. Appl. Mech. 52 (1985) 943; Mani, Haug and
// Atkinson, J. Mech. Trans. Autom. Des. 107 (1985) 82.
#pragma once

#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/singular_values.h"
#include "mechanism/loops/direction_weights.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::reduction {

template <class Space, class S>
class NullSpace {
 public:
  /// 1 - w below which a direction counts as dependent: its stiffness would be a million times its
  /// inertia, with an equal loss by rounding.
  static constexpr double kHard = 1e-6;

  explicit NullSpace(const Mechanism<Space, S>& mechanism);

  /// The basis at the current positions, J being theirs. Allocates only at first.
  void Factor(const Kinematics<Space, S>& kinematics, TreeDynamics<Space, S>& dynamics,
              const MatrixX<S>& J);

  /// udot from M udot + h = J^T lambda, J udot = gamma; with h = 0 the smallest udot in the metric
  /// M that meets gamma. False where M is not positive definite.
  bool Accelerate(const MatrixX<S>& M, const VectorX<S>& h, const VectorX<S>& gamma,
                  VectorX<S>& udot);
  /// lambda for which J^T lambda is nearest to `force`.
  void Multipliers(const VectorX<S>& force, VectorX<S>& lambda);

  int rank() const { return weights_.rank(); }
  S smallest_weight() const { return weights_.smallest(); }
  /// Ratio of the extreme singular values of the dependent directions.
  S rcond() const { return rcond_; }

 private:
  /// Singular values descend, eigenvalues of B B^T ascend, and there may be more of them.
  S WeightOf(Eigen::Index i) const { return weights_[lambda_.size() - 1 - i]; }
  bool IsLeftOut(Eigen::Index i) const { return weights_.IsLeftOut(lambda_.size() - 1 - i); }
  /// c = U^T K^-1 rows.
  void ToDirections(const VectorX<S>& rows);

  const Mechanism<Space, S>& mechanism_;
  int num_dependent_ = 0;
  S rcond_ = S(1);
  std::vector<JointMatrix<S>> K_;  ///< Cholesky factors, by constraint
  MatrixX<S> B_, response_, work_, M_g_, Mh_, basis_, reduced_;
  CholeskyFactor<MatrixX<S>> L_, Mh_factor_, reduced_factor_;
  SingularValues<S> svd_;
  DirectionWeights<S> weights_;
  VectorX<S> lambda_, rows_, c_, z_, speeds_, column_;
};

}  // namespace loopbench::reduction
