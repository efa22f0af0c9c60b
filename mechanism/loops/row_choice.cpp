#include "mechanism/loops/row_choice.h"

#include <algorithm>
#include <utility>

namespace loopbench {

RowChoice::RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas, int total)
    : left_(rows),
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
  is_in_quota_ = is_taken_;
  for (Quota& quota : quotas_) quota.keep = quota.count;
  TakeBest(total);
}

void RowChoice::Take(std::size_t joint, int row) {
  is_taken_[row] = true;
  ++taken_[joint];
  ++num_taken_;
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
  while (num_taken_ < total) {
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
