// Tests of significance against enumeration and worked examples; exponents of cost over size.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace compare_statistics_test {

/// Share of all ways to choose which of the values form the first sample whose u is at least that
/// of the given samples: the definition of p, ties included.
double EnumeratedP(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> all = a;
  all.insert(all.end(), b.begin(), b.end());
  std::vector<bool> first(all.size(), false);
  std::fill_n(first.begin(), a.size(), true);
  const auto u_of = [&](const std::vector<bool>& chosen) {
    double u = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (std::size_t j = 0; j < all.size(); ++j) {
        if (chosen[i] && !chosen[j]) u += all[i] > all[j] ? 1.0 : all[i] == all[j] ? 0.5 : 0.0;
      }
    }
    return u;
  };
  const double found = u_of(first);
  double count = 0.0, as_large = 0.0;
  do {
    count += 1.0;
    if (u_of(first) >= found) as_large += 1.0;
  } while (std::prev_permutation(first.begin(), first.end()));
  return as_large / count;
}

TEST(MannWhitney, EqualsTheTabulatedValuesOfFiveAgainstFive) {
  // The number of orders with u = 25, 24, ... is 1, 1, 2, 3, 5, ... of 252: 0.004, 0.008, 0.016,
  // 0.028, 0.048 in the tables.
  const std::vector<double> b = {1, 2, 3, 4, 5};
  EXPECT_NEAR(MannWhitney(std::vector<double>{6, 7, 8, 9, 10}, b).p_greater, 1.0 / 252, 1e-15);
  EXPECT_NEAR(MannWhitney(std::vector<double>{4.5, 7, 8, 9, 10}, b).p_greater, 2.0 / 252, 1e-15);
  EXPECT_NEAR(MannWhitney(std::vector<double>{3.5, 7, 8, 9, 10}, b).p_greater, 4.0 / 252, 1e-15);
  EXPECT_NEAR(MannWhitney(std::vector<double>{2.5, 7, 8, 9, 10}, b).p_greater, 7.0 / 252, 1e-15);
  EXPECT_NEAR(MannWhitney(std::vector<double>{1.5, 7, 8, 9, 10}, b).p_greater, 12.0 / 252, 1e-15);
}

TEST(MannWhitney, EqualsEnumerationWithoutTies) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const auto& [n, m] : {std::pair{1, 6}, {3, 4}, {4, 6}, {6, 3}}) {
    for (int repeat = 0; repeat < 5; ++repeat) {
      std::vector<double> a(n), b(m);
      for (double& x : a) x = uniform(random) + 0.2;
      for (double& x : b) x = uniform(random);
      const MannWhitneyResult result = MannWhitney(a, b);
      EXPECT_TRUE(result.exact);
      EXPECT_NEAR(result.p_greater, EnumeratedP(a, b), 1e-12) << n << " " << m;
    }
  }
}

TEST(MannWhitney, IsNearEnumerationWithTies) {
  // normal approximation: good to about 0.02 at these sizes
  const std::vector<double> a = {1, 2, 2, 3, 3, 4, 5}, b = {1, 1, 2, 2, 3, 3, 4};
  const MannWhitneyResult result = MannWhitney(a, b);
  EXPECT_FALSE(result.exact);
  EXPECT_NEAR(result.p_greater, EnumeratedP(a, b), 0.02);
  EXPECT_EQ(MannWhitney(std::vector<double>{2, 2, 2}, std::vector<double>{2, 2}).p_greater, 1.0);
}

TEST(MannWhitney, NormalAndExactAgreeForLargeSamples) {
  std::vector<double> a(40), b(40);
  std::iota(a.begin(), a.end(), 8.5);
  std::iota(b.begin(), b.end(), 0.0);
  const double exact = MannWhitney(a, b).p_greater;
  a.push_back(24.5);  // one more, and the sample is too large for the exact distribution
  const MannWhitneyResult normal = MannWhitney(a, b);
  EXPECT_FALSE(normal.exact);
  EXPECT_GT(exact, 1e-3);
  EXPECT_NEAR(normal.p_greater, exact, 0.2 * exact);
}

