#include "odca/joins.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

template <class Space, class S>
Joins<Space, S>::Joins(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver)
    : mechanism_(mechanism), plan_(plan), solver_(solver), places_(plan.num_nodes()) {
  const auto scratch = std::make_shared<LoopScratch<S>>(plan.largest_join());
  int z = 0, y = 0, x = 0, c = 0, widest = 1;
  c_offset_.assign(mechanism.joints().size(), 0);
  std::vector<bool> joined(plan.num_leaves(), false);
  loops_.reserve(plan.loop_joins());
  for (int n = 0; n < plan.num_nodes(); ++n) {
    Place& place = places_[n];
    place.z = z;
    place.y = y;
    place.x = x;
    place.handle = num_handles_;
    place.row = num_rows_;
    if (n >= plan.num_leaves()) {
      const PlanNode& node = plan.nodes()[n - plan.num_leaves()];
      for (int child : node.children) {
        if (child >= 0 && child < plan.num_leaves()) joined[child] = true;
      }
      place.bodies = 0;
      for (int child : node.children) place.bodies += child >= 0 ? places_[child].bodies : 0;
      place.kept = static_cast<int>(node.kept.size());
      y += node.rows * static_cast<int>(node.handles.size());
      x += node.rows * node.rows;
      num_rows_ += node.rows;
      widest = std::max(widest, place.kept);
      largest_matrix_ = std::max(largest_matrix_, node.rows * node.rows);
      std::vector<int> rows;
      for (const NodeJoint& joint : node.joints) {
        rows.push_back(joint.rows);
        c_offset_[joint.index] = c;
        c += 2 * joint.rows;
      }
      if (node.closes_loop) {
        place.loop = static_cast<int>(loops_.size());
        loops_.emplace_back(rows, scratch);
      }
    }
    z += place.kept * place.kept;
    num_handles_ += place.kept;
    largest_matrix_ =
        std::max(largest_matrix_, place.kept * place.kept * Space::kDim * Space::kDim);
  }
  for (int leaf = 0; leaf < plan.num_leaves(); ++leaf) {
    if (!joined[leaf]) lone_leaves_.push_back(leaf);
  }
  Z_.assign(z, Block<Space, S>::Zero());
  Y_.assign(y, Acceleration<Space, S>::Zero());
  X_.assign(x, S(0));
  c_.assign(c, Wrench<Space, S>::Zero());
  columns_.setZero(plan.largest_join(), Space::kDim * widest);
}

template <class Space, class S>
Outcome Joins<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  regularized_ = false;
  if (AssembleAll(kinematics, Pass::kPhysical)) return Outcome::kFinished;
  if (solver_ == SolverKind::kAsPublished) return Outcome::kSingular;
  if (!std::isfinite(static_cast<double>(rcond_))) return Outcome::kNonFinite;
  // a loop looks degenerate: geometry gives the directions, then the physics is solved
  regularized_ = true;
  regularization_ = kinematics.regularization();
  AssembleAll(kinematics, Pass::kGeometric);
  if (AssembleAll(kinematics, Pass::kRegularized)) return Outcome::kFinished;
  return std::isfinite(static_cast<double>(rcond_)) ? Outcome::kSingular : Outcome::kNonFinite;
}

template <class Space, class S>
bool Joins<Space, S>::AssembleAll(const Kinematics<Space, S>& kinematics, Pass pass) {
  const Masses masses = pass == Pass::kGeometric ? Masses::kGeometric : Masses::kPhysical;
  const std::vector<Inertia<Space, S>>& inertias = mechanism_.bodies(masses);
  if (pass != Pass::kRegularized) {
    dependent_rows_ = 0;
    worst_joint_ = -1;
    rcond_ = smallest_weight_ = S(1);
  }
  for (int leaf : lone_leaves_) FillLeaf(kinematics, inertias[leaf + 1], leaf);
  for (int n = plan_.num_leaves(); n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - plan_.num_leaves()];
    const Place& place = places_[n];
    for (int child : node.children) {
      if (child >= 0 && child < plan_.num_leaves()) {
        FillLeaf(kinematics, inertias[child + 1], child);
      }
    }
    const bool ok = WithRows<Space>(node, [&](auto rows) {
      FillJoints(kinematics, masses, node, rows);
      FormResponse(node, place, rows);
      if (!(node.closes_loop ? FactorLoop(node, place, pass) : FactorFloating(place, rows))) {
        return false;
      }
      ApplyToKept(node, place, rows);
      Eliminate(node, place, rows);
      return true;
    });
    if (!ok) return false;
  }
  return true;
}

