#include "odca/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/instantiate.h"
#include "mechanism/tree_dynamics.h"

namespace loopbench::odca {

template <class Space, class S>
Sweep<Space, S>::Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver)
    : mechanism_(mechanism), plan_(plan), solver_(solver), places_(plan.num_nodes()) {
  int z = 0, b = 0, w = 0, x = 0, s = 0, widest = 0;
  for (int n = 0; n < plan.num_nodes(); ++n) {
    Place& place = places_[n];
    place.z = z;
    place.b = b;
    place.w = w;
    place.x = x;
    place.s = s;
    if (n >= plan.num_leaves()) {
      const PlanNode& node = plan.nodes()[n - plan.num_leaves()];
      place.kept = static_cast<int>(node.kept.size());
      w += node.rows * static_cast<int>(node.handles.size());
      x += node.rows * node.rows;
      s += node.rows;
      widest = std::max(widest, place.kept);
      largest_matrix_ = std::max(largest_matrix_, node.rows * node.rows);
      std::vector<int> rows;
      for (const NodeJoint& joint : node.joints) rows.push_back(joint.rows);
      loops_.push_back(node.closes_loop ? std::make_unique<LoopSolver<S>>(rows) : nullptr);
      loop_X_.push_back(
          MatrixX<S>::Zero(node.closes_loop ? node.rows : 0, node.closes_loop ? node.rows : 0));
    }
    z += place.kept * place.kept;
    b += place.kept;
    largest_matrix_ =
        std::max(largest_matrix_, place.kept * place.kept * Space::kDim * Space::kDim);
  }
  Z_.assign(z, Block<Space, S>::Zero());
  b_.assign(b, Motion<Space, S>::Zero());
  F_ = b_;
  W_.assign(w, Motion<Space, S>::Zero());
  X_.assign(x, S(0));
  s_.assign(s, S(0));
  const std::size_t joints = mechanism.joints().size();
  phi_.assign(joints, Motion<Space, S>::Zero());
  c_offset_.assign(joints, 0);
  int c = 0;
  for (const PlanNode& node : plan.nodes()) {
    for (const NodeJoint& joint : node.joints) {
      c_offset_[joint.index] = c;
      c += 2 * joint.rows;
    }
  }
  c_.assign(c, Motion<Space, S>::Zero());
  columns_.setZero(plan.largest_join(), Space::kDim * std::max(widest, 1));
  vector_.setZero(plan.largest_join());
}

template <class Space, class S>
Outcome Sweep<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  FillJoints(kinematics);
  if (AssembleAll(kinematics, mechanism_.bodies(), Pass::kPhysical)) return Outcome::kFinished;
  if (solver_ == SolverKind::kAsPublished) return Outcome::kSingular;
  if (!std::isfinite(static_cast<double>(rcond_))) return Outcome::kNonFinite;
  // a loop looks degenerate: let geometry say in which directions, then solve the physics
  AssembleAll(kinematics, mechanism_.geometric_bodies(), Pass::kGeometric);
  const bool ok = AssembleAll(kinematics, mechanism_.bodies(), Pass::kSoftened);
  return ok ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
bool Sweep<Space, S>::AssembleAll(const Kinematics<Space, S>& kinematics,
                                  const std::vector<Inertia<Space, S>>& inertias, Pass pass) {
  if (pass != Pass::kSoftened) {
    dependent_rows_ = 0;
    worst_joint_ = -1;
    rcond_ = smallest_weight_ = S(1);
  }
  FillLeaves(kinematics, inertias);
  for (int n = plan_.num_leaves(); n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - plan_.num_leaves()];
    FormResponse(node, places_[n]);
    const bool ok = node.closes_loop ? FactorLoop(kinematics, node, n, pass, inertias)
                                     : FactorFloating(node, places_[n]);
    if (!ok) return false;
    ApplyToKept(node, n);
    Eliminate(node, places_[n]);
  }
  return true;
}

template <class Space, class S>
void Sweep<Space, S>::FillLeaves(const Kinematics<Space, S>& kinematics,
                                 const std::vector<Inertia<Space, S>>& inertias) {
  for (int n = 0; n < plan_.num_leaves(); ++n) {
    Block<Space, S>& Z = Z_[places_[n].z];
    const Inertia<Space, S>& inertia = inertias[n + 1];
    Z.setZero();
    Z.template topLeftCorner<Space::kRot, Space::kRot>() =
        kinematics.RotationalInverse(inertia, n + 1);
    Z.template bottomRightCorner<Space::kLin, Space::kLin>().diagonal().setConstant(S(1) /
                                                                                    inertia.mass);
  }
}

