// Sparse least-squares problems against dense orthogonal factors.
#include "mechanism/start/least_squares.h"

#include "mechanism/algebra/decompositions.h"
#include "tests/standard.h"

namespace loopbench::least_squares_test {

/// Rows of five entries each, in a band as loops of a ladder have them; beyond what is called small
/// from 300 rows on. The last `repeated` rows are sums of two earlier ones.
SparseRows Band(int rows, int repeated) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, 2 * rows);
  for (int r = 0; r < rows - repeated; ++r) {
    J(r, 2 * r) = 2.0;
    for (int k = 1; k < 5; ++k) J(r, std::min(2 * r + k, 2 * rows - 1)) = number(random);
  }
  for (int r = rows - repeated; r < rows; ++r) J.row(r) = J.row(r - repeated) + J.row(0);
  return J.sparseView();
}

Eigen::VectorXd Right(Eigen::Index rows) {
  return Eigen::VectorXd::LinSpaced(rows, -1.0, 2.0).array().sin();
}

/// Entries of size one, and singular values from some 0.5 to 5 where rows are independent: two
/// backward stable solutions differ by some eps times the square of that ratio and the length of
/// sums.
constexpr double kBound = 1000 * kEps;

TEST(LeastSquaresTest, SmallestIsTheSmallestSolution) {
  for (const int rows : {20, 400}) {
    const SparseRows J = Band(rows, 0);
    const Eigen::VectorXd r = Right(rows);
    const Eigen::VectorXd d = LeastSquares(J, "band").Smallest(r);
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> dense{Eigen::MatrixXd(J)};
    const Eigen::VectorXd expected = dense.solve(r);
    EXPECT_LE((d - expected).norm(), kBound * expected.norm()) << rows;
    EXPECT_LE((J * d - r).norm(), kBound * r.norm()) << rows;
  }
}

TEST(LeastSquaresTest, DependentRowsAreMetAsWellAsCanBe) {
  for (const int rows : {20, 400}) {
    const SparseRows J = Band(rows, 3);
    const Eigen::VectorXd r = Right(rows);  // not in the range of J
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> dense{Eigen::MatrixXd(J)};
    ASSERT_EQ(dense.rank(), rows - 3);
    const Eigen::VectorXd expected = dense.solve(r);
    const Eigen::VectorXd d = LeastSquares(J, "band").Smallest(r);
    EXPECT_LE((d - expected).norm(), kBound * expected.norm()) << rows;
    EXPECT_GT((J * d - r).norm(), 1e-3 * r.norm()) << rows;
  }
}

/// Against the normal equations of the whole, which are well conditioned here.
TEST(LeastSquaresTest, DampedMinimisesBoth) {
  for (const int rows : {20, 400}) {
    for (const int repeated : {0, 3}) {
      const SparseRows J = Band(rows, repeated);
      const Eigen::VectorXd r = Right(rows);
      for (const double damping : {1.0, 0.1}) {
        const Eigen::MatrixXd dense = J;
        Eigen::MatrixXd A = dense.transpose() * dense;
        A.diagonal().array() += damping * damping;
        const Eigen::VectorXd right = dense.transpose() * r;
        const Eigen::VectorXd expected = Eigen::LLT<Eigen::MatrixXd>(A).solve(right);
        const Eigen::VectorXd d = LeastSquares(J, "band").Damped(r, damping);
        EXPECT_LE((d - expected).norm(), kBound / (damping * damping) * expected.norm())
            << rows << ' ' << repeated << ' ' << damping;
      }
    }
  }
}

}  // namespace loopbench::least_squares_test
