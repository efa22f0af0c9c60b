#include "odca/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::odca {

namespace {

/// Multiply-adds of M^-1 c: M^-1 is diagonal except for three rotations.
template <class Space>
constexpr int kApply = Space::kRot* Space::kRot + Space::kLin;

/// The block of two sides in C Z C^T and its transpose, from the products of their rows.
template <class S, class Rows, class Others, class Dot>
[[gnu::always_inline]] inline void FillBlock(Rows rows, Others others, const Dot& dot, S* block,
                                             S* mirror) {
  const int count = rows, other_count = others;
  const bool is_diagonal = block == mirror;
  Repeat(rows, [&](int i) LOOPBENCH_INLINED {
    Repeat(others, [&](int j) LOOPBENCH_INLINED {
      if (is_diagonal && j > i) return;
      const S zeta = dot(i, j);
      block[i + count * j] = zeta;
      mirror[j + other_count * i] = zeta;
    });
  });
}

}  // namespace

template <class Space, class S>
Sweep<Space, S>::Sweep(const Mechanism<Space, S>& mechanism, const Plan& plan, SolverKind solver,
                       int threads)
    : mechanism_(mechanism),
      plan_(plan),
      solver_(solver),
      places_(plan.num_nodes()),
      bodies_(plan.num_leaves()),
      b_(plan.num_slots(), S(0)),
      F_(plan.num_rows() + Space::kDim * plan.num_leaves(), S(0)),
      start_(plan.num_leaves(), Acceleration<Space, S>::Zero()),
      along_(plan.num_leaves()),
      phi_(mechanism.joints().size(), Components<Space, S>::Zero()),
      residual_(phi_),
      s_(plan.num_rows(), S(0)),
      pool_(std::is_same_v<S, double>
                ? std::min(threads, static_cast<int>(plan.pieces().size()) - 1)
                : 1) {
  std::vector<std::shared_ptr<LoopScratch<S>>> scratch(plan.num_nodes());
  for (const PlanPiece& part : plan.pieces()) {
    Piece& piece = pieces_.emplace_back();
    piece.nodes = part.nodes;
    piece.leaves = part.leaves;
    for (const int n : part.leaves) {
      const Leaf& leaf = plan.leaves()[n];
      if (leaf.sides.empty()) piece.lone_leaves.push_back(n);
      if (leaf.end >= 0 && leaf.end != n) ++places_[leaf.end].bodies;
    }
    int rows = 0, widest = Space::kDim;
    for (const int n : part.nodes) {
      rows = std::max(rows, Node(n).rows);
      for (const Handle& handle : Node(n).handles) widest = std::max(widest, handle.width);
    }
    piece.columns.setZero(rows, widest);
    const auto shared = std::make_shared<LoopScratch<S>>(rows);
    for (const int n : part.nodes) scratch[n] = shared;
  }
  int z = 0, y = 0, x = 0, c = 0, tree = 0;
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
      if (leaf.end >= 0) {
        place.tree = tree;
        if (leaf.end == n) tree += leaf.free * leaf.free;
        c_offset_[leaf.hold.joint] = c;
        c += 2 * leaf.hold.rows;
      }
    } else {
      const PlanNode& node = Node(n);
      place.bodies = 0;
      for (int child : node.children) place.bodies += child >= 0 ? places_[child].bodies : 0;
      place.size = node.kept_numbers;
      y += node.rows * node.numbers;
      x += node.rows * node.rows;
      std::vector<int> rows;
      for (const NodeJoint& joint : node.joints) {
        rows.push_back(joint.rows);
        c_offset_[joint.index] = c;
        c += 2 * joint.rows;
      }
      if (node.closes_loop) {
        place.loop = static_cast<int>(loops_.size());
        loops_.emplace_back(rows, scratch[n]);
        loop_nodes_.push_back(n);
      }
    }
    z += place.size * place.size;
  }
  Z_.assign(z, S(0));
  Y_.assign(y, S(0));
  X_.assign(x, S(0));
  c_.assign(c, Wrench<Space, S>::Zero());
  Mc_.assign(c, Acceleration<Space, S>::Zero());
  for (const int n : plan.leaf_order()) {
    const Leaf& leaf = plan.leaves()[n];
    if (leaf.end < 0) continue;
    places_[n].hold = static_cast<int>(free_.size());
    const int own = Space::kDim - leaf.hold.rows;
    for (int k = 0; k < leaf.path; ++k) {
      const int before = k - (leaf.path - own);
      FreeDirection& free = free_.emplace_back();
      free.column =
          before < 0 ? free_[places_[leaf.holder].hold + k].column : leaf.column + own - 1 - before;
    }
  }
  trees_.assign(tree, S(0));
}

template <class Space, class S>
Components<Space, S> Sweep<Space, S>::AlongTree(int n, const Wrench<Space, S>& F) const {
  auto along = Components<Space, S>::Zero();
  WithPath(n, [&](auto size, const FreeDirection* free) LOOPBENCH_INLINED {
    Repeat(size, [&](int k) { along[free[k].column] = free[k].h.dot(F); });
  });
  ApplyTree(n, along);
  return along;
}

