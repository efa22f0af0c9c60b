// Eigenvalues and eigenvectors of symmetric matrices in every scalar.
#include "mechanism/algebra/symmetric_eigen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "harness/precision/float128.h"
#include "tests/precision/matrices.h"

namespace loopbench {
namespace {

/// Q diag(lambda) Q^T for a Q of some reflections. Its own rounding is some eps of the largest.
template <class S>
MatrixX<S> WithEigenvalues(const std::vector<double>& lambda) {
  const auto n = static_cast<Eigen::Index>(lambda.size());
  MatrixX<S> A = MatrixX<S>::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) A(i, i) = S(lambda[static_cast<std::size_t>(i)]);
  for (unsigned seed = 0; seed < 3; ++seed) {
    const MatrixX<S> v = Random<S>(n, 1, seed);
    S square = S(0);
    for (Eigen::Index i = 0; i < n; ++i) square += v(i, 0) * v(i, 0);
    MatrixX<S> H = MatrixX<S>::Identity(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) H(i, j) -= 2 * v(i, 0) * v(j, 0) / square;
    }
    A = Times<S>(Times<S>(H, A), H);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) A(j, i) = A(i, j);
  }
  return A;
}

/// Entries of U go through n reflections and some 2 n steps, which turn each column twice: sums
/// of some 5 n roundings of numbers up to one, of which 8 (n + 1) leaves room for sums that do not
/// cancel.
double Roundings(Eigen::Index n) { return 8.0 * static_cast<double>(n + 1); }

/// @return the eigenvalues
template <class S>
VectorX<S> ExpectDecomposed(const MatrixX<S>& A) {
  const Eigen::Index n = A.rows();
  SCOPED_TRACE(n);
  MatrixX<S> destroyed = A, U(n, n);
  VectorX<S> lambda(n);
  SymmetricEigen<S>(destroyed, U, lambda);
  EXPECT_LE(Skewness<S>(U), Roundings(n));
  MatrixX<S> diagonal = MatrixX<S>::Zero(n, n);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    diagonal(i, i) = lambda[i];
    largest = std::max(largest, std::abs(static_cast<double>(lambda[i])));
    EXPECT_TRUE(i == 0 || lambda[i] >= lambda[i - 1]) << i;
  }
  const MatrixX<S> product = Times<S>(Times<S>(U, diagonal), U.transpose());
  EXPECT_LE(Distance<S>(product, A),
            Roundings(n) * largest * static_cast<double>(std::numeric_limits<S>::epsilon()));
  return lambda;
}

template <class S>
class SymmetricEigenTest : public ::testing::Test {};
using Scalars = ::testing::Types<float, double, long double, Float128>;
TYPED_TEST_SUITE(SymmetricEigenTest, Scalars);

TYPED_TEST(SymmetricEigenTest, FindsTheEigenvaluesOfEverySpectrum) {
  using S = TypeParam;
  std::vector<std::vector<double>> spectra = {{}, {3.0}, {-1.0, 2.0}, {1.0, 1.0}, {0.0, 0.0, 0.0}};
  for (const int n : {3, 4, 5, 8, 21}) {
    std::vector<double> spread, graded, equal(n, 2.0), half_null, both_signs;
    for (int i = 0; i < n; ++i) {
      spread.push_back(0.1 + i);
      graded.push_back(std::pow(10.0, -i));
      half_null.push_back(2 * i < n ? 0.0 : 1.0 + i);
      both_signs.push_back(i - 0.4 * n);
    }
    for (const auto& spectrum : {spread, graded, equal, half_null, both_signs}) {
      spectra.push_back(spectrum);
    }
  }
  for (std::vector<double> expected : spectra) {
    const VectorX<S> lambda = ExpectDecomposed<S>(WithEigenvalues<S>(expected));
    std::ranges::sort(expected);
    double largest = 0.0;
    for (const double one : expected) largest = std::max(largest, std::abs(one));
    for (std::size_t i = 0; i < expected.size(); ++i) {
      // twice, for A itself is rounded, and once for a spectrum that a float has not
      EXPECT_NEAR(static_cast<double>(lambda[static_cast<Eigen::Index>(i)]), expected[i],
                  3.0 * Roundings(lambda.size()) * largest *
                      static_cast<double>(std::numeric_limits<S>::epsilon()));
    }
  }
}

TYPED_TEST(SymmetricEigenTest, HasTheSameDigitsAtEverySize) {
  using S = TypeParam;
  const MatrixX<S> A = WithEigenvalues<S>({-1.0, 1e-3, 0.5, 2.0, 2.0});
  const VectorX<S> lambda = ExpectDecomposed<S>(A);
  for (const int power : {-100, 100}) {  // a power of two: products of entries leave a float
    const S factor = S(std::ldexp(1.0, power));
    const VectorX<S> scaled = ExpectDecomposed<S>(Scaled<S>(factor, A));
    for (Eigen::Index i = 0; i < lambda.size(); ++i) {
      EXPECT_NEAR(static_cast<double>(scaled[i] / factor), static_cast<double>(lambda[i]),
                  Roundings(5) * static_cast<double>(std::numeric_limits<S>::epsilon()) * 2.0);
    }
  }
}

TYPED_TEST(SymmetricEigenTest, LeavesADiagonalAsItIs) {
  using S = TypeParam;
  MatrixX<S> A = MatrixX<S>::Zero(3, 3);
  A(0, 0) = S(3), A(1, 1) = S(-1), A(2, 2) = S(1) / S(4);
  const VectorX<S> lambda = ExpectDecomposed<S>(A);
  EXPECT_TRUE(lambda[0] == S(-1) && lambda[2] == S(3));
}

TYPED_TEST(SymmetricEigenTest, EndsWhereAnEntryIsNotFinite) {
  using S = TypeParam;
  for (const S bad : {std::numeric_limits<S>::quiet_NaN(), std::numeric_limits<S>::infinity()}) {
    MatrixX<S> A = WithEigenvalues<S>({1.0, 2.0, 3.0, 4.0}), U(4, 4);
    A(1, 2) = A(2, 1) = bad;
    VectorX<S> lambda(4);
    SymmetricEigen<S>(A, U, lambda);
    bool is_finite = true;
    for (Eigen::Index i = 0; i < 4; ++i) {
      is_finite = is_finite && lambda[i] - lambda[i] == S(0);
    }
    EXPECT_FALSE(is_finite);
  }
}

}  // namespace
}  // namespace loopbench
