#include "odca/sweep.h"

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

template <class Space, class S>
Sweep<Space, S>::Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver)
    : plan_(plan),
      joins_(mechanism, plan, solver),
      b_(joins_.num_handles(), Acceleration<Space, S>::Zero()),
      F_(joins_.num_handles(), Wrench<Space, S>::Zero()),
      phi_(mechanism.joints().size(), Components<Space, S>::Zero()),
      residual_(phi_),
      s_(joins_.num_rows(), S(0)),
      forces_(plan.largest_join(), S(0)) {}

template <class Space, class S>
Outcome Sweep<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  return joins_.Assemble(kinematics);
}

template <class Space, class S>
void Sweep<Space, S>::Solve(std::span<const Acceleration<Space, S>> b,
                            std::span<const Components<Space, S>> c0,
                            std::span<Acceleration<Space, S>> A) {
  for (int n = 0; n < plan_.num_leaves(); ++n) {
    A[n + 1].setZero();
    b_[joins_.first_handle(n)] = b[n + 1];
  }
  A[kGround].setZero();  // the inertial frame of (33-34)
  for (Components<Space, S>& phi : phi_) phi.setZero();
  Correct(c0, A);
  if (!joins_.regularized()) return;
  Residual(c0, A);
  for (int n = 0; n < plan_.num_leaves(); ++n) b_[joins_.first_handle(n)].setZero();
  Correct(residual_, A);
}

/// At the leaves A = Z F + b (1-4, 45-46) with all forces known, including the joints' own.
template <class Space, class S>
void Sweep<Space, S>::Correct(std::span<const Components<Space, S>> c0,
                              std::span<Acceleration<Space, S>> A) {
  const int leaves = plan_.num_leaves();
  for (int n = leaves; n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithRows<Space>(node, [&](auto rows) { Up(node, n, rows, c0); });
  }
  // a root's boundary is empty; a body without joints is a root whose one handle feels no force
  for (int n = 0; n < leaves; ++n) F_[joins_.first_handle(n)].setZero();
  for (int n = plan_.num_nodes() - 1; n >= leaves; --n) {
    const PlanNode& node = plan_.nodes()[n - leaves];
    WithRows<Space>(node, [&](auto rows) { Down(node, n, rows); });
  }
  for (int n = 0; n < leaves; ++n) {
    const int handle = joins_.first_handle(n);
    A[n + 1] += b_[handle];
    A[n + 1] += Apply<Acceleration<Space, S>>(joins_.LeafZ(n), F_[handle]);
  }
  operations_ += static_cast<long>(leaves) * Space::kDim * Space::kDim;
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
template <class Rows>
void Sweep<Space, S>::Up(const PlanNode& node, int n, Rows rows,
                         std::span<const Components<Space, S>> c0) {
  S* s = &s_[joins_.first_row(n)];
  int row = 0;
  const auto b_of = [&](int f) -> const Acceleration<Space, S>& {
    const Handle& handle = node.handles[f];
    return b_[joins_.first_handle(node.children[handle.child]) + handle.place];
  };
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf(joint, rows);
    for (int i = 0; i < count; ++i, ++row) {
      s[row] = c0[joint.index][i];  // (15, 42, 68)
      if (joint.from >= 0) s[row] += joins_.c_P(joint)[i].dot(b_of(joint.from));
      if (joint.to >= 0) s[row] += joins_.c_Q(joint)[i].dot(b_of(joint.to));
    }
  }
  joins_.Apply(node, n, rows, s);  // (21)
  const int kept = joins_.kept(n);
  for (int e = 0; e < kept; ++e) {
    Acceleration<Space, S> b = b_of(node.kept[e]);
    const Acceleration<Space, S>* V = joins_.V(node, n, node.kept[e]);
    for (int i = 0; i < rows; ++i) b -= V[i] * s[i];  // (29-30, 72)
    b_[joins_.first_handle(n) + e] = b;
  }
  operations_ += rows * (2 * Space::kDim + Space::kDim * kept + rows / 2);
}

/// phi = -T^T (s + V F) are the measure numbers of a series join (17), of the base and terminal
/// joint, the solution of (42), and of a coupled loop (64). The force on a handle of a child is the
/// external force F^ext of (47-48) plus c phi, the D phi of (13, 18, 39, 59, 65) moved from Mo to
/// the centre of mass.
template <class Space, class S>
template <class Rows>
void Sweep<Space, S>::Down(const PlanNode& node, int n, Rows rows) {
  const int kept = joins_.kept(n);
  const Wrench<Space, S>* F_kept = F_.data() + joins_.first_handle(n);
  S* phi = forces_.data();
  for (int i = 0; i < rows; ++i) phi[i] = -s_[joins_.first_row(n) + i];
  for (int e = 0; e < kept; ++e) {
    const Acceleration<Space, S>* V = joins_.V(node, n, node.kept[e]);
    for (int i = 0; i < rows; ++i) phi[i] -= V[i].dot(F_kept[e]);
  }
  joins_.ApplyTransposed(node, n, rows, phi);  // (17, 42, 64)
  const auto force_on = [&](int f) -> Wrench<Space, S>& {
    const Handle& handle = node.handles[f];
    return F_[joins_.first_handle(node.children[handle.child]) + handle.place];
  };
  int next = 0;
  for (int f = 0; f < static_cast<int>(node.handles.size()); ++f) {
    if (node.handles[f].kept) {
      force_on(f) = F_kept[next++];  // F^ext of (47-48)
    } else {
      force_on(f).setZero();
    }
  }
  int row = 0;
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf(joint, rows);
    for (int i = 0; i < count; ++i, ++row) {
      phi_[joint.index][i] += phi[row];
      if (joint.from >= 0) force_on(joint.from) += joins_.c_P(joint)[i] * phi[row];
      if (joint.to >= 0) force_on(joint.to) += joins_.c_Q(joint)[i] * phi[row];  // (18, 39, 65)
    }
  }
  operations_ += rows * (2 * Space::kDim + Space::kDim * kept + rows / 2);
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Sweep<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
