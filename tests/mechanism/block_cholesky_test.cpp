// Sparse factors of small blocks against dense ones.
#include "mechanism/algebra/block_cholesky.h"

#include <Eigen/Dense>

#include "tests/standard.h"

namespace loopbench::block_cholesky_test {

constexpr double kNoLimit = 1e9;

using Pairs = std::vector<std::pair<int, int>>;

/// A symmetric matrix of blocks on the diagonal and at `pairs`. Its diagonal outweighs the rest of
/// each row by 1, so its eigenvalues lie between 1 and twice the largest row, which is some 30.
class Sample {
 public:
  Sample(std::vector<int> rows, const Pairs& pairs, unsigned seed)
      : rows_(std::move(rows)), first_(rows_.size() + 1, 0) {
    std::partial_sum(rows_.begin(), rows_.end(), first_.begin() + 1);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    A.setZero(first_.back(), first_.back());
    const auto fill = [&](int i, int j) {
      for (int a = 0; a < rows_[i]; ++a) {
        for (int b = 0; b < rows_[j]; ++b) {
          A(first_[i] + a, first_[j] + b) += number(random);
          A(first_[j] + b, first_[i] + a) = A(first_[i] + a, first_[j] + b);
        }
      }
    };
    for (int i = 0; i < static_cast<int>(rows_.size()); ++i) fill(i, i);
    for (const auto& [i, j] : pairs) fill(i, j);
    A.diagonal() = A.cwiseAbs().rowwise().sum().array() + 1.0;
  }

  void PutInto(BlockCholesky& factors, const Pairs& pairs) const {
    factors.SetZero();
    const auto put = [&](int i, int j, double* number) {
      for (int a = 0; a < rows_[i]; ++a) {
        for (int b = 0; b < rows_[j]; ++b) *number++ = A(first_[i] + a, first_[j] + b);
      }
    };
    for (int i = 0; i < static_cast<int>(rows_.size()); ++i) put(i, i, factors.Diagonal(i));
    for (const auto& [i, j] : pairs) {
      const int first = factors.FirstOf(i, j);
      put(first, first == i ? j : i, factors.OffDiagonal(i, j));
    }
  }

  Eigen::MatrixXd A;

 private:
  std::vector<int> rows_, first_;
};

Pairs Path(int blocks) {
  Pairs pairs;
  for (int i = 0; i + 1 < blocks; ++i) pairs.emplace_back(i, i + 1);
  return pairs;
}
Pairs Grid(int side) {
  Pairs pairs;
  for (int i = 0; i < side * side; ++i) {
    if (i % side + 1 < side) pairs.emplace_back(i + 1, i);
    if (i + side < side * side) pairs.emplace_back(i, i + side);
  }
  return pairs;
}
Pairs Anything(int blocks, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> block(0, blocks - 1);
  Pairs pairs;
  for (int k = 0; k < 2 * blocks; ++k) {
    const int i = block(random), j = block(random);
    if (i != j) pairs.emplace_back(i, j);
  }
  return pairs;
}

/// A backward stable solution is off by the condition, 60, times eps times the length of a row of
/// L.
void ExpectSolves(const std::vector<int>& rows, const Pairs& pairs, unsigned seed) {
  const Sample sample(rows, pairs, seed);
  BlockCholesky factors(rows, pairs, kNoLimit);
  for (int round = 0; round < 2; ++round) {  // the second time in the same memory
    sample.PutInto(factors, pairs);
    ASSERT_TRUE(factors.Factor());
    const Eigen::Index n = sample.A.rows();
    ASSERT_EQ(factors.size(), n);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
    Eigen::VectorXd x = b;
    factors.Solve(x.data());
    const Eigen::VectorXd expected = sample.A.ldlt().solve(b);
    EXPECT_LE((x - expected).norm(), 60.0 * static_cast<double>(n) * kEps * expected.norm());
  }
}

TEST(BlockCholeskyTest, SolvesWhateverTheBlocks) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> rows(1, 6);
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const int blocks = 1 + static_cast<int>(seed);
    std::vector<int> mixed(blocks);
    for (int& r : mixed) r = rows(random);
    ExpectSolves(mixed, Anything(blocks, seed), seed);
    for (const int r : {1, 2, 3, 5, 6}) {
      ExpectSolves(std::vector<int>(blocks, r), Anything(blocks, seed + 100), seed);
    }
  }
  ExpectSolves(std::vector<int>(60, 2), Path(60), 1);
  ExpectSolves(std::vector<int>(64, 2), Grid(8), 1);
  ExpectSolves({}, {}, 1);
}

