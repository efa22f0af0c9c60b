// O-DCA's sweep of vectors over assembled joins (joins.h): free accelerations go up, forces come
// down. Where rank was lost, a second sweep corrects the first.
//
// Joins close loops one after another. Where constraints depend on each other, one join may be far
// worse conditioned than all constraints solved at once, and its round-off spoils the result. The
// joints' residual r = C A + c0 shows that, and one step of iterative refinement, in place:
//   A += sweep(b = 0, c0 = r),   squares the error; a softened weight w becomes 1 - (1 - w)^2.
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

  /// In: `b` the free acceleration of each body (index = body), `c0` Space::kDim numbers per
  /// mechanism joint. Out: `A` of each body. After Assemble(). Allocates nothing.
  void Solve(std::span<const Motion<Space, S>> b, std::span<const Motion<Space, S>> c0,
             std::span<Motion<Space, S>> A);

  /// phi of each mechanism joint after Solve(); zero where the plan has no such joint.
  std::span<const Motion<Space, S>> multipliers() const { return phi_; }

  /// Multiply-adds since the last Assemble() began.
  long operations() const { return joins_.operations() + operations_; }

 private:
  void Up(const PlanNode& node, int n, std::span<const Motion<Space, S>> c0);
  void Down(const PlanNode& node, int n);
  /// Up and down over what stands in b_; adds to A and phi_.
  void Correct(std::span<const Motion<Space, S>> c0, std::span<Motion<Space, S>> A);
  void Residual(std::span<const Motion<Space, S>> c0, std::span<const Motion<Space, S>> A);

  const Plan& plan_;
  Joins<Space, S> joins_;
  std::vector<Motion<Space, S>> b_, F_;  ///< by kept handle
  std::vector<Motion<Space, S>> phi_, residual_;
  std::vector<S> s_;       ///< by row
  std::vector<S> forces_;  ///< phi of one node
  long operations_ = 0;
};

}  // namespace loopbench::odca
