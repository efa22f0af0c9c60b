// The one place where loop closures are solved and their rank is decided (docs/decisions/005).
//
// A loop closure is X phi = rhs, X = C Z C^T symmetric positive semidefinite: the response of the
// mechanism across one or several joints to forces in those joints. It is X of the paper's (16),
// chi of (42) and the inverse of X in (66). Rows are components along the joints' directions D and
// have the points and axes of D. X loses rank exactly when a self-stress exists, at a singular
// configuration or through redundant constraints.
//
// Every solve has the form X^+ = T^T T and applies T. The choices of T:
//
// *Plain*, the factorisation of the paper's time. Fails when a pivot is lost in round-off.
//
//     X = L L^T,      T = L^-1
//
// *Scaled*, each joint by its own scale K, where K K^T = X_free is the response of the joint's two
// bodies alone. The eigenvalues of the factored matrix lie in [0, number of joints]. If a pivot is
// below kSuspicious, the next two replace this one.
//
//     X = (K L) (K L)^T,        T = (K L)^-1
//
// K L is the Cholesky factor of X itself: T costs no scaling, and only the decision needs K.
//
// *Geometric*, for X_g, the response of the same mechanism with unit masses, and weights w_i
// (direction_weights.h).
//
//     K_g^-1 X_g K_g^-T = U diag(lambda) U^T
//     T = diag(sqrt(w_i / lambda_i)) U^T K_g^-1
//
// *Regularized*, the physical X with directions U and weights w from the geometry. A degenerating
// direction becomes compliant, and the smallest are omitted.
//
//     R = U^T K_g^-1 X K_g^-T U
//     R + diag(R_ii (1 / w_i - 1)) = N L L^T N,      N_i^2 = R_ii / w_i
//     T = L^-1 N^-1 U^T K_g^-1
//
// So rank depends on geometry alone, while stiffness stays physical.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/space.h"
#include "mechanism/loops/direction_weights.h"

namespace loopbench {

/// Returns the share of the usual pivot limit for a joint that closes an assembly of so many
/// bodies. More than eight respond like a single body of their mass in any position, with smaller
/// pivots. A thousandth is the minimum: there, at 1e-7, geometry begins to regularize (kTheta).
constexpr double ShareOfLimit(int bodies) { return std::clamp(8.0 / bodies, 1e-3, 1.0); }

/// Room for intermediate matrices; many solvers may share one, not at the same time.
template <class S>
struct LoopScratch {
  explicit LoopScratch(int largest)
      : scaled(MatrixX<S>::Zero(largest, largest)),
        work(scaled),
        rotated(scaled),
        vector(VectorX<S>::Zero(largest)) {}
  MatrixX<S> scaled, work, rotated;
  VectorX<S> vector;
};

template <class S>
class LoopSolver {
 public:
  /// Scaled pivots below this send the decision to the geometry.
  static constexpr double kSuspicious = 1e-4;
  /// Limit for joints outside loops. Their rows are independent. Pivots are small if a light body
  /// carries heavy bodies. Relative errors of accelerations are at most eps / 1e-6 = 2e-10.
  static constexpr double kLosesDigits = 1e-6;
  using ConstRef = Eigen::Ref<const MatrixX<S>>;

  /// Joints contribute `rows[k]` rows each, in order. Without a scratch it has one of its own.
  explicit LoopSolver(std::span<const int> rows, std::shared_ptr<LoopScratch<S>> scratch = nullptr);

  int size() const { return size_; }

  void SetOnNoLoop(int joint) { parts_[joint].least = kLosesDigits; }
  /// The K of each joint, from its free response, for the next factorisation.
  void SetScale(int joint, const JointMatrix<S>& free_response);

  /// Plain Cholesky. False when a pivot falls below `tolerance` times `scale`, the size that
  /// responses have before the loop is closed: X's own entries may be all round-off.
  bool FactorPlain(const ConstRef& X, S scale, S tolerance);
  /// Scaled Cholesky. False when suspicious; nothing can be applied then.
  bool FactorScaled(const ConstRef& X);
  /// Eigen-decomposition of the geometric response; sets rank and weights.
  void FactorGeometric(const ConstRef& X_geometric, double regularization = kRegularization);
  /// After FactorGeometric with the same scale. False when masses are so unequal that rounding
  /// leaves X without a Cholesky factor.
  bool FactorRegularized(const ConstRef& X);

  /// B := T B, in place.
  void Apply(Eigen::Ref<MatrixX<S>> B) const;
  /// v := T^T v, in place.
  void ApplyTransposed(Eigen::Ref<VectorX<S>> v) const;

  /// Directions enforced with a weight of at least one half; size() unless geometric.
  int rank() const { return IsGeometric() ? weights_.rank() : size_; }
  /// Smallest weight; 1 unless geometric or regularized.
  S smallest_weight() const { return IsGeometric() ? weights_.smallest() : S(1); }
  /// Smallest pivot over the scale, or the ratio of extreme geometric eigenvalues.
  S rcond() const { return rcond_; }

 private:
  struct Part {
    int row = 0, rows = 0;
    int scale = 0;  ///< first number in scales_
    double least = kSuspicious;
  };
  enum class Form { kNone, kPlain, kScaled, kGeometric, kRegularized };
  bool IsGeometric() const { return form_ == Form::kGeometric || form_ == Form::kRegularized; }
  /// K^-1 X K^-T, in the scratch.
  auto Scaled(const ConstRef& X);
  /// Factors A = L L^T; returns its smallest pivot (smallest diagonal squared), or 0 on failure.
  S Cholesky(const ConstRef& A);
  /// Returns 1 / L_ii of the last Cholesky().
  S InversePivot(int i) const;
  void ScaleRows(Eigen::Ref<MatrixX<S>> B) const;

  int size_ = 0;
  Form form_ = Form::kNone;
  std::vector<Part> parts_;              ///< the joints
  std::vector<S> scales_;                ///< K of each joint, K^-1 if geometric, by columns
  MatrixX<S> small_;                     ///< L as in lower_triangle.h, for small sizes
  CholeskyFactor<MatrixX<S>> cholesky_;  ///< L elsewhere
  MatrixX<S> directions_;                ///< U
  VectorX<S> eigenvalues_, inverse_norms_;
  DirectionWeights<S> weights_;
  std::shared_ptr<LoopScratch<S>> scratch_;
  S rcond_ = S(1);
};

}  // namespace loopbench