template <class Space, class S>
void Sweep<Space, S>::FillJoints(const Kinematics<Space, S>& kinematics) {
  for (const PlanNode& node : plan_.nodes()) {
    for (const NodeJoint& joint : node.joints) {
      const JointState<Space, S>& state = kinematics.joints()[joint.index];
      Motion<Space, S>* c = &c_[c_offset_[joint.index]];
      for (int i = 0; i < joint.rows; ++i) {
        const Motion<Space, S> D_i = state.D.col(i);
        c[i] = -ShiftForce<Space, S>(D_i, state.r_P);
        c[joint.rows + i] = ShiftForce<Space, S>(D_i, state.r_Q);
      }
    }
  }
}

/// W = Z C^T on every handle and X = C W.                                        (16, 66)
template <class Space, class S>
void Sweep<Space, S>::FormResponse(const PlanNode& node, const Place& place) {
  const int n = node.rows;
  const auto side = [&](const NodeJoint& joint, int which) {
    return which == 0 ? joint.from : joint.to;
  };
  const auto direction = [&](const NodeJoint& joint, int which) {
    return which == 0 ? c_P(joint) : c_Q(joint);
  };
  for (int e = 0; e < static_cast<int>(node.handles.size()); ++e) {
    const Handle& handle = node.handles[e];
    const Place& child = places_[node.children[handle.child]];
    Motion<Space, S>* W = &W_[place.w + e * n];
    for (const NodeJoint& joint : node.joints) {
      for (int i = 0; i < joint.rows; ++i) W[i].setZero();
      for (int which = 0; which < 2; ++which) {
        const int f = side(joint, which);
        if (f < 0 || node.handles[f].child != handle.child) continue;
        const Block<Space, S>& Z = Z_[child.z + handle.place + child.kept * node.handles[f].place];
        const Motion<Space, S>* c = direction(joint, which);
        for (int i = 0; i < joint.rows; ++i) W[i].noalias() += Z * c[i];
        operations_ += joint.rows * Space::kDim * Space::kDim;
      }
      W += joint.rows;
    }
  }
  int row = 0;
  for (const NodeJoint& joint : node.joints) {
    for (int i = 0; i < joint.rows; ++i, ++row) {
      for (int l = 0; l <= row; ++l) {
        S sum = S(0);
        for (int which = 0; which < 2; ++which) {
          const int f = side(joint, which);
          if (f >= 0) sum += direction(joint, which)[i].dot(W_[place.w + f * n + l]);
        }
        X_[place.x + row + l * n] = X_[place.x + l + row * n] = sum;
      }
      operations_ += 2 * Space::kDim * (row + 1);
    }
  }
}

/// Cholesky in place (lower triangle of X): X is positive definite, because one side floats.
template <class Space, class S>
bool Sweep<Space, S>::FactorFloating(const PlanNode& node, const Place& place) {
  using std::sqrt;
  const int n = node.rows;
  S* X = &X_[place.x];
  for (int j = 0; j < n; ++j) {
    S pivot = X[j + j * n];
    for (int k = 0; k < j; ++k) pivot -= X[j + k * n] * X[j + k * n];
    if (!(pivot > S(0))) {
      rcond_ = pivot;
      return false;
    }
    pivot = sqrt(pivot);
    X[j + j * n] = pivot;
    for (int i = j + 1; i < n; ++i) {
      S value = X[i + j * n];
      for (int k = 0; k < j; ++k) value -= X[i + k * n] * X[j + k * n];
      X[i + j * n] = value / pivot;
    }
  }
  operations_ += static_cast<long>(n) * n * n / 6 + n;
  return true;
}