template <class Space, class S>
Acceleration<Space, S> Sweep<Space, S>::HeldAcceleration(int n, const Acceleration<Space, S>& given,
                                                         const Components<Space, S>& x) const {
  return WithPath(n, [&](auto size, const FreeDirection* free) LOOPBENCH_INLINED {
    Acceleration<Space, S> A = given;
    Repeat(size, [&](int k) { A += free[k].h * x[free[k].column]; });
    return A;
  });
}

template <class Space, class S>
Outcome Sweep<Space, S>::Assemble(const Kinematics<Space, S>& kinematics) {
  operations_ = 0;
  regularized_ = false;
  if (AssembleAll(kinematics, Pass::kPhysical)) return Outcome::kFinished;
  if (solver_ == SolverKind::kAsPublished) return Outcome::kSingular;
  if (!std::isfinite(static_cast<double>(rcond_))) return Outcome::kNonFinite;
  // a loop looks degenerate: geometry gives the directions, then the physics is solved
  regularized_ = true;
  regularization_ = kinematics.regularization();
  if (AssembleAll(kinematics, Pass::kGeometric) && AssembleAll(kinematics, Pass::kRegularized)) {
    return Outcome::kFinished;
  }
  return std::isfinite(static_cast<double>(rcond_)) ? Outcome::kSingular : Outcome::kNonFinite;
}

template <class Space, class S>
bool Sweep<Space, S>::AssembleAll(const Kinematics<Space, S>& kinematics, Pass pass) {
  std::atomic<int> failed = plan_.num_nodes();
  ForPieces([&](Piece& piece) { AssemblePiece(kinematics, pass, piece, failed); });
  AssemblePiece(kinematics, pass, pieces_.back(), failed);
  // diagnostics up to the first failed node, as in a serial sweep
  const int end = failed;
  AddOperations(end);
  if (pass != Pass::kRegularized) {
    dependent_rows_ = 0;
    worst_joint_ = -1;
    rcond_ = smallest_weight_ = S(1);
    for (const int n : loop_nodes_) {
      if (n <= end) NoteDiagnostics(Node(n), loops_[places_[n].loop]);
    }
  }
  if (end == plan_.num_nodes()) return true;
  if (!Node(end).closes_loop) rcond_ = X_[places_[end].x];
  return false;
}

template <class Space, class S>
void Sweep<Space, S>::AddOperations(int end) {
  for (Piece& piece : pieces_) {
    if (piece.nodes.empty() || piece.nodes.front() <= end) operations_ += piece.operations;
    piece.operations = 0;
  }
}

template <class Space, class S>
[[gnu::noinline]] void Sweep<Space, S>::AssemblePiece(const Kinematics<Space, S>& kinematics,
                                                      Pass pass, Piece& piece,
                                                      std::atomic<int>& failed) {
  const Masses masses = pass == Pass::kGeometric ? Masses::kGeometric : Masses::kPhysical;
  for (const int leaf : piece.lone_leaves) FillLeaf(kinematics, masses, piece, leaf);
  for (const int n : piece.nodes) {
    int first = failed.load(std::memory_order_relaxed);
    if (n > first) return;
    const PlanNode& node = Node(n);
    const Place& place = places_[n];
    for (int child : node.children) {
      if (child >= 0 && IsLeaf(child)) FillLeaf(kinematics, masses, piece, child);
    }
    const bool ok = WithSizes<Space, S>(node, [&](auto rows, auto width) {
      FormResponse(node, place, piece, rows, width);
      if (!(node.closes_loop ? FactorLoop(node, place, piece, pass)
                             : FactorFloating(place, piece, rows))) {
        return false;
      }
      ApplyToKept(node, place, piece, rows, width);
      Eliminate(node, place, piece, rows, width);
      return true;
    });
    if (ok) continue;
    while (n < first && !failed.compare_exchange_weak(first, n)) {
    }
    return;
  }
}

/// Rows of C on one body. D at Mo becomes c at the centre of mass, so that c^T A is the D^T A of
/// the paper's handles, which removes udot (12, 37-38, 57-58). That c_P and c_Q have opposite signs
/// is Newton's third law (51-52). Rows of one joint after rows of another make the block-diagonal
/// D (69).
template <class Space, class S>
template <class Rows>
void Sweep<Space, S>::FillRows(const Kinematics<Space, S>& kinematics, Masses masses,
                               const PlanSide& side, Rows rows) {
  const JointState<Space, S>& state = kinematics.joints()[side.joint];
  const Linear<Space, S> r =
      side.at_Q ? kinematics.ArmQ(side.joint, masses) : kinematics.ArmP(side.joint, masses);
  Wrench<Space, S>* c = c_.data() + c_offset_[side.joint] + (side.at_Q ? side.rows : 0);
  const S sign = side.at_Q ? S(1) : S(-1);
  Repeat(rows, [&](int i) { c[i] = ShiftForce<Space, S>(state.D(i), r) * sign; });
}

