// P A Q = L U of a tall sparse matrix: a choice of rows, and the dependence of all others on them.
//
// A has at least as many rows as columns. Partial pivoting takes the largest remaining row for each
// column, so |L| <= 1 and the pivots are as good a choice of rows as this elimination permits; or
// an earlier choice gives the pivots. With D the rows of pivots and I all others, A_I = L_I L_D^-1
// A_D. Column by column from the left, in time proportional to the multiply-adds: Gilbert and
// Peierls, SIAM J. Sci. Stat. Comput. 9 (1988) 862. Columns are taken in the order that bounds the
// fill of A^T A (COLAMD).
//
// Eigen's SparseLU needs square matrices and allocates for each. KLU keeps a first pivot order,
// which may become singular between two reviews, or allocates for another.
#pragma once

#include <span>
#include <vector>

namespace loopbench::reduction {

class SparseLu {
 public:
  SparseLu() = default;
  /// Takes the pattern of A by columns: column k begins at `rows[start[k]]`.
  SparseLu(int num_rows, std::vector<int> start, std::vector<int> rows);

  int columns() const { return static_cast<int>(start_.size()) - 1; }
  /// The pattern as it was given.
  const std::vector<int>& start() const { return start_; }
  const std::vector<int>& rows() const { return rows_; }

  /// Factors A, whose numbers are in the order of the pattern. Rows with a non-zero in `barred` are
  /// no pivots (empty: all may be). Returns false if a column has no finite pivot. Allocates the
  /// first time, and if other pivots fill more than twice as much.
  bool Factor(std::span<const double> values, std::span<const char> barred = {});

  /// The row of each pivot, in the order of elimination.
  std::span<const int> pivots() const { return pivots_; }
  bool IsPivot(int row) const { return step_of_row_[row] >= 0; }
  /// The least pivot as a part of the largest number of A, barred rows included, or of a larger
  /// pivot; 0 after a failure.
  double rcond() const { return rcond_; }
  /// Multiply-adds of the last Factor(), and entries of L.
  double operations() const { return operations_; }
  double fill() const { return static_cast<double>(L_.size()); }

  /// Solves A_D^T x = r. Overwrites r (by column); entries of x (by row) for rows I are unchanged.
  void SolveTransposed(double* r, double* x) const;
  /// A_D x = y. y (by row) is lost; x by column.
  void Solve(double* y, double* x) const;
  /// Computes the rows D of B = -(A_D^T)^-1 A_I^T: row `row` begins at `B[row * count]`, and a row
  /// of I has the column `place[row]`.
  void Dependencies(std::span<const int> place, double* B, int count) const;

 private:
  struct Entry {
    int index = 0;  ///< in L a row of A, in U a step of the elimination
    double value = 0.0;
  };

  /// Finds the columns of L that reach this column of A, in elimination order, and the other rows
  /// of the result.
  void Reach(int column);
  void Visit(int row);
  /// Sets the pattern of column k in elimination order, from the result of Reach().
  void SetL(int k);
  void SetU(int k);
  /// Returns the index in L of the pivot for column k; -1: none.
  int Largest(int k, std::span<const char> barred) const;

  std::vector<int> start_, rows_, order_;
  std::vector<Entry> L_, U_;            ///< a column of L begins with its pivot
  std::vector<int> L_start_, U_start_;  ///< by column in the order of elimination
  /// Number of columns with a valid pattern while pivots are unchanged.
  int num_known_ = 0;
  std::vector<double> diagonal_;  ///< of U
  std::vector<int> pivots_, step_of_row_;
  std::vector<double> x_, weights_;
  std::vector<int> reached_, open_, path_, next_;
  std::vector<long> marks_;
  long mark_ = 0;
  double rcond_ = 0.0, operations_ = 0.0;
  bool has_room_ = false;
};

}  // namespace loopbench::reduction
