// Numbers (1) to (3) are those of dense_reduction.h.
#include "reduction/sparse_partition.h"

#include <algorithm>
#include <utility>

#include "mechanism/loops/loop_speeds.h"

namespace loopbench::reduction {

namespace {

/// Which speeds move the two sides of each cut joint against each other, by row of J.
template <class Space>
void Pattern(const Mechanism<Space, double>& mechanism, std::vector<int>* start,
             std::vector<int>* speeds) {
  Kinematics<Space, double> anywhere(mechanism);
  start->assign(1, 0);
  for (const int index : mechanism.constraints()) {
    std::vector<int> of_loop;
    ForEachSpeedOfLoop(anywhere, index, [&](int speed, const Velocity<Space, double>&) {
      of_loop.push_back(speed);
    });
    for (int r = 0; r < mechanism.joints()[index].num_constraints(); ++r) {
      speeds->insert(speeds->end(), of_loop.begin(), of_loop.end());
      start->push_back(static_cast<int>(speeds->size()));
    }
  }
}

/// Multiply-adds of the dense matrices: M, J_D, B and B^T M B.
double DenseWork(double n, double r, double f) {
  return n * n + r * r * r / 3.0 + r * r * f + n * n * f + n * f * f;
}

/// The same of sparse ones for so many entries of J, in units of dense ones: measured on ladders,
/// of which both are as fast at some seven windows.
template <class Space>
double SparseWork(double entries, double bodies, double f) {
  return entries * (50.0 + 5.0 * f) + bodies * (50.0 * (1.0 + f) + Space::kDim * f * f);
}

}  // namespace

template <class Space>
std::unique_ptr<SparsePartition<Space>> SparsePartition<Space>::Make(
    const Mechanism<Space, double>& mechanism, bool always) {
  const int n = mechanism.num_u(), m = mechanism.num_rows();
  if (m == 0 || m > n) return nullptr;
  std::vector<int> start, speeds;
  Pattern(mechanism, &start, &speeds);
  const double sparse =
      SparseWork<Space>(static_cast<double>(speeds.size()), mechanism.num_bodies(), n - m);
  if (!always && sparse > DenseWork(n, m, n - m)) return nullptr;
  auto response = JointResponse<Space>::Make(mechanism, kMostOfResponse);
  if (response == nullptr) return nullptr;
  return std::unique_ptr<SparsePartition>(
      new SparsePartition(mechanism, std::move(start), std::move(speeds), std::move(response)));
}

template <class Space>
SparsePartition<Space>::SparsePartition(const Mechanism<Space, double>& mechanism,
                                        std::vector<int> start, std::vector<int> speeds,
                                        std::unique_ptr<JointResponse<Space>> response)
    : mechanism_(mechanism),
      response_(std::move(response)),
      dynamics_(mechanism),
      start_(std::move(start)),
      speeds_(std::move(speeds)),
      J_(speeds_.size()),
      best_(mechanism.num_u(), start_, speeds_),
      lu_(best_),
      is_independent_(mechanism.num_u()),
      place_(mechanism.num_u()),
      motions_(mechanism.num_bodies()),
      c_(VectorX<double>::Zero(mechanism.num_u())),
      column_(c_),
      residual_(c_),
      rows_(mechanism.num_rows()) {}

/// Rows of J as TreeDynamics::Jacobian() has them, in the order of the pattern.
template <class Space>
void SparsePartition<Space>::FillJacobian(const Kinematics<Space, double>& kinematics) {
  for (const int index : mechanism_.constraints()) {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    const JointState<Space, double>& state = kinematics.joints()[index];
    const int count = joint.num_constraints();
    int entry = 0;
    ForEachSpeedOfLoop(kinematics, index, [&](int, const Velocity<Space, double>& V) {
      for (int r = 0; r < count; ++r) J_[start_[joint.row + r] + entry] = state.D(r).dot(V);
      ++entry;
    });
  }
}

template <class Space>
void SparsePartition<Space>::Adopt(std::span<const int> pivots) {
  choice_.dependent.assign(pivots.begin(), pivots.end());
  std::ranges::sort(choice_.dependent);
  std::ranges::fill(is_independent_, 1);
  for (const int speed : choice_.dependent) is_independent_[speed] = 0;
  choice_.independent.clear();
  for (int speed = 0; speed < mechanism_.num_u(); ++speed) {
    if (!is_independent_[speed]) continue;
    place_[speed] = static_cast<int>(choice_.independent.size());
    choice_.independent.push_back(speed);
  }
  const Eigen::Index n = mechanism_.num_u(), f = n - mechanism_.num_rows();
  const Eigen::Index motions = Space::kDim * mechanism_.num_bodies();
  B_.setZero(n, f);
  right_.setZero(mechanism_.num_rows(), f);
  V_.setZero(motions, f + 1);
  MV_.setZero(motions, f);
  reduced_.setZero(f, f);
  z_.setZero(f);
  if (f > 0) reduced_factor_.compute(MatrixX<double>::Identity(f, f).eval());
}

template <class Space>
bool SparsePartition<Space>::Choose(const Kinematics<Space, double>& kinematics) {
  FillJacobian(kinematics);
  if (!best_.Factor(J_)) return false;
  Adopt(best_.pivots());
  return true;
}

template <class Space>
bool SparsePartition<Space>::ChooseAgain(const Kinematics<Space, double>& kinematics,
                                         double share) {
  FillJacobian(kinematics);
  if (!best_.Factor(J_)) return false;
  if (lu_.Factor(J_, is_independent_) && lu_.rcond() >= share * best_.rcond()) return false;
  Adopt(best_.pivots());
  return true;
}

template <class Space>
double SparsePartition<Space>::Factor(const Kinematics<Space, double>& kinematics) {
  kinematics_ = &kinematics;
  mass_is_current_ = false;
  FillJacobian(kinematics);
  if (!lu_.Factor(J_, is_independent_)) return 0.0;
  const int f = static_cast<int>(choice_.independent.size());
  if (f == 0) return lu_.rcond();
  // B of (2), in the order of u
  right_.setZero();
  for (int row = 0; row < mechanism_.num_rows(); ++row) {
    for (int e = start_[row]; e < start_[row + 1]; ++e) {
      if (is_independent_[speeds_[e]]) right_(row, place_[speeds_[e]]) = -J_[e];
    }
  }
  lu_.SolveTransposed(right_.data(), B_.data(), f);
  for (int i = 0; i < f; ++i) B_(choice_.independent[i], i) = 1.0;
  return lu_.rcond();
}

template <class Space>
void SparsePartition<Space>::Dependent(const VectorX<double>& target, VectorX<double>& x) {
  rows_ = target;
  x.setZero(mechanism_.num_u());
  lu_.SolveTransposed(rows_.data(), x.data(), 1);
}

template <class Space>
void SparsePartition<Space>::CompleteSpeeds(const VectorX<double>* bias, VectorX<double>& u) {
  for (std::size_t i = 0; i < choice_.independent.size(); ++i) z_[i] = u[choice_.independent[i]];
  u.noalias() = B_ * z_;
  if (bias == nullptr) return;
  Dependent(*bias, c_);
  u -= c_;
}

template <class Space>
void SparsePartition<Space>::SetMotions(const VectorX<double>& x, int index) {
  dynamics_.Motions(*kinematics_, x, motions_);
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    for (int i = 0; i < Space::kDim; ++i) V_(body * Space::kDim + i, index) = motions_[body][i];
  }
}

