// O-DCA's vector pass over assembled joins (joins.h): free accelerations go up, forces come down.
// If rank was lost, a second pass corrects the first.
//
//   up     s   = T (C b + c0)             from the children's b                (21, 68)
//          b'  = b - V^T s                to the parent                        (29-30, 72)
//   down   phi = -T^T (s + V F)           from the forces outside              (17, 42, 64)
//          F_body += C^T phi              on the bodies of the joints          (18, 39, 47-48, 65)
//   leaf   A   = M^-1 F_body + b                                               (1-4, 45-46)
//
// Symbols, axes and points of reference are defined in joins.h: a motion or force of a body is at
// its centre of mass, in ground axes. The outside force on the side of an open joint is this
// joint's phi. On a body it is the sum over its joints that close further up. Both are known when
// the downward pass reaches a node. Accelerations of assemblies are never formed.
//
// Joins close loops one after another. If constraints are dependent, one join may be much worse
// conditioned than the simultaneous solution of all constraints, and round-off spoils the result.
// The joints' residual r = C A + c0 reveals this. One step of iterative refinement,
//
//   A += sweep(b = 0, c0 = r),
//
// squares the error; a regularization weight w becomes 1 - (1 - w)^2.
#pragma once

#include "odca/joins.h"

namespace loopbench::odca {

template <class Space, class S>
class Sweep {
 public:
  /// `plan` and `mechanism` must outlive the sweep.
  Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver);

  Outcome Assemble(const Kinematics<Space, S>& kinematics);
  const Joins<Space, S>& joins() const { return joins_; }

  /// By body: free accelerations b (empty if zero) and wrenches M b. By joint: c0, and for tree
  /// joints BodyEquations::known(), the acceleration with the components c0.
  struct Loads {
    std::span<const Acceleration<Space, S>> b;
    std::span<const Wrench<Space, S>> wrenches;
    std::span<const Components<Space, S>> c0;
    std::span<const Acceleration<Space, S>> known;

    Wrench<Space, S> WrenchOn(int n) const {
      return b.empty() ? Wrench<Space, S>::Zero() : wrenches[n + 1];
    }
  };
  /// Computes `A` of each body. Requires Assemble(). Allocates nothing.
  void Solve(const Loads& loads, std::span<Acceleration<Space, S>> A);

  /// Returns phi of each mechanism joint after Solve(), the measure numbers (14) of its constraint
  /// force: components along the columns of D, which may mix moments and forces. Zero if the plan
  /// has no such joint.
  std::span<const Components<Space, S>> multipliers() const { return phi_; }

  /// Multiply-adds since the last Assemble() began.
  long operations() const { return joins_.operations() + operations_; }

 private:
  /// Passes one node upwards, and downwards.
  template <class Rows, class Width>
  void Up(const PlanNode& node, int n, Rows rows, Width width,
          std::span<const Components<Space, S>> c0);
  template <class Rows, class Width>
  void Down(const PlanNode& node, int n, Rows rows, Width width);
  /// UpLeaf() sets b at the handles of a leaf. DownLeaf() adds its acceleration to A.
  void UpLeaf(int n, const Loads& loads);
  void DownLeaf(int n, const Loads& loads, std::span<Acceleration<Space, S>> A);
  /// Runs up and down; adds to A and phi_. Without b the bodies' free accelerations are zero.
  void Correct(const Loads& loads, std::span<Acceleration<Space, S>> A);
  /// r = C A + c0 of every joint, in residual_.
  void Residual(std::span<const Components<Space, S>> c0,
                std::span<const Acceleration<Space, S>> A);

  const Plan& plan_;
  Joins<Space, S> joins_;
  std::vector<S> b_;  ///< of all handles, by slot: a join changes those that stay
  std::vector<S> F_;  ///< phi of all rows, then wrenches of bodies
  /// Accelerations of free leaves without joint forces; of held leaves the given ones.
  std::vector<Acceleration<Space, S>> start_;
  /// By last leaf of a tree: generalised forces along the free directions, L^-1 of these, and last
  /// the accelerations along the free directions.
  std::vector<Components<Space, S>> along_;
  std::vector<Components<Space, S>> phi_, residual_;
  std::vector<S> s_;  ///< by row
  long operations_ = 0;
};

}  // namespace loopbench::odca