/// Free directions h of a held body at its centre of mass: first the directions of the holder, then
/// those that its own joint leaves free. N is the sum of h^T M h over the bodies of the tree. The
/// response of its bodies is H N^-1 H^T. Dual vector i has the product 1 with row i of c and 0
/// with other rows, so c0 needs no solution of equations. The columns of D are orthonormal, except
/// for exact tilts (JointKind::exact_basis).
template <class Space, class S>
void Sweep<Space, S>::FillHold(const Kinematics<Space, S>& kinematics, Masses masses, Piece& piece,
                               int n) {
  const Leaf& leaf = plan_.leaves()[n];
  const PlanSide& hold = leaf.hold;
  const JointState<Space, S>& state = kinematics.joints()[hold.joint];
  const auto arm = [&](bool at_Q) {
    return at_Q ? kinematics.ArmQ(hold.joint, masses) : kinematics.ArmP(hold.joint, masses);
  };
  Body& body = bodies_[n];
  const Linear<Space, S>& r = body.to_hold = arm(hold.at_Q);
  body.rotational = kinematics.RotationalInertia(mechanism_.bodies(masses)[n + 1], n + 1);
  body.mass = mechanism_.bodies(masses)[n + 1].mass;
  if (leaf.holder >= 0) body.from_holder = arm(!hold.at_Q) - r;
  Acceleration<Space, S>* dual = Mc_.data() + c_offset_[hold.joint];
  for (int i = 0; i < hold.rows; ++i) dual[i] = Acceleration<Space, S>(state.D(i));
  if constexpr (Space::kRot == 3) {
    if (mechanism_.joints()[hold.joint].kind->basis_rate != nullptr) {  // two tilts come first
      const Angular<Space, S>&a = state.D(0).angular, &b = state.D(1).angular;
      const Angular<Space, S> normal = a.cross(b), scaled = normal / normal.squaredNorm();
      dual[0].angular = b.cross(scaled);
      dual[1].angular = scaled.cross(a);
    }
  }
  for (int i = 0; i < hold.rows; ++i) {
    dual[i] = ShiftMotion<Space, S>(dual[i], -r) * (hold.at_Q ? S(1) : S(-1));
  }
  const int size = leaf.path, before = size - (Space::kDim - hold.rows), all = leaf.free;
  FreeDirection* free = free_.data() + places_[n].hold;
  S* N = trees_.data() + places_[leaf.end].tree;
  if (leaf.holder < 0) std::fill_n(N, all * all, S(0));
  for (int k = 0; k < size; ++k) {
    // released directions follow D
    const int i = k - before;
    const Acceleration<Space, S> h =
        k < before ? free_[places_[leaf.holder].hold + k].h
                   : Acceleration<Space, S>(state.basis[i < state.num_u ? i : hold.rows + i]);
    free[k].h = ShiftMotion<Space, S>(h, k < before ? body.from_holder : Linear<Space, S>(-r));
    free[k].Mh = {body.rotational * free[k].h.angular, free[k].h.linear * body.mass};
    for (int l = 0; l <= k; ++l)
      N[free[l].column + all * free[k].column] += free[k].Mh.dot(free[l].h);
  }
  if (leaf.end == n) FactorLower(N, all);
  piece.operations += size * kApply<Space> + Space::kDim * (size * (size + 1) / 2 + before) +
                      (leaf.sides.empty() ? 0 : all * all * all / 6 + all);
}