TEST(MannWhitney, OfNothingDecidesNothing) {
  EXPECT_EQ(MannWhitney({}, std::vector<double>{1.0}).p_greater, 1.0);
  EXPECT_EQ(MannWhitney(std::vector<double>{1.0}, {}).p_greater, 1.0);
}

TEST(MannWhitney, EndsForSamplesOfAnySize) {
  std::vector<double> a(200'000), b(200'000, std::nan(""));
  std::iota(a.begin(), a.end(), 0.5);
  EXPECT_GE(MannWhitney(b, b).p_greater, 0.0);  // means nothing, and ends
  std::iota(b.begin(), b.end(), 0.0);
  EXPECT_EQ(MannWhitney(a, b).u, 0.5 * 200'000 * 200'001.0);
}

TEST(SmallestP, IsOneOrderOfAll) {
  EXPECT_NEAR(SmallestP(5, 5), 1.0 / 252, 1e-15);
  EXPECT_NEAR(SmallestP(3, 4), 1.0 / 35, 1e-15);
}

TEST(Holm, AdjustsTheWorkedExample) {
  // sorted 0.005, 0.01, 0.03, 0.04 times 4, 3, 2, 1; then never falling
  const std::vector<double> p = {0.01, 0.04, 0.03, 0.005};
  const std::vector<double> expected = {0.03, 0.06, 0.06, 0.02};
  const std::vector<double> adjusted = HolmAdjusted(p);
  ASSERT_EQ(adjusted.size(), expected.size());
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_NEAR(adjusted[i], expected[i], 1e-15) << i;
}

TEST(Holm, NeverExceedsOne) {
  EXPECT_EQ(HolmAdjusted(std::vector<double>{0.6, 0.9}), (std::vector<double>{1.0, 1.0}));
  EXPECT_TRUE(HolmAdjusted({}).empty());
}

TEST(Median, TakesTheMiddle) {
  EXPECT_EQ(Median(std::vector<double>{3, 1, 2}), 2.0);
  EXPECT_EQ(Median(std::vector<double>{4, 1, 2, 3}), 2.5);
  EXPECT_TRUE(std::isnan(Median({})));
  EXPECT_TRUE(std::isnan(Median(std::vector<double>{1, std::nan(""), 3})));
}

TEST(FitPower, FindsAnExactPower) {
  const std::vector<double> sizes = {3, 10, 30, 100};
  std::vector<double> costs;
  for (const double size : sizes) costs.push_back(7.0 * std::pow(size, 1.5));
  const PowerFit fit = FitPower(sizes, costs);
  EXPECT_EQ(fit.sizes, 4);
  // logarithms of these sizes have errors of a few 1e-16
  EXPECT_NEAR(fit.exponent, 1.5, 1e-13);
  EXPECT_NEAR(fit.coefficient, 7.0, 1e-12);
  EXPECT_NEAR(fit.standard_error, 0.0, 1e-13);
  EXPECT_NEAR(fit.slope_min, 1.5, 1e-13);
  EXPECT_NEAR(fit.slope_max, 1.5, 1e-13);
}

TEST(FitPower, HasTheTextbookStandardError) {
  // x = 0, 1, 2 and y = 0, 1, 1 in logarithms: slope 1/2, residuals -1/6, 1/3, -1/6, so
  // s^2 = (1/6) / 1 and the slope's standard error sqrt(s^2 / 2) = sqrt(1/12)
  const double e = std::exp(1.0);
  const PowerFit fit = FitPower(std::vector<double>{1, e, e * e}, std::vector<double>{1, e, e});
  EXPECT_NEAR(fit.exponent, 0.5, 1e-14);
  EXPECT_NEAR(fit.standard_error, std::sqrt(1.0 / 12.0), 1e-14);
  EXPECT_NEAR(fit.slope_min, 0.0, 1e-14);
  EXPECT_NEAR(fit.slope_max, 1.0, 1e-14);
}

