// Coordinate reduction for loops of few speeds each: equations (1) to (3) of dense_reduction.h with
//
//   J_D    in sparse factors (sparse_lu.h), which also choose the dependent speeds: they are the
//          pivots of J^T,
//   B^T M B = sum over bodies of V^T M_i V,    V the motions that the columns of B give the body,
//
// so that neither the mass matrix of the forest nor J is ever filled. A right-hand side costs
// O(n (1 + f)^2) for f independent speeds and loops of bounded length; the reduced matrix stays
// dense, f x f, as it is for every reduction.
//
// All constraints must be independent. The pivots of the geometric response decide this
// (mechanism/loops/joint_response.h): they prove it or leave it uncertain.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mechanism/algebra/dense_memory.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/loops/joint_response.h"
#include "mechanism/loops/loop_speeds.h"
#include "mechanism/loops/tree_dynamics.h"
#include "reduction/sparse_lu.h"

namespace loopbench::reduction {

/// Entries of J beyond which it is not sparse: numbers and places take 2.4 GB.
inline constexpr double kMaxEntries = 2e8;

/// Returns the number of speeds that move the two sides of a cut joint relative to each other.
template <class Space>
int LengthOfLoop(const Kinematics<Space, double>& anywhere, int index) {
  int length = 0;
  ForEachSpeedOfLoop(anywhere, index, [&](int, const Velocity<Space, double>&) { ++length; });
  return length;
}

inline double EntriesOf(const auto& mechanism, const auto& anywhere) {
  double entries = 0.0;
  for (const int index : mechanism.constraints()) {
    entries += static_cast<double>(LengthOfLoop(anywhere, index)) *
               mechanism.joints()[index].num_constraints();
  }
  return entries;
}

/// Returns the pattern of J^T: a column for each row of J.
template <class Space>
SparseLu WithPattern(const Mechanism<Space, double>& mechanism,
                     const Kinematics<Space, double>& anywhere) {
  std::vector<int> start(1, 0), speeds;
  for (const int index : mechanism.constraints()) {
    for (int r = 0; r < mechanism.joints()[index].num_constraints(); ++r) {
      ForEachSpeedOfLoop(anywhere, index, [&](int speed, const Velocity<Space, double>&) {
        speeds.push_back(speed);
      });
      start.push_back(static_cast<int>(speeds.size()));
    }
  }
  return {mechanism.num_u(), std::move(start), std::move(speeds)};
}

// Nanoseconds of one machine; only their ratios are used. For 29 ladders, grids, chains and random
// graphs of 3 to 300 bodies there, sparse estimates are within a third. Dense ones in the plane are
// too, except one; in space they are down to half of the measured times. Judging is up to twice.

/// M, J_D, B and B^T M B as dense matrices.
inline double DenseWork(double n, double r) {
  const double f = n - r;
  return n * (120.0 + 0.7 * n + r) + 0.1 * r * r * (r / 3.0 + f) + 0.06 * n * f * (n + f);
}

/// Work of sparse factors: elimination takes `operations` and leaves `fill` entries in L.
template <class Space>
double SparseWork(double entries, double operations, double fill, double bodies, double f) {
  const double dim = Space::kDim;
  return 14.0 * entries + 0.7 * operations + 0.3 * fill * f +
         bodies * (30.0 + dim * f * (4.0 + 0.04 * f));
}

/// Returns true if constraints are independent; called at each position.
template <class Space>
double WorkOfJudging(const JointResponse<Space>& response, double bodies) {
  return response.operations() + 10.0 * Space::kDim * Space::kDim * bodies;
}

/// Choice of dependent speeds: from the last Choose() or ChooseAgain(), or the best at each
/// position if the state does not depend on it.
enum class Choice { kKept, kFree };

template <class Space>
class SparsePartition {
 public:
  /// Returns null if constraints must be dependent or, unless `anyway`, dense matrices are less
  /// work. `mechanism` must outlive this. Throws TooDense (dense_memory.h).
  static std::unique_ptr<SparsePartition> Make(const Mechanism<Space, double>& mechanism,
                                               Choice choice, bool anyway) {
    const double n = mechanism.num_u(), m = mechanism.num_rows(), f = n - m;
    if (m == 0 || f < 0) return nullptr;
    const Kinematics<Space, double> anywhere(mechanism);
    const double entries = EntriesOf(mechanism, anywhere), bodies = mechanism.num_bodies();
    if (entries > kMaxEntries) return nullptr;
    // no elimination is less than its entries
    const double least = SparseWork<Space>(entries, entries, entries, bodies, f);
    if (!anyway && least >= DenseWork(n, m)) return nullptr;
    auto response = JointResponse<Space>::Make(mechanism, kMaxOfResponse);
    if (response == nullptr) return nullptr;
    RequireDense(mechanism.name() + ": reduction to " +
                     std::to_string(mechanism.num_u() - mechanism.num_rows()) +
                     " independent speeds of " + std::to_string(mechanism.num_u()),
                 n * f + Space::kDim * bodies * (2.0 * f + 1.0) + f * f);
    return std::unique_ptr<SparsePartition>(new SparsePartition(
        mechanism, WithPattern(mechanism, anywhere), choice, std::move(response)));
  }