/// Z of body n + 1, or C Z C^T. Z is M^-1 in ground axes, or the response of the held body. The
/// paper's zeta_ij of the handles at r_i and r_j are S(r_i) M^-1 S(r_j)^T, for bodies k and k+1
/// (1-4) and body 2 (45-46).
template <class Space, class S>
void Sweep<Space, S>::FillLeaf(const Kinematics<Space, S>& kinematics, Masses masses, Piece& piece,
                               int n) {
  const Leaf& leaf = plan_.leaves()[n];
  const Inertia<Space, S>& inertia = mechanism_.bodies(masses)[n + 1];
  Body& body = bodies_[n];
  body.rotational_inverse = kinematics.RotationalInverse(inertia, n + 1);
  body.per_mass = S(1) / inertia.mass;
  const bool is_held = leaf.end >= 0;
  if (is_held) FillHold(kinematics, masses, piece, n);
  const FreeDirection* free = free_.data() + places_[n].hold;
  const int terms = is_held ? leaf.free : Space::kDim;
  S* Z = Z_.data() + places_[n].z;
  int first = 0;
  for (const PlanSide& side : leaf.sides) {
    const int offset = Offset(side);
    const Wrench<Space, S>* c = c_.data() + offset;
    Acceleration<Space, S>* Zc = Mc_.data() + offset;
    WithSize<S, Space::kDim - 1>(side.rows, [&](auto rows) LOOPBENCH_INLINED {
      FillRows(kinematics, masses, side, rows);
      piece.operations +=
          rows * (is_held ? plan_.leaves()[side.leaf].path * Space::kDim : kApply<Space>);
      if (leaf.is_body) {
        if (is_held) piece.operations += rows * terms * Space::kDim;
        return;
      }
      Repeat(rows, [&](int i) LOOPBENCH_INLINED {
        if (!is_held) {
          Zc[i] = {body.rotational_inverse * c[i].angular, c[i].linear * body.per_mass};
        } else {
          const Components<Space, S> along = AlongTree(side.leaf, c[i]);
          for (int k = 0; k < terms; ++k) Zc[i][k] = along[k];
        }
      });
      int before = 0;
      for (const PlanSide& other : leaf.sides.first(&side - leaf.sides.data() + 1)) {
        const Acceleration<Space, S>* Zc_other = Mc_.data() + Offset(other);
        S* block = Z + leaf.width * before + other.rows * first;
        S* mirror = Z + leaf.width * first + rows * before;
        const auto fill = [&](auto others) LOOPBENCH_INLINED {
          if (!is_held) {
            const auto dot = [&](int i, int j) { return c[i].dot(Zc_other[j]); };  // (1-4, 45-46)
            return FillBlock(rows, others, dot, block, mirror);
          }
          const auto dot = [&](int i, int j) {
            S sum = Zc[i][0] * Zc_other[j][0];
            for (int k = 1; k < terms; ++k) sum += Zc[i][k] * Zc_other[j][k];
            return sum;
          };
          FillBlock(rows, others, dot, block, mirror);
        };
        if (kIsKnown<decltype(rows)> && other.rows == rows) {
          fill(rows);
        } else {
          fill(other.rows);
        }
        piece.operations += terms * (first == before ? rows * (rows + 1) / 2 : rows * other.rows);
        before += other.rows;
      }
      first += rows;
    });
  }
  if (!leaf.is_body) return;
  Block<Space, S> block = Block<Space, S>::Zero();
  if (is_held) {
    Acceleration<Space, S> G[Space::kDim];
    for (Acceleration<Space, S>& g : G) g.setZero();
    for (int k = 0; k < leaf.path; ++k) G[free[k].column] = free[k].h;
    SolveLower(&trees_[places_[n].tree], terms, G);
    for (int k = 0; k < terms; ++k) SubtractOuter(-G[k], G[k], block);
  } else {
    block = DiagonalBlock<Space, S>(body.rotational_inverse, body.per_mass);
  }
  LOOPBENCH_UNROLL
  for (int j = 0; j < Space::kDim; ++j) {
    LOOPBENCH_UNROLL
    for (int i = 0; i < Space::kDim; ++i) Z[i + Space::kDim * j] = block(i, j);
  }
}

/// Y = C Z of one side of a joint, at one handle of the same child (67).
template <class Space, class S>
template <class Rows, class Width, class Numbers>
[[gnu::always_inline]] inline void Sweep<Space, S>::RespondAt(
    const PlanNode& node, const Handle& side, const Handle& handle, const Wrench<Space, S>* c,
    Rows count, Width known, Numbers width, bool adds, S* Y) const {
  const int child = node.children[side.child], b_end = width;
  S sum[Space::kDim * Space::kDim];
  const S* Z = Z_.data() + places_[child].z + places_[child].size * side.place;
  if (!IsBody<Space>(side, known)) {
    Z += count * handle.place;
    Repeat(Product(count, width), [&](int k) { sum[k] = Z[k]; });
  } else if (IsLeaf(child)) {
    Repeat(count, [&](int i) LOOPBENCH_INLINED {
      const Acceleration<Space, S> Mc = Response(child, c[i]);
      LOOPBENCH_UNROLL
      for (int b = 0; b < Space::kDim; ++b) sum[b + Space::kDim * i] = Mc[b];
    });
  } else {
    Z += Space::kDim * handle.place;
    Repeat(count, [&](int i) LOOPBENCH_INLINED {
      Repeat(width, [&](int b) { sum[b + b_end * i] = c[i][0] * Z[b]; });
      LOOPBENCH_UNROLL
      for (int k = 1; k < Space::kDim; ++k) {
        Repeat(width, [&](int b) { sum[b + b_end * i] += c[i][k] * Z[b + b_end * k]; });
      }
    });
  }
  if (adds) Repeat(Product(count, width), [&](int k) { sum[k] += Y[k]; });
  Repeat(Product(count, width), [&](int k) { Y[k] = sum[k]; });
}

