#include "harness/precision/one_step.h"

#include <algorithm>
#include <cmath>

#include "harness/precision/scalars.h"

namespace loopbench::harness {

namespace {

/// A rational number, rounded once.
struct Ratio {
  int numerator, denominator;
  template <class S>
  S In() const {
    return S(numerator) / S(denominator);
  }
};

// J. Dormand, P. Prince, A family of embedded Runge-Kutta formulae, 1980. The last row of A is the
// solution of order 5; E is that less the one of order 4.
constexpr Ratio kC[7] = {{0, 1}, {1, 5}, {3, 10}, {4, 5}, {8, 9}, {1, 1}, {1, 1}};
constexpr Ratio kA[7][6] = {{},
                            {{1, 5}},
                            {{3, 40}, {9, 40}},
                            {{44, 45}, {-56, 15}, {32, 9}},
                            {{19372, 6561}, {-25360, 2187}, {64448, 6561}, {-212, 729}},
                            {{9017, 3168}, {-355, 33}, {46732, 5247}, {49, 176}, {-5103, 18656}},
                            {{35, 384}, {0, 1}, {500, 1113}, {125, 192}, {-2187, 6784}, {11, 84}}};
constexpr Ratio kE[7] = {{71, 57600},      {0, 1},    {-71, 16695}, {71, 1920},
                         {-17253, 339200}, {22, 525}, {-1, 40}};

}  // namespace

template <class S>
OneStep<S>::OneStep(const Problem<S>& system, OneStepMethod method, int columns)
    : system_(system), method_(method), columns_(columns) {
  const std::size_t n = static_cast<std::size_t>(system.size);
  for (std::vector<S>* vector : {&y_new_, &error_, &stage_, &before_}) vector->assign(n, S(0));
  if (method == OneStepMethod::kDormandPrince) {
    for (std::vector<S>& k : k_) k.assign(n, S(0));
    f_new_.assign(n, S(0));
  } else {
    k_[0].assign(n, S(0));
    for (std::vector<S>& column : table_) column.assign(n, S(0));
  }
}

template <class S>
Outcome OneStep<S>::Evaluate(S t, const std::vector<S>& y, std::vector<S>& f) {
  using std::isfinite;
  ++evaluations_;
  const Outcome outcome = system_.derivative(t, y, f);
  if (outcome != Outcome::kFinished) return outcome;
  const bool finite = std::ranges::all_of(f, [](const S& v) { return isfinite(v); });
  return finite ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class S>
Outcome OneStep<S>::Attempt(S t, const std::vector<S>& y, const std::vector<S>& f, S h) {
  return method_ == OneStepMethod::kGragg ? Gragg(t, y, f, h) : DormandPrince(t, y, f, h);
}

template <class S>
Outcome OneStep<S>::DormandPrince(S t, const std::vector<S>& y, const std::vector<S>& f, S h) {
  k_[0] = f;
  for (int s = 1; s < kStages; ++s) {
    stage_ = y;
    for (int j = 0; j < s; ++j) {
      const S a = h * kA[s][j].template In<S>();
      for (std::size_t i = 0; i < y.size(); ++i) stage_[i] += a * k_[j][i];
    }
    const Outcome outcome = Evaluate(t + h * kC[s].template In<S>(), stage_, k_[s]);
    if (outcome != Outcome::kFinished) return outcome;
  }
  y_new_ = stage_;
  f_new_ = k_[kStages - 1];
  for (std::size_t i = 0; i < y.size(); ++i) {
    S sum = S(0);
    for (int s = 0; s < kStages; ++s) sum += kE[s].template In<S>() * k_[s][i];
    error_[i] = h * sum;
  }
  return Outcome::kFinished;
}

template <class S>
Outcome OneStep<S>::Midpoint(S t, const std::vector<S>& y, const std::vector<S>& f, S h, int n,
                             std::vector<S>& result) {
  const S step = h / S(n);
  before_ = y;
  result = y;
  for (std::size_t i = 0; i < y.size(); ++i) result[i] += step * f[i];
  for (int m = 1; m < n; ++m) {
    const Outcome outcome = Evaluate(t + S(m) * step, result, k_[0]);
    if (outcome != Outcome::kFinished) return outcome;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const S next = before_[i] + S(2) * step * k_[0][i];
      before_[i] = result[i];
      result[i] = next;
    }
  }
  return Outcome::kFinished;
}

/// An even number of substeps has an error in even powers of h: every column gains two orders,
///   T_j,k+1 = T_jk + (T_jk - T_j-1,k) / ((n_j / n_j-k-1)^2 - 1),  n_j = 2 (j + 1).
template <class S>
Outcome OneStep<S>::Gragg(S t, const std::vector<S>& y, const std::vector<S>& f, S h) {
  for (int j = 0; j < columns_; ++j) {
    const Outcome outcome = Midpoint(t, y, f, h, 2 * (j + 1), y_new_);
    if (outcome != Outcome::kFinished) return outcome;
    for (int k = 0; k < j; ++k) {
      const S ratio = S(j + 1) / S(j - k), weight = S(1) / (ratio * ratio - S(1));
      for (std::size_t i = 0; i < y.size(); ++i) {
        const S newer = y_new_[i];
        y_new_[i] += (newer - table_[k][i]) * weight;
        table_[k][i] = newer;
      }
    }
    table_[j] = y_new_;
  }
  for (std::size_t i = 0; i < y.size(); ++i) error_[i] = y_new_[i] - table_[columns_ - 2][i];
  return Outcome::kFinished;
}

template class OneStep<float>;
template class OneStep<double>;
template class OneStep<long double>;
template class OneStep<Float128>;

}  // namespace loopbench::harness