/// Two parallel pins between the same bodies: a pair given twice, either way round.
TEST(BlockCholeskyTest, PairsMayComeTwice) {
  const Pairs once = Path(5);
  Pairs twice = once;
  for (const auto& [i, j] : once) twice.emplace_back(j, i);
  const std::vector<int> rows(5, 2);
  EXPECT_EQ(BlockCholesky(rows, twice, kNoLimit).numbers(),
            BlockCholesky(rows, once, kNoLimit).numbers());
}

/// A path fills nothing in: a block on and one below the diagonal of each column. Work is linear.
TEST(BlockCholeskyTest, PathsAndTreesAreLinear) {
  for (const int n : {10, 1000}) {
    const BlockCholesky path(std::vector<int>(n, 2), Path(n), kNoLimit);
    EXPECT_EQ(path.numbers(), 4.0 * n + 4.0 * (n - 1));
    Pairs tree;
    for (int i = 1; i < n; ++i) tree.emplace_back((i - 1) / 2, i);
    EXPECT_EQ(BlockCholesky(std::vector<int>(n, 2), tree, kNoLimit).numbers(), path.numbers());
  }
  const auto work = [](int side) {
    return BlockCholesky(std::vector<int>(side * side, 2), Grid(side), kNoLimit).operations();
  };
  // n^1.5 at best, by nested dissection; minimum degree is somewhat behind, a band has n^2
  EXPECT_LT(std::log(work(64) / work(16)) / std::log(16.0), 1.75);
}

TEST(BlockCholeskyTest, TooManyNumbersAreNotMade) {
  const std::vector<int> rows(100, 2);
  const double numbers = BlockCholesky(rows, Grid(10), kNoLimit).numbers();
  EXPECT_EQ(BlockCholesky(rows, Grid(10), numbers).numbers(), numbers);
  EXPECT_GT(BlockCholesky(rows, Grid(10), numbers - 1.0).numbers(), numbers - 1.0);
}

/// [2 1; 1 1/2 + e]: eliminating one block leaves e or 2 e of the other, of which the least ratio
/// is e / (1/2 + e) or 4 e / 4.
TEST(BlockCholeskyTest, TellsWhatPivotsHaveLost) {
  const Pairs pair = {{0, 1}};
  for (const double e : {1e-3, 1e-6}) {
    BlockCholesky factors({1, 1}, pair, kNoLimit);
    factors.SetZero();
    *factors.Diagonal(0) = 2.0;
    *factors.OffDiagonal(0, 1) = 1.0;
    *factors.Diagonal(1) = 0.5 + e;
    ASSERT_TRUE(factors.Factor());
    EXPECT_NEAR(std::min(factors.ratio(0), factors.ratio(1)), e / (0.5 + e), 4 * kEps);
    EXPECT_EQ(std::max(factors.ratio(0), factors.ratio(1)), 1.0);
    EXPECT_EQ(factors.eliminated(0) + factors.eliminated(1), 3) << "one alone, then both";
  }
  BlockCholesky factors({1, 1}, pair, kNoLimit);
  factors.SetZero();
  *factors.Diagonal(0) = *factors.Diagonal(1) = 1.0;
  EXPECT_TRUE(factors.Factor());
  EXPECT_EQ(factors.ratio(0), 1.0) << "nothing is left of the factors before";
  EXPECT_EQ(factors.ratio(1), 1.0);
  factors.SetZero();
  *factors.Diagonal(0) = *factors.Diagonal(1) = 1.0;
  *factors.OffDiagonal(0, 1) = 2.0;
  EXPECT_FALSE(factors.Factor());
  EXPECT_EQ(std::min(factors.ratio(0), factors.ratio(1)), 0.0);
}

}  // namespace loopbench::block_cholesky_test
