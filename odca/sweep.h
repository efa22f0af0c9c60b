// The numeric half of O-DCA: the equations and names are in README.md ("A joint", "A join", "Plan
// and sweep"), with an index of the paper's equations. All quantities are in ground axes: a body's
// at its centre of mass, a joint's at Mo.
//
// Joins close loops one after another. If constraints are dependent, one join may be much worse
// conditioned than the simultaneous solution of all constraints, and round-off spoils the result.
// The joints' residual r = C A + c0 reveals this. One step of iterative refinement,
//
//   A += sweep(b = 0, c0 = r),
//
// squares the error; a regularization weight w becomes 1 - (1 - w)^2.
//
// Construction allocates all memory, in the sizes of the plan.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "mechanism/algebra/known_size.h"
#include "mechanism/algebra/lower_triangle.h"
#include "mechanism/algebra/worker_pool.h"
#include "mechanism/description/outcome.h"
#include "mechanism/formulation/options.h"
#include "mechanism/loops/loop_solver.h"
#include "mechanism/model/kinematics.h"
#include "odca/plan.h"

namespace loopbench::odca {

/// Behind the parameters of a lambda: its captures must not go through memory.
#define LOOPBENCH_INLINED __attribute__((always_inline))

template <class Size>
inline constexpr bool kIsKnown = kKnownSize<Size> != 0;

/// Calls `call` with the rows of a node and the numbers of each handle. Rows are a constant for one
/// joint that leaves one direction free, or three in space. Numbers are a constant if all handles
/// are bodies, or all are rows of such joints.
template <class Space, class S, class Call>
[[gnu::always_inline]] inline auto WithSizes(const PlanNode& node, const Call& call) {
  return WithSize<S, Space::kDim, Space::kDim - 1>(node.width, [&](auto width) {
    return node.joints.size() == 1 ? WithSize<S, Space::kDim - 1, 3>(
                                         node.rows, [&](auto rows) { return call(rows, width); })
                                   : call(node.rows, width);
  });
}
/// Returns the rows of a joint of a node, given those sizes.
template <class Space, class Rows, class Width>
auto RowsOf(const NodeJoint& joint, Rows rows, Width) {
  if constexpr (kIsKnown<Rows>) {
    return rows;
  } else if constexpr (kKnownSize<Width> == Space::kDim - 1) {
    return Width();
  } else {
    return joint.rows;
  }
}
/// Returns true if a handle is a body, given the numbers of each handle of its node.
template <class Space, class Width>
bool IsBody(const Handle& handle, Width) {
  return kIsKnown<Width> ? kKnownSize<Width> == Space::kDim : handle.is_body();
}
/// Calls `call` with the numbers of a handle; `width`: the numbers of each handle of its node.
template <class Space, class S, class Width, class Call>
[[gnu::always_inline]] inline auto WithWidth(const Handle& handle, Width width, const Call& call) {
  if constexpr (kIsKnown<Width>) {
    return call(width);
  } else {
    return WithSize<S, Space::kDim - 1, Space::kDim, Space::kDim - 2>(handle.width, call);
  }
}
/// Returns the numbers of a block, a constant if both of its sides are constants.
template <class Rows, class Columns>
auto Product(Rows rows, Columns columns) {
  if constexpr (kIsKnown<Rows> && kIsKnown<Columns>) {
    return std::integral_constant<int, Rows::value * Columns::value>();
  } else {
    return rows * columns;
  }
}

template <class Space, class S>
class Sweep {
 public:
  /// `mechanism` and `plan` must outlive this. Plan joints index the mechanism's joints. Up to
  /// `threads` threads share the pieces of the plan. Results are bitwise equal for any number.
  Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver, int threads = 1);

  /// Assembles from the leaves up, at the current positions.
  Outcome Assemble(const Kinematics<Space, S>& kinematics);

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

  /// Acceleration of leaf n by a wrench.
  Acceleration<Space, S> Response(int n, const Wrench<Space, S>& F) const {
    if (plan_.leaves()[n].end >= 0) {
      Components<Space, S> x = AlongTree(n, F);
      ApplyTreeTransposed(n, x);
      return HeldAcceleration(n, Acceleration<Space, S>::Zero(), x);
    }
    return {bodies_[n].rotational_inverse * F.angular, F.linear * bodies_[n].per_mass};
  }
  /// V of an inner node on one of its kept handles: row after row.
  const S* V(const PlanNode& node, int n, const Handle& handle) const {
    return &Y_[places_[n].y + handle.number * node.rows];
  }
  /// Returns true if Assemble() dropped or regularized a direction; solutions are then refined.
  bool regularized() const { return regularized_; }
  int dependent_rows() const { return dependent_rows_; }
  S rcond() const { return rcond_; }
  S smallest_weight() const { return smallest_weight_; }
  int worst_joint() const { return worst_joint_; }
  /// Multiply-adds since the last Assemble() began, counted as they were done (an
  /// eigen-decomposition as if it were a Cholesky factorisation). After a failure in a piece, later
  /// pieces do not count.
  long operations() const { return operations_; }

