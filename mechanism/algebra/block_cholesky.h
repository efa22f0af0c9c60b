// Cholesky factors of a sparse symmetric positive definite matrix whose blocks are small and dense:
//
//   P A P^T = L L^T
//
// P orders whole blocks, once. Factors of new values then need no allocation and no search: column
// by column from the left, each from the columns before it that have a block in its row (A. George,
// J. W. Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, section 5.3).
// Eigen's sparse factors allocate whenever values change, and store numbers instead of blocks.
#pragma once

#include <span>
#include <utility>
#include <vector>

namespace loopbench {

class BlockCholesky {
 public:
  /// Takes the rows of each diagonal block; `pairs` are the (i, j), i != j, with nonzero blocks. A
  /// pair may occur twice, in either order. If L would exceed `most` numbers, none is built:
  /// numbers() then exceeds `most`, and no other call is allowed.
  BlockCholesky(const std::vector<int>& rows, std::span<const std::pair<int, int>> pairs,
                double most);

  /// Storage of A, by blocks and rows, to be filled after each SetZero(). Diagonal blocks use the
  /// lower triangle. A pair has one block: rows of the block FirstOf(), columns of the other.
  void SetZero();
  double* Diagonal(int block) { return &L_[columns_[order_[block]].first_number]; }
  int FirstOf(int i, int j) const { return order_[i] > order_[j] ? i : j; }
  /// Returns null if there is no such pair.
  double* OffDiagonal(int i, int j);

  /// Returns false if a pivot is not positive; Solve() is then invalid.
  bool Factor();
  /// x := A^-1 x, in place, block after block as given.
  void Solve(double* x) const;

  /// Results of the last Factor(): a block's smallest pivot over its value before the elimination
  /// of other blocks. 0 if the block failed, 1 if it was not reached.
  double ratio(int block) const { return ratios_[order_[block]]; }
  /// Blocks of the elimination tree down from this one, itself included.
  int eliminated(int block) const { return columns_[order_[block]].eliminated; }

  int rows(int block) const { return columns_[order_[block]].rows; }
  int size() const { return size_; }
  /// Numbers in L, and multiply-adds of Factor() and one Solve().
  double numbers() const { return numbers_; }
  double operations() const { return operations_; }

 private:
  struct Column {
    int block = 0, rows = 0;
    int first_number = 0;              ///< in L_: the diagonal block, then those below it
    int first_row = 0, num_rows = 0;   ///< in below_
    int first_left = 0, num_left = 0;  ///< in left_
    int first = 0;                     ///< in x
    int eliminated = 1;                ///< blocks of its subtree
  };
  /// A block in a column's row, to the left of it.
  struct Left {
    int column = 0;
    int place = 0;  ///< in below_
  };
  struct Below {
    int column = 0;
    int number = 0;  ///< in L_
  };
  template <int kRows, class Size>
  void Eliminate(int j, Size n);
  template <int kRows, class Size>
  bool FactorColumn(int j, Size n);
  template <int kRows>
  void SolveColumns(double* x) const;

  int size_ = 0;
  int uniform_ = 0;  ///< rows of every block; 0 if they differ
  double numbers_ = 0.0, operations_ = 0.0;
  std::vector<int> order_;  ///< column of each block
  std::vector<Column> columns_;
  std::vector<Below> below_;
  std::vector<Left> left_;
  std::vector<int> number_of_;      ///< by column: index in L_ of the present column's row
  std::vector<double> L_, ratios_;  ///< ratios_ by column
};

}  // namespace loopbench
