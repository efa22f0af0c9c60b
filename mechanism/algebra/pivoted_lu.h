// LU factors with row interchanges, P A = L U. Up to kSmallLu rows by plain loops: Eigen's blocks
// take twice to four times as long there. Larger matrices use Eigen.
#pragma once

#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/lanes.h"

namespace loopbench {

inline constexpr int kSmallLu = 48;

template <class S>
class PivotedLu {
 public:
  explicit PivotedLu(int size = 0) : size_(size), swaps_(size), inverses_(size, S(0)) {
    if (size > kSmallLu) {
      large_ = Eigen::PartialPivLU<MatrixX<S>>(size);
      permuted_.setZero(size);
    } else {
      small_.setZero(size, size);
    }
  }

  /// `A` has the size of the constructor. No allocation.
  void Factor(const MatrixX<S>& A) {
    if (size_ > kSmallLu) {
      large_.compute(A);
      return;
    }
    small_ = A;
    IsWide() ? Eliminate<true>() : Eliminate<false>();
  }
  /// The least pivot over the largest, each times its `scale` if there is one.
  S PivotRatio(const VectorX<S>* scale = nullptr) const {
    using std::abs;
    using std::max;
    using std::min;
    S least(0), most(0);
    for (int k = 0; k < size_; ++k) {
      S pivot = abs(size_ > kSmallLu ? large_.matrixLU()(k, k) : small_(k, k));
      if (scale != nullptr) pivot *= (*scale)[k];
      least = k == 0 ? pivot : min(least, pivot);
      most = k == 0 ? pivot : max(most, pivot);
    }
    return least / most;
  }

  /// x := A^-1 x, each column. No allocation.
  void Solve(Eigen::Ref<MatrixX<S>> x) {
    if (size_ > kSmallLu) {
      for (Eigen::Index column = 0; column < x.cols(); ++column) {
        permuted_.noalias() = large_.permutationP() * x.col(column);  // in place it would allocate
        x.col(column) = permuted_;
      }
      large_.matrixLU().template triangularView<Eigen::UnitLower>().solveInPlace(x);
      large_.matrixLU().template triangularView<Eigen::Upper>().solveInPlace(x);
      return;
    }
    for (Eigen::Index column = 0; column < x.cols(); ++column) {
      IsWide() ? SolveSmall<true>(x.col(column).data()) : SolveSmall<false>(x.col(column).data());
    }
  }
  /// x := A^-T x. No allocation.
  void SolveTransposed(Eigen::Ref<VectorX<S>> x) {
    if (size_ > kSmallLu) {
      large_.matrixLU().template triangularView<Eigen::Upper>().transpose().solveInPlace(x);
      large_.matrixLU().template triangularView<Eigen::UnitLower>().transpose().solveInPlace(x);
      permuted_.noalias() = large_.permutationP().transpose() * x;
      x = permuted_;
      return;
    }
    for (int k = 0; k < size_; ++k) {
      for (int i = 0; i < k; ++i) x[k] -= small_(i, k) * x[i];
      x[k] *= inverses_[k];
    }
    for (int k = size_ - 1; k >= 0; --k) {
      for (int i = k + 1; i < size_; ++i) x[k] -= small_(i, k) * x[i];
    }
    for (int k = size_ - 1; k >= 0; --k) std::swap(x[k], x[swaps_[k]]);
  }

 private:
  /// Returns true if lanes cost less than plain loops.
  bool IsWide() const { return std::is_same_v<S, double> && size_ >= 2 * kLanes; }
  template <bool kWide>
  void Eliminate() {
    for (int k = 0; k < size_; ++k) {
      swaps_[k] = LargestFrom(k);
      if (swaps_[k] != k) {
        for (int j = 0; j < size_; ++j) std::swap(small_(k, j), small_(swaps_[k], j));
      }
      inverses_[k] = S(1) / small_(k, k);
      S* L = &small_(0, k);
      for (int i = k + 1; i < size_; ++i) L[i] *= inverses_[k];
      for (int j = k + 1; j < size_; ++j) {
        S* column = &small_(0, j);
        if constexpr (std::is_same_v<S, double>) {
          if (column[k] == 0.0) continue;  // in absolute coordinates most numbers are zero
        }
        Subtract<kWide>(L, column[k], k + 1, size_, column);
      }
    }
  }
  /// y -= a times a factor, for numbers from `first` to before `end`; with the same bits in lanes.
  template <bool kWide>
  static void Subtract(const S* a, const S& factor, int first, int end, S* y) {
    int i = first;
    if constexpr (kWide && std::is_same_v<S, double>) {
      for (const S same = factor; i + kLanes <= end; i += kLanes) {
        Store(Load<Lanes>(y + i) - Load<Lanes>(a + i) * same, y + i);
      }
    }
    for (; i < end; ++i) y[i] -= a[i] * factor;
  }
  int LargestFrom(int k) const {
    using std::abs;
    int row = k;
    for (int i = k + 1; i < size_; ++i) {
      if (abs(small_(i, k)) > abs(small_(row, k))) row = i;
    }
    return row;
  }
  template <bool kWide>
  void SolveSmall(S* x) const {
    for (int k = 0; k < size_; ++k) std::swap(x[k], x[swaps_[k]]);
    for (int k = 0; k < size_; ++k) {
      const S* L = &small_(0, k);
      if constexpr (kWide) {
        if (x[k] == S(0)) continue;  // as above
      }
      Subtract<kWide>(L, x[k], k + 1, size_, x);
    }
    for (int k = size_ - 1; k >= 0; --k) {
      const S* U = &small_(0, k);
      x[k] *= inverses_[k];
      if constexpr (kWide) {
        if (x[k] == S(0)) continue;
      }
      Subtract<kWide>(U, x[k], 0, k, x);
    }
  }

  int size_;
  std::vector<int> swaps_;
  std::vector<S> inverses_;  ///< of the pivots
  MatrixX<S> small_;
  Eigen::PartialPivLU<MatrixX<S>> large_;
  VectorX<S> permuted_;
};

}  // namespace loopbench