 private:
  /// Storage of a node's numbers.
  struct Place {
    /// First number of Z, `size` x `size`, both triangles, in blocks of handles: block (e, f)
    /// at size * f.place + f.width * e.place, by columns.
    int z = 0;
    int size = 0;   ///< of the boundary
    int y = 0;      ///< first number of Y: of each handle before the join, row after row
    int x = 0;      ///< first number of X
    int loop = -1;  ///< index of the loop solver
    int hold = 0;   ///< of a held leaf, first of its free directions
    int tree = 0;   ///< of the last leaf of a tree, first number of its N
    int bodies = 1;
  };
  /// Inertia in ground axes; the rotational one of held bodies alone.
  struct Body {
    typename Inertia<Space, S>::Matrix rotational, rotational_inverse;
    S mass = S(0), per_mass = S(0);
    /// For held bodies: from the holder's centre of mass to the body's, and from there to Mo.
    Linear<Space, S> from_holder, to_hold;
  };
  /// A free direction of a held body, and the body's inertia times it.
  struct FreeDirection {
    int column = 0;  ///< its index among the free directions of the tree
    Acceleration<Space, S> h;
    Wrench<Space, S> Mh;
  };
  /// A piece of the plan, with memory for its nodes alone.
  struct alignas(64) Piece {
    std::span<const int> nodes, leaves;
    std::vector<int> lone_leaves;  ///< leaves without sides: inside trees, or without joints
    MatrixX<S> columns;
    long operations = 0;  ///< until AddOperations()
  };
  /// v := L^-1 v and v := L^-T v for N = L L^T of the tree of leaf n.
  void ApplyTree(int n, Components<Space, S>& v) const {
    WithTree(n, [&](auto size, const S* L) { SolveLower(L, size, &v[0]); });
  }
  void ApplyTreeTransposed(int n, Components<Space, S>& v) const {
    WithTree(n, [&](auto size, const S* L) { SolveLowerTransposed(L, size, &v[0]); });
  }
  /// L^-1 H^T F
  Components<Space, S> AlongTree(int n, const Wrench<Space, S>& F) const;
  /// L^-1 H^T c of each row c of a side of a held leaf, in the first components.
  const Acceleration<Space, S>* AlongTree(const PlanSide& side) const { return &Mc_[Offset(side)]; }
  /// `given` plus the acceleration along the free directions of a held body.
  Acceleration<Space, S> HeldAcceleration(int n, const Acceleration<Space, S>& given,
                                          const Components<Space, S>& x) const;
  /// Rows c of a joint, at the centres of mass: the wrenches on P and Q that unit forces along D
  /// make.
  const Wrench<Space, S>* c(int joint, bool at_Q, int rows) const {
    return &c_[c_offset_[joint] + (at_Q ? rows : 0)];
  }
  const Wrench<Space, S>* c_P(const NodeJoint& joint) const {
    return c(joint.index, false, joint.rows);
  }
  const Wrench<Space, S>* c_Q(const NodeJoint& joint) const {
    return c(joint.index, true, joint.rows);
  }
  /// v := T v for the rows of an inner node, and v := T^T v.
  template <class Rows>
  void Apply(const PlanNode& node, int n, Rows rows, S* v) const {
    if (node.closes_loop) {
      loops_[places_[n].loop].Apply(Eigen::Map<MatrixX<S>>(v, rows, 1));
    } else {
      SolveLower(&X_[places_[n].x], rows, v);
    }
  }
  template <class Rows>
  void ApplyTransposed(const PlanNode& node, int n, Rows rows, S* v) const {
    if (node.closes_loop) {
      loops_[places_[n].loop].ApplyTransposed(Eigen::Map<VectorX<S>>(v, rows));
    } else {
      SolveLowerTransposed(&X_[places_[n].x], rows, v);
    }
  }

  bool IsLeaf(int n) const { return n < plan_.num_leaves(); }
  const PlanNode& Node(int n) const { return plan_.nodes()[n - plan_.num_leaves()]; }
  enum class Pass { kPhysical, kGeometric, kRegularized };

