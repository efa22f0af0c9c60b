#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>

#include "harness/run/timing.h"

namespace loopbench::harness {
namespace {

constexpr int kRows = 12, kNumbers = 4096;  // of doubles: 32 KiB, a first cache
constexpr int kFactorings = 12, kPasses = 4;

// The same instructions at the same offsets of cache lines in every build: either changes the time
// of a loop by a fifth at equal machine speed. CMakeLists.txt aligns the loops.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define LOOPBENCH_ONE_CODE \
  [[gnu::noinline, gnu::aligned(64), gnu::target("arch=x86-64,tune=generic")]]
#else
#define LOOPBENCH_ONE_CODE [[gnu::noinline, gnu::aligned(64)]]
#endif

/// Computes L of A = L L^T in place of A.
LOOPBENCH_ONE_CODE void Factor(double (*A)[kRows]) {
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kRows; ++j) A[i][j] = 1.0 / (1 + i + j) + (i == j ? 20.0 : 0.0);
  }
  for (int k = 0; k < kRows; ++k) {
    A[k][k] = std::sqrt(A[k][k]);
    for (int i = k + 1; i < kRows; ++i) {
      A[i][k] /= A[k][k];
      for (int j = k + 1; j <= i; ++j) A[i][j] -= A[i][k] * A[j][k];
    }
  }
}

/// Means of numbers near 1, which stay there.
LOOPBENCH_ONE_CODE void Pass(double* numbers) {
  for (int i = 0; i + 8 < kNumbers; ++i) numbers[i] = 0.5 * numbers[i] + 0.5 * numbers[i + 8];
}

std::atomic<double> alone = std::numeric_limits<double>::infinity();

}  // namespace

double CalibrationNs() {
  using Clock = std::chrono::steady_clock;
  alignas(64) static thread_local double matrix[kRows][kRows];
  alignas(64) static thread_local double numbers[kNumbers];
  if (numbers[0] == 0.0) std::fill_n(numbers, kNumbers, 1.0);
  double least = std::numeric_limits<double>::infinity();
  for (int times = 0; times < 3; ++times) {
    const Clock::time_point begin = Clock::now();
    for (int i = 0; i < kFactorings; ++i) Factor(matrix);
    for (int i = 0; i < kPasses; ++i) Pass(numbers);
    least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
  }
  volatile double kept = matrix[1][0] + numbers[0];  // or there would be nothing to do
  static_cast<void>(kept);
  for (double known = alone; least < known && !alone.compare_exchange_weak(known, least);) {
  }
  return least;
}

double CalibrationBaselineNs() { return alone; }

}  // namespace loopbench::harness
