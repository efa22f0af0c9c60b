// P A Q = L U of a tall sparse matrix: which of its rows to solve for, and how.
//
// A has at least as many rows as columns. Partial pivoting takes one row for each column, the one
// that the elimination leaves largest, so |L| <= 1 and the pivots are as good a choice of rows as
// such an elimination knows. Factors of the chosen rows alone come from the same function. Column
// by column from the left, in time proportional to the multiply-adds: Gilbert and Peierls, SIAM J.
// Sci. Stat. Comput. 9 (1988) 862. Columns are taken in the order that bounds the fill of A^T A
// (COLAMD).
//
// Eigen's SparseLU has square matrices and allocates for each; KLU could keep a first pivot order,
// which may pass through zero between two reviews, or allocate for another.
#pragma once

#include <span>
#include <vector>

namespace loopbench::reduction {

class SparseLu {
 public:
  SparseLu() = default;
  /// The pattern of A by columns: those of column k are `rows[start[k]]` to `rows[start[k + 1] -
  /// 1]`.
  SparseLu(int num_rows, std::vector<int> start, std::vector<int> rows);

  int columns() const { return static_cast<int>(start_.size()) - 1; }

  /// Factors of A, whose numbers are in the order of the pattern, without the rows that `left_out`
  /// names by a non-zero (empty: of all rows). False where a column has no pivot, or one that is
  /// not finite. Allocates only where other pivots need twice the memory that the first ones did.
  bool Factor(std::span<const double> values, std::span<const char> left_out = {});

  /// The row of each pivot, in the order of elimination.
  std::span<const int> pivots() const { return pivots_; }
  /// Ratio of the extreme pivots, 0 after a failure.
  double rcond() const { return rcond_; }
  /// Multiply-adds of the last Factor().
  double operations() const { return operations_; }

  /// After a Factor() of as many rows as columns, D: A_D^T X = R for `count` right-hand sides side
  /// by side. R (columns x count, row by row) is lost; of X (rows x count) other rows than D stay.
  void SolveTransposed(double* R, double* X, int count) const;
  /// The same of A_D x = y: of `y` (by row) those of D are lost; x by column.
  void Solve(double* y, double* x) const;

 private:
  struct Entry {
    int index = 0;  ///< in L a row of A, in U a column in the order of elimination
    double value = 0.0;
  };

  /// Columns of L that reach column k, in the order in which they act, and the rows that it may
  /// take its pivot from.
  void Reach(int column, std::span<const char> left_out);
  void Visit(int row);

  std::vector<int> start_, rows_, order_;
  std::vector<Entry> L_, U_;
  std::vector<int> L_start_, U_start_;  ///< by column in the order of elimination
  std::vector<double> diagonal_;        ///< of U
  std::vector<int> pivots_, step_of_row_;
  std::vector<double> x_, weights_;
  std::vector<int> reached_, candidates_, path_, next_;
  std::vector<long> marks_;
  long mark_ = 0;
  double rcond_ = 0.0, operations_ = 0.0;
};

}  // namespace loopbench::reduction
