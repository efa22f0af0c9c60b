// Peers in a build that has none: their names are known, files are read, runs are refused.
#include "tests/harness/cli_fixture.h"
#include "tests/harness/in_child.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::peers_test {

constexpr const char* kMessage =
    "formulation \"peer/simbody\" needs a build with -DLOOPBENCH_PEERS=ON";

std::string Asking(const std::string& more = "") {
  return R"({"name": "peers", "tolerances": 1e-6,
      "problems": [{"mechanism": "four-bar.json", "horizon": 0.2}],
      "methods": [{"formulation": "odca", "enforcement": "acceleration"},
                  {"formulation": "peer/simbody", "enforcement": "projection"}]
      )" +
         more + "}";
}

Experiment Read(const std::string& text) {
  return ParseExperiment(text, kConfigs / "mechanisms/peers.json");
}

/// Returns the message of RequirePeers(), "none" without one.
std::string Refusal(const Experiment& experiment) {
  try {
    RequirePeers({experiment});
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

TEST(PeersTest, AreColumnsWithAnIntegratorOfTheirOwn) {
  const std::vector<Case> cases = Expand(Read(Asking(R"(, "integrator": "trbdf2")")));
  ASSERT_EQ(cases.size(), 2u);
  EXPECT_EQ(cases[0].keys.Text("integrator"), "trbdf2");
  EXPECT_EQ(cases[0].keys.Text("jacobian"), "forward");
  EXPECT_EQ(ToString(cases[1].method), "peer/simbody/projection/joint/rank-revealing");
  EXPECT_EQ(cases[1].keys.Text("integrator"), "simbody-merson");
  EXPECT_EQ(cases[1].keys.Find("jacobian"), nullptr);
}

TEST(PeersTest, ThatABuildDoesNotHaveAreNamedWithTheirPlace) {
  Experiment experiment = Read(Asking());
  ExpectPart(Refusal(experiment), "peers.json: /methods: " + std::string(kMessage));
  experiment.methods.resize(1);
  ExpectPart(Refusal(experiment), "peers.json: /timing/methods: " + std::string(kMessage));
  experiment.timing.methods.resize(1);
  EXPECT_EQ(Refusal(experiment), "none");
  experiment.timing.families = {{"chain", {3}, {{"peer/simbody", Enforcement::kPosition}}}};
  ExpectPart(Refusal(experiment), "peers.json: /timing/families: " + std::string(kMessage));
  experiment.timing.repeats = 0;
  EXPECT_EQ(Refusal(experiment), "none");
  EXPECT_THROW(MakePeer("peer/simbody", {}), ConfigError);
  EXPECT_EQ(MakePeer("odca", {}), nullptr);
  EXPECT_EQ(MakePeer("no-such-name", {}), nullptr);
}

TEST(PeersTest, ARegisteredOneIsMade) {
  InChild([] {
    int made = 0;
    RegisterPeer("peer/simbody", [&made](const MechanismDescription&) {
      ++made;
      return std::unique_ptr<Peer>();
    });
    EXPECT_EQ(Refusal(Read(Asking())), "none");
    MakePeer("peer/simbody", {});
    EXPECT_EQ(made, 1);
    EXPECT_THROW(RegisterPeer("peer/simbody", {}), std::invalid_argument);
    EXPECT_THROW(RegisterPeer("odca", {}), std::invalid_argument);
    EXPECT_THROW(RegisterPeer("peer/none", {}), std::invalid_argument);
  });
}

#ifndef LOOPBENCH_PEERS
TEST_F(CommandLineTest, PeersAreReadInEveryBuildAndRunWhereTheyAre) {
  Write("peers.json", Asking());
  Expect("check peers.json", 0, {"2 cases"});
  Expect("list peers.json", 0, {"peer/simbody"});
  Expect("explain peers.json", 0, {"peer/simbody: the library Simbody"});
  Expect("run peers.json --out out", 2, {"peers.json: /methods: ", kMessage});
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  Expect("estimate peers.json", 2, {kMessage});
}
#endif

}  // namespace loopbench::harness::peers_test
