#include "reduction/sparse_lu.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace loopbench::reduction {

namespace {

/// Rows equal up to rounding, as for equal bodies, are taken in order: each has a slightly smaller
/// weight than the one before, by less than a useful difference.
constexpr double kFromFirstToLast = 1e-3;

/// Column numbers in the order of their elimination.
std::vector<int> Order(int num_rows, const std::vector<int>& start, const std::vector<int>& rows) {
  const int columns = static_cast<int>(start.size()) - 1;
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < columns; ++k) {
    for (int e = start[k]; e < start[k + 1]; ++e) entries.emplace_back(rows[e], k, 1.0);
  }
  Eigen::SparseMatrix<double> A(num_rows, columns);
  A.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> place;
  Eigen::COLAMDOrdering<int>()(A, place);
  std::vector<int> order(columns);
  for (int k = 0; k < columns; ++k) order[place.indices()[k]] = k;
  return order;
}

}  // namespace

SparseLu::SparseLu(int num_rows, std::vector<int> start, std::vector<int> rows)
    : start_(std::move(start)),
      rows_(std::move(rows)),
      order_(Order(num_rows, start_, rows_)),
      L_start_(columns() + 1, 0),
      U_start_(columns() + 1, 0),
      diagonal_(columns(), 0.0),
      pivots_(columns(), -1),
      step_of_row_(num_rows, -1),
      x_(num_rows, 0.0),
      weights_(num_rows),
      marks_(num_rows, 0) {
  for (int i = 0; i < num_rows; ++i) weights_[i] = 1.0 - kFromFirstToLast * i / num_rows;
  for (std::vector<int>* list : {&reached_, &open_, &path_, &next_}) list->reserve(num_rows);
}

/// Visits depth first from `row`, without recursion: its column of L, and the columns it reaches.
void SparseLu::Visit(int row) {
  if (marks_[row] == mark_) return;
  marks_[row] = mark_;
  if (step_of_row_[row] < 0) {
    open_.push_back(row);
    return;
  }
  path_.assign(1, step_of_row_[row]);
  next_.assign(1, L_start_[path_[0]] + 1);
  while (!path_.empty()) {
    const int step = path_.back();
    int& at = next_.back();
    int deeper = -1;
    for (; deeper < 0 && at < L_start_[step + 1]; ++at) {
      const int reached = L_[at].index;
      if (marks_[reached] == mark_) continue;
      marks_[reached] = mark_;
      if (step_of_row_[reached] < 0) {
        open_.push_back(reached);
      } else {
        deeper = step_of_row_[reached];
      }
    }
    if (deeper >= 0) {
      path_.push_back(deeper);
      next_.push_back(L_start_[deeper] + 1);
    } else {
      reached_.push_back(step);
      path_.pop_back();
      next_.pop_back();
    }
  }
}

void SparseLu::Reach(int column) {
  ++mark_;
  reached_.clear();
  open_.clear();
  for (int e = start_[column]; e < start_[column + 1]; ++e) Visit(rows_[e]);
  // a column precedes the columns that it reaches
  std::ranges::reverse(reached_);
}

void SparseLu::SetL(int k) {
  L_.resize(L_start_[k]);
  for (const int row : open_) L_.push_back({row});
  L_start_[k + 1] = static_cast<int>(L_.size());
}

void SparseLu::SetU(int k) {
  U_.resize(U_start_[k]);
  for (const int step : reached_) U_.push_back({step});
  U_start_[k + 1] = static_cast<int>(U_.size());
}

int SparseLu::Largest(int k, std::span<const char> barred) const {
  int place = -1;
  double best = 0.0;
  for (int e = L_start_[k]; e < L_start_[k + 1]; ++e) {
    const int row = L_[e].index;
    if (!barred.empty() && barred[row]) continue;
    const double size = weights_[row] * std::abs(x_[row]);
    if (size > best || (size == best && place >= 0 && row < L_[place].index)) {
      best = size;
      place = e;
    }
  }
  return place;
}

