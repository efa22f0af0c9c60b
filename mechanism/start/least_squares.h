// Least-squares problems of a start: as many rows as loops have constraints, a column per speed.
//
// Rows have few entries, so J J^T + damping^2 is formed and factored sparsely: time and memory are
// near-linear for chains and ladders. Its condition is the square of J's. If a pivot indicates that
// J is close to losing rank, and for all small J, dense orthogonal factors decide.
#pragma once

#include <Eigen/SparseCholesky>
#include <string>

namespace loopbench {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

class LeastSquares {
 public:
  /// Method of Damped() if J is close to losing rank.
  enum class Care {
    kFull,   ///< by dense factors
    kRough,  ///< sparsely all the same, d = 0 without factors: for a step that is tried
  };
  /// `owner` begins the message where dense factors cannot be had.
  LeastSquares(SparseRows J, std::string owner, Care care = Care::kFull);

  /// argmin |J d - r|^2 + damping^2 |d|^2. Throws TooDense (dense_memory.h).
  Eigen::VectorXd Damped(const Eigen::VectorXd& r, double damping);
  /// The smallest d of those that come nearest to J d = r. Throws TooDense.
  Eigen::VectorXd Smallest(const Eigen::VectorXd& r);

 private:
  /// J J^T + damping^2 sparsely; false where dense factors are to decide.
  bool Factor(double damping);
  /// J for factors that take so many numbers, J included.
  Eigen::MatrixXd Dense(double numbers) const;

  SparseRows J_;
  std::string owner_;
  Care care_;
  bool is_small_;
  Eigen::SparseMatrix<double> JJt_;  ///< lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
};

}  // namespace loopbench
