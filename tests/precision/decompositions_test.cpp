// Singular values and vectors, eigenvalues and eigenvectors of symmetric matrices, in every scalar.
#include "harness/precision/float128.h"
#include "mechanism/algebra/singular_values.h"
#include "mechanism/algebra/space.h"
#include "mechanism/algebra/symmetric_eigen.h"
#include "tests/standard.h"

namespace loopbench {
namespace {

using Scalars = ::testing::Types<float, double, long double, Float128>;

template <class S>
MatrixX<S> Random(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatrixX<S> A(rows, columns);
  for (Eigen::Index i = 0; i < A.size(); ++i) A.data()[i] = S(uniform(generator));
  return A;
}

/// By coefficients: Eigen's products of so many scalars take the compiler half a minute.
template <class S>
MatrixX<S> Times(const MatrixX<S>& A, const MatrixX<S>& B) {
  MatrixX<S> product(A.rows(), B.cols());
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    for (Eigen::Index j = 0; j < B.cols(); ++j) {
      product(i, j) = S(0);
      for (Eigen::Index k = 0; k < A.cols(); ++k) product(i, j) += A(i, k) * B(k, j);
    }
  }
  return product;
}

template <class S>
MatrixX<S> Scaled(const S& factor, MatrixX<S> A) {
  for (Eigen::Index i = 0; i < A.size(); ++i) A.data()[i] *= factor;
  return A;
}

/// The largest entry of |A - B|.
template <class S>
double Distance(const MatrixX<S>& A, const MatrixX<S>& B) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < A.size(); ++i) {
    using std::abs;
    largest = std::max(largest, static_cast<double>(abs(A.data()[i] - B.data()[i])));
  }
  return largest;
}

/// How far A^T A is from the identity, in eps.
template <class S>
double Skewness(const MatrixX<S>& A) {
  return Distance<S>(Times<S>(A.transpose(), A), MatrixX<S>::Identity(A.cols(), A.cols())) /
         static_cast<double>(std::numeric_limits<S>::epsilon());
}

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

/// Entries of U go through n reflections and some 2 n steps, which turn each column twice. This
/// makes some 5 n roundings of numbers up to one; 8 (n + 1) bounds their sum without cancellation.
double Roundings(Eigen::Index n) { return 8.0 * static_cast<double>(n + 1); }

/// @return the eigenvalues
template <class S>
VectorX<S> ExpectEigenvectors(const MatrixX<S>& A) {
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
    const VectorX<S> lambda = ExpectEigenvectors<S>(WithEigenvalues<S>(expected));
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
  const VectorX<S> lambda = ExpectEigenvectors<S>(A);
  for (const int power : {-100, 100}) {  // a power of two: products of entries leave a float
    const S factor = S(std::ldexp(1.0, power));
    const VectorX<S> scaled = ExpectEigenvectors<S>(Scaled<S>(factor, A));
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
  const VectorX<S> lambda = ExpectEigenvectors<S>(A);
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
