// Reactions of a mechanism's joints, for the rows of a trajectory.
#pragma once

#include <Eigen/Sparse>
#include <Eigen/SparseQR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "harness/observers/trajectory.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::harness {

/// Joint reactions: forces and moments that hold the user's bodies together.
///
/// Each body needs the wrench w = M A + c - f_applied, which follows from all body accelerations.
/// The joints must supply it. The wrench of a joint is D lambda on its second body, at its point
/// Mo, and the opposite on the first:
///
///   sum over joints of S(r) D lambda = w        body by body                                (*)
///
/// This needs no multipliers of a formulation. O-DCA, the Lagrange equations and reduction solve
/// the same equations in fewer unknowns, and agree to the accuracy of their accelerations. It holds
/// for all joints of the user: also between merged bodies, and out of the plane of a problem
/// simplified to planar.
///
/// Couplings add a column each, their efforts over the coefficients; they are not part of a joint's
/// reaction. All joints are then one part. Bodies with one joint left are solved in turn from the
/// leaves inwards. The remaining loops are solved part by part: by sparse QR for many unknowns, by
/// dense QR with pivoting for few or dependent ones. Rigid bodies do not determine how redundant
/// constraints share a load. A reaction component is known if no solution of (*) with w = 0 changes
/// it, else NaN. Positions with a relative violation e leave directions free in which (*) holds to
/// less than 10 e.
template <class Space>
class Reactions {
 public:
  /// `of` must outlive it.
  explicit Reactions(const UserMechanism<Space>& of)
      : user_(of),
        w_(of.mechanism().num_bodies()),
        total_(of.mechanism().joints().size()),
        open_(total_.size()),
        left_(w_.size()),
        first_(total_.size()),
        joints_of_(w_.size()) {
    const auto& joints = user_.mechanism().joints();
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      if (joints[j].in_tree() || joints[j].num_directions() == 0) continue;
      bearing_.push_back(j);
      for (const int body : {joints[j].from, joints[j].to}) {
        if (body != kGround) joints_of_[body].push_back(j);
      }
    }
  }

  /// Solves at the present state of the mechanism. `A`: accelerations of the centres of mass by
  /// body; `applied`: all other forces there.
  void Solve(std::span<const Acceleration<Space, double>> A,
             std::span<const Wrench<Space, double>> applied) {
    w_[kGround].setZero();
    for (int b = 1; b < static_cast<int>(w_.size()); ++b) {
      w_[b] = InertialForce<Space, double>(user_.kinematics(), b, A[b]) - applied[b];
      left_[b] = static_cast<int>(joints_of_[b].size());
    }
    AddRotorWrenches<Space, double>(user_.kinematics(), A, w_);
    for (auto& changes : open_) changes.clear();
    is_done_.assign(total_.size(), false);
    const bool is_coupled = !user_.mechanism().couplings().empty();
    if (!is_coupled) Leaves();
    const double limit = std::max(
        100 * std::numeric_limits<double>::epsilon() * static_cast<double>(bearing_.size()),
        kOfMismatch * user_.RelativeMismatch());
    // geometric mean of round-off (a multiple of the limit) and a share of the load
    negligible_ = std::sqrt(limit);
    if (is_coupled) return SolvePart(bearing_, limit);
    for (const int j : bearing_) {
      if (!is_done_[j]) SolvePart(PartOf(j), limit);
    }
  }

  /// Returns the wrench on the joint's second body at the joint's point: [moment; force] along the
  /// columns of `axes`, in ground axes. Excludes drives; NaN if not unique.
  Wrench<Space, double> Of(int joint, const Rotation<Space, double>& axes) const {
    const JointState<Space, double>& state = State(joint);
    const auto& given = At(joint);
    Wrench<Space, double> reaction = total_[joint];
    std::vector<Wrench<Space, double>> changes = open_[joint];
    for (int i = 0; i < given.num_drives; ++i) {
      const Direction<Space, double>& D = state.D(i);
      const auto without = [&](Wrench<Space, double>& wrench) {
        const double effort = wrench.dot(Velocity<Space, double>(D * 1.0));
        wrench -= WrenchOfEffort<Space, double>(D, 1 / D.squaredNorm(), effort);
      };
      without(reaction);
      std::ranges::for_each(changes, without);
    }
    const Rotation<Space, double> to_axes = axes.transpose();
    reaction = Rotate<Space, double>(to_axes, reaction);
    for (const Wrench<Space, double>& change : changes) {
      const Wrench<Space, double> turned = Rotate<Space, double>(to_axes, change);
      for (int i = 0; i < Space::kDim; ++i) {
        const double unit = i < Space::kRot ? length() : 1.0;
        if (std::abs(turned[i]) > negligible_ * unit) reaction[i] = kNaN;
      }
    }
    return reaction;
  }

  /// Returns the effort of a prescribed motion along its coordinate [N m or N]; NaN if not unique.
  double DriveOf(int joint, int coordinate) const {
    const Velocity<Space, double> along = user_.DirectionOfSpeed(joint, coordinate) * 1.0;
    return IsKnown(joint, along) ? total_[joint].dot(along) : kNaN;
  }

  /// Returns the effort of a coupling along the coordinate of one of its joints, as above.
  double CouplingOf(int coupling, int part) const {
    const auto& parts = user_.mechanism().couplings()[coupling].parts;
    return parts[part].ratio * mu_[coupling];
  }

 private:
  /// Number of unknowns up to which dense QR is faster, and up to which its cost is acceptable.
  static constexpr Eigen::Index kFew = 60, kMost = 900;
  /// Singular directions are free if below this multiple of a relative violation e of the
  /// positions.
  static constexpr double kOfMismatch = 10.0;
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  /// Solutions of G x = w: a particular one, and columns that span the homogeneous ones.
  struct Solution {
    Eigen::VectorXd x;
    Eigen::MatrixXd open;  ///< empty if x is unique
    bool is_known = true;  ///< false: no component is known
  };

  /// Solves by Q R P^T = G with column pivoting; pivots below `limit` of the first are free.
  static Solution SolveDense(const Eigen::MatrixXd& G, const Eigen::VectorXd& w, double limit) {
    Eigen::ColPivHouseholderQR<MatrixX<double>> qr(G);
    const auto& R = qr.matrixR();
    const Eigen::Index n = G.cols();
    Eigen::Index rank = 0;
    while (rank < std::min(G.rows(), n) && std::abs(R(rank, rank)) > limit * std::abs(R(0, 0))) {
      ++rank;
    }
    const MatrixX<double> R11 = R.topLeftCorner(rank, rank);
    VectorX<double> y = w;
    y.applyOnTheLeft(qr.householderQ().setLength(qr.nonzeroPivots()).adjoint());
    Solution solution;
    VectorX<double> x = VectorX<double>::Zero(n);
    x.head(rank) = R11.triangularView<Eigen::Upper>().solve(y.head(rank));
    solution.x = qr.colsPermutation() * x;
    if (rank == n) return solution;
    MatrixX<double> open = MatrixX<double>::Identity(n, n).rightCols(n - rank);
    open.topRows(rank) = -R11.triangularView<Eigen::Upper>().solve(
        MatrixX<double>(R.topRightCorner(rank, n - rank)));
    solution.open = qr.colsPermutation() * open;
    return solution;
  }

  const JointState<Space, double>& State(int j) const { return user_.kinematics().joints()[j]; }
  const Joint<Space, double>& At(int j) const { return user_.mechanism().joints()[j]; }

  /// Subtracts the joint's wrench from the wrenches that its bodies still need.
  void Give(int j) {
    w_[At(j).to] -= ShiftForce<Space, double>(total_[j], State(j).r_Q);
    w_[At(j).from] += ShiftForce<Space, double>(total_[j], State(j).r_P);
    for (const int body : {At(j).from, At(j).to}) --left_[body];
    is_done_[j] = true;
  }

  /// Solves bodies with one joint left, repeatedly.
  void Leaves() {
    std::vector<int> queue;
    for (int b = 1; b < static_cast<int>(left_.size()); ++b) {
      if (left_[b] == 1) queue.push_back(b);
    }
    while (!queue.empty()) {
      const int body = queue.back();
      queue.pop_back();
      if (left_[body] != 1) continue;
      const int j = *std::ranges::find_if(joints_of_[body], [&](int k) { return !is_done_[k]; });
      const bool is_second = At(j).to == body;
      const Wrench<Space, double> needed = ShiftForce<Space, double>(
          is_second ? w_[body] : -w_[body], is_second ? -State(j).r_Q : -State(j).r_P);
      total_[j].setZero();
      for (int i = 0; i < State(j).directions(); ++i) {
        const auto& D = State(j).D(i);
        total_[j] += D * (D.dot(needed) / D.squaredNorm());
      }
      Give(j);
      const int other = is_second ? At(j).from : At(j).to;
      if (other != kGround && left_[other] == 1) queue.push_back(other);
    }
  }

  /// Returns the unsolved joints connected to `start` without passing Ground.
  std::vector<int> PartOf(int start) {
    std::vector<int> part = {start};
    is_done_[start] = true;
    for (std::size_t i = 0; i < part.size(); ++i) {
      for (const int body : {At(part[i]).from, At(part[i]).to}) {
        if (body == kGround) continue;
        for (const int j : joints_of_[body]) {
          if (is_done_[j]) continue;
          is_done_[j] = true;
          part.push_back(j);
        }
      }
    }
    return part;
  }

  /// Returns the norm of a direction in (*), with moments over the mechanism's length.
  double SizeOf(const Direction<Space, double>& D) const {
    return std::sqrt(D.angular.squaredNorm() / (length() * length()) + D.linear.squaredNorm());
  }
  double length() const { return user_.mechanism().length(); }
  double SizeOfForce(const Coupling<double>& coupling) const {
    double most = 0.0;
    for (const auto& [j, ratio] : coupling.parts) {
      const double size = SizeOf(user_.DirectionOfSpeed(j, 0));
      most = std::max(most, std::abs(ratio) * At(j).kind->inverse_H_squared * size);
    }
    return most;
  }

  void SolvePart(const std::vector<int>& part, double limit) {
    std::vector<int> place(w_.size(), -1);
    Eigen::Index rows = 0, columns = 0;
    std::vector<Eigen::Triplet<double>> entries;
    // F on the second body of a joint, and the opposite on the first
    const auto enter = [&](int j, const auto& F, double scale) {
      for (const bool is_second : {true, false}) {
        const int body = is_second ? At(j).to : At(j).from;
        if (body == kGround) continue;
        if (place[body] < 0) {
          place[body] = static_cast<int>(rows);
          rows += Space::kDim;
        }
        const auto at_centre =
            ShiftForce<Space, double>(F, is_second ? State(j).r_Q : State(j).r_P);
        for (int i = 0; i < Space::kDim; ++i) {
          const double unit = i < Space::kRot ? 1 / length() : 1.0;
          entries.emplace_back(place[body] + i, columns,
                               (is_second ? scale : -scale) * unit * at_centre[i]);
        }
      }
    };
    for (const int j : part) {
      first_[j] = columns;
      for (int i = 0; i < State(j).directions(); ++i, ++columns) {
        enter(j, State(j).D(i), 1 / SizeOf(State(j).D(i)));
      }
    }
    const Eigen::Index first_coupling = columns;
    for (const Coupling<double>& coupling : user_.mechanism().couplings()) {
      const double most = SizeOfForce(coupling);
      for (const auto& [j, ratio] : coupling.parts) {
        const Wrench<Space, double> F = WrenchOfEffort<Space, double>(
            user_.DirectionOfSpeed(j, 0), At(j).kind->inverse_H_squared, 1.0);
        enter(j, F, ratio / most);
      }
      ++columns;
    }
    Eigen::VectorXd needed(rows);
    for (std::size_t b = 1; b < place.size(); ++b) {
      for (int i = 0; place[b] >= 0 && i < Space::kDim; ++i) {
        needed[place[b] + i] = w_[b][i] / (i < Space::kRot ? length() : 1.0);
      }
    }
    const Solution solution = Solved(entries, needed, columns, limit);
    Enter(part, solution);
    mu_.clear();
    for (const Coupling<double>& coupling : user_.mechanism().couplings()) {
      const Eigen::Index column = first_coupling + std::ssize(mu_);
      const auto changes = [&](double change) { return std::abs(change) > negligible_; };
      const bool is_known =
          solution.is_known &&
          (solution.open.cols() == 0 || std::ranges::none_of(solution.open.row(column), changes));
      mu_.push_back(is_known ? solution.x[column] / SizeOfForce(coupling) : kNaN);
    }
  }

  static Solution Solved(const std::vector<Eigen::Triplet<double>>& entries,
                         const Eigen::VectorXd& needed, Eigen::Index columns, double limit) {
    Eigen::SparseMatrix<double> G(needed.size(), columns);
    G.setFromTriplets(entries.begin(), entries.end());
    if (columns > kFew) {
      G.makeCompressed();
      Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> qr;
      qr.setPivotThreshold(limit);  // columns have a norm near one
      qr.compute(G);
      if (qr.info() == Eigen::Success && qr.rank() == columns) return {qr.solve(needed), {}, true};
    }
    if (columns > kMost) return {{}, {}, false};
    return SolveDense(G.toDense(), needed, limit);
  }

  void Enter(const std::vector<int>& part, const Solution& solution) {
    for (const int j : part) {
      total_[j].setZero();
      const int count = State(j).directions();
      open_[j].assign(static_cast<std::size_t>(solution.open.cols()),
                      Wrench<Space, double>::Zero());
      for (int i = 0; !solution.is_known && i < Space::kDim; ++i) total_[j][i] = kNaN;
      for (int i = 0; solution.is_known && i < count; ++i) {
        const Wrench<Space, double> D = State(j).D(i) * (1 / SizeOf(State(j).D(i)));
        total_[j] += D * solution.x[first_[j] + i];
        for (std::size_t k = 0; k < open_[j].size(); ++k) {
          open_[j][k] += D * solution.open(first_[j] + i, static_cast<Eigen::Index>(k));
        }
      }
    }
  }

  /// Returns true if no homogeneous solution changes the power of the joint's wrench for a motion.
  bool IsKnown(int j, const Velocity<Space, double>& along) const {
    const double size = along.angular.norm() * length() + along.linear.norm();
    return std::ranges::all_of(open_[j], [&](const Wrench<Space, double>& change) {
      return std::abs(change.dot(along)) <= negligible_ * size;
    });
  }

  const UserMechanism<Space>& user_;
  std::vector<Wrench<Space, double>> w_;      ///< wrenches that bodies still need
  std::vector<Wrench<Space, double>> total_;  ///< wrenches on second bodies, including drives
  std::vector<std::vector<Wrench<Space, double>>> open_;  ///< homogeneous solutions
  std::vector<double> mu_;           ///< by coupling: its efforts over their coefficients
  std::vector<int> left_;            ///< number of unsolved joints of a body
  std::vector<Eigen::Index> first_;  ///< column of a joint's first direction
  std::vector<std::vector<int>> joints_of_;
  std::vector<int> bearing_;  ///< the user's joints with constrained directions
  std::vector<bool> is_done_;
  double negligible_ = 0.0;
};

}  // namespace loopbench::harness
