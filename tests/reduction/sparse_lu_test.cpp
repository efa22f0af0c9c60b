// Factors of random sparse matrices against dense products and solves.
#include "reduction/sparse_lu.h"

#include "mechanism/algebra/factors.h"
#include "tests/contract/placed.h"
#include "tests/standard.h"

namespace loopbench::reduction::sparse_lu_test {

using testing::Random;
using testing::RandomNumbers;

/// A tall matrix with `per_column` entries in each column, by columns.
struct Sample {
  Sample(int rows, int columns, int per_column, std::uint64_t seed)
      : A(MatrixX<double>::Zero(rows, columns)) {
    Random random(seed);
    start.push_back(0);
    for (int k = 0; k < columns; ++k) {
      std::vector<int> chosen;
      while (static_cast<int>(chosen.size()) < per_column) {
        const int row = random.Below(rows);
        if (std::ranges::find(chosen, row) == chosen.end()) chosen.push_back(row);
      }
      for (const int row : chosen) Add(row, k, random.Uniform(-1.0, 1.0));
      start.push_back(static_cast<int>(index.size()));
    }
  }
  void Add(int row, int column, double value) {
    index.push_back(row);
    values.push_back(value);
    A(row, column) = value;
  }

  std::vector<int> start, index;
  std::vector<double> values;
  MatrixX<double> A;
};

/// Rows `rows` of A, in that order.
MatrixX<double> RowsOf(const MatrixX<double>& A, std::span<const int> rows) {
  MatrixX<double> chosen(rows.size(), A.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) chosen.row(i) = A.row(rows[i]);
  return chosen;
}

TEST(SparseLu, SolvesWithTheRowsThatItChose) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const int columns = 1 + static_cast<int>(seed), rows = columns + static_cast<int>(seed % 7);
    const Sample sample(rows, columns, std::min(columns, 3), seed);
    SparseLu lu(rows, sample.start, sample.index);
    if (!lu.Factor(sample.values)) {
      // no pivot is left where rank is lost, be it structural
      EXPECT_LT(Eigen::FullPivLU<MatrixX<double>>(sample.A).rank(), columns) << seed;
      continue;
    }
    const std::vector<int> pivots(lu.pivots().begin(), lu.pivots().end());
    std::vector<char> barred(rows, 1);
    for (const int pivot : pivots) barred[pivot] = 0;
    ASSERT_EQ(std::ranges::count(barred, 0), columns) << "each column has a pivot of its own";
    const double rcond = lu.rcond();
    ASSERT_TRUE(lu.Factor(sample.values, barred));
    EXPECT_TRUE(std::ranges::equal(lu.pivots(), pivots)) << "what is barred was not chosen";
    EXPECT_EQ(lu.rcond(), rcond);

    Random random(seed);
    const MatrixX<double> A_D = RowsOf(sample.A, pivots);
    // backward stable but for the growth of pivots, which stays small here: residuals of n terms
    const auto bound = [&](const MatrixX<double>& x) {
      return 100.0 * kEps * columns * A_D.norm() * x.norm();
    };
    const VectorX<double> r = RandomNumbers(random, columns);
    VectorX<double> lost = r, solved = VectorX<double>::Constant(rows, 7.0);
    lu.SolveTransposed(lost.data(), solved.data());
    const MatrixX<double> x_D = RowsOf(solved, pivots);
    EXPECT_LE((A_D.transpose() * x_D - r).norm(), bound(x_D)) << seed;
    std::vector<int> others, place(rows, -1);
    for (int row = 0; row < rows; ++row) {
      if (!barred[row]) continue;
      EXPECT_EQ(solved[row], 7.0) << "not a row that was asked for";
      place[row] = static_cast<int>(others.size());
      others.push_back(row);
    }
    const int count = static_cast<int>(others.size());
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    RowMajor B = RowMajor::Constant(rows, count, 7.0);
    lu.Dependencies(place, B.data(), count);
    const MatrixX<double> B_D = RowsOf(B, pivots);
    EXPECT_LE((A_D.transpose() * B_D + RowsOf(sample.A, others).transpose()).norm(),
              bound(B_D) + 100.0 * kEps * sample.A.norm())
        << seed;

