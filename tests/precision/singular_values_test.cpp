// Singular values and vectors in every scalar.
#include "mechanism/algebra/singular_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/precision/float128.h"
#include "tests/precision/matrices.h"

namespace loopbench {
namespace {

/// Three to six sweeps of n rotations per column round each entry of U and V once each, and entries
/// of U diag(sigma) V^T - A are sums of n such errors: with random signs some sqrt(6 n) roundings
/// of numbers up to sigma_1, of which 8 (n + 1) leaves room for sums that do not cancel.
template <class S>
void ExpectDecomposed(const MatrixX<S>& A) {
  SCOPED_TRACE(testing::Message() << A.rows() << " x " << A.cols());
  SingularValues<S> svd;
  svd.Compute(A);
  const Eigen::Index n = std::min(A.rows(), A.cols());
  const double roundings = 8.0 * (static_cast<double>(std::max(A.rows(), A.cols())) + 1.0);
  ASSERT_EQ(svd.sigma().size(), n);
  ASSERT_EQ(svd.U().rows(), A.rows());
  ASSERT_EQ(svd.U().cols(), A.rows());
  ASSERT_EQ(svd.V().rows(), A.cols());
  ASSERT_EQ(svd.V().cols(), A.cols());
  EXPECT_LE(Skewness<S>(svd.U()), roundings);
  EXPECT_LE(Skewness<S>(svd.V()), roundings);
  for (Eigen::Index i = 0; i < n; ++i) {
    EXPECT_TRUE(svd.sigma()[i] >= S(0)) << i;
    EXPECT_TRUE(i == 0 || svd.sigma()[i] <= svd.sigma()[i - 1]) << i;
  }
  if (n > 0) {
    MatrixX<S> sigma = MatrixX<S>::Zero(A.rows(), A.cols());
    for (Eigen::Index k = 0; k < n; ++k) sigma(k, k) = svd.sigma()[k];
    const MatrixX<S> product = Times<S>(Times<S>(svd.U(), sigma), svd.V().transpose());
    const double eps = static_cast<double>(std::numeric_limits<S>::epsilon());
    EXPECT_LE(Distance<S>(product, A), roundings * eps * static_cast<double>(svd.sigma()[0]));
  }
  SingularValues<S> values;
  values.ComputeValues(A);
  for (Eigen::Index i = 0; i < n; ++i) EXPECT_TRUE(values.sigma()[i] == svd.sigma()[i]) << i;
}

template <class S>
class SingularValuesTest : public ::testing::Test {};
using Scalars = ::testing::Types<float, double, long double, Float128>;
TYPED_TEST_SUITE(SingularValuesTest, Scalars);

TYPED_TEST(SingularValuesTest, DecomposeEveryShape) {
  using S = TypeParam;
  unsigned seed = 0;
  for (const auto& [rows, columns] : {std::pair{1, 1},
                                      {1, 6},
                                      {6, 1},
                                      {2, 2},
                                      {5, 5},
                                      {4, 9},
                                      {9, 4},
                                      {12, 13},
                                      {0, 3},
                                      {3, 0},
                                      {0, 0}}) {
    ExpectDecomposed<S>(Random<S>(rows, columns, ++seed));
  }
}

/// As constraints are: rows that repeat others, rows and columns of zeros, nothing but zeros.
TYPED_TEST(SingularValuesTest, DecomposeWhatHasLessRank) {
  using S = TypeParam;
  for (const auto& [rows, columns] : {std::pair{6, 6}, {5, 9}, {9, 5}}) {
    ExpectDecomposed<S>(MatrixX<S>::Zero(rows, columns));
    ExpectDecomposed<S>(MatrixX<S>::Ones(rows, columns));
    ExpectDecomposed<S>(MatrixX<S>::Identity(rows, columns));
    MatrixX<S> A = Random<S>(rows, columns, 7);
    A.row(2).setZero();
    A.col(1).setZero();
    A.row(4) = A.row(0);
    ExpectDecomposed<S>(A);
    const MatrixX<S> low = Times<S>(Random<S>(rows, 2, 8), Random<S>(2, columns, 9));
    ExpectDecomposed<S>(low);
    SingularValues<S> svd;
    svd.Compute(low);
    // the error of the product itself: two roundings of numbers below 2 in each of 81 entries
    EXPECT_TRUE(svd.sigma()[2] <= S(36) * std::numeric_limits<S>::epsilon());
    EXPECT_TRUE(svd.sigma()[1] > S(0.1));
  }
}

/// A = B D with the columns of D falling by a hundred each. Their order is not that of their sizes.
template <class S>
MatrixX<S> Graded() {
  // B is 4 1 + noise: well conditioned
  MatrixX<S> A = Random<S>(7, 5, 3);
  for (int j = 0; j < 5; ++j) {
    A(j, j) += S(4);
    for (int i = 0; i < 7; ++i) A(i, j) *= S(std::ldexp(1.0, -7 * ((3 * j) % 5)));
  }
  return A;
}

/// Each singular value has its own relative accuracy: the backward errors are small beside each
/// column. Some 5 columns of 7 numbers, times the condition of B (below 4).
TYPED_TEST(SingularValuesTest, OfGradedMatricesKeepTheirDigits) {
  using S = TypeParam;
  SingularValues<Float128> exact;
  exact.Compute(Graded<Float128>());
  SingularValues<S> tall, wide;
  tall.Compute(Graded<S>());
  wide.Compute(Graded<S>().transpose());
  for (int i = 0; i < 5; ++i) {
    const Float128 sigma = exact.sigma()[i];
    const Float128 allowed = 140 * sigma * Float128(std::numeric_limits<S>::epsilon());
    EXPECT_TRUE(abs(Float128(tall.sigma()[i]) - sigma) <= allowed) << i;
    EXPECT_TRUE(abs(Float128(wide.sigma()[i]) - sigma) <= allowed) << i;
  }
  EXPECT_LT(static_cast<double>(exact.sigma()[4] / exact.sigma()[0]), 1e-8);
}

/// The product of the singular values is the determinant, of a triangular matrix the product of its
/// diagonal: here 2^-40, all of it in the smallest of them.
TYPED_TEST(SingularValuesTest, MultiplyToTheDeterminant) {
  using S = TypeParam;
  MatrixX<S> A(3, 3);
  A << S(1), S(1), S(0), S(0), S(1), S(0), S(0), S(1), S(std::ldexp(1.0, -40));
  SingularValues<S> svd;
  svd.Compute(A);
  const S determinant = svd.sigma()[0] * svd.sigma()[1] * svd.sigma()[2];
  using std::abs;
  EXPECT_TRUE(abs(determinant / S(std::ldexp(1.0, -40)) - S(1)) <=
              S(72) * std::numeric_limits<S>::epsilon())
      << static_cast<double>(determinant);
}

/// Neither large nor small numbers matter whose squares are none.
TYPED_TEST(SingularValuesTest, HaveTheScaleOfTheirMatrix) {
  using S = TypeParam;
  const MatrixX<S> A = Random<S>(6, 4, 5);
  SingularValues<S> svd, scaled;
  svd.Compute(A);
  for (const double factor : {0x1p+100, 0x1p-100}) {
    scaled.Compute(Scaled<S>(S(factor), A));
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(scaled.sigma()[i] == S(factor) * svd.sigma()[i]) << i;
    ExpectDecomposed<S>(Scaled<S>(S(factor), A));
  }
}

TYPED_TEST(SingularValuesTest, OfTwoByTwoAreKnown) {
  using S = TypeParam;
  // U and V turn by angles with rational sines and cosines; sigma = 2, 1/2
  MatrixX<S> U(2, 2), V(2, 2);
  U << S(3) / S(5), -S(4) / S(5), S(4) / S(5), S(3) / S(5);
  V << S(5) / S(13), -S(12) / S(13), S(12) / S(13), S(5) / S(13);
  MatrixX<S> sigma(2, 2);
  sigma << S(2), S(0), S(0), S(1) / S(2);
  SingularValues<S> svd;
  svd.Compute(Times<S>(Times<S>(U, sigma), V.transpose()));
  const double eps = static_cast<double>(std::numeric_limits<S>::epsilon());
  const MatrixX<S> in_U = Times<S>(svd.U().transpose(), U), in_V = Times<S>(svd.V().transpose(), V);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(static_cast<double>((svd.sigma()[i] - sigma(i, i)) / S(eps)), 0.0, 8.0);
    // vectors up to the sign that a pair of them shares
    EXPECT_NEAR(static_cast<double>((in_U(i, i) * in_V(i, i) - S(1)) / S(eps)), 0.0, 16.0);
  }
}

TYPED_TEST(SingularValuesTest, OfWhatIsNotFiniteAreNot) {
  using S = TypeParam;
  using std::isfinite;
  MatrixX<S> A = Random<S>(4, 3, 5);
  for (const S bad : {std::numeric_limits<S>::quiet_NaN(), std::numeric_limits<S>::infinity()}) {
    A(1, 1) = bad;
    SingularValues<S> svd;
    svd.Compute(A);
    EXPECT_FALSE(isfinite(svd.sigma()[0]) && isfinite(svd.sigma()[1]) && isfinite(svd.sigma()[2]));
  }
}

}  // namespace
}  // namespace loopbench
