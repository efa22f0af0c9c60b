#include "odca/sweep.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

template <class Space, class S>
Sweep<Space, S>::Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver)
    : plan_(plan),
      joins_(mechanism, plan, solver),
      b_(plan.num_slots(), S(0)),
      F_(plan.num_rows() + Space::kDim * plan.num_leaves(), S(0)),
      start_(plan.num_leaves(), Acceleration<Space, S>::Zero()),
      along_(plan.num_leaves()),
      phi_(mechanism.joints().size(), Components<Space, S>::Zero()),
      residual_(phi_),
      s_(plan.num_rows(), S(0)) {}

template <class Space, class S>
Outcome Sweep<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  return joins_.Assemble(kinematics);
}

template <class Space, class S>
void Sweep<Space, S>::Solve(const Loads& loads, std::span<Acceleration<Space, S>> A) {
  for (Acceleration<Space, S>& acceleration : A) acceleration.setZero();  // Ground's too (33-34)
  for (Components<Space, S>& phi : phi_) phi.setZero();
  Correct(loads, A);
  if (!joins_.regularized()) return;
  Residual(loads.c0, A);
  Correct({.b = {}, .wrenches = {}, .c0 = residual_, .known = {}}, A);
}

/// The last leaf of a tree has the handles of all its bodies.
template <class Space, class S>
[[gnu::always_inline]] inline void Sweep<Space, S>::UpLeaf(int n, const Loads& loads) {
  const Leaf& leaf = plan_.leaves()[n];
  const bool is_held = leaf.end >= 0;
  Components<Space, S>& along = along_[is_held ? leaf.end : n];
  if (is_held) {
    const int joint = leaf.hold.joint;
    if (leaf.holder < 0) along.setZero();
    start_[n] =
        joins_.Hang(n, leaf.holder < 0 ? nullptr : &start_[leaf.holder], loads.WrenchOn(n),
                    loads.c0[joint], loads.known.empty() ? nullptr : &loads.known[joint], along);
    operations_ += Space::kDim * (leaf.hold.rows + 2 * leaf.path);
    if (leaf.sides.empty()) return;
    joins_.ApplyTree(n, along);
  } else {
    start_[n] = loads.b.empty() ? Acceleration<Space, S>::Zero() : loads.b[n + 1];
  }
  S* slot = b_.data() + leaf.slot;
  if (loads.b.empty() && !is_held) {
    std::fill_n(slot, leaf.width, S(0));
    return;
  }
  if (leaf.is_body) {
    Components<Space, S> x = along;
    if (is_held) joins_.ApplyTreeTransposed(n, x);
    const auto all = is_held ? joins_.HeldAcceleration(n, start_[n], x) : start_[n];
    LOOPBENCH_UNROLL
    for (int d = 0; d < Space::kDim; ++d) slot[d] = all[d];
    return;
  }
  for (const PlanSide& side : leaf.sides) {
    const Wrench<Space, S>* c = joins_.c(side.joint, side.at_Q, side.rows);
    WithSize<S, Space::kDim - 1>(side.rows, [&](auto rows) LOOPBENCH_INLINED {
      Repeat(rows, [&](int i) { slot[i] = c[i].dot(start_[side.leaf]); });
      if (is_held) {
        const Acceleration<Space, S>* of_side = joins_.AlongTree(side);
        WithSize<S, 1, 2, 3>(leaf.free, [&](auto free) LOOPBENCH_INLINED {
          Repeat(rows,
                 [&](int i) { Repeat(free, [&](int k) { slot[i] += of_side[i][k] * along[k]; }); });
        });
      }
      slot += rows;
    });
    operations_ += (Space::kDim + leaf.free) * side.rows;
  }
}

