// Exponents of cost over size, on costs whose exponents are known, and from benchmark records.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace scaling_test {

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
  Record record;
  record.Set("benchmark", name);
  record.Set("outcome", std::string("finished"));
  record.Set("bodies", bodies);
  record.Set("series.cpu_ns",
             std::vector<double>{0.9 * nanoseconds, nanoseconds, 5.0 * nanoseconds});
  return record;
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
      Record timing;
      timing.Set("kind", std::string("timing"));
      timing.Set("mechanism", "crooked-chain-" + std::to_string(static_cast<int>(n)));
      timing.Set("formulation", std::string(formulation));
      timing.Set("enforcement", std::string("projection"));
      timing.Set("outcome", std::string("finished"));
      timing.Set("bodies", n);
      timing.Set("series.rhs_ns",
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

}  // namespace scaling_test
}  // namespace loopbench::harness