/// Z = M^-1 of body n + 1, at its centre of mass in ground axes. The paper's zeta_ij of the handles
/// at r_i and r_j are S(r_i) Z S(r_j)^T: for bodies k and k+1 (1-4) and for body 2 (45-46).
template <class Space, class S>
void Joins<Space, S>::FillLeaf(const Kinematics<Space, S>& kinematics,
                               const Inertia<Space, S>& inertia, int n) {
  Z_[places_[n].z] =
      DiagonalBlock<Space, S>(kinematics.RotationalInverse(inertia, n + 1), S(1) / inertia.mass);
}

/// Rows of C. D at Mo becomes c at the centres of mass, so that c^T A is the D^T A of the paper's
/// handles, which removes udot (12, 37-38, 57-58). That c_P and c_Q have opposite signs is Newton's
/// third law (51-52). Rows of one joint after those of another make the block-diagonal D (69).
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::FillJoints(const Kinematics<Space, S>& kinematics, Masses masses,
                                 const PlanNode& node, Rows rows) {
  for (const NodeJoint& joint : node.joints) {
    const JointState<Space, S>& state = kinematics.joints()[joint.index];
    const Linear<Space, S> r_P = kinematics.ArmP(joint.index, masses);
    const Linear<Space, S> r_Q = kinematics.ArmQ(joint.index, masses);
    Wrench<Space, S>* c = &c_[c_offset_[joint.index]];
    const int count = RowsOf(joint, rows);
    for (int i = 0; i < count; ++i) {
      c[i] = -ShiftForce<Space, S>(state.D(i), r_P);
      c[count + i] = ShiftForce<Space, S>(state.D(i), r_Q);
    }
  }
}

/// Y = C Z on every handle, and X = Y C^T, both triangles. Y is the paper's D^T zeta (67) except
/// for the sign of c_P. X is D^T [zeta + zeta] D of a series join (16), the left side of (15). It
/// is chi at the closing of base and terminal joint (42), with the block rows (40) and (41). In a
/// coupled loop it has the block rows (61) and (63); the paper writes X for its inverse (66).
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::FormResponse(const PlanNode& node, const Place& place, Rows rows) {
  const int n = rows;
  const auto side = [&](const NodeJoint& joint, int which) {
    return which == 0 ? joint.from : joint.to;
  };
  const auto direction = [&](const NodeJoint& joint, int which) {
    return which == 0 ? c_P(joint) : c_Q(joint);
  };
  for (int e = 0; e < static_cast<int>(node.handles.size()); ++e) {
    const Handle& handle = node.handles[e];
    const Place& child = places_[node.children[handle.child]];
    const bool is_leaf = node.children[handle.child] < plan_.num_leaves();
    Acceleration<Space, S>* Y = &Y_[place.y + e * n];
    for (const NodeJoint& joint : node.joints) {
      const int count = RowsOf(joint, rows);
      for (int i = 0; i < count; ++i) Y[i].setZero();
      for (int which = 0; which < 2; ++which) {
        const int f = side(joint, which);
        if (f < 0 || node.handles[f].child != handle.child) continue;
        const Block<Space, S>& Z = Z_[child.z + handle.place + child.kept * node.handles[f].place];
        const Wrench<Space, S>* c = direction(joint, which);
        for (int i = 0; i < count; ++i) {  // (67)
          Y[i] += is_leaf ? ApplyDiagonal<Acceleration<Space, S>>(Z, c[i])
                          : loopbench::Apply<Acceleration<Space, S>>(Z, c[i]);
        }
        operations_ += count * Space::kDim * Space::kDim;
      }
      Y += count;
    }
  }
  S* X = &X_[place.x];
  std::fill_n(X, n * n, S(0));
  int first = 0;
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf(joint, rows);
    for (int which = 0; which < 2; ++which) {
      const int f = side(joint, which);
      if (f < 0) continue;
      const Wrench<Space, S>* c = direction(joint, which);
      const Acceleration<Space, S>* Y = &Y_[place.y + f * n];
      for (int i = 0; i < count; ++i) {
        for (int l = 0; l <= first + i; ++l)
          X[first + i + l * n] += c[i].dot(Y[l]);  // (16, 42, 66)
      }
    }
    operations_ += Space::kDim * count * (2 * first + count + 1);
    first += count;
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < j; ++i) X[i + j * n] = X[j + i * n];
  }
}