/// A = Z F + b (1-4, 45-46) with all forces known, including the joints' own. The last leaf of a
/// tree solves for all its bodies.
template <class Space, class S>
[[gnu::always_inline]] inline void Sweep<Space, S>::DownLeaf(int n, const Loads& loads,
                                                             std::span<Acceleration<Space, S>> A) {
  const Leaf& leaf = plan_.leaves()[n];
  const auto force_on = [&](int other) { return &F_[plan_.num_rows() + Space::kDim * other]; };
  Wrench<Space, S> F;
  LOOPBENCH_UNROLL
  for (int d = 0; d < Space::kDim; ++d) F[d] = force_on(n)[d];
  operations_ += Space::kDim * Space::kDim / 3;
  if (leaf.end < 0) {
    A[n + 1] += start_[n] + joins_.Response(n, F);
    return;
  }
  Components<Space, S>& x = along_[leaf.end];
  if (leaf.end == n) {
    if (leaf.sides.empty()) joins_.ApplyTree(n, x);
    if (leaf.is_body) x += joins_.AlongTree(n, F);
    for (const PlanSide& side : leaf.is_body ? std::span<const PlanSide>() : leaf.sides) {
      const Acceleration<Space, S>* of_side = joins_.AlongTree(side);
      WithSize<S, 1, 2, 3>(leaf.free, [&](auto free) LOOPBENCH_INLINED {
        for (int i = 0; i < side.rows; ++i) {
          Repeat(free, [&](int k) { x[k] += of_side[i][k] * F_[side.row + i]; });
        }
      });
    }
    joins_.ApplyTreeTransposed(n, x);
  }
  const Acceleration<Space, S> all = joins_.HeldAcceleration(n, start_[n], x);
  A[n + 1] += all;
  const Wrench<Space, S> holding = joins_.HoldingWrench(n, all, F + loads.WrenchOn(n));
  const Components<Space, S> phi = joins_.HoldingForce(n, holding);
  for (int i = 0; i < leaf.hold.rows; ++i) phi_[leaf.hold.joint][i] += phi[i];
  operations_ += Space::kDim * (leaf.hold.rows + 2 * leaf.path);
  if (leaf.holder < 0) return;
  const Wrench<Space, S> reaction = joins_.OnHolder(n, holding);
  LOOPBENCH_UNROLL
  for (int d = 0; d < Space::kDim; ++d) force_on(leaf.holder)[d] += reaction[d];
}

template <class Space, class S>
void Sweep<Space, S>::Correct(const Loads& loads, std::span<Acceleration<Space, S>> A) {
  const int leaves = plan_.num_leaves();
  std::ranges::fill(F_, S(0));
  for (const int n : plan_.leaf_order()) UpLeaf(n, loads);
  for (int n = leaves; n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithSizes<Space, S>(node, [&](auto rows, auto width) { Up(node, n, rows, width, loads.c0); });
  }
  for (int n = plan_.num_nodes() - 1; n >= leaves; --n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithSizes<Space, S>(node, [&](auto rows, auto width) { Down(node, n, rows, width); });
  }
  const std::vector<int>& order = plan_.leaf_order();
  for (auto n = order.rbegin(); n != order.rend(); ++n) DownLeaf(*n, loads, A);
}

/// r = C A + c0 of every joint: D^T times the difference of the two sides of (7), without udot.
template <class Space, class S>
void Sweep<Space, S>::Residual(std::span<const Components<Space, S>> c0,
                               std::span<const Acceleration<Space, S>> A) {
  for (const PlanNode& node : plan_.nodes()) {
    const auto body = [&](int handle) { return node.handles[handle].body; };
    for (const NodeJoint& joint : node.joints) {
      Components<Space, S>& r = residual_[joint.index];
      for (int i = 0; i < joint.rows; ++i) {
        r[i] = c0[joint.index][i];
        if (joint.from >= 0) r[i] += joins_.c_P(joint)[i].dot(A[body(joint.from)]);
        if (joint.to >= 0) r[i] += joins_.c_Q(joint)[i].dot(A[body(joint.to)]);
      }
      operations_ += 2 * Space::kDim * joint.rows;
    }
  }
}

