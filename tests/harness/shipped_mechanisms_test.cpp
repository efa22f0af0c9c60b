// Every shipped mechanism runs: all three formulations, both coordinate sets, a short while.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "harness/config/mechanism_reader.h"
#include "harness/run_case.h"

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

const fs::path kMechanisms = fs::path(LOOPBENCH_SOURCE_DIR) / "configs/mechanisms";

std::vector<std::string> ShippedNames() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kMechanisms)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

/// Time of a short run [s]: Andrews' squeezer turns a thousand times as fast as the others, the
/// governor takes 1e4 steps a second.
double ShortHorizon(const std::string& name) {
  if (name == "andrews-squeezer") return 0.005;
  return name == "flyball-governor" ? 0.02 : 0.2;
}

/// Reduction at the level of speeds, the others at that of accelerations; rank-revealing, since
/// some start in singular positions.
Column ColumnOf(FormulationKind formulation, Coordinates coordinates) {
  const bool reduction = formulation == FormulationKind::kReduction;
  return {.formulation = formulation,
          .enforcement = reduction ? Enforcement::kVelocity : Enforcement::kAcceleration,
          .coordinates = coordinates,
          .solver = SolverKind::kRankRevealing};
}

class ShippedMechanism : public testing::TestWithParam<std::string> {};

TEST_P(ShippedMechanism, RunsInEveryColumnAndBalancesItsEnergy) {
  Experiment experiment;
  experiment.name = "shipped";
  experiment.scenes.resize(1);
  experiment.scenes[0].name = GetParam();
  experiment.scenes[0].mechanism = ReadMechanism(kMechanisms / (GetParam() + ".json"));
  constexpr double kRtol = 1e-8;
  for (const auto formulation :
       {FormulationKind::kOdca, FormulationKind::kLagrange, FormulationKind::kReduction}) {
    for (const auto coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
      const Case one{.scene = 0,
                     .mechanism = GetParam(),
                     .column = ColumnOf(formulation, coordinates),
                     .integrator = "ode45",
                     .rtol = kRtol,
                     .atol = kRtol,
                     .horizon = ShortHorizon(GetParam()),
                     .limits = {.wall_s = 60.0}};
      const Record record = RunCase(experiment, one);
      ASSERT_EQ(record.Text("outcome"), "finished")
          << ToString(one.column) << ": " << record.Text("message");
      // errors of at most rtol per step and component, some 1e3 steps and energies up to 1e3 J
      EXPECT_LE(record.Number("energy_error_max"), 1e6 * kRtol) << ToString(one.column);
      EXPECT_LE(record.Number("drift_position_max"), 1e3 * kRtol) << ToString(one.column);
      std::cout << ToString(one.column) << ": " << record.Number("energy_error_max") << " J, "
                << record.Number("drift_position_max") << " m\n";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedMechanism, testing::ValuesIn(ShippedNames()),
                         [](const auto& name) {
                           std::string text = name.param;
                           std::erase(text, '-');
                           return text;
                         });

}  // namespace
}  // namespace loopbench::harness
