#include "mechanism/loops/excursion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mechanism/loops/direction_weights.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench {

template <class Space>
Excursion<Space>::Excursion(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                            double accuracy)
    : mechanism_(&mechanism),
      kinematics_(mechanism),
      q_(q),
      units_(VectorX<double>::Ones(mechanism.num_u())) {
  kinematics_.UpdatePosition(q_);
  for (const TreeStep& step : mechanism.tree()) {
    const JointState<Space, double>& state = kinematics_.joints()[step.joint];
    const int offset = mechanism.joints()[step.joint].u_offset;
    for (int i = 0; i < state.num_u; ++i) {
      const bool shifts = state.H(i).angular.isZero();
      if (shifts) units_[offset + i] = mechanism.length();
    }
  }
  // poses go through centres of mass, and rounding with them
  double farthest = 0.0;
  for (const JointState<Space, double>& state : kinematics_.joints()) {
    farthest = std::max({farthest, state.r_P.norm(), state.r_Q.norm()});
  }
  const double eps = std::numeric_limits<double>::epsilon();
  // joints are given to the accuracy, with independent errors; four is the root of 16 joints
  const double of_loop = accuracy * std::min(4.0, std::sqrt(std::ssize(mechanism.joints())));
  rank_ratio_ = std::max(kRankRatio, of_loop);
  closed_ = std::max(std::max(1e-11, of_loop) * mechanism.length(), 100 * eps * farthest);
  kinematics_.AcceptStep();
  kinematics_.CountTurns();
  Factor();
}

template <class Space>
void Excursion<Space>::Factor() {
  kinematics_.UpdatePosition(q_);
  kinematics_.AcceptStep();
  here_ = RowsOfDirections(kinematics_);
  rank_ = 0;
  conditioning_ = 1.0;
  factored_ = false;
  if (here_.rows.size() == 0) return;
  // independent rows are the rule, and cheap to recognise; their diagonal is at most one
  constexpr double kSurely = 1e-2;
  if (here_.rows.rows() <= here_.rows.cols()) {
    const Eigen::LLT<Eigen::MatrixXd> cholesky(
        MatrixX<double>(here_.rows * here_.rows.transpose()));
    if (cholesky.info() == Eigen::Success) {
      conditioning_ = cholesky.matrixLLT().diagonal().minCoeff();
      rank_ = static_cast<int>(here_.rows.rows());
      if (conditioning_ > kSurely) return;
    }
  }
  // between rigid parts all is round-off
  const double largest = here_.rows.colwise().norm().maxCoeff();
  const double counts = std::max(largest, std::sqrt(DirectionWeights<double>::kMinResponse));
  if (!(largest > rank_ratio_ * counts)) here_.rows.setZero();  // nothing is constrained
  solver_.setThreshold(std::min(0.5, rank_ratio_ * counts / largest));
  solver_.compute(here_.rows);
  factored_ = true;
  rank_ = static_cast<int>(solver_.rank());
  excess_ = rank_ < std::min(here_.rows.rows(), here_.rows.cols())
                ? std::abs(solver_.matrixQTZ()(rank_, rank_)) / counts
                : 0.0;
  conditioning_ = rank_ > 0 ? std::abs(solver_.matrixQTZ()(rank_ - 1, rank_ - 1)) / counts : 1.0;
}

template <class Space>
double Excursion<Space>::Size(const VectorX<double>& u) const {
  return u.size() == 0 ? 0.0 : u.cwiseQuotient(units_).template lpNorm<Eigen::Infinity>();
}

/// Newton's method from q_ moved by u, with a rank of at most `rank`. True when the loops close.
template <class Space>
bool Excursion<Space>::Close(int rank, double distance, const VectorX<double>& u,
                             VectorX<double>& q, VectorX<double>& travelled) {
  q = mechanism_->Moved(q_, u);
  travelled = u;
  // quadratic where the loops are regular; where they are not, the way left halves each time, and
  // too long a step back may miss by more than before
  constexpr int kMaxIterations = 60, kMaxHalvings = 8;
  kinematics_.UpdatePosition(q);
  DirectionRows here = RowsOfDirections(kinematics_);
  bool closed = here.mismatch.norm() < closed_;
  for (int i = 0; i < kMaxIterations && !closed; ++i) {
    // far below the least singular value on approach to a singular configuration
    double threshold = 1e-9;
    if (rank > 0 && rank < std::min(here.rows.rows(), here.rows.cols())) {
      const auto pivots = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(here.rows)
                              .matrixQR()
                              .diagonal()
                              .cwiseAbs()
                              .eval();
      threshold = std::max(threshold, std::sqrt(pivots[rank - 1] * pivots[rank]) / pivots[0]);
    }
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    solver.setThreshold(threshold);
    solver.compute(here.rows);
    VectorX<double> back = solver.solve(VectorX<double>(-here.mismatch));
    here.mass.matrixU().solveInPlace(back);
    const double before = here.mismatch.norm();
    bool nearer = false;
    for (int halving = 0; halving < kMaxHalvings && !nearer; ++halving, back *= 0.5) {
      if (Size(back) > distance) continue;
      const VectorX<double> trial = mechanism_->Moved(q, back);
      kinematics_.UpdatePosition(trial);
      DirectionRows there = RowsOfDirections(kinematics_);
      nearer = there.mismatch.norm() < before;
      if (!nearer) continue;
      q = trial;
      here = std::move(there);
      travelled += back;
    }
    if (!nearer) break;
    closed = here.mismatch.norm() < closed_;
  }
  return closed;
}

template <class Space>
StepKind Excursion<Space>::Step(double distance, int seed) {
  const int n = mechanism_->num_u();
  if (n == 0 || rank_ == n) return StepKind::kFellBack;
  // a generic speed: an irrational mixture, less the components that the constraints remove
  VectorX<double> y(n);
  for (int i = 0; i < n; ++i) y[i] = std::cos(1.0 + seed * std::sqrt(2.0) + (i + seed) * (i + 0.5));
  if (course_.size() == n) y = course_ * (3.0 / course_.norm()) + y / y.norm();
  if (here_.rows.size() > 0 && !factored_) {
    solver_.setThreshold(rank_ratio_);
    solver_.compute(here_.rows);
    factored_ = true;
  }
  if (here_.rows.size() > 0) y -= solver_.solve(VectorX<double>(here_.rows * y));
  VectorX<double> u = here_.mass.matrixU().solve(y);
  const double along = distance / Size(u);
  u *= along;
  y *= along;
  VectorX<double> q, travelled;
  // off the loops redundant rows are independent, and lead anywhere: they follow the known rank,
  // unless the rank is larger nearby
  const bool closed =
      Close(rank_, distance, u, q, travelled) || Close(n, distance, u, q, travelled);
  bend_ = (travelled - u).cwiseQuotient(units_).norm() / u.cwiseQuotient(units_).norm();
  // a direction that is kept is a motion; a return to a tenth of the distance is none
  const bool moved = closed && Size(travelled) > 0.1 * distance;
  if (moved) {
    q_ = q;
    course_ = y;
  }
  Factor();
  if (!closed) return StepKind::kNotClosed;
  return moved ? StepKind::kMoved : StepKind::kFellBack;
}

template class Excursion<Planar>;
template class Excursion<Spatial>;

}  // namespace loopbench
