// Every shipped mechanism runs: all three formulations, both coordinate sets, a short while.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference {
namespace shipped_mechanisms_test {

/// Time of a short run [s]: Andrews' squeezer turns a thousand times as fast as the others, the
/// governor takes 1e4 steps a second.
double ShortHorizon(const std::string& name) {
  if (name == "andrews-squeezer") return 0.005;
  return name == "flyball-governor" ? 0.02 : 0.2;
}

class ShippedMechanism : public testing::TestWithParam<std::string> {};

TEST_P(ShippedMechanism, RunsInEveryColumnAndBalancesItsEnergy) {
  const Experiment experiment =
      Single(ReadMechanism(kConfigs / "mechanisms" / (GetParam() + ".json")));
  constexpr double kRtol = 1e-8;
  // rank-revealing: some start in singular positions
  for (const Method& method : RankRevealingMethods()) {
    const Record record = RunCase(
        experiment, CaseOf(experiment, GetParam(), method, kRtol, ShortHorizon(GetParam())));
    if (method.formulation == "reduction" && GetParam().ends_with("singular-start") &&
        record.Text("outcome") == "singular") {
      continue;  // no set of independent speeds serves there: a result, see results/paper
    }
    ASSERT_EQ(record.Text("outcome"), "finished")
        << ToString(method) << ": " << record.Text("message");
    // errors of at most rtol per step and component, some 1e3 steps and energies up to 1e3 J
    EXPECT_LE(record.Number("energy_error_max"), 1e6 * kRtol) << ToString(method);
    EXPECT_LE(record.Number("drift_position_max"), 1e3 * kRtol) << ToString(method);
    std::cout << ToString(method) << ": " << record.Number("energy_error_max") << " J, "
              << record.Number("drift_position_max") << " m\n";
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedMechanism, testing::ValuesIn(ShippedNames()),
                         [](const auto& name) { return WithoutDashes(name.param); });

}  // namespace shipped_mechanisms_test
}  // namespace loopbench::harness::reference
