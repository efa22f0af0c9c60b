#include "mechanism/loops/row_choice.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace loopbench {

RowChoice::RowChoice(const Eigen::MatrixXd& rows, std::vector<Quota> quotas)
    : left_(rows),
      quotas_(std::move(quotas)),
      is_taken_(static_cast<std::size_t>(rows.rows()), false),
      taken_(quotas_.size(), 0) {}

void RowChoice::Take(std::size_t joint, int row) {
  is_taken_[row] = true;
  ++taken_[joint];
  ++num_taken_;
  const double norm = left_.row(row).norm();
  if (!(norm > 0.0)) return;
  const Eigen::RowVectorXd unit = left_.row(row) / norm;
  // twice: the remainder of nearly dependent rows must be orthogonal, too
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::VectorXd along = left_ * unit.transpose();
    left_.noalias() -= along * unit;
  }
}

void RowChoice::TakeFixed() {
  for (std::size_t j = 0; j < quotas_.size(); ++j) {
    const Quota& quota = quotas_[j];
    const int fixed = quota.keep == quota.count ? quota.count : quota.fixed;
    for (int i = 0; i < fixed; ++i) Take(j, quota.first + i);
  }
}

double RowChoice::TakeBest(int total, const std::function<bool(int)>& allowed) {
  double least = std::numeric_limits<double>::infinity();
  while (num_taken_ < total) {
    double best = -1.0;
    std::size_t joint = 0;
    int row = -1;
    for (std::size_t j = 0; j < quotas_.size(); ++j) {
      if (taken_[j] >= quotas_[j].keep) continue;
      for (int r = quotas_[j].first; r < quotas_[j].first + quotas_[j].count; ++r) {
        if (is_taken_[r] || !allowed(r)) continue;
        // the first of equals, rounding aside, so that all formulations choose alike
        const double norm = left_.row(r).norm();
        if (row >= 0 && !(norm > best * (1.0 + 1e-6))) continue;
        best = norm;
        joint = j;
        row = r;
      }
    }
    if (row < 0) break;
    least = std::min(least, best);
    Take(joint, row);
  }
  return least;
}

std::vector<Released> RowChoice::NotTaken(const std::vector<int>& joints) const {
  std::vector<Released> released;
  for (std::size_t j = 0; j < quotas_.size(); ++j) {
    Released out{joints[j], {}};
    for (int i = quotas_[j].fixed; i < quotas_[j].count; ++i) {
      if (!is_taken_[quotas_[j].first + i]) out.directions.push_back(i - quotas_[j].fixed);
    }
    if (!out.directions.empty()) released.push_back(std::move(out));
  }
  return released;
}

}  // namespace loopbench