  /// The judge of positions.
  JointResponse<Space>& response() { return *response_; }
  /// Returns true if all constraints are certainly independent at this position.
  bool AreIndependent(const Kinematics<Space, double>& kinematics) {
    return response_->Factor(kinematics, Masses::kGeometric);
  }

  /// Chooses the best dependent speeds at these positions. Returns false if some constraint has
  /// none.
  bool Choose(const Kinematics<Space, double>& kinematics) {
    FillJacobian(kinematics);
    std::ranges::fill(is_independent_, 0);
    if (!lu_.Factor(J_)) return false;
    SetIndependent();
    if (best_ == nullptr) return true;
    for (const int speed : independent_) is_independent_[speed] = 1;
    return true;
  }

  /// Does the same if the reciprocal condition of the kept ones is below `share` of the best;
  /// returns true if they were replaced.
  bool ChooseAgain(const Kinematics<Space, double>& kinematics, double share) {
    FillJacobian(kinematics);
    if (!best_->Factor(J_)) return false;
    if (lu_.Factor(J_, is_independent_) && lu_.rcond() >= share * best_->rcond()) return false;
    return Choose(kinematics);
  }

  /// Returns true if it saves work over dense matrices, with the fill of the last choice, unknown
  /// before; at velocity level half of that fill.
  bool IsWorthwhile() const {
    const double n = mechanism_.num_u(), m = mechanism_.num_rows(),
                 bodies = mechanism_.num_bodies();
    const double dense = DenseWork(n, m);
    const double sparse = SparseWork<Space>(static_cast<double>(J_.size()), lu_.operations(),
                                            lu_.fill(), bodies, n - m);
    // A choice by row pivots ages sooner than one by a QR of J: in the absolute coordinates of
    // dead-centre it is replaced ten times for once, which costs a tenth more steps.
    if (best_ != nullptr) return sparse < 0.5 * dense;
    return sparse + WorkOfJudging(*response_, bodies) < dense;
  }

  /// Indices into u, ascending.
  const std::vector<int>& independent() const { return independent_; }

  /// Computes J_D's factors and B. Returns the reciprocal condition, 0 without factors.
  double Factor(const Kinematics<Space, double>& kinematics) {
    kinematics_ = &kinematics;
    mass_is_current_ = false;
    FillJacobian(kinematics);
    if (!lu_.Factor(J_, is_independent_)) return 0.0;
    if (best_ == nullptr) SetIndependent();
    // B of (2), in the order of u
    const int f = static_cast<int>(independent_.size());
    if (f == 0) return lu_.rcond();
    lu_.Dependencies(place_, B_.data(), f);
    for (int i = 0; i < f; ++i) {
      B_.row(independent_[i]).setZero();
      B_(independent_[i], i) = 1.0;
    }
    return lu_.rcond();
  }

  /// Returns true if B^T M B of the last Factor() is positive definite beyond round-off.
  bool HasMass() {
    if (independent_.empty()) return true;
    FactorMass();
    // a factorisation does not detect NaN
    return reduced_factor_.info() == Eigen::Success &&
           reduced_factor_.matrixLLT().diagonal().allFinite();
  }

  /// x_D = J_D^-1 target, x_I = 0.
  void Dependent(const VectorX<double>& target, VectorX<double>& x) {
    rows_ = target;
    x.setZero(mechanism_.num_u());
    lu_.SolveTransposed(rows_.data(), x.data());
  }

  /// (1): u = B u_I, less J_D^-1 b where `bias` is not null.
  void CompleteSpeeds(const VectorX<double>* bias, VectorX<double>& u) {
    for (std::size_t i = 0; i < independent_.size(); ++i) z_[i] = u[independent_[i]];
    u.noalias() = B_ * z_;
    if (bias == nullptr) return;
    Dependent(*bias, c_);
    u -= c_;
  }

