// Symbols are defined in self_stress.h. Columns of J are the speeds a along H, then b along D.
#include "mechanism/loops/self_stress.h"

#include <algorithm>
#include <array>
#include <limits>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/lower_triangle.h"
#include "mechanism/loops/row_choice.h"

namespace loopbench {

namespace {

/// A = L L^T in A's place, as lower_triangle.h has it; the smallest pivot.
template <class S>
S FactorInPlace(MatrixX<S>& A) {
  const auto size = static_cast<int>(A.rows());
  if (size <= kSmallTriangle) return FactorLower(A.data(), size);
  CholeskyFactor<MatrixX<S>>::InPlace(A);
  const S least = A.diagonal().minCoeff();
  A.diagonal() = A.diagonal().cwiseInverse().eval();
  return least * least;
}

template <class S, class T>
void SolveBoth(const MatrixX<S>& L, T* x) {
  SolveLower(L.data(), static_cast<int>(L.rows()), x);
  SolveLowerTransposed(L.data(), static_cast<int>(L.rows()), x);
}

template <class T>
LOOPBENCH_INLINE T ZeroOf() {
  if constexpr (std::is_same_v<T, Lanes>) {
    return T{};
  } else {
    return T(0);
  }
}

/// Sum of a_i x_i of n numbers; T: numbers or packs.
template <class T, class S>
T Dot(const T* a, const S* x, int n) {
  T sum = ZeroOf<T>();
  for (int i = 0; i < n; ++i) sum += a[i] * x[i];
  return sum;
}

template <class S, class T, int n>
LOOPBENCH_INLINE void Add(const Small<S, n>& a, const T& s, Small<T, n>& sum) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < n; ++i) sum[i] += a[i] * s;
}
template <class S, class T, int n>
LOOPBENCH_INLINE T Dot(const Small<S, n>& a, const Small<T, n>& b) {
  T sum = a[0] * b[0];
  LOOPBENCH_UNROLL
  for (int i = 1; i < n; ++i) sum += a[i] * b[i];
  return sum;
}
/// sum += direction * s.
template <class Space, class S, class T, class Kind>
LOOPBENCH_INLINE void Add(const DirectionParts& parts, const Direction<Space, S>& direction,
                          const T& s, SpatialVector<Space, T, Kind>& sum) {
  if (parts.turns) Add(direction.angular, s, sum.angular);
  if (parts.shifts) Add(direction.linear, s, sum.linear);
}
template <class Space, class S, class T, class Kind>
LOOPBENCH_INLINE T Dot(const DirectionParts& parts, const Direction<Space, S>& direction,
                       const SpatialVector<Space, T, Kind>& V) {
  if (!parts.shifts) return Dot(direction.angular, V.angular);
  if (!parts.turns) return Dot(direction.linear, V.linear);
  return Dot(direction.angular, V.angular) + Dot(direction.linear, V.linear);
}
/// moment += r x f.
template <class S, class T>
LOOPBENCH_INLINE void AddMoment(const Small<S, 2>& r, const Small<T, 2>& f, Small<T, 1>& moment) {
  moment[0] += r[0] * f[1] - r[1] * f[0];
}
template <class S, class T>
LOOPBENCH_INLINE void AddMoment(const Small<S, 3>& r, const Small<T, 3>& f, Small<T, 3>& moment) {
  moment[0] += r[1] * f[2] - r[2] * f[1];
  moment[1] += r[2] * f[0] - r[0] * f[2];
  moment[2] += r[0] * f[1] - r[1] * f[0];
}
template <class Space, class T>
LOOPBENCH_INLINE void SetZero(Wrench<Space, T>& F) {
  LOOPBENCH_UNROLL
  for (int i = 0; i < Space::kRot; ++i) F.angular[i] = ZeroOf<T>();
  LOOPBENCH_UNROLL
  for (int i = 0; i < Space::kLin; ++i) F.linear[i] = ZeroOf<T>();
}

}  // namespace