template <class Space, class S>
bool Sweep<Space, S>::FactorLoop(const Kinematics<Space, S>& kinematics, const PlanNode& node,
                                 int n, Pass pass, const std::vector<Inertia<Space, S>>& inertias) {
  const int index = n - plan_.num_leaves();
  LoopSolver<S>& loop = *loops_[index];
  MatrixX<S>& X = loop_X_[index];
  X = Eigen::Map<const MatrixX<S>>(&X_[places_[n].x], node.rows, node.rows);
  operations_ += static_cast<long>(node.rows) * node.rows * node.rows / 6 + node.rows;
  if (solver_ == SolverKind::kAsPublished) {
    // A pivot that is all round-off is not a pivot. The sums behind X are about as long as there
    // are bodies, and their terms as large as the responses of the bodies alone: 2800 random planar
    // ladders in space, whose pivots are zero, leave at most 0.6 eps per body. 64 is a margin.
    S scale = S(0);
    for (const NodeJoint& joint : node.joints) {
      const auto free = FreeResponse(kinematics, inertias, joint.index);
      scale = std::max(scale, free.diagonal().maxCoeff());
    }
    const S eps = std::numeric_limits<S>::epsilon();
    const bool ok = loop.FactorPlain(X, scale, S(64) * eps * S(mechanism_.num_bodies()));
    NoteDiagnostics(node, n);
    return ok;
  }
  if (pass != Pass::kSoftened) {
    for (int j = 0; j < static_cast<int>(node.joints.size()); ++j) {
      loop.SetScale(j, FreeResponse(kinematics, inertias, node.joints[j].index));
    }
  }
  if (pass == Pass::kPhysical) {
    const bool ok = loop.FactorScaled(X);
    NoteDiagnostics(node, n);
    return ok;
  }
  if (pass == Pass::kGeometric) {
    loop.FactorGeometric(X);
    dependent_rows_ += loop.size() - loop.rank();
    NoteDiagnostics(node, n);
  } else {
    loop.FactorSoftened(X);
  }
  return true;
}

template <class Space, class S>
void Sweep<Space, S>::NoteDiagnostics(const PlanNode& node, int n) {
  const LoopSolver<S>& loop = *loops_[n - plan_.num_leaves()];
  if (!(loop.rcond() >= rcond_)) {
    rcond_ = loop.rcond();
    worst_joint_ = node.joints.back().index;
  }
  smallest_weight_ = std::min(smallest_weight_, loop.smallest_weight());
}

/// V = T W^T, kept transposed in W's place, for the handles that stay.
template <class Space, class S>
void Sweep<Space, S>::ApplyToKept(const PlanNode& node, int n) {
  const Place& place = places_[n];
  const int rows = node.rows;
  if (!node.closes_loop) {
    const S* L = &X_[place.x];
    for (int e : node.kept) {
      Motion<Space, S>* W = &W_[place.w + e * rows];
      for (int i = 0; i < rows; ++i) {
        for (int k = 0; k < i; ++k) W[i] -= L[i + k * rows] * W[k];
        W[i] /= L[i + i * rows];
      }
    }
  } else if (!node.kept.empty()) {
    const int width = Space::kDim * static_cast<int>(node.kept.size());
    auto B = columns_.topLeftCorner(rows, width);
    for (std::size_t k = 0; k < node.kept.size(); ++k) {
      for (int i = 0; i < rows; ++i) {
        B.row(i).template segment<Space::kDim>(Space::kDim * k) =
            W_[place.w + node.kept[k] * rows + i].transpose();
      }
    }
    loops_[n - plan_.num_leaves()]->Apply(B);
    for (std::size_t k = 0; k < node.kept.size(); ++k) {
      for (int i = 0; i < rows; ++i) {
        W_[place.w + node.kept[k] * rows + i] =
            B.row(i).template segment<Space::kDim>(Space::kDim * k).transpose();
      }
    }
  }
  operations_ += Space::kDim * rows * (rows + 1) / 2 * static_cast<long>(node.kept.size());
}

/// Z' = Z - V^T V over the handles that stay.                                    (26-28, 71)
template <class Space, class S>
void Sweep<Space, S>::Eliminate(const PlanNode& node, const Place& place) {
  const int n = node.rows;
  for (int f = 0; f < place.kept; ++f) {
    const Handle& at_f = node.handles[node.kept[f]];
    const Motion<Space, S>* V_f = &W_[place.w + node.kept[f] * n];
    for (int e = f; e < place.kept; ++e) {
      const Handle& at_e = node.handles[node.kept[e]];
      const Motion<Space, S>* V_e = &W_[place.w + node.kept[e] * n];
      Block<Space, S> Z = Block<Space, S>::Zero();
      if (at_e.child == at_f.child) {
        const Place& child = places_[node.children[at_e.child]];
        Z = Z_[child.z + at_e.place + child.kept * at_f.place];
      }
      for (int i = 0; i < n; ++i) Z.noalias() -= V_e[i] * V_f[i].transpose();
      Z_[place.z + e + place.kept * f] = Z;
      if (e != f) Z_[place.z + f + place.kept * e] = Z.transpose();
      operations_ += static_cast<long>(n) * Space::kDim * Space::kDim;
    }
  }
}