template <class Space>
void SparsePartition<Space>::FactorMass() {
  if (mass_is_current_) return;
  mass_is_current_ = true;
  const int f = static_cast<int>(choice_.independent.size());
  for (int i = 0; i < f; ++i) {
    column_ = B_.col(i);
    SetMotions(column_, i);
    for (int body = 1; body < mechanism_.num_bodies(); ++body) {
      const Inertia<Space, double>& inertia = mechanism_.bodies()[body];
      const Wrench<Space, double> momentum(
          kinematics_->RotationalInertia(inertia, body) * motions_[body].angular,
          inertia.mass * motions_[body].linear);
      for (int k = 0; k < Space::kDim; ++k) MV_(body * Space::kDim + k, i) = momentum[k];
    }
  }
  reduced_.noalias() = V_.leftCols(f).transpose() * MV_;
  reduced_factor_.compute(reduced_);
}

/// B^T M B z = B^T (force - M c), x = B z + c.
template <class Space>
void SparsePartition<Space>::Solve(const VectorX<double>& force, const VectorX<double>& target,
                                   VectorX<double>& x) {
  Dependent(target, c_);
  x = c_;
  const int f = static_cast<int>(choice_.independent.size());
  if (f == 0) return;
  FactorMass();
  SetMotions(c_, f);
  z_.setZero();
  z_.noalias() -= MV_.transpose() * V_.col(f);
  if (force.size() > 0) z_.noalias() += B_.transpose() * force;
  reduced_factor_.solveInPlace(z_);
  x.noalias() += B_ * z_;
}

template <class Space>
void SparsePartition<Space>::Multipliers(const VectorX<double>& force, const VectorX<double>& x,
                                         VectorX<double>& lambda) {
  dynamics_.MassTimes(*kinematics_, x, residual_);
  if (force.size() > 0) residual_ -= force;
  lambda.resize(mechanism_.num_rows());
  lu_.Solve(residual_.data(), lambda.data());
}

template class SparsePartition<Planar>;
template class SparsePartition<Spatial>;

}  // namespace loopbench::reduction
