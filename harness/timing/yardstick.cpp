#include "harness/timing/yardstick.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

namespace loopbench::harness {
namespace {

constexpr std::size_t kRows = 12, kNumbers = 4096;  // of doubles: 32 KiB, a first cache
constexpr int kFactorings = 12, kPasses = 4;

/// L of A = L L^T, in the place of A.
void Factor(double (*A)[kRows]) {
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t j = 0; j < kRows; ++j) {
      A[i][j] = 1.0 / static_cast<double>(1 + i + j) + (i == j ? 20.0 : 0.0);
    }
  }
  for (std::size_t k = 0; k < kRows; ++k) {
    A[k][k] = std::sqrt(A[k][k]);
    for (std::size_t i = k + 1; i < kRows; ++i) {
      A[i][k] /= A[k][k];
      for (std::size_t j = k + 1; j <= i; ++j) A[i][j] -= A[i][k] * A[j][k];
    }
  }
}

/// Means of numbers near 1, which stay there.
void Pass(std::vector<double>* numbers) {
  for (std::size_t i = 0; i + 8 < numbers->size(); ++i) {
    (*numbers)[i] = 0.5 * (*numbers)[i] + 0.5 * (*numbers)[i + 8];
  }
}

}  // namespace

double YardstickNs() {
  using Clock = std::chrono::steady_clock;
  static thread_local double matrix[kRows][kRows];
  static thread_local std::vector<double> numbers(kNumbers, 1.0);
  double least = std::numeric_limits<double>::infinity();
  for (int times = 0; times < 3; ++times) {
    const Clock::time_point begin = Clock::now();
    for (int i = 0; i < kFactorings; ++i) Factor(matrix);
    for (int i = 0; i < kPasses; ++i) Pass(&numbers);
    least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
  }
  volatile double kept = matrix[1][0] + numbers[0];  // or there would be nothing to do
  static_cast<void>(kept);
  return least;
}

}  // namespace loopbench::harness