/// Y = C Z on every handle, and X = Y C^T, both triangles. At a handle with the rows of a joint,
/// the rows of C are rows of the identity. Y is the paper's D^T zeta (67) except for the sign of
/// c_P. X is D^T [zeta + zeta] D of a series join (16), the left side of (15). It is chi at the
/// closing of base and terminal joint (42), with the block rows (40) and (41). In a coupled loop it
/// has the block rows (61) and (63); the paper writes X for its inverse (66).
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::FormResponse(const PlanNode& node, const Place& place, Piece& piece,
                                   Rows rows, Width known) {
  const int n = rows;
  S* X = X_.data() + place.x;
  int first = 0;
  for (const NodeJoint& joint : node.joints) {
    const auto count = RowsOf<Space>(joint, rows, known);
    const auto each_side = [&](const auto& call) LOOPBENCH_INLINED {
      if (joint.from >= 0) call(node.handles[joint.from], c_P(joint), false);
      if (joint.to >= 0) call(node.handles[joint.to], c_Q(joint), joint.from >= 0);
    };
    each_side([&](const Handle& side, const Wrench<Space, S>* c, bool is_second) LOOPBENCH_INLINED {
      const bool self_joins = is_second && node.handles[joint.from].child == side.child;
      for (const Handle& handle : node.handles) {
        if (handle.child != side.child) continue;
        WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
          S* Y = Y_.data() + place.y + handle.number * n + first * width;
          RespondAt(node, side, handle, c, count, known, width, self_joins, Y);
        });
      }
    });
    each_side([&](const Handle& side, const Wrench<Space, S>* c, bool adds) LOOPBENCH_INLINED {
      const S* Y = Y_.data() + place.y + side.number * n;
      Repeat(count, [&](int i) LOOPBENCH_INLINED {  // (16, 42, 66)
        S* X_i = X + first + i;
        for (int l = 0; l <= first + i; ++l) {
          S sum = adds ? X_i[l * n] : S(0);
          if (!IsBody<Space>(side, known)) {
            sum += Y[l * count + i];
          } else {
            LOOPBENCH_UNROLL
            for (int k = 0; k < Space::kDim; ++k) sum += c[i][k] * Y[l * Space::kDim + k];
          }
          X_i[l * n] = sum;
        }
      });
      if (!IsBody<Space>(side, known)) return;
      const int child = node.children[side.child];
      piece.operations += count * Space::kDim * (IsLeaf(child) ? 0 : places_[child].size) +
                          Space::kDim * (count * first + count * (count + 1) / 2);
    });
    first += count;
  }
  if (!node.closes_loop) return;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < j; ++i) X[i + j * n] = X[j + i * n];
  }
}

/// X = L L^T in place of X's lower triangle, T = L^-1; (17) inverts X. X is positive definite,
/// because one side floats.
template <class Space, class S>
template <class Rows>
bool Sweep<Space, S>::FactorFloating(const Place& place, Piece& piece, Rows rows) {
  piece.operations += static_cast<long>(rows) * rows * rows / 6 + rows;
  const S least = FactorLower(&X_[place.x], rows);
  if (least > S(0)) return true;
  X_[place.x] = least;  // for AssembleAll()
  return false;
}

/// Across a joint, of its two bodies alone: the X of a series join of two leaves that are not held.
template <class Space, class S>
JointMatrix<S> Sweep<Space, S>::FreeResponseAt(const PlanNode& node, const NodeJoint& joint) const {
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
bool Sweep<Space, S>::FactorLoop(const PlanNode& node, const Place& place, Piece& piece,
                                 Pass pass) {
  LoopSolver<S>& loop = loops_[place.loop];
  const Eigen::Map<const MatrixX<S>> X(&X_[place.x], node.rows, node.rows);
  piece.operations += static_cast<long>(node.rows) * node.rows * node.rows / 6 + node.rows;
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
    return loop.FactorPlain(X, scale, S(64) * eps * S(mechanism_.num_bodies()));
  }
  if (pass != Pass::kRegularized) {
    for (int j = 0; j < static_cast<int>(node.joints.size()); ++j) {
      loop.SetScale(j, FreeResponseAt(node, node.joints[j]));
    }
  }
  if (pass == Pass::kPhysical) {
    const S limit = S(LoopSolver<S>::kSuspicious * ShareOfLimit(place.bodies));
    return loop.FactorScaled(X) || loop.rcond() >= limit;
  }
  if (pass == Pass::kGeometric) {
    loop.FactorGeometric(X, regularization_);
    return true;
  }
  return loop.FactorRegularized(X);
}

template <class Space, class S>
void Sweep<Space, S>::NoteDiagnostics(const PlanNode& node, const LoopSolver<S>& loop) {
  dependent_rows_ += loop.size() - loop.rank();
  if (!(loop.rcond() >= rcond_)) {
    rcond_ = loop.rcond();
    worst_joint_ = node.joints.back().index;
  }
  smallest_weight_ = std::min(smallest_weight_, loop.smallest_weight());
}

/// V = T Y in Y's place, for the handles that stay: the X Y of (64) is -T^T V.
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::ApplyToKept(const PlanNode& node, const Place& place, Piece& piece, Rows rows,
                                  Width known) {
  const int n = rows;
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    S* Y = Y_.data() + place.y + handle.number * n;
    if (node.closes_loop) {
      using RowByRow = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowByRow> block(Y, n, handle.width);
      auto columns = piece.columns.topLeftCorner(n, handle.width);
      columns = block;
      loops_[place.loop].Apply(columns);
      block = columns;
    } else {
      const S* L = X_.data() + place.x;
      WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
        Repeat(rows, [&](int i) LOOPBENCH_INLINED {
          S V[Space::kDim];
          Repeat(width, [&](int b) { V[b] = Y[i * width + b]; });
          for (int k = 0; k < i; ++k) {
            Repeat(width, [&](int b) { V[b] -= Y[k * width + b] * L[i + k * n]; });
          }
          Repeat(width, [&](int b) { Y[i * width + b] = V[b] * L[i + i * n]; });
        });
      });
    }
    piece.operations += static_cast<long>(n) * (n + 1) / 2 * handle.width;
  }
}

