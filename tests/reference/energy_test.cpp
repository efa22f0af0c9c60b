// Energy of the paper's conservative problems that stay clear of singular positions.
#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <tuple>

#include "tests/reference/cases.h"

namespace loopbench::harness::reference {
namespace energy_test {

/// Errors of at most rtol per step and component, some 1e3 steps and energies of some 10 J.
constexpr double kErrorPerTolerance = 1e4;  // [J]

class ConservativeProblem : public testing::TestWithParam<std::tuple<std::string, Method>> {};

TEST_P(ConservativeProblem, KeepsItsEnergyWithinTheTolerance) {
  const auto& [problem, method] = GetParam();
  for (const double rtol : {1e-6, 1e-8, 1e-10}) {
    const Record record = RunPaper(problem, method, rtol, 10.0);
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    EXPECT_LE(record.Number("energy_error_max"), kErrorPerTolerance * rtol) << rtol;
    std::cout << "energy error " << record.Number("energy_error_max") / rtol << " rtol\n";
  }
}

INSTANTIATE_TEST_SUITE_P(Paper, ConservativeProblem,
                         testing::Combine(testing::Values("square-four-bar", "square-seven-bar",
                                                          "four-bar", "seven-bar",
                                                          "general-seven-bar"),
                                          testing::ValuesIn(PublishedMethods())),
                         [](const auto& test) {
                           std::string name =
                               std::get<0>(test.param) + NameOf(std::get<1>(test.param));
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace energy_test
}  // namespace loopbench::harness::reference
