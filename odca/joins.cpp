#include "odca/joins.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

namespace {

/// Multiply-adds of M^-1 c: M^-1 is diagonal except for three rotations.
template <class Space>
constexpr int kApply = Space::kRot* Space::kRot + Space::kLin;

}  // namespace

template <class Space, class S>
Joins<Space, S>::Joins(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver)
    : mechanism_(mechanism),
      plan_(plan),
      solver_(solver),
      places_(plan.num_nodes()),
      bodies_(plan.num_leaves()) {
  const auto scratch = std::make_shared<LoopScratch<S>>(plan.largest_join());
  int z = 0, y = 0, x = 0, c = 0, free = 0, widest = Space::kDim;
  c_offset_.assign(mechanism.joints().size(), 0);
  loops_.reserve(plan.loop_joins());
  for (int n = 0; n < plan.num_nodes(); ++n) {
    Place& place = places_[n];
    place.z = z;
    place.y = y;
    place.x = x;
    if (n < plan.num_leaves()) {
      const Leaf& leaf = plan.leaves()[n];
      place.size = leaf.width;
      if (leaf.sides.empty()) lone_leaves_.push_back(n);
      if (leaf.hold.joint >= 0) {
        place.hold = free;
        free += Space::kDim - leaf.hold.rows;
        c_offset_[leaf.hold.joint] = c;
        c += 2 * leaf.hold.rows;
      }
    } else {
      const PlanNode& node = plan.nodes()[n - plan.num_leaves()];
      place.bodies = 0;
      for (int child : node.children) place.bodies += child >= 0 ? places_[child].bodies : 0;
      place.size = node.kept_numbers;
      y += node.rows * node.numbers;
      x += node.rows * node.rows;
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
      for (const Handle& handle : node.handles) widest = std::max(widest, handle.width);
    }
    z += place.size * place.size;
    largest_matrix_ = std::max(largest_matrix_, place.size * place.size);
  }
  Z_.assign(z, S(0));
  Y_.assign(y, S(0));
  X_.assign(x, S(0));
  c_.assign(c, Wrench<Space, S>::Zero());
  Mc_.assign(c, Acceleration<Space, S>::Zero());
  free_.resize(free);
  columns_.setZero(plan.largest_join(), widest);
}

template <class Space, class S>
std::span<const typename Joins<Space, S>::FreeDirection> Joins<Space, S>::FreeDirections(
    int n) const {
  const PlanSide& hold = plan_.leaves()[n].hold;
  if (hold.joint < 0) return {};
  return std::span(free_).subspan(places_[n].hold, Space::kDim - hold.rows);
}

template <class Space, class S>
Acceleration<Space, S> Joins<Space, S>::Response(int n, const Wrench<Space, S>& F) const {
  const Body& body = bodies_[n];
  if (plan_.leaves()[n].hold.joint < 0) {
    return {body.rotational_inverse * F.angular, F.linear * body.per_mass};
  }
  auto A = Acceleration<Space, S>::Zero();
  for (const FreeDirection& free : FreeDirections(n)) A += free.g * free.g.dot(F);
  return A;
}

template <class Space, class S>
Acceleration<Space, S> Joins<Space, S>::Held(int n, const Wrench<Space, S>& F,
                                             const Components<Space, S>& c0) const {
  const PlanSide& hold = plan_.leaves()[n].hold;
  const Acceleration<Space, S>* dual = &Mc_[c_offset_[hold.joint]];
  auto A = Acceleration<Space, S>::Zero();
  for (int i = 0; i < hold.rows; ++i) A -= dual[i] * c0[i];
  const Acceleration<Space, S> held = A;
  for (const FreeDirection& free : FreeDirections(n)) {
    A += free.g * (free.g.dot(F) - free.Mg.dot(held));
  }
  return A;
}