    VectorX<double> y = RandomNumbers(random, rows), x(columns);
    const MatrixX<double> y_D = RowsOf(y, pivots);
    lu.Solve(y.data(), x.data());
    EXPECT_LE((A_D * x - y_D).norm(), bound(x)) << seed;
  }
}

/// The pivot is the largest that is left, so that no row not chosen would have been better.
TEST(SparseLu, TakesTheLargestRow) {
  const std::vector<double> column = {0.5, -3.0, 2.0, 0.0, 1.0, 2.9};
  SparseLu lu(6, {0, 6}, {0, 1, 2, 3, 4, 5});
  ASSERT_TRUE(lu.Factor(column));
  EXPECT_EQ(lu.pivots()[0], 1);
  const std::vector<char> barred = {0, 1, 0, 0, 0, 0};
  ASSERT_TRUE(lu.Factor(column, barred));
  EXPECT_EQ(lu.pivots()[0], 5);
  EXPECT_DOUBLE_EQ(lu.rcond(), 2.9 / 3.0) << "as a part of what it could be";
}

TEST(SparseLu, HasNoFactorsWithoutRank) {
  Sample sample(8, 3, 4, 5);
  SparseLu lu(8, sample.start, sample.index);
  ASSERT_TRUE(lu.Factor(sample.values));
  std::vector<double> values = sample.values;
  std::fill_n(values.begin() + 4, 4, 0.0);
  EXPECT_FALSE(lu.Factor(values)) << "a column of zeros";
  EXPECT_EQ(lu.rcond(), 0.0);
  values = sample.values;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    std::fill_n(values.begin(), 4, bad);
    EXPECT_FALSE(lu.Factor(values));
  }
  std::vector<char> barred(8, 1);
  barred[0] = barred[1] = 0;
  EXPECT_FALSE(lu.Factor(sample.values, barred)) << "fewer rows than columns";
  ASSERT_TRUE(lu.Factor(sample.values)) << "nothing of that is left behind";
  const std::vector<int> pivots(lu.pivots().begin(), lu.pivots().end());
  SparseLu fresh(8, sample.start, sample.index);
  ASSERT_TRUE(fresh.Factor(sample.values));
  EXPECT_TRUE(std::ranges::equal(fresh.pivots(), pivots));
  EXPECT_EQ(fresh.rcond(), lu.rcond());
}

/// What is remembered of the last pattern leaves no trace in the numbers.
TEST(SparseLu, IsTheSameAfterOtherPivots) {
  int others = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Sample sample(30, 20, 4, seed);
    SparseLu lu(30, sample.start, sample.index);
    Random random(seed);
    std::vector<int> pivots;
    for (int k = 0; k < 12; ++k) {
      std::vector<double> values = sample.values;
      for (double& value : values) value *= random.Uniform(k % 3 == 0 ? 1.0 : 0.2, 1.0);
      const bool is_spoilt = k % 4 == 3;
      if (is_spoilt) values[random.Below(80)] = std::numeric_limits<double>::infinity();
      std::vector<char> barred(30, 0);
      if (k % 5 == 4) barred[random.Below(30)] = 1;
      SparseLu fresh(30, sample.start, sample.index);
      const bool factored = fresh.Factor(values, barred);
      ASSERT_EQ(lu.Factor(values, barred), factored);
      ASSERT_EQ(lu.rcond(), fresh.rcond());
      if (!factored || is_spoilt) continue;
      ++found;
      ASSERT_EQ(lu.operations(), fresh.operations());
      ASSERT_TRUE(std::ranges::equal(lu.pivots(), fresh.pivots()));
      others += !pivots.empty() && !std::ranges::equal(lu.pivots(), pivots);
      pivots.assign(lu.pivots().begin(), lu.pivots().end());
      const VectorX<double> r = RandomNumbers(random, 20);
      VectorX<double> lost = r, x = VectorX<double>::Zero(30), expected = x;
      lu.SolveTransposed(lost.data(), x.data());
      lost = r;
      fresh.SolveTransposed(lost.data(), expected.data());
      EXPECT_EQ(x, expected) << "to the last bit";
    }
  }
  EXPECT_GT(others, 50) << "of " << found;
  EXPECT_GT(found - others, 20);
}

}  // namespace loopbench::reduction::sparse_lu_test
