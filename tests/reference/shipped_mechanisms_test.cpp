// Energy: every shipped mechanism with all three formulations and both coordinate sets for a short
// while, and the paper's conservative problems that stay clear of singular positions.
#include "tests/reference/cases.h"

namespace loopbench::harness::reference::shipped_mechanisms_test {

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
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedMechanism, testing::ValuesIn(ShippedNames()), NameOfParam());

/// Errors of at most rtol per step and component, some 1e3 steps and energies of some 10 J.
constexpr double kErrorPerTolerance = 1e4;  // [J]

class ConservativeProblem : public testing::TestWithParam<std::tuple<std::string, Method>> {};

TEST_P(ConservativeProblem, KeepsItsEnergyWithinTheTolerance) {
  const auto& [problem, method] = GetParam();
  for (const double rtol : {1e-6, 1e-8, 1e-10}) {
    const Record record = RunPaper(problem, method, rtol, 10.0);
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    EXPECT_LE(record.Number("energy_error_max"), kErrorPerTolerance * rtol) << rtol;
  }
}

INSTANTIATE_TEST_SUITE_P(Paper, ConservativeProblem,
                         testing::Combine(testing::Values("square-four-bar", "square-seven-bar",
                                                          "four-bar", "seven-bar",
                                                          "general-seven-bar"),
                                          testing::ValuesIn(PublishedMethods())),
                         NameOfParam());

}  // namespace loopbench::harness::reference::shipped_mechanisms_test
