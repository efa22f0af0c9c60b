#include "mechanism/start/least_squares.h"

#include <algorithm>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/dense_memory.h"

namespace loopbench {

namespace {

/// Entries of J up to which dense factors are used at once: about 10 ms.
constexpr double kSmall = 1e5;
/// Entries of J below which rough solutions gain nothing from sparse factors.
constexpr double kTiny = 1e3;
/// Least pivot of J J^T over its original entry: solutions keep at least six digits.
constexpr double kMinPivot = 1e-10;
/// Share of r that a step of an iteration may leave; the next step removes it.
constexpr double kStepLeaves = 1e-3;
/// Number of corrections of a solution, each by all digits of the factors, and their goal:
/// residuals over the sizes of their terms, of which round-off of long rows is about 1e-14.
constexpr int kCorrections = 4;
constexpr double kSolved = 1e-12;

double Numbers(const SparseRows& J) {
  return static_cast<double>(J.rows()) * static_cast<double>(J.cols());
}

}  // namespace

LeastSquares::LeastSquares(SparseRows J, std::string owner, Care care)
    : J_(std::move(J)),
      owner_(std::move(owner)),
      care_(care),
      is_small_(Numbers(J_) <= (care == Care::kRough ? kTiny : kSmall)) {
  if (is_small_) return;
  JJt_ = Eigen::SparseMatrix<double>(J_ * J_.transpose()).triangularView<Eigen::Lower>();
  factors_.analyzePattern(JJt_);
}

bool LeastSquares::Factor(double damping) {
  if (is_small_) return false;
  const double shift = damping * damping;
  factors_.setShift(shift);
  factors_.factorize(JJt_);
  if (factors_.info() != Eigen::Success) return false;
  if (care_ == Care::kRough) return true;
  const Eigen::VectorXd before = factors_.permutationP() * Eigen::VectorXd(JJt_.diagonal());
  return (factors_.vectorD().array() >= kMinPivot * (before.array() + shift)).all();
}

Eigen::MatrixXd LeastSquares::Dense(double numbers) const {
  RequireDense(owner_ +
                   (is_small_ ? ""
                              : ": its loops are close to a position where they lose rank, and "
                                "there") +
                   " the consistent start is dense: a matrix of " + std::to_string(J_.rows()) +
                   " constraints by " + std::to_string(J_.cols()) + " speeds and its factors",
               numbers);
  return Eigen::MatrixXd(J_);
}

/// Only the range of J^T can lessen |J d - r|. Sparsely d = J^T y with (J J^T + damping^2) y = r.
/// Densely, with the thin J^T = Q R, d = Q y, a problem as small as J has rows.
Eigen::VectorXd LeastSquares::Damped(const Eigen::VectorXd& r, double damping) {
  if (Factor(damping)) {
    const Eigen::VectorXd y = factors_.solve(r), d = J_.transpose() * y;
    if (care_ == Care::kRough) return d;
    if ((r - J_ * d - damping * damping * y).norm() <= kStepLeaves * r.norm()) return d;
  }
  if (care_ == Care::kRough && !is_small_) return Eigen::VectorXd::Zero(J_.cols());
  const Eigen::Index rank = std::min(J_.rows(), J_.cols());
  // J, the factors of its transpose, Q, and the square problem with its factors
  const Eigen::MatrixXd J = Dense(2.0 * Numbers(J_) + static_cast<double>(J_.cols() * rank) +
                                  2.0 * static_cast<double>((J_.rows() + rank) * rank));
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(J.transpose());
  const Eigen::MatrixXd Q = ThinQ(qr);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(J.rows() + rank, rank);
  A.topRows(J.rows()).noalias() = J * Q;
  A.bottomRows(rank).diagonal().setConstant(damping);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(A.rows());
  rhs.head(J.rows()) = r;
  const Eigen::HouseholderQR<Eigen::MatrixXd> least(A);
  return Q * Eigen::VectorXd(least.solve(rhs));
}

/// All corrections of d lie in the range of J^T, too, so it is the smallest of all solutions.
Eigen::VectorXd LeastSquares::Smallest(const Eigen::VectorXd& r) {
  if (Factor(0.0)) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(J_.cols()), left = r;
    for (int i = 0; i <= kCorrections; ++i) {
      d += J_.transpose() * Eigen::VectorXd(factors_.solve(left));
      left = r - J_ * d;
    }
    const Eigen::VectorXd terms = r.cwiseAbs() + SparseRows(J_.cwiseAbs()) * d.cwiseAbs();
    if (left.norm() <= kSolved * terms.norm()) return d;
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(Dense(3.0 * Numbers(J_)));
  return solver.solve(r);
}

}  // namespace loopbench