TEST(FitPower, SaysWhatItCannotKnow) {
  const PowerFit two = FitPower(std::vector<double>{1, 10}, std::vector<double>{1, 100});
  EXPECT_NEAR(two.exponent, 2.0, 1e-14);
  EXPECT_TRUE(std::isnan(two.standard_error));
  EXPECT_TRUE(std::isnan(FitPower(std::vector<double>{5}, std::vector<double>{1}).exponent));
  EXPECT_TRUE(std::isnan(FitPower({}, {}).exponent));
  // what has no logarithm is no point, and equal sizes are one
  const PowerFit odd = FitPower(std::vector<double>{1, 10, 10, 100, 0},
                                std::vector<double>{1, 50, 200, std::nan(""), 3});
  EXPECT_EQ(odd.sizes, 2);
  EXPECT_NEAR(odd.exponent, 2.0, 1e-14);
}

Record Benchmark(const std::string& name, double bodies, double nanoseconds) {
  return RecordOf("benchmark", name, "outcome", "finished", "bodies", bodies, "series.cpu_ns",
                  std::vector<double>{0.9 * nanoseconds, nanoseconds, 5.0 * nanoseconds});
}

TEST(FitFamilies, GroupsByTheNumberInTheName) {
  std::vector<Record> records;
  for (const double n : {1.0, 2.0, 4.0}) {
    const std::string number = std::to_string(static_cast<int>(n));
    // a ladder of n windows has 2 n + 1 bodies: time grows with bodies, not with windows
    records.push_back(Benchmark("rhs/ladder/" + number + "/odca", 2 * n + 1, 10 * (2 * n + 1)));
    records.push_back(Benchmark("rhs/chain/" + number + "/odca", n, n * n));
  }
  records.push_back(Benchmark("rhs/four-bar/odca", 3, 100));
  records.push_back(Benchmark("rhs/chain/8/odca", 8, 1));
  records.back().Set("outcome", std::string("singular"));
  const std::vector<Record> rows = FitFamilies(records, 0.0);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].Text("family"), "rhs/ladder/N/odca");
  EXPECT_NEAR(rows[0].Number("exponent"), 1.0, 1e-13);
  EXPECT_NEAR(rows[0].Number("ns_per_body"), 10.0, 1e-12);
  EXPECT_NEAR(rows[0].Number("bodies_max"), 9.0, 1e-12);
  EXPECT_EQ(rows[1].Text("family"), "rhs/chain/N/odca");
  EXPECT_NEAR(rows[1].Number("exponent"), 2.0, 1e-13);
  EXPECT_EQ(rows[1].Number("failed"), 1.0);
  // sizes below the start do not count; a single one left gives no exponent, and is no gap
  const std::vector<Record> late = FitFamilies(records, 3.0);
  ASSERT_EQ(late.size(), 2u);
  EXPECT_EQ(late[1].Text("family"), "rhs/chain/N/odca");
  EXPECT_EQ(late[1].Find("exponent"), nullptr);
  EXPECT_EQ(late[1].Number("sizes"), 1.0);
  EXPECT_EQ(late[1].Number("failed"), 1.0);
  // "inf" and "nan" are words
  EXPECT_EQ(FitFamilies({Benchmark("a/inf/1", 1, 1), Benchmark("a/inf/2", 2, 2)}, 0.0).size(), 1u);
}

TEST(FitFamilies, TakesTheTimingsOfAStore) {
  std::vector<Record> records;
  for (const double n : {10.0, 100.0}) {
    for (const char* formulation : {"odca", "peer/simbody"}) {
      Record timing = RecordOf(
          "kind", "timing", "mechanism", "crooked-chain-" + std::to_string(static_cast<int>(n)),
          "formulation", formulation, "enforcement", "projection", "outcome", "finished", "bodies",
          n, "series.rhs_ns",
          std::vector<double>{std::string(formulation) == "odca" ? 3.0 * n : n * n});
      records.push_back(timing);
    }
  }
  records.push_back(records.front());
  records.back().Set("mechanism", std::string("four-bar"));  // has no size
  records.push_back(records.front());
  records.back().Set("kind", std::string("case"));
  const std::vector<Record> rows = FitFamilies(records, 0.0);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].Text("family"), "rhs/crooked-chain/N/odca/projection");
  EXPECT_NEAR(rows[0].Number("exponent"), 1.0, 1e-13);
  EXPECT_EQ(rows[1].Text("family"), "rhs/crooked-chain/N/peer/simbody/projection");
  EXPECT_NEAR(rows[1].Number("exponent"), 2.0, 1e-13);
}

}  // namespace compare_statistics_test
}  // namespace loopbench::harness
