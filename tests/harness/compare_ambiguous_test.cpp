// Cases that one side holds twice, and comparisons of nothing: said to people and to CI servers.
#include <gtest/gtest.h>

#include <ctime>
#include <string>
#include <vector>

#include "harness/history/compare_summary.h"
#include "harness/judge/compare.h"

namespace loopbench::harness {
namespace compare_ambiguous_test {

Record Case(int number) {
  Record record;
  record.Set("kind", std::string("accuracy"));
  record.Set("mechanism", "m" + std::to_string(number));
  record.Set("outcome", std::string("finished"));
  return record;
}

TEST(CompareAmbiguous, ManyCasesThatAreThereTwiceTakeNoLongerThanOthers) {
  constexpr int kCases = 40'000;
  std::vector<Record> once, twice;
  for (int i = 0; i < kCases; ++i) once.push_back(Case(i));
  twice = once;
  twice.insert(twice.end(), once.begin(), once.end());
  const auto seconds = [&](const std::vector<Record>& base, ComparisonReport* report) {
    const std::clock_t start = std::clock();
    *report = Compare(base, once, {});
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  ComparisonReport plain, report;
  const double of_once = seconds(once, &plain), of_twice = seconds(twice, &report);
  EXPECT_TRUE(plain.ambiguous.empty());
  ASSERT_EQ(report.ambiguous.size(), std::size_t{kCases});
  EXPECT_NE(report.ambiguous.front().find("m0"), std::string::npos);
  EXPECT_EQ(report.ExitCode({}), 2);
  // twice as many records: a factor of 2, and 5 for a busy machine; a list that is sought through
  // for each record took 30 times as long
  EXPECT_LT(of_twice, 10.0 * of_once) << of_once;
}

TEST(CompareAmbiguous, NothingComparedIsAnErrorOfJunit) {
  const std::string nothing = ComparisonJunit(Compare({}, {}, {}), false);
  EXPECT_NE(nothing.find("tests=\"1\" failures=\"0\" skipped=\"0\" errors=\"1\""),
            std::string::npos)
      << nothing;
  EXPECT_NE(nothing.find("<error message=\"could not measure: "), std::string::npos) << nothing;
  // what fails says so by itself
  const std::vector<Record> twice = {Case(1), Case(1)};
  EXPECT_NE(ComparisonJunit(Compare(twice, {Case(1)}, {}), false).find("errors=\"0\""),
            std::string::npos);
  EXPECT_NE(ComparisonJunit(Compare({Case(1)}, {Case(1)}, {}), false).find("errors=\"0\""),
            std::string::npos);
}

}  // namespace compare_ambiguous_test
}  // namespace loopbench::harness
