// Couplings of joint coordinates and rotors (mechanism.h) with any solver of the joint constraints.
//
//   (M + R^T I R) x - J^T lambda - G^T mu = f,      J x = c,      G x = d
//
// G has a row per coupling, R one per rotor, I are the rotors' inertias. The rotors' efforts tau =
// -I R x are unknowns like mu. x0 is the inner solver's result for (f, c). A column of Y is its
// result for a row of G or R as force, with c = 0. Then
//
//   x = x0 + Y [mu; tau],   X = [G; R] Y,   (X + diag(0, I^-1)) [mu; tau] = [d; 0] - [G; R] x0
//
// X, symmetric and positive semidefinite, is the response of the mechanism to these forces. The sum
// is scaled by FreeResponseOf() and factored by Cholesky with pivoting. Couplings whose pivots are
// round-off depend on the other constraints: they carry no force. As published they end the run as
// `singular`. Rotors with such pivots are on coordinates that cannot move.
//
// Vectors of rows contain the rows of joints, then a number per coupling, which may be missing and
// is then zero. A position takes one solution of the inner solver per coupling and rotor.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/options.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class CoupledSolver final : public ConstraintSolver<Space, S> {
 public:
  /// `mechanism` must outlive the solver.
  CoupledSolver(const Mechanism<Space, S>& mechanism,
                std::unique_ptr<ConstraintSolver<Space, S>> inner, SolverKind kind)
      : mechanism_(mechanism),
        inner_(std::move(inner)),
        kind_(kind),
        dynamics_(mechanism),
        num_couplings_(std::ssize(mechanism.couplings())),
        rows_(VectorX<S>::Zero(mechanism.num_rows())),
        lambda_(rows_),
        lambda_change_(rows_),
        rest_(VectorX<S>::Zero(mechanism.num_u())),
        force_(rest_),
        column_(rest_),
        A_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()) {
    const std::vector<Rotor<S>>& rotors = mechanism.rotors();
    const Eigen::Index rows = num_couplings_ + std::ssize(rotors);
    G_.setZero(rows, mechanism.num_u());
    Y_.setZero(mechanism.num_u(), rows);
    X_.setZero(rows, rows);
    scale_.setZero(rows);
    mu_ = left_ = yield_ = scale_;
    for (std::size_t r = 0; r < rotors.size(); ++r) {
      yield_[num_couplings_ + static_cast<Eigen::Index>(r)] = S(1) / rotors[r].inertia;
    }
    order_.resize(static_cast<std::size_t>(rows));
  }

  Outcome Factor(const Kinematics<Space, S>& kinematics) override {
    using std::sqrt;
    rank_ = static_cast<int>(order_.size());
    const Outcome outcome = inner_->Factor(kinematics);
    this->conditioning_ = inner_->conditioning();
    if (outcome != Outcome::kFinished) return outcome;
    dynamics_.CouplingJacobian(kinematics, G_, true);
    rows_.setZero();
    for (int c = 0; c < G_.rows(); ++c) {
      force_ = G_.row(c).transpose();
      inner_->Solve(force_, rows_, column_, nullptr);
      Y_.col(c) = column_;
      const S free =
          yield_[c] + (c < num_couplings_ ? FreeResponseOf(kinematics, Masses::kPhysical, c)
                                          : FreeResponseOfCoordinate(
                                                kinematics, Masses::kPhysical,
                                                mechanism_.rotors()[c - num_couplings_].joint));
      scale_[c] = free > S(0) ? S(S(1) / sqrt(free)) : S(0);
    }
    rank_ = FactorResponse();
    const auto independent = std::count_if(order_.begin(), order_.begin() + rank_,
                                           [&](int row) { return row < num_couplings_; });
    this->conditioning_.rank += static_cast<int>(independent);
    const bool depends = independent < num_couplings_;
    return depends && kind_ == SolverKind::kAsPublished ? Outcome::kSingular : Outcome::kFinished;
  }

  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override {
    SetTarget(target);
    inner_->Solve(force, rows_, x, lambda != nullptr ? &lambda_ : nullptr);
    Couple(x);
    if (lambda != nullptr) PutMultipliers(*lambda);
  }

  /// Without forces of inertia, left_ contains the accelerations for udot = 0, also of rotors.
  bool Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                  VectorX<S>& udot, VectorX<S>* lambda) override {
    SetTarget(feedback);
    if (!inner_->Accelerate(kinematics, rows_, udot, lambda != nullptr ? &lambda_ : nullptr)) {
      return false;
    }
    dynamics_.BodyAccelerations(kinematics, rest_, A_);
    for (int c = 0; c < num_couplings_; ++c) {
      left_[c] += CouplingAcceleration<Space, S>(kinematics, c, nullptr, A_);
    }
    for (std::size_t r = 0; r < mechanism_.rotors().size(); ++r) {
      left_[num_couplings_ + static_cast<Eigen::Index>(r)] =
          CoordinateAcceleration<Space, S>(kinematics, mechanism_.rotors()[r].joint, A_);
    }
    left_ = -left_;
    Couple(udot);
    if (lambda != nullptr) PutMultipliers(*lambda);
    return true;
  }

  bool TakesWrenches() const override { return inner_->TakesWrenches(); }
  void SolveWrenches(const VectorX<S>& wrenches, VectorX<S>& x, VectorX<S>* lambda) override {
    left_.setZero();
    inner_->SolveWrenches(wrenches, x, lambda != nullptr ? &lambda_ : nullptr);
    Couple(x);
    if (lambda != nullptr) PutMultipliers(*lambda);
  }
  /// The inner solver's change, then the smallest in the metric of the masses that satisfies the
  /// couplings.
  void Correct(const VectorX<S>& target, VectorX<S>& x) override {
    SetTarget(target);
    inner_->Correct(rows_, x);
    Couple(x);
  }
  void Start(const Kinematics<Space, S>& kinematics) override { inner_->Start(kinematics); }
  bool Review(const Kinematics<Space, S>& kinematics) override {
    return inner_->Review(kinematics);
  }

  void AppendMode(std::vector<int>& mode) const override { inner_->AppendMode(mode); }
  void TakeMode(std::span<const int> mode) override { inner_->TakeMode(mode); }
  std::string WhySingular() const override {
    const std::string why = inner_->WhySingular();
    if (!why.empty()) return why;
    std::string names;
    for (std::size_t i = static_cast<std::size_t>(rank_); i < order_.size(); ++i) {
      if (order_[i] >= mechanism_.num_coordinate_couplings()) continue;
      names += (names.empty() ? "\"" : ", \"") +
               mechanism_.couplings()[static_cast<std::size_t>(order_[i])].name + '"';
    }
    return names.empty() ? "" : "coupling " + names + " depends on the other constraints";
  }

  std::vector<NamedCount> Counters() const override { return inner_->Counters(); }

 private:
  /// Pivots of the scaled X below this are round-off of the inner solver. Mass ratios of 1e9 leave
  /// pivots of 1e-9.
  static S LeastPivot() { return S(4096) * std::numeric_limits<S>::epsilon(); }
  /// Factors the scaled sum X + diag(0, I^-1); returns its rank.
  int FactorResponse() {
    using std::sqrt;
    const int n = static_cast<int>(order_.size());
    X_.noalias() = G_ * Y_;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        X_(i, j) = X_(j, i) = (X_(i, j) + X_(j, i)) * S(0.5) * scale_[i] * scale_[j];
      }
      X_(i, i) += yield_[i] * scale_[i] * scale_[i];
    }
    std::iota(order_.begin(), order_.end(), 0);
    for (int p = 0; p < n; ++p) {
      int best = p;
      for (int i = p + 1; i < n; ++i) {
        if (X_(i, i) > X_(best, best)) best = i;
      }
      if (!(X_(best, best) > LeastPivot())) return p;
      if (best != p) {
        X_.row(p).swap(X_.row(best));
        X_.col(p).swap(X_.col(best));
        std::swap(order_[p], order_[best]);
      }
      X_(p, p) = sqrt(X_(p, p));
      for (int i = p + 1; i < n; ++i) X_(i, p) /= X_(p, p);
      for (int j = p + 1; j < n; ++j) {
        for (int i = j; i < n; ++i) {
          X_(i, j) -= X_(i, p) * X_(j, p);
          X_(j, i) = X_(i, j);
        }
      }
    }
    return n;
  }

  /// Sets rows_ and left_ from rows of joints and couplings, as far as there are any.
  void SetTarget(const VectorX<S>& target) {
    rows_.setZero();
    left_.setZero();
    const Eigen::Index rows = std::min(target.size(), rows_.size());
    rows_.head(rows) = target.head(rows);
    if (target.size() > rows_.size()) left_.head(num_couplings_) = target.tail(num_couplings_);
  }

  /// Sets mu_, efforts of couplings, then of rotors, for [d; 0] in left_. Adds Y mu to x = x0.
  void Couple(VectorX<S>& x) {
    left_.noalias() -= G_ * x;
    mu_.setZero();
    // L z = scaled left, then L^T z
    for (int i = 0; i < rank_; ++i) {
      S z = left_[order_[i]] * scale_[order_[i]];
      for (int j = 0; j < i; ++j) z -= X_(i, j) * mu_[order_[j]];
      mu_[order_[i]] = z / X_(i, i);
    }
    for (int i = rank_ - 1; i >= 0; --i) {
      S z = mu_[order_[i]];
      for (int j = i + 1; j < rank_; ++j) z -= X_(j, i) * mu_[order_[j]];
      mu_[order_[i]] = z / X_(i, i);
    }
    mu_ = mu_.cwiseProduct(scale_);
    x.noalias() += Y_ * mu_;
  }

  /// Multipliers after Couple(), if lambda_ contains the inner solver's.
  void PutMultipliers(VectorX<S>& lambda) {
    force_.noalias() = G_.transpose() * mu_;
    rows_.setZero();
    inner_->Solve(force_, rows_, column_, &lambda_change_);
    lambda.resize(lambda_.size() + num_couplings_);
    lambda << lambda_ + lambda_change_, mu_.head(num_couplings_);
  }

  const Mechanism<Space, S>& mechanism_;
  std::unique_ptr<ConstraintSolver<Space, S>> inner_;
  SolverKind kind_;
  TreeDynamics<Space, S> dynamics_;
  Eigen::Index num_couplings_;
  MatrixX<S> G_, Y_, X_;    ///< G_: with R; X_: scaled sum, then L by pivot order
  VectorX<S> yield_;        ///< 0 by coupling, 1 / inertia by rotor
  VectorX<S> scale_;        ///< 1 / sqrt(FreeResponseOf() + yield_)
  std::vector<int> order_;  ///< rows of G_ by pivot
  int rank_ = 0;            ///< of X_
  VectorX<S> rows_, lambda_, lambda_change_, rest_, force_, column_, mu_, left_;
  std::vector<Acceleration<Space, S>> A_;
};

}  // namespace loopbench