bool SparseLu::Factor(std::span<const double> values, std::span<const char> barred) {
  std::ranges::fill(step_of_row_, -1);
  rcond_ = operations_ = 0.0;
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (int k = 0; k < columns(); ++k) {
    const int column = order_[k];
    if (k >= num_known_) {
      Reach(column);
      SetU(k);
      SetL(k);
    }
    for (int e = start_[column]; e < start_[column + 1]; ++e) {
      x_[rows_[e]] = values[e];
      most = std::max(most, std::abs(values[e]));
    }
    for (int e = U_start_[k]; e < U_start_[k + 1]; ++e) {
      const int step = U_[e].index, first = L_start_[step] + 1;
      const double u = U_[e].value = std::exchange(x_[pivots_[step]], 0.0);
      for (int l = first; l < L_start_[step + 1]; ++l) x_[L_[l].index] -= L_[l].value * u;
      operations_ += L_start_[step + 1] - first;
    }
    int place = Largest(k, barred);
    if (k < num_known_ && (place < 0 || L_[place].index != pivots_[k])) {
      num_known_ = k;
      Reach(column);
      SetL(k);  // in its order without a pivot
      place = Largest(k, barred);
    }
    const int pivot = place < 0 ? -1 : L_[place].index;
    const double value = pivot < 0 ? 0.0 : x_[pivot];
    if (place >= 0) std::rotate(&L_[L_start_[k]], &L_[place], &L_[place] + 1);
    for (int e = L_start_[k]; e < L_start_[k + 1]; ++e) {
      L_[e].value = std::exchange(x_[L_[e].index], 0.0) / value;
    }
    if (pivot < 0 || !std::isfinite(value)) return false;
    operations_ += L_start_[k + 1] - L_start_[k];
    pivots_[k] = pivot;
    step_of_row_[pivot] = k;
    diagonal_[k] = value;
    num_known_ = std::max(num_known_, k + 1);
    least = std::min(least, std::abs(value));
    most = std::max(most, std::abs(value));
  }
  if (!has_room_) {
    has_room_ = true;
    L_.reserve(2 * L_.size() + 64);
    U_.reserve(2 * U_.size() + 64);
  }
  rcond_ = columns() == 0 ? 1.0 : least / most;
  return true;
}

void SparseLu::SolveTransposed(double* r, double* x) const {
  // U^T y = Q^T r, y of step k instead of r's column order_[k]
  for (int k = 0; k < columns(); ++k) {
    double y = r[order_[k]];
    for (int e = U_start_[k]; e < U_start_[k + 1]; ++e) y -= U_[e].value * r[order_[U_[e].index]];
    r[order_[k]] = y / diagonal_[k];
  }
  // L_D^T x = y, from the last pivot to the first
  for (int k = columns() - 1; k >= 0; --k) {
    double y = r[order_[k]];
    for (int e = L_start_[k] + 1; e < L_start_[k + 1]; ++e) {
      if (IsPivot(L_[e].index)) y -= L_[e].value * x[L_[e].index];
    }
    x[pivots_[k]] = y;
  }
}

void SparseLu::Solve(double* y, double* x) const {
  for (int k = 0; k < columns(); ++k) {
    const double w = y[pivots_[k]];
    x[order_[k]] = w;
    for (int e = L_start_[k] + 1; e < L_start_[k + 1]; ++e) y[L_[e].index] -= L_[e].value * w;
  }
  for (int k = columns() - 1; k >= 0; --k) {
    const double z = x[order_[k]] /= diagonal_[k];
    for (int e = U_start_[k]; e < U_start_[k + 1]; ++e) x[order_[U_[e].index]] -= U_[e].value * z;
  }
}

/// B_D = -L_D^-T L_I^T, from the last pivot to the first.
void SparseLu::Dependencies(std::span<const int> place, double* B, int count) const {
  const auto row_of = [&](int row) { return B + static_cast<std::ptrdiff_t>(row) * count; };
  for (int k = columns() - 1; k >= 0; --k) {
    double* b = row_of(pivots_[k]);
    std::fill_n(b, count, 0.0);
    for (int e = L_start_[k] + 1; e < L_start_[k + 1]; ++e) {
      const auto& [row, value] = L_[e];
      if (!IsPivot(row)) {
        b[place[row]] -= value;
        continue;
      }
      const double* from = row_of(row);
      for (int i = 0; i < count; ++i) b[i] -= value * from[i];
    }
  }
}

}  // namespace loopbench::reduction
