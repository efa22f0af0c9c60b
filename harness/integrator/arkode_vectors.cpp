#include "harness/integrator/arkode_vectors.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace loopbench::harness {
namespace {

// Debian's library goes through memory once per term; these give the same bits (same order of
// additions) in one pass.
void Scale(sunrealtype c, N_Vector x, N_Vector z) {
  const std::span<double> from = Span(x), to = Span(z);
  if (c == 1) {
    std::copy(from.begin(), from.end(), to.begin());
  } else {
    std::transform(from.begin(), from.end(), to.begin(), [c](double v) { return c * v; });
  }
}

// One block of a linear combination, small enough to stay in registers.
template <size_t kWidth>
void CombineBlock(size_t first, int count, const sunrealtype* c, const N_Vector* x, double* to) {
  std::array<double, kWidth> sum{};
  for (int k = 0; k < count; ++k) {
    const double* from = NV_DATA_S(x[k]) + first;
    for (size_t j = 0; j < kWidth; ++j) {
      sum[j] += c[k] * from[j];
    }
  }
  std::copy(sum.begin(), sum.end(), to + first);
}

int LinearCombination(int count, sunrealtype* c, N_Vector* x, N_Vector z) {
  const std::span<double> to = Span(z);
  size_t i = 0;
  for (; i + 8 <= to.size(); i += 8) {
    CombineBlock<8>(i, count, c, x, to.data());
  }
  for (; i + 2 <= to.size(); i += 2) {
    CombineBlock<2>(i, count, c, x, to.data());
  }
  if (i < to.size()) {
    CombineBlock<1>(i, count, c, x, to.data());
  }
  return 0;
}

// How many components the norms see: quadratures come last and have weight zero.
size_t Weighted(std::span<const double> weight) {
  size_t count = weight.size();
  while (count > 0 && weight[count - 1] == 0) {
    --count;
  }
  return count;
}

sunrealtype RmsNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  const size_t count = Weighted(weight);
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    const double term = v[i] * weight[i];
    sum += term * term;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

sunrealtype MaxNorm(N_Vector x, N_Vector w) {
  const std::span<double> v = Span(x), weight = Span(w);
  const size_t count = Weighted(weight);
  double norm = 0;
  for (size_t i = 0; i < count; ++i) {
    norm = std::max(norm, std::abs(v[i]) * weight[i]);
  }
  return norm;
}

}  // namespace

void UseOurOperations(N_Vector v, bool max_norm) {
  v->ops->nvscale = Scale;
  v->ops->nvlinearcombination = LinearCombination;
  v->ops->nvwrmsnorm = max_norm ? MaxNorm : RmsNorm;
}

}  // namespace loopbench::harness
