// One multiplier per constrained direction of every joint, those of the tree included: sparse.
//
//   X phi = -(C b + c0),      X = C M^-1 C^T,      A = b + M^-1 C^T phi
//
// with the rows c^T of all joints (body_equations.h) in C and M the block-diagonal mass matrix of
// the bodies. X has a block for every two joints on one body, so its factors (block_cholesky.h) are
// linear in size for chains, ladders and trees. A body with k joints makes k^2 blocks.
//
// This file does not decide rank. Pivots belong to K^-1 X K^-T, where K K^T is the free response of
// each joint, with the meaning of loop_solver.h: below kSuspicious the loops may have lost rank,
// and another method must check. ShareOfLimit() is the pivot over that limit.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mechanism/algebra/block_cholesky.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

/// Numbers beyond which X is not sparse: 1.6 GB.
inline constexpr double kMaxOfResponse = 2e8;

template <class Space>
class JointResponse {
 public:
  /// Returns null if X would exceed `most` numbers. `mechanism` must outlive this.
  static std::unique_ptr<JointResponse> Make(const Mechanism<Space, double>& mechanism,
                                             double most);

  /// Returns false if rank or digits are uncertain, or a number is not finite. Equations are solved
  /// with physical masses.
  bool Factor(const Kinematics<Space, double>& kinematics, Masses masses = Masses::kPhysical);
  /// A of all bodies, and phi(). An empty b is zero.
  void Solve(std::span<const Acceleration<Space, double>> b,
             std::span<const Components<Space, double>> c0,
             std::span<Acceleration<Space, double>> A);

  /// Returns true if the last Factor() had a certain rank. Small pivots of joints on no loop only
  /// mean lost digits, for a light body that holds many.
  bool has_rank() const { return has_rank_; }

  std::span<const Components<Space, double>> phi() const { return phi_; }
  /// Least pivot of the last Factor(), and the joint nearest to its limit, -1 if all are 1.
  double rcond() const { return rcond_; }
  int worst_joint() const { return worst_joint_; }
  /// Returns true if all numbers in X were finite.
  bool IsFinite() const;
  /// Multiply-adds of factors and one solution.
  double operations() const { return X_.operations(); }

 private:
  /// A joint's rows on one of its bodies.
  struct Side {
    int joint = 0, block = 0, body = 0, rows = 0;
    bool is_Q = false;
    int first = 0;  ///< in c_ and Mc_
    int row = 0;    ///< in x_
  };
  /// Two sides on one body, and the index of the block of their joints.
  struct Pair {
    int first = 0, second = 0;  ///< sides: its rows, its columns
    double* block = nullptr;
  };

  JointResponse(std::vector<Side> sides, std::vector<int> joints, BlockCholesky X,
                std::span<const Joint<Space, double>> all,
                const std::vector<std::vector<int>>& sides_of_body);

  std::vector<Side> sides_;
  std::vector<int> joints_;             ///< with constrained directions, in the order of blocks
  std::vector<double> inverse_shares_;  ///< of the limit (ShareOfLimit()), by block
  std::vector<bool> on_loops_;          ///< by block
  bool has_rank_ = false;
  BlockCholesky X_;
  std::vector<Pair> pairs_;
  std::vector<Wrench<Space, double>> c_;
  std::vector<Acceleration<Space, double>> Mc_;
  std::vector<double> x_;
  std::vector<Components<Space, double>> phi_;
  double rcond_ = 1.0;
  int worst_joint_ = -1;
};

/// Returns true if pivots prove all constraints independent at this position, by geometry alone;
/// false proves nothing.
template <class Space>
bool AreIndependent(const Kinematics<Space, double>& kinematics);

}  // namespace loopbench
