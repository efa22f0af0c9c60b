// Cases that one side holds twice, and comparisons of nothing: said to people and to CI servers.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "harness/history/history.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace compare_ambiguous_test {

Record Case(int number) {
  Record record;
  record.Set("kind", std::string("accuracy"));
  record.Set("mechanism", "m" + std::to_string(number));
  record.Set("outcome", std::string("finished"));
  return record;
}

// So many that a list which is sought through for each of them would be felt.
TEST(CompareAmbiguous, ManyCasesThatAreThereTwiceAreEachNamedOnce) {
  constexpr int kCases = 20'000;
  std::vector<Record> once;
  for (int i = 0; i < kCases; ++i) once.push_back(Case(i));
  EXPECT_TRUE(Compare(once, once, {}).ambiguous.empty());
  std::vector<Record> thrice;
  for (int i = 0; i < 3; ++i) thrice.insert(thrice.end(), once.begin(), once.end());
  const ComparisonReport report = Compare(thrice, once, {});
  ASSERT_EQ(report.ambiguous.size(), std::size_t{kCases});
  EXPECT_EQ(std::set(report.ambiguous.begin(), report.ambiguous.end()).size(), std::size_t{kCases});
  EXPECT_NE(report.ambiguous.front().find("m0"), std::string::npos);
  EXPECT_TRUE(report.findings.empty());
  EXPECT_EQ(report.ExitCode({}), 2);
}

TEST(CompareAmbiguous, NothingComparedIsAnErrorOfJunit) {
  const std::string nothing = ComparisonJunit(Compare({}, {}, {}), {});
  EXPECT_NE(nothing.find("tests=\"1\" failures=\"0\" skipped=\"0\" errors=\"1\""),
            std::string::npos)
      << nothing;
  EXPECT_NE(nothing.find("<error message=\"could not measure: "), std::string::npos) << nothing;
  // what fails says so by itself
  const std::vector<Record> twice = {Case(1), Case(1)};
  EXPECT_NE(ComparisonJunit(Compare(twice, {Case(1)}, {}), {}).find("errors=\"0\""),
            std::string::npos);
  EXPECT_NE(ComparisonJunit(Compare({Case(1)}, {Case(1)}, {}), {}).find("errors=\"0\""),
            std::string::npos);
}

}  // namespace compare_ambiguous_test
}  // namespace loopbench::harness
