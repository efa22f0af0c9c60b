#include "mechanism/loops/row_choice.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace loopbench {

RowChoice::RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas, int total)
    : rows_(rows),
      left_(rows),
      scale_(rows.size() > 0 ? rows.rowwise().norm().maxCoeff() : 0.0),
      quotas_(std::move(quotas)),
      joint_of_(static_cast<std::size_t>(rows.rows())),
      is_taken_(joint_of_.size(), false),
      taken_(quotas_.size(), 0) {
  int in_quotas = 0;
  for (std::size_t j = 0; j < quotas_.size(); ++j) {
    const Quota& quota = quotas_[j];
    const int fixed = quota.keep == quota.count ? quota.count : quota.fixed;
    std::fill_n(joint_of_.begin() + quota.first, quota.count, j);
    for (int i = 0; i < fixed; ++i) Take(quota.first + i);
    in_quotas += quota.keep;
  }
  in_quotas = std::min(in_quotas, total);
  TakeBest(in_quotas);
  DropDependent();
  // rows as different as possible first: a path of large elements of T, if there is one
  constexpr double kLarge = 0.1;
  while (std::ssize(order_) < in_quotas && (Augment(kLarge) || Augment(kDependent))) {
  }
  TakeBest(in_quotas);
  Exchange();
  is_in_quota_ = is_taken_;
  for (Quota& quota : quotas_) quota.keep = quota.count;
  TakeBest(total);
}

void RowChoice::Take(int row) {
  is_taken_[row] = true;
  ++taken_[joint_of_[row]];
  const double norm = left_.row(row).norm();
  order_.push_back({row, norm});
  least_ = std::min(least_, norm);
  if (!(norm > kRounding * scale_)) return;
  const Eigen::RowVectorXd unit = left_.row(row) / norm;
  // twice: the remainder of nearly dependent rows must be orthogonal, too
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::VectorXd along = left_ * unit.transpose();
    left_.noalias() -= along * unit;
  }
}

void RowChoice::TakeAgain(const std::vector<Taken>& order) {
  order_.clear();
  left_ = rows_;
  is_taken_.assign(is_taken_.size(), false);
  taken_.assign(taken_.size(), 0);
  least_ = std::numeric_limits<double>::infinity();
  for (const Taken& one : order) Take(one.row);
}

void RowChoice::TakeBest(int total) {
  while (std::ssize(order_) < total) {
    double best = -1.0;
    int row = -1;
    for (int r = 0; r < rows_.rows(); ++r) {
      if (is_taken_[r] || !HasRoom(joint_of_[r])) continue;
      // the first of equals, rounding aside, so that all formulations choose alike
      const double norm = left_.row(r).norm();
      if (row >= 0 && !(norm > best * (1.0 + 1e-6))) continue;
      best = norm;
      row = r;
    }
    if (row < 0) break;
    Take(row);
  }
}

void RowChoice::DropDependent() {
  std::vector<Taken> order = order_;
  std::erase_if(order, [&](const Taken& one) {
    return one.norm <= kDependent * scale_ && MayChange(one.row);
  });
  if (order.size() < order_.size()) TakeAgain(order);
}

RowChoice::Projection RowChoice::OntoTaken() const {
  const auto size = static_cast<Eigen::Index>(order_.size());
  if (size == 0) return {Eigen::MatrixXd(rows_.rows(), 0), {}};
  Eigen::MatrixXd taken(rows_.cols(), size);
  for (Eigen::Index k = 0; k < size; ++k) taken.col(k) = rows_.row(order_[k].row).transpose();
  // not by the Gram matrix: it squares the ratio of small rows to large ones
  const Eigen::MatrixXd inverse =
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(taken).pseudoInverse();
  return {rows_ * inverse.transpose(), inverse.rowwise().squaredNorm()};
}

bool RowChoice::Augment(double tolerance) {
  const Projection onto = OntoTaken();
  const double least = tolerance * scale_;
  constexpr int kNone = -1, kNotReached = -2;
  std::vector<int> before(is_taken_.size(), kNotReached), leaves(is_taken_.size(), kNone);
  std::vector<int> reached;
  for (int row = 0; row < rows_.rows(); ++row) {
    if (is_taken_[row] || !MayChange(row) || !(left_.row(row).norm() > least)) continue;
    reached.push_back(row);
    before[row] = kNone;
  }
  // of equals, rounding aside, the first one, so that all formulations choose alike
  std::ranges::stable_sort(reached, std::greater(), [&](int row) {
    return std::round(1e6 * left_.row(row).norm() / scale_);
  });
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const int row = reached[next];
    if (HasRoom(joint_of_[row])) {
      std::vector<Taken> order = order_;
      int enters = row;
      for (; before[enters] != kNone; enters = before[enters]) order[leaves[enters]].row = enters;
      order.push_back({enters, 0.0});
      TakeAgain(order);
      return true;
    }
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if (joint_of_[order_[k].row] != joint_of_[row] || !MayChange(order_[k].row)) continue;
      for (int other = 0; other < rows_.rows(); ++other) {
        if (is_taken_[other] || before[other] != kNotReached || !MayChange(other)) continue;
        if (!(std::abs(onto.T(other, static_cast<Eigen::Index>(k))) > tolerance)) continue;
        reached.push_back(other);
        before[other] = row;
        leaves[other] = static_cast<int>(k);
      }
    }
  }
  return false;
}

void RowChoice::Exchange() {
  constexpr double kGain = 2.0;
  for (Eigen::Index round = 0; round < rows_.rows() && !order_.empty(); ++round) {
    const Projection onto = OntoTaken();
    double most = kGain * kGain;
    Taken* out = nullptr;
    int in = -1;
    for (Eigen::Index k = 0; k < std::ssize(order_); ++k) {
      Taken& one = order_[k];
      if (!MayChange(one.row)) continue;
      for (int row = 0; row < rows_.rows(); ++row) {
        if (joint_of_[row] != joint_of_[one.row] || is_taken_[row] || !MayChange(row)) continue;
        // of volume, squared
        const double gain =
            onto.T(row, k) * onto.T(row, k) + left_.row(row).squaredNorm() * onto.inverse[k];
        if (!(gain > most * (1.0 + 1e-6))) continue;
        most = gain;
        out = &one;
        in = row;
      }
    }
    if (out == nullptr) return;
    out->row = in;
    TakeAgain(std::vector<Taken>(order_));
  }
}

std::vector<Released> RowChoice::BeyondQuotas(const std::vector<int>& joints) const {
  std::vector<Released> released;
  for (std::size_t j = 0; j < quotas_.size(); ++j) {
    Released out{joints[j], {}};
    for (int i = quotas_[j].fixed; i < quotas_[j].count; ++i) {
      const auto row = static_cast<std::size_t>(quotas_[j].first + i);
      if (is_in_quota_[row]) continue;
      out.directions.push_back(i - quotas_[j].fixed);
      if (is_taken_[row]) out.moving.push_back(i - quotas_[j].fixed);
    }
    if (!out.directions.empty()) released.push_back(std::move(out));
  }
  return released;
}

}  // namespace loopbench