/// Z' = Z - V^T V over the handles that stay. In a series join the blocks of two handles of one
/// child are Upsilon_11 (26) and Upsilon_22 (27), those across, with Z = 0 between the children,
/// Upsilon_12 (28); where body 2 alone stays of a coupled loop, the block is zeta^asm (71).
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::Eliminate(const PlanNode& node, const Place& place, Piece& piece, Rows rows,
                                Width known) {
  const int n = rows, size = place.size;
  const S* Y = Y_.data() + place.y;
  S* to = Z_.data() + place.z;
  int column = 0;
  for (int f : node.kept) {
    const Handle& at_f = node.handles[f];
    const Place& child = places_[node.children[at_f.child]];
    WithWidth<Space, S>(at_f, known, [&](auto width_f) LOOPBENCH_INLINED {
      const S* Z = Z_.data() + child.z + child.size * at_f.place;
      const S* V_f = Y + at_f.number * n;
      int row = 0;
      for (int e : node.kept) {
        if (e > f) break;
        const Handle& at_e = node.handles[e];
        WithWidth<Space, S>(at_e, known, [&](auto width_e) LOOPBENCH_INLINED {
          const auto numbers = Product(width_e, width_f);
          const int a_end = width_e, b_end = width_f;
          const S* V_e = Y + at_e.number * n;
          S z[Space::kDim * Space::kDim];
          if (at_e.child == at_f.child) {
            Repeat(numbers, [&](int k) { z[k] = Z[width_f * at_e.place + k]; });
          } else {
            Repeat(numbers, [&](int k) { z[k] = S(0); });
          }
          for (int i = 0; i < n; ++i) {
            Repeat(width_f, [&](int b) LOOPBENCH_INLINED {
              const S V_b = V_f[b + b_end * i];
              Repeat(width_e, [&](int a) {
                z[a + a_end * b] -= V_e[a + a_end * i] * V_b;  // (26-28, 71)
              });
            });
          }
          S* block = to + size * column + b_end * row;
          Repeat(numbers, [&](int k) { block[k] = z[k]; });
          if (e != f) {
            S* mirror = to + size * row + a_end * column;
            Repeat(width_e, [&](int a) LOOPBENCH_INLINED {
              Repeat(width_f, [&](int b) { mirror[b + b_end * a] = z[a + a_end * b]; });
            });
          }
          row += a_end;
        });
      }
      column += width_f;
    });
  }
  piece.operations += static_cast<long>(n) * (size * (size + 1) / 2);
}

template <class Space, class S>
void Sweep<Space, S>::Solve(const Loads& loads, std::span<Acceleration<Space, S>> A) {
  for (Acceleration<Space, S>& acceleration : A) acceleration.setZero();  // Ground's too (33-34)
  for (Components<Space, S>& phi : phi_) phi.setZero();
  Correct(loads, A);
  if (!regularized_) return;
  pool_.ForEach(static_cast<int>(pieces_.size()),
                [&](int i) { Residual(pieces_[i], loads.c0, A); });
  Correct({.b = {}, .wrenches = {}, .c0 = residual_, .known = {}}, A);
}

/// The last leaf of a tree has the handles of all its bodies. The given part of a held body's
/// acceleration has nothing along its free directions. It is the acceleration of the holder, moved
/// to the body, with c0 of the hold; if the hold is a tree joint, `known` replaces c0. The
/// generalised forces of F - M (given part) are added along the tree.
template <class Space, class S>
[[gnu::always_inline]] inline void Sweep<Space, S>::UpLeaf(int n, Piece& piece,
                                                           const Loads& loads) {
  const Leaf& leaf = plan_.leaves()[n];
  std::fill_n(F_.data() + plan_.num_rows() + Space::kDim * n, Space::kDim, S(0));
  const bool is_held = leaf.end >= 0;
  Components<Space, S>& along = along_[is_held ? leaf.end : n];
  Acceleration<Space, S>& given = start_[n];
  if (is_held) {
    const int joint = leaf.hold.joint;
    if (leaf.holder < 0) {
      along.setZero();
      given.setZero();
    } else {
      given = ShiftMotion<Space, S>(start_[leaf.holder], bodies_[n].from_holder);
    }
    if (!mechanism_.joints()[joint].in_tree()) {
      const Acceleration<Space, S>* dual = Mc_.data() + c_offset_[joint];
      for (int i = 0; i < leaf.hold.rows; ++i) given -= dual[i] * loads.c0[joint][i];
    } else if (!loads.known.empty()) {  // components along H do not matter
      const auto part = ShiftMotion<Space, S>(loads.known[joint], -bodies_[n].to_hold);
      leaf.hold.at_Q ? given -= part : given += part;
    }
    const Wrench<Space, S> F = loads.WrenchOn(n);
    WithPath(n, [&](auto size, const FreeDirection* free) LOOPBENCH_INLINED {
      Repeat(size,
             [&](int k) { along[free[k].column] += free[k].h.dot(F) - free[k].Mh.dot(given); });
    });
    piece.operations += Space::kDim * (leaf.hold.rows + 2 * leaf.path);
    if (leaf.sides.empty()) return;
    ApplyTree(n, along);
  } else {
    given = loads.b.empty() ? Acceleration<Space, S>::Zero() : loads.b[n + 1];
  }
  S* slot = b_.data() + leaf.slot;
  if (loads.b.empty() && !is_held) {
    std::fill_n(slot, leaf.width, S(0));
    return;
  }
  if (leaf.is_body) {
    Components<Space, S> x = along;
    if (is_held) ApplyTreeTransposed(n, x);
    const auto all = is_held ? HeldAcceleration(n, given, x) : given;
    LOOPBENCH_UNROLL
    for (int d = 0; d < Space::kDim; ++d) slot[d] = all[d];
    return;
  }
  for (const PlanSide& side : leaf.sides) {
    const Wrench<Space, S>* c = this->c(side.joint, side.at_Q, side.rows);
    WithSize<S, Space::kDim - 1>(side.rows, [&](auto rows) LOOPBENCH_INLINED {
      Repeat(rows, [&](int i) { slot[i] = c[i].dot(start_[side.leaf]); });
      if (is_held) {
        const Acceleration<Space, S>* of_side = AlongTree(side);
        WithSize<S, 1, 2, 3>(leaf.free, [&](auto free) LOOPBENCH_INLINED {
          Repeat(rows,
                 [&](int i) { Repeat(free, [&](int k) { slot[i] += of_side[i][k] * along[k]; }); });
        });
      }
      slot += rows;
    });
    piece.operations += (Space::kDim + leaf.free) * side.rows;
  }
}

