// Self-stresses of redundant constraints, and the equations that keep their rank off the loops.
//
// Of the m rows of J only r are independent at any admissible position: r is structural
// (redundancy.h). W (m x d, d = m - r, orthonormal) spans the self-stresses, J^T W = 0, and U their
// complement, the range of J. The drift e of the constraints lies in that range to first order:
// e = U eta, in a basis U that the motion carries along without turning it. Then
//
//   U^T (e'' + W' W'^T e) = eta'',      W' the rate of W with W^T W' = 0,
//
// so the accelerations of level `acceleration` satisfy
//
//   U^T (J udot - gamma + W' W'^T e) = 0                                                     (1)
//
// and eta grows as t^2. Without the term it grows exponentially where W keeps turning. Speeds of
// level `velocity` satisfy U^T (J u + b) = 0, so that eta' = 0.
//
// Solvers impose r rows; d rows Q of the cut joints are released. A solution x0 that has the target
// c in the imposed rows misses it by J_Q x0 - c_Q in the others, whereas a solution of (1) misses c
// along W alone. It is x0 + y with J y = W W_Q^T (J_Q x0 - c_Q) in the imposed rows. Multipliers of
// the imposed rows have a part along W, whose force J^T W W^T lambda is of first order in e, too.
// In joint coordinates it is taken away, and results depend on the released rows in second order
// only. In absolute coordinates it stays: without it, Bennett's linkage drifted three times as far.
//
// Rows t of joints in a spanning forest are independent; in joint coordinates there are none. With
// speeds a along H and b along D of these joints, J_t is the identity of b, and loops have the rows
// J_H a + J_D b. With T = J_HQ J_HR^+,
//
//   W ~ [-J_D^T W_c; W_c],      W_c = [-T^T; 1],
//
// and the rates follow from J^T W = 0: W'^T e = -W^T J' J^+ e, W' x = -(J^+)^T J'^T W x.
//
// All this holds to first order in e, for rows that are derivatives of e to that order
// (JointKind::exact_basis). Rotations are multiplied by the mechanism's length, so that all rows
// are lengths in a constant scale.
#pragma once

#include <vector>

#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class SelfStress {
 public:
  /// `mechanism` releases directions, and must outlive this.
  explicit SelfStress(const Mechanism<Space, S>& mechanism);

  /// J, T and W at the positions of `kinematics`; no other call may come first. No allocation.
  void Factor(const Kinematics<Space, S>& kinematics);
  /// Whether other released directions may serve better here: elements of T, by which a mismatch of
  /// imposed rows is found in released ones, exceed ten, which costs a digit; or the imposed rows
  /// are nearly dependent, where T does not show it.
  bool ServesBadly() const {
    return d_ > 0 && (pivot_ < S(1e-4) || T_.cwiseAbs().maxCoeff() > S(10));
  }
  /// The released directions that serve best here, as many of each joint as the mechanism releases.
  /// Allocates.
  std::vector<Released> Choose(const Kinematics<Space, S>& kinematics) const;

  /// W' W'^T e for the imposed rows; speeds must be current.
  const VectorX<S>& Feedback(const Kinematics<Space, S>& kinematics);
  /// W W_Q^T (J u + b)_Q for the imposed rows, at the speeds of `kinematics`.
  const VectorX<S>& ShareOfSpeeds(const Kinematics<Space, S>& kinematics);
  /// The same of (J udot - gamma + feedback)_Q for accelerations A of the centres of mass, after
  /// Feedback().
  const VectorX<S>& ShareOfAccelerations(const Kinematics<Space, S>& kinematics,
                                         std::span<const Acceleration<Space, S>> A);
  /// -J^T W W^T lambda: the generalised force that takes the part along W from multipliers lambda
  /// of the imposed rows. Empty in absolute coordinates.
  const VectorX<S>& ForceOfStress(const VectorX<S>& lambda);

 private:
  /// A joint of the spanning forest, at its child: parent and child are bodies.
  struct Edge {
    int joint = -1, parent = kGround, sign = 1, depth = 0;
    int column = 0, D_column = -1;  ///< first columns of J_H and J_D; -1 in joint coordinates
  };
  /// A joint that closes a loop. Rows of loops are imposed ones, then released ones.
  struct Loop {
    int joint = 0, imposed = 0, released = 0;  ///< first rows
  };
  void Span();
  int RowOf(const Loop& loop, int direction) const {
    const int rows = mechanism_->joints()[loop.joint].num_constraints();
    return direction < rows ? loop.imposed + direction : loop.released + direction - rows;
  }
  /// Calls sink(edge, sign) for each joint of the forest between the two sides of a loop's joint.
  template <class Sink>
  void ForEachEdge(const Loop& loop, const Sink& sink) const;
  /// Rows of J_ and of J_rate_.
  void FillRows(const Kinematics<Space, S>& kinematics, const Loop& loop);
  void FillRates(const Kinematics<Space, S>& kinematics, const Loop& loop);
  /// e of the forest's rows and of the loops'.
  void Measure(const Kinematics<Space, S>& kinematics);
  /// W W_Q^T missed_, in the rows of the mechanism.
  const VectorX<S>& Share();
  /// Numbers of forest and loops by the mechanism's rows, out of scale.
  void ToRows(const Eigen::Ref<const VectorX<S>>& forest, const VectorX<S>& loops,
              VectorX<S>& rows) const;

  const Mechanism<Space, S>* mechanism_;
  std::vector<Edge> edges_;  ///< by child body
  std::vector<int> forest_;  ///< children of the forest's joints that have rows
  std::vector<Loop> loops_;
  int r_ = 0, d_ = 0;      ///< imposed and released rows of loops
  S pivot_ = S(1);         ///< least pivot of the imposed rows, over the trace
  int H_ = 0, D_ = 0;      ///< columns of J_H and J_D
  MatrixX<S> J_, J_rate_;  ///< [J_H J_D] of the loops; rows and columns in scale
  VectorX<S> row_scale_, column_scale_;
  MatrixX<S> gram_, T_, C_, W_c_, W_t_;  ///< gram_ and C_ hold Cholesky factors, T_ holds T^T
  VectorX<S> e_t_, e_c_, x_, y_, z_t_, z_c_, missed_, along_, feedback_, share_, force_;
};

}  // namespace loopbench