/// X = L L^T in place of X's lower triangle, T = L^-1; (17) inverts X. X is positive definite,
/// because one side floats.
template <class Space, class S>
template <class Rows>
bool Joins<Space, S>::FactorFloating(const Place& place, Rows rows) {
  operations_ += static_cast<long>(rows) * rows * rows / 6 + rows;
  const S least = FactorLower(&X_[place.x], rows);
  if (least > S(0)) return true;
  rcond_ = least;
  return false;
}

/// Across a joint, of its two bodies alone: the X of a series join of two leaves.
template <class Space, class S>
JointMatrix<S> Joins<Space, S>::FreeResponseAt(const PlanNode& node, const NodeJoint& joint) const {
  JointMatrix<S> X = JointMatrix<S>::Zero(joint.rows, joint.rows);
  for (const bool at_Q : {true, false}) {
    const int handle = at_Q ? joint.to : joint.from;
    if (handle < 0) continue;
    const Block<Space, S>& Z = LeafZ(node.handles[handle].body - 1);
    const Wrench<Space, S>* c = at_Q ? c_Q(joint) : c_P(joint);
    for (int a = 0; a < joint.rows; ++a) {
      const auto A = ApplyDiagonal<Acceleration<Space, S>>(Z, c[a]);
      for (int b = 0; b < joint.rows; ++b) X(b, a) += c[b].dot(A);
    }
  }
  return X;
}

/// T of a node that closes loops, with T^T T = chi^-1 of (42) or the paper's X of (66). The matrix
/// is only semidefinite here, and loop_solver.h decides its rank.
template <class Space, class S>
bool Joins<Space, S>::FactorLoop(const PlanNode& node, const Place& place, Pass pass) {
  LoopSolver<S>& loop = loops_[place.loop];
  const Eigen::Map<const MatrixX<S>> X(&X_[place.x], node.rows, node.rows);
  operations_ += static_cast<long>(node.rows) * node.rows * node.rows / 6 + node.rows;
  if (solver_ == SolverKind::kAsPublished) {
    // A pivot that is all round-off is not a pivot. The sums behind X are about as long as there
    // are bodies, and their terms as large as the responses of the bodies alone: 2800 random planar
    // ladders in space, whose pivots are zero, leave at most 0.6 eps per body. 64 is a margin.
    S scale = S(0);
    for (const NodeJoint& joint : node.joints) {
      const auto free = FreeResponseAt(node, joint);
      scale = std::max(scale, free.diagonal().maxCoeff());
    }
    const S eps = std::numeric_limits<S>::epsilon();
    const bool ok = loop.FactorPlain(X, scale, S(64) * eps * S(mechanism_.num_bodies()));
    NoteDiagnostics(node, loop);
    return ok;
  }
  if (pass != Pass::kRegularized) {
    for (int j = 0; j < static_cast<int>(node.joints.size()); ++j) {
      loop.SetScale(j, FreeResponseAt(node, node.joints[j]));
    }
  }
  if (pass == Pass::kPhysical) {
    const S limit = S(LoopSolver<S>::kSuspicious * ShareOfLimit(place.bodies));
    const bool ok = loop.FactorScaled(X) || loop.rcond() >= limit;
    NoteDiagnostics(node, loop);
    return ok;
  }
  if (pass == Pass::kGeometric) {
    loop.FactorGeometric(X, regularization_);
    dependent_rows_ += loop.size() - loop.rank();
    NoteDiagnostics(node, loop);
    return true;
  }
  return loop.FactorRegularized(X);
}

