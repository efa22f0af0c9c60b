// Chooses rows that differ from each other as much as they can: Gram-Schmidt with pivoting, under
// quotas of joints, then as moving rows (mechanism.h) without quotas. Dense; for analyses.
#pragma once

#include <Eigen/Core>
#include <limits>
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
  /// Takes all rows of joints that keep all and prescribed ones, the best others until all quotas
  /// are full, improved by exchanges within joints, then the best of all until `total` are taken.
  RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas, int total);

  /// The least norm that a row had left when it was taken.
  double least() const { return least_; }
  /// Rows taken of a joint (index into the quotas).
  int taken(std::size_t joint) const { return taken_[joint]; }
  /// Returns the rows beyond the quotas as directions of `joints` (one per quota).
  std::vector<Released> BeyondQuotas(const std::vector<int>& joints) const;

 private:
  /// Takes one row of a joint (index into the quotas).
  void Take(std::size_t joint, int row);
  /// More rows by pivoting until `total` are taken.
  void TakeBest(int total);
  /// Exchanges rows of a joint while this doubles the volume of the rows taken. Pivoting alone may
  /// take a row early that leaves other joints nothing.
  void Exchange();

  struct Taken {
    std::size_t joint;
    int row;
  };
  Eigen::MatrixXd rows_, left_;  ///< left_: rows less their parts along those taken
  std::vector<Taken> order_;
  std::vector<Quota> quotas_;
  std::vector<bool> is_taken_, is_in_quota_;
  std::vector<int> taken_;  ///< by joint
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace loopbench
