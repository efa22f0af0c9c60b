// Self-stresses of redundant constraints, and loop equations of structural rank.
//
// Only r of the m rows of J are independent at any admissible position: r is structural
// (redundancy.h). W (m x d, d = m - r, orthonormal) spans the self-stresses, J^T W = 0, and U their
// complement, the range of J. The drift e of the constraints lies in that range to first order: e =
// U eta, in a basis U transported with the motion without rotation. Then
//
//   U^T (e'' + W' W'^T e) = eta'',      W' the rate of W with W^T W' = 0,
//
// so the accelerations of level `acceleration` satisfy
//
//   U^T (J udot - gamma + W' W'^T e) = 0                                                     (1)
//
// and eta grows as t^2. Without the term it grows exponentially where W keeps turning. Speeds of
// level `velocity` satisfy U^T (J u + b) = 0, so that eta' = 0.
//
// Solvers impose r rows, and d rows Q of the joints that close loops are released. With R the other
// rows of these joints, J_H their columns H of a spanning forest and T = J_HQ J_HR^+ transposed,
//
//   W ~ [-J_D^T W_c; W_c],      W_c = [-T; 1],      U ~ [1; T^T] if nothing but W_c is there.
//
// D are the directions constrained by joints of the forest; joint coordinates have none. Each joint
// imposes its part of U: direction k becomes D_k + sum_q T_kq D_q over its released directions q.
// A moving row (mechanism.h) is one more row of U, imposed as it is. So is a coupling on which
// released constraints depend: its row contains a constant for each of its joints.
// For one loop in joint coordinates this is complete, and solvers solve (1). Otherwise a solution
// x0 violates c by rho = J x0 - c in the range of [-T_b; 1], T_b the blocks of T that belong to one
// joint, and rho must lie along W. The solution is x0 + y with U_b^T J y = U_b^T W W^T rho.
// Multipliers then have a part along W, whose force J^T W W^T lambda, of first order in e, stays.
//
// Rates of W follow from W^T e = 0, W'^T e = -W^T e', and from J^T W = 0, W' x = -(J^+)^T J'^T W x.
// Multiplication by the transpose of J' is a sum along the loops, not a matrix.
//
// All this holds to first order in e, for rows that are derivatives of e to that order
// (JointKind::exact_basis). Rotations are multiplied by the mechanism's length, so that all rows
// are lengths in a constant scale.
#pragma once

#include <type_traits>
#include <vector>