template <class Space, class S>
Components<Space, S> Joins<Space, S>::HoldingForce(int n, const Acceleration<Space, S>& A,
                                                   const Wrench<Space, S>& F) const {
  const PlanSide& hold = plan_.leaves()[n].hold;
  const Wrench<Space, S> force =
      Wrench<Space, S>(bodies_[n].rotational * A.angular, A.linear * bodies_[n].mass) - F;
  auto phi = Components<Space, S>::Zero();
  for (int i = 0; i < hold.rows; ++i) phi[i] = Mc_[c_offset_[hold.joint] + i].dot(force);
  return phi;
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
  if (pass != Pass::kRegularized) {
    dependent_rows_ = 0;
    worst_joint_ = -1;
    rcond_ = smallest_weight_ = S(1);
  }
  for (int leaf : lone_leaves_) FillLeaf(kinematics, masses, leaf);
  for (int n = plan_.num_leaves(); n < plan_.num_nodes(); ++n) {
    const PlanNode& node = plan_.nodes()[n - plan_.num_leaves()];
    const Place& place = places_[n];
    for (int child : node.children) {
      if (child >= 0 && child < plan_.num_leaves()) FillLeaf(kinematics, masses, child);
    }
    const bool ok = WithRows<Space>(node, [&](auto rows) {
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

/// Rows of C on one body. D at Mo becomes c at the centre of mass, so that c^T A is the D^T A of
/// the paper's handles, which removes udot (12, 37-38, 57-58). That c_P and c_Q have opposite signs
/// is Newton's third law (51-52). Rows of one joint after those of another make the block-diagonal
/// D (69).
template <class Space, class S>
void Joins<Space, S>::FillRows(const Kinematics<Space, S>& kinematics, Masses masses,
                               const PlanSide& side) {
  const JointState<Space, S>& state = kinematics.joints()[side.joint];
  const Linear<Space, S> r =
      side.at_Q ? kinematics.ArmQ(side.joint, masses) : kinematics.ArmP(side.joint, masses);
  Wrench<Space, S>* c = &c_[c_offset_[side.joint] + (side.at_Q ? side.rows : 0)];
  for (int i = 0; i < side.rows; ++i) {
    c[i] = ShiftForce<Space, S>(state.D(i), r);
    if (!side.at_Q) c[i] = -c[i];
  }
}

/// The directions h that its joint to Ground leaves to a body, at the centre of mass, as g = T h
/// with T^T T = (H^T M H)^-1: the response of the held body is G G^T. Then the duals of the joint's
/// rows c, as D is orthonormal: they have the product 1 with their own c and 0 with others, so that
/// c0 costs no solution.
template <class Space, class S>
void Joins<Space, S>::FillHold(const Kinematics<Space, S>& kinematics, Masses masses, int n) {
  const PlanSide& hold = plan_.leaves()[n].hold;
  const JointState<Space, S>& state = kinematics.joints()[hold.joint];
  const Linear<Space, S> r =
      hold.at_Q ? kinematics.ArmQ(hold.joint, masses) : kinematics.ArmP(hold.joint, masses);
  Body& body = bodies_[n];
  body.rotational = kinematics.RotationalInertia(mechanism_.bodies(masses)[n + 1], n + 1);
  body.mass = mechanism_.bodies(masses)[n + 1].mass;
  const auto at_centre = [&](const Direction<Space, S>& direction) {
    return Acceleration<Space, S>(ShiftMotion<Space, S>(direction, -r));
  };
  for (int i = 0; i < hold.rows; ++i) {
    Acceleration<Space, S>& dual = Mc_[c_offset_[hold.joint] + i];
    dual = at_centre(state.D(i));
    if (!hold.at_Q) dual = -dual;
  }
  const int size = Space::kDim - hold.rows;
  FreeDirection* free = &free_[places_[n].hold];
  JointMatrix<S> T(size, size);
  for (int k = 0; k < size; ++k) {
    // released directions follow D
    free[k].g = at_centre(state.basis[k < state.num_u ? k : hold.rows + k]);
    free[k].Mg = {body.rotational * free[k].g.angular, free[k].g.linear * body.mass};
    for (int l = 0; l <= k; ++l) T(k, l) = free[k].Mg.dot(free[l].g);
  }
  FactorLower(T.data(), size);
  for (int k = 0; k < size; ++k) {
    for (int l = 0; l < k; ++l) {
      free[k].g -= free[l].g * T(k, l);
      free[k].Mg -= free[l].Mg * T(k, l);
    }
    free[k].g *= T(k, k);
    free[k].Mg *= T(k, k);
  }
  operations_ += size * kApply<Space> + size * size * size / 6 + size +
                 3 * Space::kDim * (size * (size + 1) / 2);
}

/// Z of body n + 1, or C Z C^T. Z is M^-1 in ground axes, or the response of the held body. The
/// paper's zeta_ij of the handles at r_i and r_j are S(r_i) M^-1 S(r_j)^T, for bodies k and k+1
/// (1-4) and body 2 (45-46).
template <class Space, class S>
void Joins<Space, S>::FillLeaf(const Kinematics<Space, S>& kinematics, Masses masses, int n) {
  const Leaf& leaf = plan_.leaves()[n];
  const Inertia<Space, S>& inertia = mechanism_.bodies(masses)[n + 1];
  Body& body = bodies_[n];
  body.rotational_inverse = kinematics.RotationalInverse(inertia, n + 1);
  body.per_mass = S(1) / inertia.mass;
  const bool is_held = leaf.hold.joint >= 0;
  if (is_held) FillHold(kinematics, masses, n);
  const std::span<const FreeDirection> free = FreeDirections(n);
  const int terms = is_held ? static_cast<int>(free.size()) : Space::kDim;
  S* Z = &Z_[places_[n].z];
  int first = 0;
  for (const PlanSide& side : leaf.sides) {
    FillRows(kinematics, masses, side);
    const int offset = c_offset_[side.joint] + (side.at_Q ? side.rows : 0);
    const Wrench<Space, S>* c = &c_[offset];
    Acceleration<Space, S>* Mc = &Mc_[offset];
    for (int i = 0; i < side.rows; ++i) {
      if (!is_held) {
        Mc[i] = {body.rotational_inverse * c[i].angular, c[i].linear * body.per_mass};
      } else if (leaf.is_body) {
        Mc[i] = Response(n, c[i]);
      } else {  // its components along G suffice
        for (int k = 0; k < terms; ++k) Mc[i][k] = free[k].g.dot(c[i]);
      }
    }
    operations_ += side.rows * (is_held ? terms * Space::kDim : kApply<Space>);
    if (leaf.is_body) {
      if (is_held) operations_ += side.rows * terms * Space::kDim;
      continue;
    }
    int before = 0;
    for (const PlanSide& other : leaf.sides.first(&side - leaf.sides.data() + 1)) {
      const Acceleration<Space, S>* Mc_other =
          &Mc_[c_offset_[other.joint] + (other.at_Q ? other.rows : 0)];
      for (int i = 0; i < side.rows; ++i) {
        const int last = before == first ? i + 1 : other.rows;
        for (int j = 0; j < last; ++j) {
          S zeta = S(0);  // (1-4, 45-46)
          if (is_held) {
            for (int k = 0; k < terms; ++k) zeta += Mc[i][k] * Mc_other[j][k];
          } else {
            zeta = c[i].dot(Mc_other[j]);
          }
          Z[first + i + leaf.width * (before + j)] = zeta;
          Z[before + j + leaf.width * (first + i)] = zeta;
        }
        operations_ += last * terms;
      }
      before += other.rows;
    }
    first += side.rows;
  }
  if (!leaf.is_body) return;
  Block<Space, S> block = Block<Space, S>::Zero();
  if (is_held) {
    for (const FreeDirection& direction : free) SubtractOuter(-direction.g, direction.g, block);
  } else {
    block = DiagonalBlock<Space, S>(body.rotational_inverse, body.per_mass);
  }
  for (int j = 0; j < Space::kDim; ++j) {
    for (int i = 0; i < Space::kDim; ++i) Z[i + Space::kDim * j] = block(i, j);
  }
}

/// Y = C Z on every handle, and X = Y C^T, both triangles. At a handle with the rows of a joint,
/// the rows of C are those of the identity. Y is the paper's D^T zeta (67) except for the sign of
/// c_P. X is D^T [zeta + zeta] D of a series join (16), the left side of (15). It is chi at the
/// closing of base and terminal joint (42), with the block rows (40) and (41). In a coupled loop it
/// has the block rows (61) and (63); the paper writes X for its inverse (66).
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::FormResponse(const PlanNode& node, const Place& place, Rows rows) {
  const int n = rows;
  const auto each_side = [&](const NodeJoint& joint, const auto& call) {
    if (joint.from >= 0) call(node.handles[joint.from], c_offset_[joint.index]);
    if (joint.to >= 0) call(node.handles[joint.to], c_offset_[joint.index] + joint.rows);
  };
  std::fill_n(&Y_[place.y], n * node.numbers, S(0));
  int first = 0;
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf(joint, rows);
    each_side(joint, [&](const Handle& side, int offset) {
      const int child = node.children[side.child];
      const int size = places_[child].size;
      const bool is_leaf = child < plan_.num_leaves();
      const S* Z = &Z_[places_[child].z + size * side.place];
      for (const Handle& handle : node.handles) {
        if (handle.child != side.child) continue;
        WithWidth<Space>(handle, [&](auto known) {
          const int width = known;
          S* Y = &Y_[place.y + handle.number * n + first * width];
          for (int i = 0; i < count; ++i, Y += width) {  // (67)
            S sum[Space::kDim];
            LOOPBENCH_UNROLL
            for (int b = 0; b < width; ++b) sum[b] = Y[b];
            if (!side.is_body()) {
              const S* Z_i = Z + size * i + handle.place;
              LOOPBENCH_UNROLL
              for (int b = 0; b < width; ++b) sum[b] += Z_i[b];
            } else if (is_leaf) {
              LOOPBENCH_UNROLL
              for (int b = 0; b < width; ++b) sum[b] += Mc_[offset + i][b];
            } else {
              LOOPBENCH_UNROLL
              for (int k = 0; k < Space::kDim; ++k) {
                const S c_k = c_[offset + i][k];
                const S* Z_k = Z + size * k + handle.place;
                LOOPBENCH_UNROLL
                for (int b = 0; b < width; ++b) sum[b] += c_k * Z_k[b];
              }
            }
            LOOPBENCH_UNROLL
            for (int b = 0; b < width; ++b) Y[b] = sum[b];
          }
        });
      }
      if (side.is_body() && !is_leaf) operations_ += count * Space::kDim * size;
    });
    first += count;
  }
  S* X = &X_[place.x];
  std::fill_n(X, n * n, S(0));
  first = 0;
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf(joint, rows);
    each_side(joint, [&](const Handle& side, int offset) {
      const S* Y = &Y_[place.y + side.number * n];
      for (int i = 0; i < count; ++i) {  // (16, 42, 66)
        S* X_i = X + first + i;
        if (!side.is_body()) {
          for (int l = 0; l <= first + i; ++l) X_i[l * n] += Y[l * count + i];
        } else {
          const Wrench<Space, S>& c = c_[offset + i];
          for (int l = 0; l <= first + i; ++l) {
            S sum = X_i[l * n];
            LOOPBENCH_UNROLL
            for (int k = 0; k < Space::kDim; ++k) sum += c[k] * Y[l * Space::kDim + k];
            X_i[l * n] = sum;
          }
        }
      }
      if (side.is_body()) operations_ += Space::kDim * (count * first + count * (count + 1) / 2);
    });
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

/// Across a joint, of its two bodies alone: the X of a series join of two leaves that are not held.
template <class Space, class S>
JointMatrix<S> Joins<Space, S>::FreeResponseAt(const PlanNode& node, const NodeJoint& joint) const {
  JointMatrix<S> X = JointMatrix<S>::Zero(joint.rows, joint.rows);
  for (const bool at_Q : {true, false}) {
    const int handle = at_Q ? joint.to : joint.from;
    if (handle < 0) continue;
    const Body& body = bodies_[node.handles[handle].body - 1];
    const Wrench<Space, S>* c = at_Q ? c_Q(joint) : c_P(joint);
    for (int a = 0; a < joint.rows; ++a) {
      const Acceleration<Space, S> A(body.rotational_inverse * c[a].angular,
                                     c[a].linear * body.per_mass);
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
  const int n = rows;
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    S* Y = &Y_[place.y + handle.number * n];
    if (node.closes_loop) {
      using RowByRow = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowByRow> block(Y, n, handle.width);
      auto columns = columns_.topLeftCorner(n, handle.width);
      columns = block;
      loops_[place.loop].Apply(columns);
      block = columns;
    } else {
      const S* L = &X_[place.x];
      WithWidth<Space>(handle, [&](auto known) {
        const int width = known;
        for (int i = 0; i < rows; ++i) {
          S V[Space::kDim];
          LOOPBENCH_UNROLL
          for (int b = 0; b < width; ++b) V[b] = Y[i * width + b];
          for (int k = 0; k < i; ++k) {
            const S L_ik = L[i + k * rows];
            LOOPBENCH_UNROLL
            for (int b = 0; b < width; ++b) V[b] -= Y[k * width + b] * L_ik;
          }
          const S inverse = L[i + i * rows];
          LOOPBENCH_UNROLL
          for (int b = 0; b < width; ++b) Y[i * width + b] = V[b] * inverse;
        }
      });
    }
    operations_ += static_cast<long>(n) * (n + 1) / 2 * handle.width;
  }
}

/// Z' = Z - V^T V over the handles that stay. In a series join the blocks of two handles of one
/// child are Upsilon_11 (26) and Upsilon_22 (27), those across, with Z = 0 between the children,
/// Upsilon_12 (28); where body 2 alone stays of a coupled loop, the block is zeta^asm (71).
template <class Space, class S>
template <class Rows>
void Joins<Space, S>::Eliminate(const PlanNode& node, const Place& place, Rows rows) {
  const int n = rows;
  int column = 0;
  for (int f : node.kept) {
    const Handle& at_f = node.handles[f];
    const Place& child = places_[node.children[at_f.child]];
    const S* V_f = &Y_[place.y + at_f.number * n];
    int row = 0;
    for (int e : node.kept) {
      if (e > f) break;
      const Handle& at_e = node.handles[e];
      const bool within = at_e.child == at_f.child;
      const S* V_e = &Y_[place.y + at_e.number * n];
      const S* Z = &Z_[child.z] + (within ? child.size * at_f.place + at_e.place : 0);
      WithWidth<Space>(at_e, [&](auto known) {
        const int width = known;
        for (int b = 0; b < at_f.width; ++b) {
          S z[Space::kDim];
          LOOPBENCH_UNROLL
          for (int a = 0; a < width; ++a) z[a] = within ? Z[a + child.size * b] : S(0);
          for (int i = 0; i < rows; ++i) {
            const S V_b = V_f[b + i * at_f.width];
            LOOPBENCH_UNROLL
            for (int a = 0; a < width; ++a) z[a] -= V_e[a + i * width] * V_b;  // (26-28, 71)
          }
          S* to = &Z_[place.z + row + place.size * (column + b)];
          LOOPBENCH_UNROLL
          for (int a = 0; a < width; ++a) to[a] = z[a];
          if (e == f) continue;
          S* mirror = &Z_[place.z + column + b + place.size * row];
          LOOPBENCH_UNROLL
          for (int a = 0; a < width; ++a) mirror[place.size * a] = z[a];
        }
      });
      row += at_e.width;
    }
    column += at_f.width;
  }
  operations_ += static_cast<long>(n) * (place.size * (place.size + 1) / 2);
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Joins<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