template <class Space, class S>
SelfStress<Space, S>::SelfStress(const Mechanism<Space, S>& mechanism) : mechanism_(&mechanism) {
  Span();
  const int m = r_ + d_;
  rows_.setZero(H_, m);
  row_scale_.setOnes(m);
  inverse_scale_ = row_scale_;
  column_scale_.setOnes(H_ + D_);
  gram_.setIdentity(r_, r_);
  imposed_.assign(PacksFor(r_) * H_, ZeroOf<Pack>());
  released_.assign(PacksFor(d_) * H_, ZeroOf<Pack>());
  W_.assign(PacksFor(d_) * size(), ZeroOf<Pack>());
  for (int q = 0; q < d_; ++q) Set(W_[q / kPack * size() + r_ + q], q % kPack, S(1));
  C_.setIdentity(d_, d_);
  z_.setZero(m + D_);
  y_.setZero(H_ + D_);
  along_.assign(PacksFor(d_), ZeroOf<Pack>());
  loads_of_pack_.resize(edges_.size());
  loads_.assign(edges_.size(), Wrench<Space, S>::Zero());
  load_rates_ = loads_;
  const bool has_others = mechanism.num_moving_rows() > 0 || !coupled_.empty();
  feedback_.setZero(has_others ? mechanism.num_equations() : mechanism.num_rows());
  share_ = feedback_;
  is_exact_ = D_ == 0 && loops_.size() == 1 && loops_.front().num_drives == 0 && !has_others;
}

/// In joint coordinates the forest is the tree of the mechanism, in absolute ones a forest of
/// joints without released directions; with couplings it contains only joints of the same tree.
/// All other constraints close loops.
template <class Space, class S>
void SelfStress<Space, S>::Span() {
  const auto& joints = mechanism_->joints();
  const bool in_joints = mechanism_->coordinates() == Coordinates::kJoint;
  std::vector<std::vector<int>> joints_of(static_cast<std::size_t>(mechanism_->num_bodies()));
  for (int c = 0; c < mechanism_->num_coordinate_couplings(); ++c) {
    if (mechanism_->couplings()[c].in_loops) coupled_.push_back({c, {}});
  }
  const auto usable = [&](int j) {
    if (in_joints) return joints[j].in_tree();
    return !joints[j].in_tree() && joints[j].num_released == 0 &&
           (coupled_.empty() || !joints[j].is_cut);
  };
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (!usable(j)) continue;
    joints_of[joints[j].from].push_back(j);
    joints_of[joints[j].to].push_back(j);
  }
  edges_.assign(joints_of.size(), Edge());
  std::vector<bool> reached(joints_of.size(), false), spans(joints.size(), false);
  for (int root = 0; root < mechanism_->num_bodies(); ++root) {
    std::vector<int> bodies;
    if (!reached[root]) bodies.push_back(root);
    reached[root] = true;
    for (std::size_t next = 0; next < bodies.size(); ++next) {
      const int parent = bodies[next];
      for (const int j : joints_of[parent]) {
        const int child = joints[j].from == parent ? joints[j].to : joints[j].from;
        if (reached[child]) continue;
        reached[child] = spans[j] = true;
        bodies.push_back(child);
        edges_[child] = {.joint = j,
                         .parent = parent,
                         .sign = joints[j].to == child ? 1 : -1,
                         .depth = edges_[parent].depth + 1,
                         .column = in_joints ? joints[j].u_offset : H_,
                         .D_column = in_joints ? -1 : D_,
                         .num_u = joints[j].num_u(),
                         .num_columns = in_joints ? joints[j].num_u() : Space::kDim,
                         .parts = {},
                         .arm = {},
                         .arm_rate = {},
                         .own_rates = {}};
        forest_.push_back(child);
        H_ += joints[j].num_u();
        if (!in_joints) D_ += joints[j].num_constraints();
      }
    }
  }
  for (const int j : mechanism_->constraints()) {
    if (spans[j]) continue;
    loops_.push_back({.joint = j,
                      .imposed = r_,
                      .rows_released = std::vector<int>(joints[j].num_released),
                      .num_u = joints[j].num_u(),
                      .num_imposed = joints[j].num_constraints(),
                      .num_released = joints[j].num_released,
                      .num_drives = joints[j].num_drives,
                      .links = LinksOf(j),
                      .parts = {},
                      .arm = {},
                      .arm_rate = {},
                      .basis = {},
                      .own_rates = {}});
    r_ += joints[j].num_constraints();
    d_ += joints[j].num_released;
  }
  r_ += static_cast<int>(coupled_.size()) + mechanism_->num_moving_rows();
  d_ -= mechanism_->num_moving_rows();
  std::vector<bool> on_loop(edges_.size(), false);
  for (const Loop& loop : loops_) {
    for (const Link& link : loop.links) on_loop[link.child] = true;
  }
  for (auto child = forest_.rbegin(); child != forest_.rend(); ++child) {
    if (on_loop[*child]) inward_.push_back(*child);
  }
}