#include "mechanism/algebra/lanes.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class SelfStress {
 public:
  /// `mechanism` releases directions, and must outlive this.
  explicit SelfStress(const Mechanism<Space, S>& mechanism);
  ~SelfStress();  ///< in the library, whose instruction set aligns packs

  /// J, T and W at the positions of `kinematics`, and its imposed directions turned as above,
  /// unless the released ones are constraints within the accuracy of the input only. No other call
  /// may come first. No allocation. False if other released directions serve better here: imposed
  /// rows are nearly dependent, or elements of T exceed ten, which costs a digit. For directions
  /// released within the accuracy the limit is two, because elements of T multiply the rounding.
  bool Factor(Kinematics<Space, S>& kinematics);
  /// The released directions that serve best here, as many of each joint as the mechanism releases.
  /// Allocates.
  std::vector<Released> Choose(const Kinematics<Space, S>& kinematics) const;
  /// Turns imposed directions of other kinematics at the same positions.
  template <class Any>
  void Turn(Kinematics<Space, Any>& kinematics) const {
    for (const Loop& loop : loops_) {
      for (int k = loop.num_drives; k < loop.num_imposed; ++k) {
        Basis<Space, Any>& basis = kinematics.basis(loop.joint);
        for (int q = 0; q < loop.num_released; ++q) {
          const int row = loop.rows_released[q];
          if (row < r_) continue;
          const S share =
              W(loop.imposed + k, row - r_) * row_scale_[row] * inverse_scale_[loop.imposed + k];
          basis[loop.num_u + k] -= basis[loop.num_u + loop.num_imposed + q] * Any(share);
        }
      }
    }
  }

  /// W' W'^T e for the imposed rows; speeds must be current.
  const VectorX<S>& Feedback(const Kinematics<Space, S>& kinematics);
  /// Returns true if solvers of the imposed rows solve (1). Otherwise use the following functions.
  bool is_exact() const { return is_exact_; }
  /// U_b^T W W^T rho of speeds, rho = J u + b, for the imposed rows.
  const VectorX<S>& ShareOfSpeeds(const Kinematics<Space, S>& kinematics);
  /// U_b^T W W^T rho with rho = J udot - gamma + W' W'^T e, for accelerations A of the centres of
  /// mass. Feedback() must have been called.
  const VectorX<S>& ShareOfAccelerations(const Kinematics<Space, S>& kinematics,
                                         std::span<const Acceleration<Space, S>> A);

 private:
  using Parts = std::array<DirectionParts, Space::kDim>;
  /// Numbers of several columns of W or of several rows, for operations on all at once.
  using Pack = std::conditional_t<std::is_same_v<S, double>, Lanes, S>;
  static constexpr int kPack = std::is_same_v<S, double> ? kLanes : 1;
  static int PacksFor(int count) { return (count + kPack - 1) / kPack; }
  static const S& At(const Pack& pack, int i) {
    return reinterpret_cast<const S*>(&pack)[i];  // vectors may alias their elements
  }
  static void Set(Pack& pack, int i, const S& value) { reinterpret_cast<S*>(&pack)[i] = value; }

  /// A joint of the spanning forest, at its child: parent and child are bodies.
  struct Edge {
    int joint = -1, parent = kGround, sign = 1, depth = 0;
    int column = 0, D_column = -1;  ///< first columns of J_H and J_D; -1 in joint coordinates
    int num_u = 0, num_columns = 0;
    Parts parts;
    bool moves = false;              ///< whether some of its columns do
    Linear<Space, S> arm, arm_rate;  ///< from the origin of wrenches to Mo
    Basis<Space, S> own_rates;       ///< OwnRates() of its directions
  };
  /// A joint of the forest on the loop between the two sides of a closing joint.
  struct Link {
    int child = 0;
    bool is_reversed = false;
  };
  /// A joint that closes a loop. Order of rows: imposed rows of loops, couplings, moving rows,
  /// released rows.
  struct Loop {
    int joint = 0, imposed = 0;      ///< first row
    std::vector<int> rows_released;  ///< of its released directions: moving or not imposed
    int num_u = 0, num_imposed = 0, num_released = 0, num_drives = 0;
    std::vector<Link> links;
    Parts parts;
    bool moves = false;
    Linear<Space, S> arm, arm_rate;    ///< as of an edge
    Basis<Space, S> basis, own_rates;  ///< as UpdatePosition() has it

    int row(int direction) const {
      return direction < num_imposed ? imposed + direction : rows_released[direction - num_imposed];
    }
    int directions() const { return num_imposed + num_released; }
  };
  /// Scaled coefficient of a coupling for one joint of the forest.
  struct Coefficient {
    int column = 0;  ///< of J
    S value = S(0);
  };
  /// A coupling among the rows, which come after imposed ones of loops.
  struct CoupledRow {
    int coupling = 0;
    std::vector<Coefficient> coefficients;
  };
  /// A row of J among the equations of the mechanism, and the factor of its numbers there.
  struct Equation {
    int row = 0, equation = 0;
    S scale = S(1);
  };
  S W(int row, int column) const { return At(W_[column / kPack * size() + row], column % kPack); }
  int size() const { return r_ + d_ + D_; }
  int FirstMovingEquation() const {
    return mechanism_->num_rows() + mechanism_->num_coordinate_couplings();
  }
  int FirstMovingRow() const { return r_ - mechanism_->num_moving_rows(); }
  int FirstCoupledRow() const { return FirstMovingRow() - static_cast<int>(coupled_.size()); }
  void Span();
  /// Coefficients and scales of couplings.
  void Couple();
  /// Sets rows, parts and scales for the released directions of `kinematics`.
  void Arrange(const Kinematics<Space, S>& kinematics);
  std::vector<Link> LinksOf(int joint) const;
  /// Column of J for column i of a joint's [H D].
  int ColumnOf(const Edge& edge, int i) const {
    return i < edge.num_u ? edge.column + i : H_ + edge.D_column + i - edge.num_u;
  }
  /// Arms of all joints on loops.
  void FillArms(const Kinematics<Space, S>& kinematics);
  void FillRows(const Kinematics<Space, S>& kinematics, Loop& loop);
  void SetRow(int column, int row, const S& value);
  void FillRates(const Kinematics<Space, S>& kinematics);
  /// gram_ and T in W_; the least pivot over the trace.
  S FactorRows();
  /// Returns true if no element of T exceeds `most`.
  bool HasSmallT(const S& most) const;
  /// Rates of directions that are fixed in P, times numbers with the sum V.
  template <class Kind>
  SpatialVector<Space, S, Kind> TurnWithP(const Kinematics<Space, S>& kinematics, int joint,
                                          const SpatialVector<Space, S, Kind>& V) const;
  /// Sets the wrench of a loop's joint that its rows of z make, at Mo.
  template <class T>
  void SetWrench(const Loop& loop, const T* z, Wrench<Space, T>& F) const;
  /// z = -J_D^T z in the rows of the forest, from its rows of loops; T: of one vector or of a pack.
  template <class T>
  void SetForest(const Kinematics<Space, S>& kinematics, T* z,
                 std::vector<Wrench<Space, T>>& loads) const;
  /// y = J'^T z.
  void ColumnsOfRates(const Kinematics<Space, S>& kinematics);
  /// z = e'.
  void MeasureSpeeds(const Kinematics<Space, S>& kinematics);
  /// z = W a with a = (W^T W)^-1 W^T z, from the first `count` numbers of z; the others are zero.
  void ProjectOnStress(int count);
  /// Returns U_b^T W W^T rho, in the rows of the mechanism, for the violation of released rows,
  /// which they have in z.
  const VectorX<S>& Share();
  /// U_b^T z by the mechanism's rows, out of scale. Changes z.
  void ToRows(VectorX<S>& rows);

  const Mechanism<Space, S>* mechanism_;
  std::vector<Edge> edges_;  ///< by child body
  std::vector<int> forest_;  ///< children of the forest's joints
  std::vector<int> inward_;  ///< those on loops, children before parents
  std::vector<Loop> loops_;
  std::vector<CoupledRow> coupled_;
  std::vector<Equation> equations_;  ///< of all rows but released ones
  bool is_exact_ = false, is_arranged_ = false;
  std::vector<Released> arranged_;
  int r_ = 0, d_ = 0;  ///< imposed rows (with couplings and moving rows), released rows
  int H_ = 0, D_ = 0;  ///< columns of J_H and J_D
  MatrixX<S> rows_;    ///< J_H transposed; rows and columns in scale
  /// Imposed rows of J_H, and released ones: number h of several rows, pack after pack.
  std::vector<Pack> imposed_, released_;
  /// Factors of rows and their inverses, and of columns: 1 / length.
  VectorX<S> row_scale_, inverse_scale_, column_scale_;
  MatrixX<S> gram_, C_;  ///< Cholesky factors, C = W^T W
  /// Numbers by rows of J: r_ imposed rows, d_ released rows, rows of the forest. W has -T, 1 and
  /// -J_D^T W_c there, for several columns in a pack.
  std::vector<Pack> W_;
  VectorX<S> z_;
  VectorX<S> y_;             ///< numbers by columns of J
  std::vector<Pack> along_;  ///< numbers by columns of W
  VectorX<S> feedback_, share_;
  /// Wrenches by body that its joint of the forest transmits, at the origin: Mo of the first loop.
  std::vector<Wrench<Space, Pack>> loads_of_pack_;
  std::vector<Wrench<Space, S>> loads_, load_rates_;
};

}  // namespace loopbench
