// The equations of constraint_solver.h body by body, for solvers that form neither h and gamma nor
// the mass matrix of the forest:
//
//   A = b + M^-1 sum of c phi        each body: its wrenches, and those of its joints
//   sum of c^T A + c0 = 0            each joint with constrained directions
//
// All accelerations are at centres of mass, without centripetal terms. A joint from P to Q carries
// D phi on Q and -D phi on P at Mo (13); at the centres of mass this is
//
//   c_Q =  S(r_Q)^T D,    c_P = -S(r_P)^T D,    c0 = D^T (n_Q - n_P - g),    n = [0; w x (w x r)]
//
// and demands D^T (A_Q - A_P - g) = 0 at Mo (12). Equation numbers: the O-DCA paper's.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
class BodyEquations {
 public:
  /// `mechanism` must outlive this.
  explicit BodyEquations(const Mechanism<Space, S>& mechanism);

  /// b and c0 of ConstraintSolver::Solve(): a force along a tree joint is a pair of wrenches.
  void SetForce(const Kinematics<Space, S>& kinematics, const VectorX<S>& force,
                const VectorX<S>& target);
  /// For ConstraintSolver::SolveWrenches(): b of the wrenches, and c0 = 0.
  void SetWrenches(const Kinematics<Space, S>& kinematics, const VectorX<S>& wrenches);
  /// For ConstraintSolver::Accelerate(): b from the wrenches of applied forces less w x I w.
  void SetState(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback);
  /// ConstraintSolver::AccelerateWithShare(): `solve` solves the equations as they are set, `phi`
  /// returns the constraint forces of the last solution.
  void AccelerateWithShare(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                           auto& stress, VectorX<S>& udot, VectorX<S>* lambda, auto solve,
                           auto phi) {
    SetState(kinematics, feedback);
    solve();
    if (lambda != nullptr) Read(phi(), *lambda);
    SetTarget(stress.ShareOfAccelerations(kinematics, A_));
    std::swap(A_, last_);
    solve();
    for (std::size_t body = 0; body < A_.size(); ++body) A_[body] += last_[body];
    Read(kinematics, udot);
    if (lambda == nullptr) return;
    lambda_change_ = *lambda;
    Read(phi(), *lambda);
    *lambda += lambda_change_;
  }
  /// Sets the velocity violation of `kinematics` as the only load.
  void SetMissed(const Kinematics<Space, S>& kinematics);

  /// Empty if no force acts.
  std::span<const Acceleration<Space, S>> b() const {
    return has_force_ ? std::span<const Acceleration<Space, S>>(b_)
                      : std::span<const Acceleration<Space, S>>();
  }
  /// M b, without the rounding errors of b.
  std::span<const Wrench<Space, S>> wrenches() const { return wrenches_; }
  std::span<const Components<Space, S>> c0() const { return c0_; }
  /// n_Q - n_P - g of each joint, at Mo in ground axes; empty if speeds do not count.
  std::span<const Acceleration<Space, S>> known() const {
    return has_speeds_ ? std::span<const Acceleration<Space, S>>(known_)
                       : std::span<const Acceleration<Space, S>>();
  }
  /// For the solution: of all bodies, with Ground's zero.
  std::span<Acceleration<Space, S>> A() { return A_; }

  /// x of the tree joints from A.
  void Read(const Kinematics<Space, S>& kinematics, VectorX<S>& x) const;
  /// lambda from the phi of all joints.
  void Read(std::span<const Components<Space, S>> phi, VectorX<S>& lambda) const;

 private:
  /// c0 for accelerations of constraints, without force.
  void SetTarget(const VectorX<S>& target);
  /// b_ for wrenches_, at the speeds of `kinematics` or at rest.
  void SetFree(const Kinematics<Space, S>& kinematics, bool turning);

  const Mechanism<Space, S>& mechanism_;
  std::vector<Wrench<Space, S>> wrenches_;
  std::vector<Acceleration<Space, S>> b_, A_, last_;
  std::vector<Components<Space, S>> c0_;
  std::vector<Acceleration<Space, S>> known_;
  bool has_force_ = false, has_speeds_ = false;
  VectorX<S> lambda_change_;
  VectorX<S> known_x_;  ///< part of x that does not come from A
};

}  // namespace loopbench