  /// Solves (2) and (3) with `force` (empty: zero) instead of -h and `target` instead of gamma:
  /// B^T M B z = B^T (force - M c), x = B z + c. Not finite if HasMass() is false.
  void Solve(const VectorX<double>& force, const VectorX<double>& target, VectorX<double>& x) {
    Dependent(target, c_);
    x = c_;
    const int f = static_cast<int>(independent_.size());
    if (f == 0) return;
    if (!HasMass()) {
      x.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    SetMotions(c_, f);
    z_.setZero();
    z_.noalias() -= MV_.transpose() * V_.col(f);
    if (force.size() > 0) z_.noalias() += B_.transpose() * force;
    reduced_factor_.solveInPlace(z_);
    x.noalias() += B_ * z_;
  }

  /// lambda of J_D^T lambda = (M x - force)_D.
  void Multipliers(const VectorX<double>& force, const VectorX<double>& x,
                   VectorX<double>& lambda) {
    dynamics_.MassTimes(*kinematics_, x, residual_);
    if (force.size() > 0) residual_ -= force;
    lambda.resize(mechanism_.num_rows());
    lu_.Solve(residual_.data(), lambda.data());
  }

 private:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  SparsePartition(const Mechanism<Space, double>& mechanism, SparseLu lu, Choice choice,
                  std::unique_ptr<JointResponse<Space>> response)
      : mechanism_(mechanism),
        response_(std::move(response)),
        dynamics_(mechanism),
        J_(lu.rows().size()),
        lu_(std::move(lu)),
        is_independent_(choice == Choice::kKept ? mechanism.num_u() : 0),
        place_(mechanism.num_u()),
        motions_(mechanism.num_bodies()),
        c_(VectorX<double>::Zero(mechanism.num_u())),
        column_(c_),
        residual_(c_),
        rows_(mechanism.num_rows()) {
    if (choice == Choice::kKept) best_ = std::make_unique<SparseLu>(lu_);
    const Eigen::Index n = mechanism.num_u(), f = n - mechanism.num_rows();
    const Eigen::Index motions = Space::kDim * mechanism.num_bodies();
    independent_.reserve(f);
    B_.setZero(n, f);
    V_.setZero(motions, f + 1);
    MV_.setZero(motions, f);
    reduced_.setZero(f, f);
    z_.setZero(f);
    if (f > 0) reduced_factor_.compute(MatrixX<double>::Identity(f, f).eval());
  }

  /// Rows of J as TreeDynamics::Jacobian() has them, in the order of the pattern.
  void FillJacobian(const Kinematics<Space, double>& kinematics) {
    for (const int index : mechanism_.constraints()) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      const JointState<Space, double>& state = kinematics.joints()[index];
      const int count = joint.num_constraints();
      int entry = 0;
      ForEachSpeedOfLoop(kinematics, index, [&](int, const Velocity<Space, double>& V) {
        for (int r = 0; r < count; ++r) J_[lu_.start()[joint.row + r] + entry] = state.D(r).dot(V);
        ++entry;
      });
    }
  }

  /// Sets the lists of independent speeds from the pivots of lu_.
  void SetIndependent() {
    independent_.clear();
    for (int speed = 0; speed < mechanism_.num_u(); ++speed) {
      if (lu_.IsPivot(speed)) continue;
      place_[speed] = static_cast<int>(independent_.size());
      independent_.push_back(speed);
    }
  }

  /// B^T M B of (3), once per position.
  void FactorMass() {
    if (mass_is_current_) return;
    mass_is_current_ = true;
    const int f = static_cast<int>(independent_.size());
    for (int i = 0; i < f; ++i) {
      column_ = B_.col(i);
      SetMotions(column_, i);
      for (int body = 1; body < mechanism_.num_bodies(); ++body) {
        const auto momentum = InertiaTimes<Space, double>(*kinematics_, body, motions_[body]);
        for (int k = 0; k < Space::kDim; ++k) MV_(body * Space::kDim + k, i) = momentum[k];
      }
    }
    // the factor needs one triangle, which Eigen computes by blocks that few columns do not fill
    if (f > 8) {
      reduced_.template triangularView<Eigen::Lower>() = V_.leftCols(f).transpose() * MV_;
    } else {
      reduced_.noalias() = V_.leftCols(f).transpose() * MV_;
    }
    reduced_factor_.compute(reduced_);
  }

  /// Motions of all bodies for the speeds x, in column `index` of V_.
  void SetMotions(const VectorX<double>& x, int index) {
    dynamics_.Motions(*kinematics_, x, motions_);
    for (int body = 1; body < mechanism_.num_bodies(); ++body) {
      for (int i = 0; i < Space::kDim; ++i) V_(body * Space::kDim + i, index) = motions_[body][i];
    }
  }

  const Mechanism<Space, double>& mechanism_;
  std::unique_ptr<JointResponse<Space>> response_;
  TreeDynamics<Space, double> dynamics_;
  const Kinematics<Space, double>* kinematics_ = nullptr;  ///< of the last Factor()
  std::vector<double> J_;                                  ///< in the order of lu_'s pattern
  SparseLu lu_;
  std::unique_ptr<SparseLu> best_;  ///< null for a free choice, which uses lu_
  std::vector<int> independent_;
  std::vector<char> is_independent_;  ///< by speed, of the choice that is kept
  std::vector<int> place_;            ///< of a speed among the independent ones
  Columns B_;                         ///< num_u x f
  MatrixX<double> V_, MV_, reduced_;  ///< a column for each of B and one for c
  CholeskyFactor<MatrixX<double>> reduced_factor_;
  bool mass_is_current_ = false;
  std::vector<Acceleration<Space, double>> motions_;
  VectorX<double> c_, z_, column_, residual_, rows_;
};

}  // namespace loopbench::reduction