  bool AssembleAll(const Kinematics<Space, S>& kinematics, Pass pass);
  /// Stops at a node that fails, or after `failed`, the first failed node of all pieces so far.
  void AssemblePiece(const Kinematics<Space, S>& kinematics, Pass pass, Piece& piece,
                     std::atomic<int>& failed);
  /// Calls `call` with all pieces but the last one; threads share these.
  void ForPieces(const auto& call) {
    pool_.ForEach(static_cast<int>(pieces_.size()) - 1, [&](int i) { call(pieces_[i]); });
  }
  /// Adds the operations of pieces that begin no later than node `end`.
  void AddOperations(int end);
  void FillLeaf(const Kinematics<Space, S>& kinematics, Masses masses, Piece& piece, int n);
  void FillHold(const Kinematics<Space, S>& kinematics, Masses masses, Piece& piece, int n);
  template <class Rows>
  void FillRows(const Kinematics<Space, S>& kinematics, Masses masses, const PlanSide& side,
                Rows rows);
  int Offset(const PlanSide& side) const {
    return c_offset_[side.joint] + (side.at_Q ? side.rows : 0);
  }
  /// Calls `call` with the number of free directions on the path to a held leaf, and the
  /// directions. The number is a constant up to three. WithTree() takes all free directions of the
  /// leaf's tree, and N or its factor.
  template <class Call>
  [[gnu::always_inline]] auto WithPath(int n, const Call& call) const {
    const FreeDirection* free = free_.data() + places_[n].hold;
    return WithSize<S, 1, 2, 3>(plan_.leaves()[n].path,
                                [&](auto size) LOOPBENCH_INLINED { return call(size, free); });
  }
  template <class Call>
  [[gnu::always_inline]] auto WithTree(int n, const Call& call) const {
    const S* N = trees_.data() + places_[plan_.leaves()[n].end].tree;
    return WithSize<S, 1, 2, 3>(plan_.leaves()[n].free,
                                [&](auto size) LOOPBENCH_INLINED { return call(size, N); });
  }
  template <class Rows, class Width>
  void FormResponse(const PlanNode& node, const Place& place, Piece& piece, Rows rows, Width width);
  template <class Rows>
  bool FactorFloating(const Place& place, Piece& piece, Rows rows);
  JointMatrix<S> FreeResponseAt(const PlanNode& node, const NodeJoint& joint) const;
  bool FactorLoop(const PlanNode& node, const Place& place, Piece& piece, Pass pass);
  template <class Rows, class Width>
  void ApplyToKept(const PlanNode& node, const Place& place, Piece& piece, Rows rows, Width width);
  template <class Rows, class Width, class Numbers>
  void RespondAt(const PlanNode& node, const Handle& side, const Handle& handle,
                 const Wrench<Space, S>* c, Rows count, Width known, Numbers width, bool adds,
                 S* Y) const;
  template <class Rows, class Width>
  void Eliminate(const PlanNode& node, const Place& place, Piece& piece, Rows rows, Width width);
  void NoteDiagnostics(const PlanNode& node, const LoopSolver<S>& loop);

  /// Passes one node upwards, and downwards.
  template <class Rows, class Width>
  void Up(const PlanNode& node, int n, Piece& piece, Rows rows, Width width,
          std::span<const Components<Space, S>> c0);
  template <class Rows, class Width>
  void Down(const PlanNode& node, int n, Piece& piece, Rows rows, Width width);
  /// UpLeaf() sets b at the handles of a leaf. DownLeaf() adds its acceleration to A.
  void UpLeaf(int n, Piece& piece, const Loads& loads);
  void DownLeaf(int n, Piece& piece, const Loads& loads, std::span<Acceleration<Space, S>> A);
  void UpPiece(Piece& piece, const Loads& loads);
  void DownPiece(Piece& piece, const Loads& loads, std::span<Acceleration<Space, S>> A);
  /// Runs up and down; adds to A and phi_. Without b the bodies' free accelerations are zero.
  void Correct(const Loads& loads, std::span<Acceleration<Space, S>> A);
  /// r = C A + c0 of every joint of a piece, in residual_.
  void Residual(Piece& piece, std::span<const Components<Space, S>> c0,
                std::span<const Acceleration<Space, S>> A);

  const Mechanism<Space, S>& mechanism_;
  const Plan& plan_;
  SolverKind solver_;
  std::vector<Place> places_;
  std::vector<Body> bodies_;  ///< by leaf
  std::vector<FreeDirection> free_;
  std::vector<S> trees_;  ///< N of each tree, or its factor as lower_triangle.h has it
  std::vector<S> Z_;
  std::vector<S> Y_;                        ///< Y of each node; on handles that stay then V = T Y
  std::vector<Wrench<Space, S>> c_;         ///< rows c_P, then c_Q of each joint
  std::vector<Acceleration<Space, S>> Mc_;  ///< responses to c; of a hold, duals of its c
  std::vector<int> c_offset_;               ///< of each mechanism joint in c_
  std::vector<S> X_;
  std::vector<LoopSolver<S>> loops_;
  std::vector<int> loop_nodes_;  ///< their nodes
  std::vector<Piece> pieces_;
  bool regularized_ = false;
  int dependent_rows_ = 0, worst_joint_ = -1;
  S rcond_ = S(1), smallest_weight_ = S(1);
  double regularization_ = kRegularization;
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
  WorkerPool pool_;
};

}  // namespace loopbench::odca
