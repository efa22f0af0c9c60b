// Chooses rows that differ from each other as much as they can: Gram-Schmidt with pivoting, under
// quotas of joints. Dense; for analyses.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "mechanism/model/mechanism.h"

namespace loopbench {

/// Rows of one joint among all, and how many of them are to be kept.
struct Quota {
  int first = 0, count = 0;
  int fixed = 0;  ///< the first so many are kept in any case: prescribed coordinates
  int keep = 0;   ///< at most
};

class RowChoice {
 public:
  RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas);

  /// Takes one row of a joint (index into the quotas).
  void Take(std::size_t joint, int row);
  /// Takes rows without a choice: rows of joints that keep all, and prescribed ones.
  void TakeFixed();
  /// More rows by pivoting, of those `allowed`, until `total` are taken. The least norm that a row
  /// had left when it was taken.
  double TakeBest(int total, const std::function<bool(int row)>& allowed);

  const std::vector<bool>& taken() const { return is_taken_; }
  /// Returns the rows not taken, as directions of `joints` (one per quota).
  std::vector<Released> NotTaken(const std::vector<int>& joints) const;

 private:
  Eigen::MatrixXd left_;  ///< rows less their parts along those taken
  std::vector<Quota> quotas_;
  std::vector<bool> is_taken_;
  std::vector<int> taken_;  ///< by joint
  int num_taken_ = 0;
};

}  // namespace loopbench
