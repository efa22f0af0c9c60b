#include "mechanism/loops/row_choice.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

namespace loopbench {

RowChoice::RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas, int total)
    : rows_(rows),
      left_(rows),
      quotas_(std::move(quotas)),
      is_taken_(static_cast<std::size_t>(rows.rows()), false),
      taken_(quotas_.size(), 0) {
  int in_quotas = 0;
  for (std::size_t j = 0; j < quotas_.size(); ++j) {
    const Quota& quota = quotas_[j];
    const int fixed = quota.keep == quota.count ? quota.count : quota.fixed;
    for (int i = 0; i < fixed; ++i) Take(j, quota.first + i);
    in_quotas += quota.keep;
  }
  TakeBest(std::min(in_quotas, total));
  Exchange();
  is_in_quota_ = is_taken_;
  for (Quota& quota : quotas_) quota.keep = quota.count;
  TakeBest(total);
}

void RowChoice::Take(std::size_t joint, int row) {
  is_taken_[row] = true;
  ++taken_[joint];
  order_.push_back({joint, row});
  const double norm = left_.row(row).norm();
  least_ = std::min(least_, norm);
  if (!(norm > 0.0)) return;
  const Eigen::RowVectorXd unit = left_.row(row) / norm;
  // twice: the remainder of nearly dependent rows must be orthogonal, too
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::VectorXd along = left_ * unit.transpose();
    left_.noalias() -= along * unit;
  }
}

void RowChoice::TakeBest(int total) {
  while (std::ssize(order_) < total) {
    double best = -1.0;
    std::size_t joint = 0;
    int row = -1;
    for (std::size_t j = 0; j < quotas_.size(); ++j) {
      if (taken_[j] >= quotas_[j].keep) continue;
      for (int r = quotas_[j].first; r < quotas_[j].first + quotas_[j].count; ++r) {
        if (is_taken_[r]) continue;
        // the first of equals, rounding aside, so that all formulations choose alike
        const double norm = left_.row(r).norm();
        if (row >= 0 && !(norm > best * (1.0 + 1e-6))) continue;
        best = norm;
        joint = j;
        row = r;
      }
    }
    if (row < 0) break;
    Take(joint, row);
  }
}

void RowChoice::Exchange() {
  constexpr double kGain = 2.0;
  const auto may_change = [&](std::size_t joint, int row) {
    const Quota& quota = quotas_[joint];
    return quota.keep < quota.count && row >= quota.first + quota.fixed;
  };
  for (Eigen::Index round = 0; round < rows_.rows() && !order_.empty(); ++round) {
    const auto size = static_cast<Eigen::Index>(order_.size());
    Eigen::MatrixXd taken(size, rows_.cols());
    for (Eigen::Index k = 0; k < size; ++k) taken.row(k) = rows_.row(order_[k].row);
    const Eigen::MatrixXd inverse =
        (taken * taken.transpose()).ldlt().solve(Eigen::MatrixXd::Identity(size, size));
    const Eigen::MatrixXd T = rows_ * taken.transpose() * inverse;
    double most = kGain * kGain;
    Taken* out = nullptr;
    int in = -1;
    for (Eigen::Index k = 0; k < size; ++k) {
      const std::size_t joint = order_[k].joint;
      if (!may_change(joint, order_[k].row)) continue;
      for (int row = quotas_[joint].first; row < quotas_[joint].first + quotas_[joint].count;
           ++row) {
        if (is_taken_[row] || !may_change(joint, row)) continue;
        const double rest = (rows_.row(row) - T.row(row) * taken).squaredNorm();
        const double gain = T(row, k) * T(row, k) + rest * inverse(k, k);  // of volume, squared
        if (!(gain > most)) continue;
        most = gain;
        out = &order_[k];
        in = row;
      }
    }
    if (out == nullptr) return;
    out->row = in;
    const std::vector<Taken> order = std::move(order_);
    order_.clear();
    left_ = rows_;
    is_taken_.assign(is_taken_.size(), false);
    taken_.assign(taken_.size(), 0);
    least_ = std::numeric_limits<double>::infinity();
    for (const Taken& one : order) Take(one.joint, one.row);
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