/// A = Z F + b (1-4, 45-46) with all forces known, including the joints' own. The last leaf of a
/// tree solves for all its bodies.
template <class Space, class S>
[[gnu::always_inline]] inline void Sweep<Space, S>::DownLeaf(int n, Piece& piece,
                                                             const Loads& loads,
                                                             std::span<Acceleration<Space, S>> A) {
  const Leaf& leaf = plan_.leaves()[n];
  const auto force_on = [&](int other) { return &F_[plan_.num_rows() + Space::kDim * other]; };
  Wrench<Space, S> F;
  LOOPBENCH_UNROLL
  for (int d = 0; d < Space::kDim; ++d) F[d] = force_on(n)[d];
  piece.operations += Space::kDim * Space::kDim / 3;
  if (leaf.end < 0) {
    A[n + 1] += start_[n] + Response(n, F);
    return;
  }
  Components<Space, S>& x = along_[leaf.end];
  if (leaf.end == n) {
    if (leaf.sides.empty()) ApplyTree(n, x);
    if (leaf.is_body) x += AlongTree(n, F);
    for (const PlanSide& side : leaf.is_body ? std::span<const PlanSide>() : leaf.sides) {
      const Acceleration<Space, S>* of_side = AlongTree(side);
      WithSize<S, 1, 2, 3>(leaf.free, [&](auto free) LOOPBENCH_INLINED {
        for (int i = 0; i < side.rows; ++i) {
          Repeat(free, [&](int k) { x[k] += of_side[i][k] * F_[side.row + i]; });
        }
      });
    }
    ApplyTreeTransposed(n, x);
  }
  const Acceleration<Space, S> all = HeldAcceleration(n, start_[n], x);
  A[n + 1] += all;
  // the wrench of the hold on the body, its phi, and the opposite wrench at the holder
  const Body& body = bodies_[n];
  const Wrench<Space, S> holding =
      Wrench<Space, S>(body.rotational * all.angular, all.linear * body.mass) -
      (F + loads.WrenchOn(n));
  const Acceleration<Space, S>* dual = Mc_.data() + c_offset_[leaf.hold.joint];
  for (int i = 0; i < leaf.hold.rows; ++i) phi_[leaf.hold.joint][i] += dual[i].dot(holding);
  piece.operations += Space::kDim * (leaf.hold.rows + 2 * leaf.path);
  if (leaf.holder < 0) return;
  const Wrench<Space, S> reaction = -ShiftForce<Space, S>(holding, body.from_holder);
  LOOPBENCH_UNROLL
  for (int d = 0; d < Space::kDim; ++d) force_on(leaf.holder)[d] += reaction[d];
}

template <class Space, class S>
void Sweep<Space, S>::Correct(const Loads& loads, std::span<Acceleration<Space, S>> A) {
  ForPieces([&](Piece& piece) { UpPiece(piece, loads); });
  UpPiece(pieces_.back(), loads);
  DownPiece(pieces_.back(), loads, A);
  ForPieces([&](Piece& piece) { DownPiece(piece, loads, A); });
  AddOperations(plan_.num_nodes());
}

template <class Space, class S>
[[gnu::noinline]] void Sweep<Space, S>::UpPiece(Piece& piece, const Loads& loads) {
  for (const int n : piece.leaves) UpLeaf(n, piece, loads);
  for (const int n : piece.nodes) {
    WithSizes<Space, S>(
        Node(n), [&](auto rows, auto width) { Up(Node(n), n, piece, rows, width, loads.c0); });
  }
}