template <class Space, class S>
void SelfStress<Space, S>::Couple() {
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    CoupledRow& coupled = coupled_[i];
    coupled.coefficients.clear();
    S sum(0);
    for (const auto& [joint, ratio] : mechanism_->couplings()[coupled.coupling].parts) {
      const auto edge = std::ranges::find(edges_, joint, &Edge::joint);
      if (edge == edges_.end() || edge->num_columns == 0) continue;  // prescribed in the tree
      const int column = ColumnOf(*edge, 0);
      coupled.coefficients.push_back({column, ratio * column_scale_[column]});
      sum += coupled.coefficients.back().value * coupled.coefficients.back().value;
    }
    using std::sqrt;
    const int row = FirstCoupledRow() + static_cast<int>(i);
    inverse_scale_[row] = sqrt(sum);
    row_scale_[row] = S(1) / inverse_scale_[row];
    for (Coefficient& coefficient : coupled.coefficients) {
      coefficient.value *= row_scale_[row];
      if (coefficient.column < H_) SetRow(coefficient.column, row, coefficient.value);
    }
  }
}

/// Rotations count as lengths.
template <class Space, class S>
void SelfStress<Space, S>::Arrange(const Kinematics<Space, S>& kinematics) {
  is_arranged_ = true;
  arranged_ = kinematics.released();
  rows_.setZero();  // other columns may belong to a moving row
  std::ranges::fill(imposed_, ZeroOf<Pack>());
  std::ranges::fill(released_, ZeroOf<Pack>());
  int next_moving = FirstMovingRow(), next = r_;
  for (const Released& out : arranged_) {
    Loop& loop = *std::ranges::find(loops_, out.joint, &Loop::joint);
    for (std::size_t q = 0; q < out.directions.size(); ++q) {
      loop.rows_released[q] = out.IsMoving(out.directions[q]) ? next_moving++ : next++;
    }
  }
  const S length = mechanism_->length(), per_length = S(1) / length;
  for (Loop& loop : loops_) {
    loop.parts = kinematics.PartsOf(loop.joint);
    loop.moves = std::ranges::any_of(loop.parts, &DirectionParts::moves);
    for (int k = 0; k < loop.directions(); ++k) {
      const bool turns = loop.parts[loop.num_u + k].turns;
      row_scale_[loop.row(k)] = turns ? length : S(1);
      inverse_scale_[loop.row(k)] = turns ? per_length : S(1);
    }
  }
  for (const int child : forest_) {
    Edge& edge = edges_[child];
    edge.parts = kinematics.PartsOf(edge.joint);
    // a coordinate turns about an axis that is fixed in both of its bodies
    const bool keeps_H = mechanism_->joints()[edge.joint].in_tree() &&
                         mechanism_->joints()[edge.joint].kind->basis_rate != nullptr;
    edge.moves = false;
    for (int i = 0; i < edge.num_columns; ++i) {
      if (keeps_H) edge.parts[i].moves = false;
      edge.moves = edge.moves || edge.parts[i].moves;
      column_scale_[ColumnOf(edge, i)] = edge.parts[i].turns ? per_length : S(1);
    }
  }
  Couple();
  equations_.clear();
  for (const Loop& loop : loops_) {
    for (int k = 0; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      equations_.push_back({row, mechanism_->joints()[loop.joint].row + k, inverse_scale_[row]});
    }
  }
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const int row = FirstCoupledRow() + static_cast<int>(i);
    equations_.push_back({row, mechanism_->num_rows() + coupled_[i].coupling, inverse_scale_[row]});
  }
  for (int i = 0; i < mechanism_->num_moving_rows(); ++i) {
    const int row = FirstMovingRow() + i;
    equations_.push_back({row, FirstMovingEquation() + i, inverse_scale_[row]});
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    if (edge.D_column < 0) continue;
    const Joint<Space, S>& joint = mechanism_->joints()[edge.joint];
    for (int k = 0; k < joint.num_constraints(); ++k) {
      equations_.push_back(
          {r_ + d_ + edge.D_column + k, joint.row + k, column_scale_[H_ + edge.D_column + k]});
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::SetRow(int column, int row, const S& value) {
  rows_(column, row) = value;
  if (row < r_) {
    Set(imposed_[row / kPack * H_ + column], row % kPack, value);
  } else {
    Set(released_[(row - r_) / kPack * H_ + column], (row - r_) % kPack, value);
  }
}

template <class Space, class S>
auto SelfStress<Space, S>::LinksOf(int joint) const -> std::vector<Link> {
  std::vector<Link> links;
  int to_Q = mechanism_->joints()[joint].to, to_P = mechanism_->joints()[joint].from;
  while (to_Q != to_P) {
    const bool on_Q = edges_[to_Q].depth >= edges_[to_P].depth;
    int& body = on_Q ? to_Q : to_P;
    const Edge& edge = edges_[body];
    links.push_back({body, on_Q != (edge.sign > 0)});
    body = edge.parent;
  }
  return links;
}

template <class Space, class S>
void SelfStress<Space, S>::FillArms(const Kinematics<Space, S>& kinematics) {
  const Linear<Space, S> origin = kinematics.JointPoint(loops_.front().joint);
  for (Loop& loop : loops_) {
    // a constant zero, which recorded operations leave out
    loop.arm = &loop == &loops_.front() ? Linear<Space, S>::Zero()
                                        : kinematics.JointPoint(loop.joint) - origin;
    loop.basis = kinematics.joints()[loop.joint].basis;
  }
  for (const int child : inward_) {
    edges_[child].arm = kinematics.JointPoint(edges_[child].joint) - origin;
  }
}

/// D^T S(p - p_j) H_j of all joints j between the two sides of the loop's joint at p.
template <class Space, class S>
void SelfStress<Space, S>::FillRows(const Kinematics<Space, S>& kinematics, Loop& loop) {
  std::array<S*, Space::kDim> in_rows, in_packs;
  std::array<S, Space::kDim> scales;
  for (int k = 0; k < loop.directions(); ++k) {
    const int row = loop.row(k), place = row < r_ ? row : row - r_;
    std::vector<Pack>& packs = row < r_ ? imposed_ : released_;
    in_rows[k] = rows_.data() + static_cast<Eigen::Index>(row) * H_;
    in_packs[k] = reinterpret_cast<S*>(packs.data() + place / kPack * H_) + place % kPack;
    scales[k] = row_scale_[row];
  }
  for (const Link& link : loop.links) {
    const Edge& edge = edges_[link.child];
    const Linear<Space, S> arm = loop.arm - edge.arm;
    for (int i = 0; i < edge.num_u; ++i) {
      const int column = ColumnOf(edge, i);
      const S scale = link.is_reversed ? S(-column_scale_[column]) : column_scale_[column];
      Velocity<Space, S> V = Velocity<Space, S>::Zero();
      Add(edge.parts[i], kinematics.joints()[edge.joint].basis[i], scale, V);
      V = ShiftMotion<Space, S>(V, arm);
      for (int k = 0; k < loop.directions(); ++k) {
        const int d = loop.num_u + k;
        const S number = scales[k] * Dot(loop.parts[d], loop.basis[d], V);
        in_rows[k][column] = in_packs[k][column * kPack] = number;
      }
    }
  }
}

/// Rates of directions, in axes that turn with P of each joint, and of arms.
template <class Space, class S>
void SelfStress<Space, S>::FillRates(const Kinematics<Space, S>& kinematics) {
  // velocity of Mo, as a point of Q
  const auto speed = [&](int joint) {
    const int body = mechanism_->joints()[joint].to;
    return ShiftMotion<Space, S>(kinematics.motions()[body], kinematics.joints()[joint].r_Q).linear;
  };
  for (const int child : inward_) {
    Edge& edge = edges_[child];
    edge.arm_rate = speed(edge.joint);
    if (edge.moves) kinematics.OwnRates(edge.joint, edge.parts, edge.num_columns, edge.own_rates);
  }
  for (Loop& loop : loops_) {
    loop.arm_rate = speed(loop.joint);
    if (loop.moves) kinematics.OwnRates(loop.joint, loop.parts, Space::kDim, loop.own_rates);
  }
}

template <class Space, class S>
S SelfStress<Space, S>::FactorRows() {
  const auto row = [&](int k) { return rows_.data() + static_cast<Eigen::Index>(k) * H_; };
  for (int j = 0; j < r_; ++j) {
    for (int p = j / kPack; p < PacksFor(r_); ++p) {
      const Pack products = Dot(imposed_.data() + p * H_, row(j), H_);
      for (int i = std::max(j, p * kPack); i < std::min(r_, (p + 1) * kPack); ++i) {
        gram_(i, j) = At(products, i % kPack);
      }
    }
  }
  // at a singular configuration T belongs to regularized rows
  const S trace = gram_.trace();
  gram_.diagonal().array() += S(64) * std::numeric_limits<S>::epsilon() * trace;
  const S pivot = FactorInPlace(gram_) / trace;
  for (int p = 0; p < PacksFor(d_); ++p) {
    Pack* T = &W_[p * size()];
    for (int k = 0; k < r_; ++k) T[k] = -Dot(released_.data() + p * H_, row(k), H_);
    SolveBoth(gram_, T);
  }
  return pivot;
}

template <class Space, class S>
bool SelfStress<Space, S>::Factor(Kinematics<Space, S>& kinematics) {
  if (!is_arranged_ || kinematics.released() != arranged_) Arrange(kinematics);
  FillArms(kinematics);
  for (Loop& loop : loops_) FillRows(kinematics, loop);
  const S pivot = r_ > 0 ? FactorRows() : S(1);
  const int rows = size();
  for (int p = 0; p < PacksFor(d_); ++p) {
    Pack* W_p = &W_[p * rows];
    if (D_ > 0) SetForest(kinematics, W_p, loads_of_pack_);
    for (int j = 0; j < std::min(d_, (p + 1) * kPack); ++j) {
      const S* W_j = reinterpret_cast<const S*>(&W_[j / kPack * rows]) + j % kPack;
      Pack products = ZeroOf<Pack>();
      for (int i = 0; i < rows; ++i) products += W_p[i] * W_j[i * kPack];
      for (int i = std::max(j, p * kPack); i < std::min(d_, (p + 1) * kPack); ++i) {
        C_(i, j) = At(products, i % kPack);
      }
    }
  }
  FactorInPlace(C_);
  if (mechanism_->is_redundant()) Turn(kinematics);
  if (d_ == 0) return true;
  // Rows within the accuracy: speeds err by T^2, accelerations by T^3 times the rounding.
  const S most = mechanism_->is_redundant() ? S(10) : S(2);
  return pivot >= S(1e-4) && HasSmallT(most);
}

template <class Space, class S>
bool SelfStress<Space, S>::HasSmallT(const S& most) const {
  using std::abs;
  for (int q = 0; q < d_; ++q) {
    for (int k = 0; k < r_; ++k) {
      if (!(abs(W(k, q)) <= most)) return false;
    }
  }
  return true;
}

template <class Space, class S>
std::vector<Released> SelfStress<Space, S>::Choose(const Kinematics<Space, S>& kinematics) const {
  Eigen::MatrixXd rows(r_ + d_, H_);
  std::vector<Quota> quotas;
  std::vector<int> joints;
  int next = 0;
  for (const Loop& loop : loops_) {
    quotas.push_back({next, loop.directions(), loop.num_drives, loop.num_imposed});
    joints.push_back(loop.joint);
    for (int k = 0; k < loop.directions(); ++k) {
      rows.row(next++) = rows_.col(loop.row(k)).transpose().template cast<double>();
    }
  }
  for (int row = FirstCoupledRow(); row < FirstMovingRow(); ++row) {
    quotas.push_back({next, 1, 1, 1});
    joints.push_back(-1);
    rows.row(next++) = rows_.col(row).transpose().template cast<double>();
  }
  std::vector<Released> released = RowChoice(rows, quotas, r_).BeyondQuotas(joints);
  // rows count imposed directions first
  for (Released& out : released) {
    const int drives = mechanism_->joints()[out.joint].num_drives;
    for (std::vector<int>* directions : {&out.directions, &out.moving}) {
      for (int& direction : *directions) {
        direction = kinematics.DirectionOf(out.joint, drives + direction);
      }
      std::ranges::sort(*directions);
    }
  }
  return released;
}

template <class Space, class S>
template <class Kind>
SpatialVector<Space, S, Kind> SelfStress<Space, S>::TurnWithP(
    const Kinematics<Space, S>& kinematics, int joint,
    const SpatialVector<Space, S, Kind>& V) const {
  const Angular<Space, S>& w = kinematics.motions()[mechanism_->joints()[joint].from].angular;
  return {CrossAngular<S>(w, V.angular), Cross<S>(w, V.linear)};
}

template <class Space, class S>
template <class T>
void SelfStress<Space, S>::SetWrench(const Loop& loop, const T* z, Wrench<Space, T>& F) const {
  SetZero<Space>(F);
  for (int k = 0; k < loop.directions(); ++k) {
    const int row = loop.row(k), i = loop.num_u + k;
    Add(loop.parts[i], loop.basis[i], T(z[row] * row_scale_[row]), F);
  }
}

/// A joint of the forest transmits the wrenches of all loops that pass its outward side. The two
/// wrenches of a loop that does not pass the joint cancel.
template <class Space, class S>
template <class T>
void SelfStress<Space, S>::SetForest(const Kinematics<Space, S>& kinematics, T* z,
                                     std::vector<Wrench<Space, T>>& loads) const {
  T* forest = z + r_ + d_;
  std::fill_n(forest, D_, ZeroOf<T>());
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const T force = z[FirstCoupledRow() + static_cast<int>(i)];
    for (const Coefficient& one : coupled_[i].coefficients) {
      if (one.column >= H_) forest[one.column - H_] -= one.value * force;
    }
  }
  for (Wrench<Space, T>& load : loads) SetZero<Space>(load);
  for (const Loop& loop : loops_) {
    Wrench<Space, T> F;
    SetWrench(loop, z, F);
    AddMoment(loop.arm, F.linear, F.angular);
    loads[mechanism_->joints()[loop.joint].to] += F;
    loads[mechanism_->joints()[loop.joint].from] -= F;
  }
  for (const int child : inward_) {
    const Edge& edge = edges_[child];
    Wrench<Space, T> F = loads[child];
    loads[edge.parent] += F;
    AddMoment(-edge.arm, F.linear, F.angular);
    const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
    for (int i = edge.num_u; i < edge.num_columns; ++i) {
      const S scale = column_scale_[ColumnOf(edge, i)];
      forest[edge.D_column + i - edge.num_u] -=
          Dot(edge.parts[i], basis[i], F) * (edge.sign > 0 ? scale : S(-scale));
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::ColumnsOfRates(const Kinematics<Space, S>& kinematics) {
  for (std::size_t body = 0; body < loads_.size(); ++body) {
    loads_[body].setZero();
    load_rates_[body].setZero();
  }
  for (const Loop& loop : loops_) {
    Wrench<Space, S> F, F_rate = Wrench<Space, S>::Zero();
    SetWrench(loop, z_.data(), F);
    for (int k = 0; k < loop.directions(); ++k) {
      const int i = loop.num_u + k;
      if (!loop.parts[i].moves) continue;
      Add(loop.parts[i], loop.own_rates[i], S(row_scale_[loop.row(k)] * z_[loop.row(k)]), F_rate);
    }
    F_rate += TurnWithP(kinematics, loop.joint, F);
    AddMoment(loop.arm, F.linear, F.angular);
    AddMoment(loop.arm, F_rate.linear, F_rate.angular);
    AddMoment(loop.arm_rate, F.linear, F_rate.angular);
    const Joint<Space, S>& joint = mechanism_->joints()[loop.joint];
    loads_[joint.to] += F;
    loads_[joint.from] -= F;
    load_rates_[joint.to] += F_rate;
    load_rates_[joint.from] -= F_rate;
  }
  for (const int child : inward_) {
    const Edge& edge = edges_[child];
    Wrench<Space, S> F = loads_[child], F_rate = load_rates_[child];
    loads_[edge.parent] += F;
    load_rates_[edge.parent] += F_rate;
    const Linear<Space, S> back = -edge.arm;
    AddMoment(back, F.linear, F.angular);
    AddMoment(back, F_rate.linear, F_rate.angular);
    AddMoment(Linear<Space, S>(-edge.arm_rate), F.linear, F_rate.angular);
    F_rate -= TurnWithP(kinematics, edge.joint, F);
    const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
    for (int i = 0; i < edge.num_columns; ++i) {
      const int column = ColumnOf(edge, i);
      S part = Dot(edge.parts[i], basis[i], F_rate);
      if (edge.parts[i].moves) part += Dot(edge.parts[i], edge.own_rates[i], F);
      part *= column_scale_[column];
      y_[column] = edge.sign > 0 ? part : S(-part);
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::MeasureSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S>& V = kinematics.joints()[loop.joint].V_rel;
    for (int k = 0; k < loop.directions(); ++k) {
      const int row = loop.row(k), i = loop.num_u + k;
      z_[row] = row_scale_[row] * Dot(loop.parts[i], loop.basis[i], V);
    }
    if (loop.num_drives == 0) continue;
    const Components<Space, S> speed = kinematics.ConstraintSpeed(loop.joint);
    for (int k = 0; k < loop.num_drives; ++k) z_[loop.row(k)] = row_scale_[loop.row(k)] * speed[k];
  }
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const int row = FirstCoupledRow() + static_cast<int>(i);
    z_[row] = row_scale_[row] * kinematics.CouplingSpeed(coupled_[i].coupling);
  }
  if (D_ == 0) return;
  std::fill_n(z_.data() + r_ + d_, D_, S(0));  // joints on no loop have no part
  const S length = mechanism_->length();
  for (const int child : inward_) {
    const Edge& edge = edges_[child];
    const JointState<Space, S>& state = kinematics.joints()[edge.joint];
    S* z = z_.data() + r_ + d_ + edge.D_column;
    for (int k = 0; k < state.rows(); ++k) {
      const DirectionParts& parts = edge.parts[edge.num_u + k];
      const S speed = Dot(parts, state.D(k), state.V_rel);
      z[k] = parts.turns ? S(speed * length) : speed;
    }
    const int drives = mechanism_->joints()[edge.joint].num_drives;
    if (drives == 0) continue;
    const Components<Space, S> speed = kinematics.ConstraintSpeed(edge.joint);
    for (int k = 0; k < drives; ++k) {
      z[k] = speed[k] * (edge.parts[edge.num_u + k].turns ? length : S(1));
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::ProjectOnStress(int count) {
  // local copies: writing numbers could change members
  const int rows = size(), packs = PacksFor(d_), columns = d_;
  const Pack* W = W_.data();
  Pack* along = along_.data();
  S* z = z_.data();
  for (int p = 0; p < packs; ++p) along[p] = Dot(W + p * rows, z, count);
  SolveBoth(C_, reinterpret_cast<S*>(along));
  const auto number = [=](int i, int p, int last) [[gnu::always_inline]] {
    const Pack products = W[p * rows + i] * along[p];
    S sum = At(products, 0);
    for (int q = 1; q < last; ++q) sum += At(products, q);
    return sum;
  };
  if (packs == 0) std::fill_n(z, rows, S(0));
  for (int p = 0; p < packs; ++p) {
    const int last = std::min(kPack, columns - p * kPack);
    if (p == 0) {
      for (int i = 0; i < rows; ++i) z[i] = number(i, 0, last);
    } else {
      for (int i = 0; i < rows; ++i) z[i] += number(i, p, last);
    }
  }
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Feedback(const Kinematics<Space, S>& kinematics) {
  FillRates(kinematics);
  MeasureSpeeds(kinematics);
  ProjectOnStress(size());
  // z = W' W'^T e + W (..): J^T z = J'^T W W^T e'; released rows have no part of z
  ColumnsOfRates(kinematics);
  for (int p = 0; p < PacksFor(r_); ++p) {
    const Pack products = Dot(imposed_.data() + p * H_, y_.data(), H_);
    for (int k = p * kPack; k < std::min(r_, (p + 1) * kPack); ++k) z_[k] = At(products, k % kPack);
  }
  std::fill_n(z_.data() + r_, d_, S(0));
  SolveBoth(gram_, z_.data());
  if (D_ > 0) {
    SetForest(kinematics, z_.data(), loads_);
    for (int i = 0; i < D_; ++i) z_[r_ + d_ + i] += y_[H_ + i];
  }
  ToRows(feedback_);
  return feedback_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S>& V = kinematics.joints()[loop.joint].V_rel;
    for (int q = 0; q < loop.num_released; ++q) {
      const int row = loop.rows_released[q];
      if (row < r_) continue;
      z_[row] = row_scale_[row] * loop.basis[loop.num_u + loop.num_imposed + q].dot(V);
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfAccelerations(
    const Kinematics<Space, S>& kinematics, std::span<const Acceleration<Space, S>> A) {
  for (const Loop& loop : loops_) {
    if (loop.num_released == 0) continue;
    const Components<Space, S> left = JointAcceleration<Space, S>(kinematics, loop.joint, A);
    for (int q = 0; q < loop.num_released; ++q) {
      const int row = loop.rows_released[q];
      if (row < r_) continue;
      z_[row] = row_scale_[row] * left[loop.num_imposed + q];
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Share() {
  // of W^T rho, rho = [-T_b; 1] missed
  std::fill_n(z_.data(), r_, S(0));
  for (const Loop& loop : loops_) {
    for (int k = loop.num_drives; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      for (const int q : loop.rows_released) {
        if (q >= r_) z_[row] += W(row, q - r_) * z_[q];
      }
    }
  }
  ProjectOnStress(r_ + d_);
  ToRows(share_);
  return share_;
}

template <class Space, class S>
void SelfStress<Space, S>::ToRows(VectorX<S>& rows) {
  for (const Loop& loop : loops_) {
    for (int k = loop.num_drives; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      for (const int q : loop.rows_released) {
        if (q >= r_) z_[row] -= W(row, q - r_) * z_[q];
      }
    }
  }
  const S* z = z_.data();
  S* numbers = rows.data();
  for (const Equation& one : equations_) numbers[one.equation] = z[one.row] * one.scale;
}

template <class Space, class S>
SelfStress<Space, S>::~SelfStress() = default;

#define LOOPBENCH_INSTANTIATE(Space, S) template class SelfStress<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
