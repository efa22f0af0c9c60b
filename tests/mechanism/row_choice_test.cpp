// The choice of independent rows under quotas, against all choices.
#include "mechanism/loops/row_choice.h"

#include <Eigen/SVD>

#include "tests/standard.h"

namespace loopbench::row_choice_test {

constexpr int kRows = 10, kColumns = 5;

/// The largest least singular value of `total` rows within the quotas, prescribed ones among them.
double BestOf(const Eigen::MatrixXd& rows, const std::vector<Quota>& quotas, int total) {
  double best = 0.0;
  for (unsigned set = 0; set < 1u << kRows; ++set) {
    if (std::popcount(set) != total) continue;
    const bool is_within = std::ranges::all_of(quotas, [set](const Quota& quota) {
      const unsigned of_joint = (set >> quota.first) & ((1u << quota.count) - 1);
      const unsigned fixed = (1u << quota.fixed) - 1;
      return std::popcount(of_joint) <= quota.keep && (of_joint & fixed) == fixed;
    });
    if (!is_within) continue;
    Eigen::MatrixXd taken(total, kColumns);
    for (int row = 0, next = 0; row < kRows; ++row) {
      if ((set >> row & 1) != 0) taken.row(next++) = rows.row(row);
    }
    best = std::max(best, taken.jacobiSvd().singularValues().minCoeff());
  }
  return best;
}

/// Two loops with five rows each, as of two coupled overconstrained linkages. Rows with few small
/// integers depend on each other often, and pivoting alone ends in dependent rows.
TEST(RowChoice, TakesIndependentRowsWhereverQuotasPermitThem) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> number(-1, 1), some(0, 2);
  const std::vector<std::vector<Quota>> choices = {{{0, 5, 0, 2}, {5, 5, 0, 2}},
                                                   {{0, 5, 0, 3}, {5, 5, 0, 2}},
                                                   {{0, 5, 1, 3}, {5, 5, 0, 2}},
                                                   {{0, 4, 0, 2}, {4, 4, 1, 2}, {8, 2, 0, 1}}};
  int possible = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    Eigen::MatrixXd rows(kRows, kColumns);
    for (double& element : rows.reshaped()) element = some(random) == 0 ? number(random) : 0.0;
    // rows of other sizes, as of small parts
    const double least_size = std::array{1.0, 0.01, 1e-3}[trial % 3];
    for (int row = 0; row < kRows; ++row) rows.row(row) *= some(random) == 0 ? least_size : 1.0;
    const std::vector<Quota>& quotas = choices[(trial / 3) % choices.size()];
    int total = 0;
    for (const Quota& quota : quotas) total += quota.keep;
    const double best = BestOf(rows, quotas, total);
    const double found = RowChoice(rows, quotas, total).least();
    if (best < 1e-10) {
      EXPECT_LT(found, 1e-10) << rows;
      continue;
    }
    ++possible;
    // at least a tenth of the smallest row: its part orthogonal to others of small integers
    EXPECT_GT(found, 0.1 * least_size) << rows << "\nbest " << best;
  }
  EXPECT_GT(possible, 500);
}

/// Pivoting takes the first row, on which both rows of joint B depend.
TEST(RowChoice, MovesARowOutOfAJointWhereAnotherOneNeedsItsPlace) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(4, 2);
  rows << 2.0, 0.0,  // joint A
      0.0, 1.0,      //
      1.5, 0.0,      // joint B: depends on the first row of A
      1.0, 0.0;
  const RowChoice choice(rows, {{0, 2, 0, 1}, {2, 2, 0, 1}}, 2);
  EXPECT_EQ(choice.least(), 1.0);
  const std::vector<Released> released = choice.BeyondQuotas({7, 8});
  ASSERT_EQ(released.size(), 2u);
  EXPECT_EQ(released[0].directions, std::vector<int>{0});
  EXPECT_EQ(released[1].directions, std::vector<int>{1});
}

}  // namespace loopbench::row_choice_test