template <class Space, class S>
void Joins<Space, S>::NoteDiagnostics(const PlanNode& node, const LoopSolver<S>& loop) {
  if (!(loop.rcond() >= rcond_)) {
    rcond_ = loop.rcond();
    worst_joint_ = node.joints.back().index;
  }
  smallest_weight_ = std::min(smallest_weight_, loop.smallest_weight());
}

/// V = T Y in Y's place, for the handles that stay: the X Y of (64) is -T^T V.
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::ApplyToKept(const PlanNode& node, const Place& place, Rows rows) {
  if (!node.closes_loop) {
    for (int e : node.kept) SolveLower(&X_[place.x], rows, &Y_[place.y + e * rows]);
  } else if (!node.kept.empty()) {
    const int width = Space::kDim * static_cast<int>(node.kept.size());
    auto B = columns_.topLeftCorner(rows, width);
    for (std::size_t k = 0; k < node.kept.size(); ++k) {
      for (int i = 0; i < rows; ++i) {
        const Acceleration<Space, S>& Y = Y_[place.y + node.kept[k] * rows + i];
        for (int d = 0; d < Space::kDim; ++d) B(i, Space::kDim * k + d) = Y[d];
      }
    }
    loops_[place.loop].Apply(B);
    for (std::size_t k = 0; k < node.kept.size(); ++k) {
      for (int i = 0; i < rows; ++i) {
        Acceleration<Space, S>& Y = Y_[place.y + node.kept[k] * rows + i];
        for (int d = 0; d < Space::kDim; ++d) Y[d] = B(i, Space::kDim * k + d);
      }
    }
  }
  operations_ += Space::kDim * rows * (rows + 1) / 2 * static_cast<long>(node.kept.size());
}

/// Z' = Z - V^T V over the handles that stay. In a series join the blocks of two bodies of one
/// child are Upsilon_11 (26) and Upsilon_22 (27), those across, with Z = 0 between the children,
/// Upsilon_12 (28); where body 2 alone stays of a coupled loop, the block is zeta^asm (71).
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::Eliminate(const PlanNode& node, const Place& place, Rows rows) {
  const int n = rows;
  for (int f = 0; f < place.kept; ++f) {
    const Handle& at_f = node.handles[node.kept[f]];
    const Acceleration<Space, S>* V_f = &Y_[place.y + node.kept[f] * n];
    for (int e = f; e < place.kept; ++e) {
      const Handle& at_e = node.handles[node.kept[e]];
      const Acceleration<Space, S>* V_e = &Y_[place.y + node.kept[e] * n];
      Block<Space, S> Z = Block<Space, S>::Zero();
      if (at_e.child == at_f.child) {
        const Place& child = places_[node.children[at_e.child]];
        Z = Z_[child.z + at_e.place + child.kept * at_f.place];
      }
      for (int i = 0; i < n; ++i) SubtractOuter(V_e[i], V_f[i], Z);  // (26-28, 71)
      Z_[place.z + e + place.kept * f] = Z;
      if (e != f) Z_[place.z + f + place.kept * e] = Z.transpose();
      operations_ += static_cast<long>(n) * Space::kDim * Space::kDim;
    }
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Joins<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
