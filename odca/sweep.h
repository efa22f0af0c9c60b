// The numeric half of O-DCA: runs a plan up (assembly) and down (disassembly).
//
// For an assembly with boundary bodies 1..h, all at their centres of mass,
//   A = Z F + b                                                             (1-2, 5-6)
// with F the forces of what is still outside. A joint j from P to Q demands
//   c_Q^T A_Q + c_P^T A_P + c0 = 0,   c_Q = S(r_Q)^T D,  c_P = -S(r_P)^T D,
//   c0 = D^T (n_Q - n_P - g),         n = [0; w x (w x r)],                  (7, 12)
// and carries D phi on Q, -D phi on P, that is c phi on the centres of mass. With C the rows c of
// all joints of a node, on the union of its children's boundaries:
//   X = C Z C^T                                                             (16, 66)
//   phi = -X^+ (C b + c0 + C Z F)                                           (17, 64)
//   Z' = Z - Z C^T X^+ C Z                                                  (26-28, 71)
//   b' = b - Z C^T X^+ (C b + c0)                                           (29-30, 72)
// X^+ = T^T T (loop_solver.h), so with V = T C Z and s = T (C b + c0): Z' = Z - V^T V, b' = b - V^T
// s, phi = -T^T (s + V F). V, T and s are what the way down needs.
//
// All memory is taken at construction; a sweep allocates nothing, and holds no matrix larger than
// the plan's largest join.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mechanism/formulation.h"
#include "mechanism/loop_solver.h"
#include "odca/plan.h"

namespace loopbench::odca {

template <class Space, class S>
class Sweep {
 public:
  /// `plan` and `mechanism` must outlive the sweep. Plan joints index the mechanism's joints.
  Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver);

  /// The way up for matrices: Z of every assembly, T and V of every join, at the current positions.
  Outcome Assemble(const Kinematics<Space, S>& kinematics);

  /// The way up and down for vectors. In: `b` the free acceleration of each body (index = body),
  /// `c0` Space::kDim numbers per mechanism joint. Out: `A` of each body. After Assemble().
  void Solve(std::span<const Motion<Space, S>> b, std::span<const Motion<Space, S>> c0,
             std::span<Motion<Space, S>> A);

  /// phi of each mechanism joint after Solve(); zero where the plan has no such joint.
  std::span<const Motion<Space, S>> multipliers() const { return phi_; }

  int dependent_rows() const { return dependent_rows_; }
  S rcond() const { return rcond_; }
  S smallest_weight() const { return smallest_weight_; }
  int worst_joint() const { return worst_joint_; }
  /// Multiply-adds since the last Assemble() began, counted as they were done (an
  /// eigen-decomposition as if it were a Cholesky factorisation).
  long operations() const { return operations_; }
  /// Entries of the largest matrix held for one join: X or one Z.
  int largest_matrix() const { return largest_matrix_; }

 private:
  /// Where a node's numbers live. Leaves have one handle and no rows.
  struct Place {
    int z = 0;     ///< first block of Z (kept x kept, by columns)
    int b = 0;     ///< first motion of b
    int kept = 1;  ///< handles after the join
    int w = 0;     ///< first motion of W: rows() per handle
    int x = 0;     ///< first number of X, s
    int s = 0;
  };
  enum class Pass { kPhysical, kGeometric, kSoftened };

  bool AssembleAll(const Kinematics<Space, S>& kinematics,
                   const std::vector<Inertia<Space, S>>& inertias, Pass pass);
  const Motion<Space, S>* c_P(const NodeJoint& joint) const { return &c_[c_offset_[joint.index]]; }
  const Motion<Space, S>* c_Q(const NodeJoint& joint) const { return c_P(joint) + joint.rows; }
  void FillLeaves(const Kinematics<Space, S>& kinematics,
                  const std::vector<Inertia<Space, S>>& inertias);
  void FillJoints(const Kinematics<Space, S>& kinematics);
  void FormResponse(const PlanNode& node, const Place& place);
  bool FactorFloating(const PlanNode& node, const Place& place);
  bool FactorLoop(const Kinematics<Space, S>& kinematics, const PlanNode& node, int n, Pass pass,
                  const std::vector<Inertia<Space, S>>& inertias);
  void ApplyToKept(const PlanNode& node, int n);
  void Eliminate(const PlanNode& node, const Place& place);
  void NoteDiagnostics(const PlanNode& node, int n);
  void Up(const PlanNode& node, int n, std::span<const Motion<Space, S>> c0);
  void Down(const PlanNode& node, int n);

  const Mechanism<Space, S>& mechanism_;
  const Plan& plan_;
  SolverKind solver_;
  std::vector<Place> places_;
  std::vector<Block<Space, S>> Z_;
  std::vector<Motion<Space, S>> b_, F_, W_, phi_;
  std::vector<Motion<Space, S>> c_;  ///< rows c_P, then c_Q of each joint
  std::vector<int> c_offset_;        ///< of each mechanism joint in c_
  std::vector<S> X_, s_;
  std::vector<std::unique_ptr<LoopSolver<S>>> loops_;  ///< of nodes that close loops
  std::vector<MatrixX<S>> loop_X_;
  MatrixX<S> columns_;
  VectorX<S> vector_;
  int dependent_rows_ = 0, worst_joint_ = -1, largest_matrix_ = 0;
  S rcond_ = S(1), smallest_weight_ = S(1);
  long operations_ = 0;
};

}  // namespace loopbench::odca