/// C b + c0 is the negative of the bracket in (15) without outer forces, of chi_i3 in (42), of K
/// (68); with T it is s, and the paper's Y-hat is -C^T T^T s (21). Then b' = b - V^T s is
/// Upsilon_i3 (29-30) and zeta^asm_i3 (72). The zero that c0 + c_P^T A_P + c_Q^T A_Q must be is
/// (37-38) at joints to Ground and (57-58) in a coupled loop.
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::Up(const PlanNode& node, int n, Rows rows, Width known,
                         std::span<const Components<Space, S>> c0) {
  S* s = s_.data() + node.joints.front().row;
  int row = 0;
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf<Space>(joint, rows, known);
    for (int i = 0; i < count; ++i) s[row + i] = c0[joint.index][i];  // (15, 42, 68)
    for (const bool at_Q : {false, true}) {
      const int h = at_Q ? joint.to : joint.from;
      if (h < 0) continue;
      const S* b = b_.data() + node.handles[h].slot;
      if (!IsBody<Space>(node.handles[h], known)) {
        for (int i = 0; i < count; ++i) s[row + i] += b[i];
        continue;
      }
      const Wrench<Space, S>* c = joins_.c(joint.index, at_Q, joint.rows);
      for (int i = 0; i < count; ++i) {
        S sum = s[row + i];
        LOOPBENCH_UNROLL
        for (int d = 0; d < Space::kDim; ++d) sum += c[i][d] * b[d];
        s[row + i] = sum;
      }
      operations_ += Space::kDim * count;
    }
    row += count;
  }
  joins_.Apply(node, n, rows, s);  // (21)
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    const S* V = joins_.V(node, n, handle);
    S* b = b_.data() + handle.slot;
    WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
      for (int i = 0; i < rows; ++i) {
        Repeat(width, [&](int a) { b[a] -= V[i * width + a] * s[i]; });  // (29-30, 72)
      }
    });
  }
  operations_ += rows * (node.kept_numbers + rows / 2);
}

/// phi = -T^T (s + V F) are the measure numbers of a series join (17), of the base and terminal
/// joint, the solution of (42), and of a coupled loop (64). The force on a body is the external
/// force F^ext of (47-48) plus c phi, the D phi of (13, 18, 39, 59, 65) moved from Mo to the centre
/// of mass.
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::Down(const PlanNode& node, int n, Rows rows, Width known) {
  const int first = node.joints.front().row;
  S* phi = F_.data() + first;
  for (int i = 0; i < rows; ++i) phi[i] = -s_[first + i];
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    const S* V = joins_.V(node, n, handle);
    const S* F = F_.data() + handle.force;
    WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
      for (int i = 0; i < rows; ++i) {
        S sum = phi[i];
        Repeat(width, [&](int a) { sum -= V[i * width + a] * F[a]; });
        phi[i] = sum;
      }
    });
  }
  joins_.ApplyTransposed(node, n, rows, phi);  // (17, 42, 64)
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf<Space>(joint, rows, known);
    for (int i = 0; i < count; ++i) phi_[joint.index][i] += phi[i];
    for (const bool at_Q : {false, true}) {
      const int h = at_Q ? joint.to : joint.from;
      if (h < 0) continue;
      const Wrench<Space, S>* c = joins_.c(joint.index, at_Q, joint.rows);
      auto sum = Wrench<Space, S>::Zero();
      for (int i = 0; i < count; ++i) sum += c[i] * phi[i];  // (18, 39, 47-48, 65)
      S* F = F_.data() + plan_.num_rows() + Space::kDim * (node.handles[h].body - 1);
      LOOPBENCH_UNROLL
      for (int d = 0; d < Space::kDim; ++d) F[d] += sum[d];
      operations_ += Space::kDim * count;
    }
    phi += count;
  }
  operations_ += rows * (node.kept_numbers + rows / 2);
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Sweep<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
