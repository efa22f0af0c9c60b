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
  /// are full, and then the best of all until `total` are taken. Rows within quotas are independent
  /// if any such choice is. Exchanges within joints improve them.
  RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas, int total);

  /// The least norm that a row had left when it was taken.
  double least() const { return least_; }
  /// Rows taken of a joint (index into the quotas).
  int taken(std::size_t joint) const { return taken_[joint]; }
  /// Returns the rows beyond the quotas as directions of `joints` (one per quota).
  std::vector<Released> BeyondQuotas(const std::vector<int>& joints) const;

 private:
  struct Taken {
    int row;
    double norm;  ///< that it had left
  };
  /// All rows as T times the rows taken, and a rest in left_.
  struct Projection {
    Eigen::MatrixXd T;
    Eigen::VectorXd inverse;  ///< diagonal of the inverse Gram matrix of the rows taken
  };
  /// Shares of the largest norm. Positions close to about 1e-10 of their size, so dependent rows
  /// keep remainders of this share: kDependent is larger. Sums leave less than kRounding.
  static constexpr double kRounding = 1e-12, kDependent = 1e-6;

  bool HasRoom(std::size_t joint) const { return taken_[joint] < quotas_[joint].keep; }
  bool MayChange(int row) const {
    const Quota& quota = quotas_[joint_of_[row]];
    return quota.keep < quota.count && row >= quota.first + quota.fixed;
  }
  void Take(int row);
  void TakeAgain(const std::vector<Taken>& order);
  /// More rows by pivoting until `total` are taken.
  void TakeBest(int total);
  /// Pivoting may take a row early that leaves other joints only rows that depend on those taken.
  void DropDependent();
  /// Takes one more independent row. If its joint has no room, one of its rows leaves, and so on:
  /// a shortest augmenting path of the intersection of two matroids (Schrijver, Combinatorial
  /// Optimization, section 41.2). False if there is none whose elements of T exceed `tolerance`.
  bool Augment(double tolerance);
  /// Exchanges rows of a joint while this doubles the volume of the rows taken.
  void Exchange();
  Projection OntoTaken() const;

  Eigen::MatrixXd rows_, left_;  ///< left_: rows less their parts along those taken
  double scale_;                 ///< the largest norm of a row
  std::vector<Taken> order_;
  std::vector<Quota> quotas_;
  std::vector<std::size_t> joint_of_;  ///< index into the quotas, by row
  std::vector<bool> is_taken_, is_in_quota_;
  std::vector<int> taken_;  ///< by joint
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace loopbench
