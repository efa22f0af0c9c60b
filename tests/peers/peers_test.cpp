// Peers against O-DCA: an independent check of the model. Of each shipped mechanism that a peer can
// express, accelerations at a state agree to round-off, and where a run ends within its accuracy.
#include <gtest/gtest.h>

#include <iostream>

#include "harness/run/compiled_scene.h"
#include "harness/run/peers.h"
#include "mechanism/start/assembly.h"
#include "peers/register.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_test {

using reference::CaseOf;
using reference::Single;

const bool kRegistered = (peers::RegisterPeers(), true);

/// Time of a short run [s]: Andrews' squeezer turns a thousand times as fast as the others.
double ShortHorizon(const std::string& name) {
  if (name == "andrews-squeezer") return 0.005;
  return name == "flyball-governor" ? 0.02 : 0.2;
}

class PeerOnShipped : public testing::TestWithParam<std::string> {};

/// State and derivative by O-DCA after `t` of its run at level position.
template <class Space>
void CompareAccelerations(const MechanismDescription& description, double t) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto system = MakeFormulation<Space>("odca", mechanism, {Enforcement::kPosition});
  ASSERT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  std::vector<double> y(static_cast<std::size_t>(system->state_size()));
  system->ToState(start.q, start.u, y);
  const auto project = [&](double at, std::span<double> state) {
    return system->BeginStep(at, state) ? StepAction::kRestart : StepAction::kContinue;
  };
  if (t > 0.0) Integrate(*system, 0.0, t, y, {}, project);
  std::vector<double> ours(y.size()), theirs(y.size());
  ASSERT_EQ(system->Examine(t, y, ours), Outcome::kFinished);
  const auto peer = MakePeer("peer/simbody", description);
  ASSERT_EQ(peer->Derivative(t, y, theirs), Outcome::kFinished);
  double largest = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    largest = std::max(largest, std::abs(ours[i]));
    difference = std::max(difference, std::abs(ours[i] - theirs[i]));
  }
  std::cout << "ACC " << description.name << " " << t << " " << difference << " of " << largest
            << " rcond " << system->diagnostics().rcond << '\n';
}

TEST_P(PeerOnShipped, HasTheSameAccelerations) {
  const MechanismFile file = ReadMechanism(kConfigs / "mechanisms" / (GetParam() + ".json"));
  for (const auto& part : CompileScene(file.description, file.observe, {}).compiled.parts) {
    for (const double t : {0.0, ShortHorizon(GetParam())}) {
      try {
        part.description.space == SpaceKind::kPlanar
            ? CompareAccelerations<Planar>(part.description, t)
            : CompareAccelerations<Spatial>(part.description, t);
      } catch (const Inexpressible& e) {
        std::cout << "ACC " << GetParam() << " " << e.what() << "\n";
      }
    }
  }
}

TEST_P(PeerOnShipped, EndsWhereOdcaDoes) {
  const Experiment experiment =
      Single(ReadMechanism(kConfigs / "mechanisms" / (GetParam() + ".json")));
  constexpr double kRtol = 1e-10;
  const auto run = [&](const std::string& formulation) {
    return RunCase(experiment,
                   CaseOf(experiment, GetParam(), {formulation, Enforcement::kPosition}, kRtol,
                          ShortHorizon(GetParam())));
  };
  const Record ours = run("odca"), theirs = run("peer/simbody");
  double difference = 0;
  for (const auto& [key, value] : ours.items()) {
    if (!key.starts_with("series.final.")) continue;
    const auto a = ours.Numbers(key), b = theirs.Numbers(key);
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
      difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  std::cout << "END " << GetParam() << " " << theirs.Text("outcome") << " "
            << theirs.Text("message") << " " << difference << " drift "
            << theirs.Number("drift_position_max") << " dE " << theirs.Text("energy_error_max")
            << " doubts " << theirs.Text("doubts") << "\n";
}

INSTANTIATE_TEST_SUITE_P(All, PeerOnShipped, testing::ValuesIn(reference::ShippedNames()),
                         [](const auto& name) { return reference::WithoutDashes(name.param); });

}  // namespace peers_test
}  // namespace loopbench::harness
