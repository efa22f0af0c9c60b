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
      phi_(mechanism.joints().size(), Components<Space, S>::Zero()),
      residual_(phi_),
      s_(plan.num_rows(), S(0)) {}

template <class Space, class S>
Outcome Sweep<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  return joins_.Assemble(kinematics);
}

template <class Space, class S>
void Sweep<Space, S>::Solve(std::span<const Acceleration<Space, S>> b,
                            std::span<const Wrench<Space, S>> wrenches,
                            std::span<const Components<Space, S>> c0,
                            std::span<Acceleration<Space, S>> A) {
  for (Acceleration<Space, S>& acceleration : A) acceleration.setZero();  // Ground's too (33-34)
  for (Components<Space, S>& phi : phi_) phi.setZero();
  Correct(b, wrenches, c0, A);
  if (!joins_.regularized()) return;
  Residual(c0, A);
  Correct({}, {}, residual_, A);
}

/// At the leaves A = Z F + b (1-4, 45-46) with all forces known, including the joints' own.
template <class Space, class S>
void Sweep<Space, S>::Correct(std::span<const Acceleration<Space, S>> b,
                              std::span<const Wrench<Space, S>> wrenches,
                              std::span<const Components<Space, S>> c0,
                              std::span<Acceleration<Space, S>> A) {
  const int leaves = plan_.num_leaves();
  std::ranges::fill(F_, S(0));
  const auto wrench = [&](int n) { return b.empty() ? Wrench<Space, S>::Zero() : wrenches[n + 1]; };
  for (int n = 0; n < leaves; ++n) {
    const Leaf& leaf = plan_.leaves()[n];
    if (leaf.hold.joint >= 0) {
      start_[n] = joins_.Held(n, wrench(n), c0[leaf.hold.joint]);
      operations_ += Space::kDim * (2 * Space::kDim - leaf.hold.rows);
    } else {
      start_[n] = b.empty() ? Acceleration<Space, S>::Zero() : b[n + 1];
    }
    S* slot = b_.data() + leaf.slot;
    if (b.empty() && leaf.hold.joint < 0) {
      std::fill_n(slot, leaf.width, S(0));
      continue;
    }
    if (leaf.is_body) {
      LOOPBENCH_UNROLL
      for (int d = 0; d < Space::kDim; ++d) slot[d] = start_[n][d];
      continue;
    }
    for (const PlanSide& side : leaf.sides) {
      const Wrench<Space, S>* c = joins_.c(side.joint, side.at_Q, side.rows);
      WithSize<Space::kDim - 1>(side.rows, [&](auto rows) LOOPBENCH_INLINED {
        Repeat(rows, [&](int i) { slot[i] = c[i].dot(start_[n]); });
        slot += rows;
      });
      operations_ += Space::kDim * side.rows;
    }
  }
  for (int n = leaves; n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithSizes<Space>(node, [&](auto rows, auto width) { Up(node, n, rows, width, c0); });
  }
  for (int n = plan_.num_nodes() - 1; n >= leaves; --n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithSizes<Space>(node, [&](auto rows, auto width) { Down(node, n, rows, width); });
  }
  for (int n = 0; n < leaves; ++n) {
    const PlanSide& hold = plan_.leaves()[n].hold;
    Wrench<Space, S> F;
    LOOPBENCH_UNROLL
    for (int d = 0; d < Space::kDim; ++d) F[d] = F_[plan_.num_rows() + Space::kDim * n + d];
    const Acceleration<Space, S> all = start_[n] + joins_.Response(n, F);
    A[n + 1] += all;
    operations_ += Space::kDim * Space::kDim / 3;
    if (hold.joint < 0) continue;
    const Components<Space, S> phi = joins_.HoldingForce(n, all, F + wrench(n));
    for (int i = 0; i < hold.rows; ++i) phi_[hold.joint][i] += phi[i];
    operations_ += Space::kDim * (2 * Space::kDim - hold.rows);
  }
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
    WithWidth<Space>(handle, known, [&](auto width) LOOPBENCH_INLINED {
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
    WithWidth<Space>(handle, known, [&](auto width) LOOPBENCH_INLINED {
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