template <class Space, class S>
[[gnu::noinline]] void Sweep<Space, S>::DownPiece(Piece& piece, const Loads& loads,
                                                  std::span<Acceleration<Space, S>> A) {
  for (auto n = piece.nodes.rbegin(); n != piece.nodes.rend(); ++n) {
    WithSizes<Space, S>(Node(*n),
                        [&](auto rows, auto width) { Down(Node(*n), *n, piece, rows, width); });
  }
  for (auto n = piece.leaves.rbegin(); n != piece.leaves.rend(); ++n) {
    DownLeaf(*n, piece, loads, A);
  }
}

/// r = C A + c0 of every joint: D^T times the difference of the two sides of (7), without udot.
template <class Space, class S>
void Sweep<Space, S>::Residual(Piece& piece, std::span<const Components<Space, S>> c0,
                               std::span<const Acceleration<Space, S>> A) {
  for (const int n : piece.nodes) {
    const PlanNode& node = Node(n);
    const auto body = [&](int handle) { return node.handles[handle].body; };
    for (const NodeJoint& joint : node.joints) {
      Components<Space, S>& r = residual_[joint.index];
      for (int i = 0; i < joint.rows; ++i) {
        r[i] = c0[joint.index][i];
        if (joint.from >= 0) r[i] += c_P(joint)[i].dot(A[body(joint.from)]);
        if (joint.to >= 0) r[i] += c_Q(joint)[i].dot(A[body(joint.to)]);
      }
      piece.operations += 2 * Space::kDim * joint.rows;
    }
  }
}

/// C b + c0 is the negative of the bracket in (15) without outer forces, of chi_i3 in (42), of K
/// (68); with T it is s, and the paper's Y-hat is -C^T T^T s (21). Then b' = b - V^T s is
/// Upsilon_i3 (29-30) and zeta^asm_i3 (72). The zero that c0 + c_P^T A_P + c_Q^T A_Q must be is
/// (37-38) at joints to Ground and (57-58) in a coupled loop.
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::Up(const PlanNode& node, int n, Piece& piece, Rows rows, Width known,
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
      const Wrench<Space, S>* c = this->c(joint.index, at_Q, joint.rows);
      for (int i = 0; i < count; ++i) {
        S sum = s[row + i];
        LOOPBENCH_UNROLL
        for (int d = 0; d < Space::kDim; ++d) sum += c[i][d] * b[d];
        s[row + i] = sum;
      }
      piece.operations += Space::kDim * count;
    }
    row += count;
  }
  Apply(node, n, rows, s);  // (21)
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    const S* V = this->V(node, n, handle);
    S* b = b_.data() + handle.slot;
    WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
      for (int i = 0; i < rows; ++i) {
        Repeat(width, [&](int a) { b[a] -= V[i * width + a] * s[i]; });  // (29-30, 72)
      }
    });
  }
  piece.operations += rows * (node.kept_numbers + rows / 2);
}

/// phi = -T^T (s + V F) are the measure numbers of a series join (17), of the base and terminal
/// joint, the solution of (42), and of a coupled loop (64). The force on a body is the external
/// force F^ext of (47-48) plus c phi, the D phi of (13, 18, 39, 59, 65) moved from Mo to the centre
/// of mass.
template <class Space, class S>
template <class Rows, class Width>
void Sweep<Space, S>::Down(const PlanNode& node, int n, Piece& piece, Rows rows, Width known) {
  const int first = node.joints.front().row;
  S* phi = F_.data() + first;
  for (int i = 0; i < rows; ++i) phi[i] = -s_[first + i];
  for (int e : node.kept) {
    const Handle& handle = node.handles[e];
    const S* V = this->V(node, n, handle);
    const S* F = F_.data() + handle.force;
    WithWidth<Space, S>(handle, known, [&](auto width) LOOPBENCH_INLINED {
      for (int i = 0; i < rows; ++i) {
        S sum = phi[i];
        Repeat(width, [&](int a) { sum -= V[i * width + a] * F[a]; });
        phi[i] = sum;
      }
    });
  }
  ApplyTransposed(node, n, rows, phi);  // (17, 42, 64)
  for (const NodeJoint& joint : node.joints) {
    const int count = RowsOf<Space>(joint, rows, known);
    for (int i = 0; i < count; ++i) phi_[joint.index][i] += phi[i];
    for (const bool at_Q : {false, true}) {
      const int h = at_Q ? joint.to : joint.from;
      if (h < 0) continue;
      const Wrench<Space, S>* c = this->c(joint.index, at_Q, joint.rows);
      auto sum = Wrench<Space, S>::Zero();
      for (int i = 0; i < count; ++i) sum += c[i] * phi[i];  // (18, 39, 47-48, 65)
      S* F = F_.data() + plan_.num_rows() + Space::kDim * (node.handles[h].body - 1);
      LOOPBENCH_UNROLL
      for (int d = 0; d < Space::kDim; ++d) F[d] += sum[d];
      piece.operations += Space::kDim * count;
    }
    phi += count;
  }
  piece.operations += rows * (node.kept_numbers + rows / 2);
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Sweep<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::odca