template <class Space, class S>
void Sweep<Space, S>::Solve(std::span<const Motion<Space, S>> b,
                            std::span<const Motion<Space, S>> c0, std::span<Motion<Space, S>> A) {
  for (int n = 0; n < plan_.num_leaves(); ++n) b_[places_[n].b] = b[n + 1];
  for (int n = plan_.num_leaves(); n < plan_.num_nodes(); ++n) {
    Up(plan_.nodes()[n - plan_.num_leaves()], n, c0);
  }
  // a root's boundary is empty; a body without joints is a root whose one handle feels no force
  for (int n = 0; n < plan_.num_leaves(); ++n) F_[places_[n].b].setZero();
  for (int n = plan_.num_nodes() - 1; n >= plan_.num_leaves(); --n) {
    Down(plan_.nodes()[n - plan_.num_leaves()], n);
  }
  A[kGround].setZero();
  for (int n = 0; n < plan_.num_leaves(); ++n) {
    const Place& place = places_[n];
    A[n + 1] = b_[place.b];
    A[n + 1].noalias() += Z_[place.z] * F_[place.b];
  }
  operations_ += static_cast<long>(plan_.num_leaves()) * Space::kDim * Space::kDim;
}

/// s = T (C b + c0), b' = b - V^T s.                                             (29-30, 72)
template <class Space, class S>
void Sweep<Space, S>::Up(const PlanNode& node, int n, std::span<const Motion<Space, S>> c0) {
  const Place& place = places_[n];
  S* s = &s_[place.s];
  int row = 0;
  const auto b_of = [&](int f) -> const Motion<Space, S>& {
    const Handle& handle = node.handles[f];
    return b_[places_[node.children[handle.child]].b + handle.place];
  };
  for (const NodeJoint& joint : node.joints) {
    for (int i = 0; i < joint.rows; ++i, ++row) {
      s[row] = c0[joint.index][i];
      if (joint.from >= 0) s[row] += c_P(joint)[i].dot(b_of(joint.from));
      if (joint.to >= 0) s[row] += c_Q(joint)[i].dot(b_of(joint.to));
    }
  }
  if (node.closes_loop) {
    loops_[n - plan_.num_leaves()]->Apply(Eigen::Map<MatrixX<S>>(s, node.rows, 1));
  } else {
    const S* L = &X_[place.x];
    for (int i = 0; i < node.rows; ++i) {
      for (int k = 0; k < i; ++k) s[i] -= L[i + k * node.rows] * s[k];
      s[i] /= L[i + i * node.rows];
    }
  }
  for (int e = 0; e < place.kept; ++e) {
    Motion<Space, S> b = b_of(node.kept[e]);
    const Motion<Space, S>* V = &W_[place.w + node.kept[e] * node.rows];
    for (int i = 0; i < node.rows; ++i) b -= V[i] * s[i];
    b_[place.b + e] = b;
  }
  operations_ += node.rows * (2 * Space::kDim + Space::kDim * place.kept + node.rows / 2);
}

/// phi = -T^T (s + V F), then the forces on the children's handles.                 (17, 64-65)
template <class Space, class S>
void Sweep<Space, S>::Down(const PlanNode& node, int n) {
  const Place& place = places_[n];
  auto phi = vector_.head(node.rows);
  for (int i = 0; i < node.rows; ++i) {
    phi[i] = -s_[place.s + i];
    for (int e = 0; e < place.kept; ++e) {
      phi[i] -= W_[place.w + node.kept[e] * node.rows + i].dot(F_[place.b + e]);
    }
  }
  if (node.closes_loop) {
    loops_[n - plan_.num_leaves()]->ApplyTransposed(phi);
  } else {
    const S* L = &X_[place.x];
    for (int i = node.rows - 1; i >= 0; --i) {
      for (int k = i + 1; k < node.rows; ++k) phi[i] -= L[k + i * node.rows] * phi[k];
      phi[i] /= L[i + i * node.rows];
    }
  }
  int kept = 0;
  for (const Handle& handle : node.handles) {
    Motion<Space, S>& F = F_[places_[node.children[handle.child]].b + handle.place];
    if (handle.kept) {
      F = F_[place.b + kept++];
    } else {
      F.setZero();
    }
  }
  int row = 0;
  for (const NodeJoint& joint : node.joints) {
    const auto force_on = [&](int f) -> Motion<Space, S>& {
      const Handle& handle = node.handles[f];
      return F_[places_[node.children[handle.child]].b + handle.place];
    };
    Motion<Space, S>& out = phi_[joint.index];
    out.setZero();
    for (int i = 0; i < joint.rows; ++i, ++row) {
      out[i] = phi[row];
      if (joint.from >= 0) force_on(joint.from) += c_P(joint)[i] * phi[row];
      if (joint.to >= 0) force_on(joint.to) += c_Q(joint)[i] * phi[row];
    }
  }
  operations_ += node.rows * (2 * Space::kDim + Space::kDim * place.kept + node.rows / 2);
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Sweep<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
