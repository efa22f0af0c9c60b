// What decides how far a direction is enforced: the distance from a singular position, not the
// number of loops; and no eigenvalue that is round-off.
#include "mechanism/loops/direction_weights.h"

#include "mechanism/algebra/symmetric_eigen.h"
#include "mechanism/loops/scaled_loops.h"
#include "tests/contract/comparison.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::direction_weights_test {

DirectionWeights<double> WeightsOf(MatrixX<double> X, std::span<const int> rows) {
  DirectionWeights<double> weights(rows);
  const Eigen::VectorXd lambda = SymmetricEigenvalues(X);
  MatrixX<double> work = X;
  weights.FindPivots(X, work);
  weights.Weigh(lambda);
  return weights;
}

/// The scaled geometric response of a row of windows, `distance` [rad] from all bars in line.
MatrixX<double> ResponseOfLadder(int windows, double distance, std::vector<int>* rows) {
  const testing::Assembled<> at(Ladder(windows, distance, 0.0));
  *rows = at.mechanism.RowsOfConstraints();
  const MatrixX<double> B = ScaleLoops(at.kinematics).B;
  return B * B.transpose();
}

class WindowsTest : public ::testing::TestWithParam<int> {};

/// The least eigenvalue falls like one over the square of their number, in the best position too.
/// The pivots that vanish are 0.33 to 1 times the square of the distance whatever the number: at
/// least 8 theta at 1e-3, at most theta / 40 at 3e-5.
TEST_P(WindowsTest, RegularizeWhereOneWindowDoes) {
  std::vector<int> rows;
  const auto weights_at = [&](double distance) {
    const MatrixX<double> X = ResponseOfLadder(GetParam(), distance, &rows);
    return WeightsOf(X, rows);
  };
  EXPECT_EQ(weights_at(M_PI_2).smallest(), 1.0);
  EXPECT_GT(weights_at(1e-3).smallest(), 0.999);
  EXPECT_EQ(weights_at(3e-5).rank(), GetParam());  // of two rows for each window
  EXPECT_EQ(weights_at(0.0).rank(), GetParam());
}
INSTANTIATE_TEST_SUITE_P(Ladders, WindowsTest, ::testing::Values(1, 2, 5, 10, 40, 100));

TEST(DirectionWeightsTest, OneJointIsWeighedByItsEigenvalues) {
  const int rows[] = {3};
  Eigen::Vector3d lambda(1e-8, 4e-8, 1.0);
  const DirectionWeights<double> weights = WeightsOf(lambda.asDiagonal(), rows);
  for (int i = 0; i < 3; ++i) {
    const double ratio = lambda[i] / DirectionWeights<double>::kTheta;
    EXPECT_DOUBLE_EQ(weights[i], -std::expm1(-ratio * ratio));
  }
  EXPECT_EQ(weights.rank(), 2);
}

/// Kahan's matrix R, with a pivot of at least 1e-5 in R^T R and an eigenvalue of 3e-16 of the
/// largest. Larger ones lose this pivot to rounding.
TEST(DirectionWeightsTest, AnEigenvalueThatHidesBehindPivotsIsLeftOut) {
  constexpr int kSize = 24;
  const double s = std::pow(1e-5, 0.5 / (kSize - 1)), c = std::sqrt(1.0 - s * s);
  MatrixX<double> R = MatrixX<double>::Identity(kSize, kSize);
  for (int i = 0; i < kSize; ++i) {
    R.row(i).tail(kSize - 1 - i).setConstant(-c);
    R.row(i) *= std::pow(s, i);
  }
  const MatrixX<double> X = R.transpose() * R;
  const std::vector<int> rows(kSize, 1);
  const Eigen::VectorXd lambda = SymmetricEigenvalues(X);
  ASSERT_LT(lambda[0], 1e-12 * lambda[kSize - 1]);
  ASSERT_GT(X.llt().matrixLLT().diagonal().cwiseAbs2().minCoeff(), 0.9e-5);
  const DirectionWeights<double> weights = WeightsOf(X, rows);
  EXPECT_LT(weights.smallest(), 0.5);
  EXPECT_EQ(weights.rank(), kSize - 1);
}

TEST(DirectionWeightsTest, WhatIsNotFiniteIsLeftOut) {
  MatrixX<double> X = MatrixX<double>::Identity(4, 4);
  X(2, 1) = X(1, 2) = std::numeric_limits<double>::quiet_NaN();
  const int rows[] = {2, 2};
  DirectionWeights<double> weights(rows);
  MatrixX<double> work = X;
  weights.FindPivots(X, work);
  weights.Weigh(Eigen::VectorXd::Constant(4, std::numeric_limits<double>::quiet_NaN()));
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(weights.IsLeftOut(i));
}

}  // namespace loopbench::direction_weights_test
