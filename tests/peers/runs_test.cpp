// Whole runs by peers: they end where O-DCA does, the observers see them as they see ours, and what
// a peer does not have is named.
#include <gtest/gtest.h>

#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "tests/peers/shared.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_runs_test {

using peers_test::kInexpressible;
using reference::RunShipped;

const Method kSimbody = {"peer/simbody", Enforcement::kPosition};
const Method kOdca = {"odca", Enforcement::kPosition};

/// Time of a short run [s]: Andrews' squeezer turns a thousand times as fast as the others, and
/// Peaucellier's linkage passes a singular position at 0.32 s, where Simbody's energy jumps by 0.3
/// J.
double ShortHorizon(const std::string& name) {
  if (name == "peaucellier") return 0.3;
  if (name == "andrews-squeezer") return 0.005;
  return name == "flyball-governor" ? 0.02 : 0.5;
}

class ShippedRuns : public testing::TestWithParam<std::string> {};

TEST_P(ShippedRuns, OfSimbodyEndWhereThoseOfOdcaDo) {
  constexpr double kRtol = 1e-10;
  const double horizon = ShortHorizon(GetParam());
  const Record theirs = RunShipped(GetParam(), kSimbody, kRtol, horizon);
  if (const auto why = kInexpressible.find(GetParam()); why != kInexpressible.end()) {
    EXPECT_EQ(theirs.Text("outcome"), "unsupported");
    EXPECT_EQ(theirs.Text("message"), why->second);
    return;
  }
  ASSERT_EQ(theirs.Text("outcome"), "finished") << theirs.Text("message");
  EXPECT_EQ(theirs.Number("t_reached"), horizon);
  EXPECT_EQ(theirs.Text("integrator"), "simbody-merson");
  const Record ours = RunShipped(GetParam(), kOdca, kRtol, horizon);
  // some 100 steps with errors of rtol each, in both runs; half a second magnifies them little
  EXPECT_LE(peers_test::EndDifference(ours, theirs), 100 * kRtol);
  // its projection goes to a tenth of the tolerance, by a norm of all constraints
  EXPECT_LE(theirs.Number("drift_position_max"), kRtol);
  EXPECT_EQ(OwnWarnings(theirs), "");
}

INSTANTIATE_TEST_SUITE_P(All, ShippedRuns, testing::ValuesIn(reference::ShippedNames()),
                         [](const auto& name) { return reference::WithoutDashes(name.param); });

TEST(PeerRuns, CountWhatThePeerDid) {
  const Record run = RunShipped("four-bar", kSimbody, 1e-8, 1.0);
  // Merson's method evaluates five times a step
  EXPECT_GT(run.Number("steps"), 10.0);
  EXPECT_GE(run.Number("rhs_evaluations"), 4 * run.Number("steps"));
  EXPECT_TRUE(reference::IsSet(run, "energy_error_max"));
  EXPECT_FALSE(reference::IsSet(run, "correction_max"));  // ours are known, a peer's are not
}

TEST(PeerRuns, HaveNoEnergyBalanceWhereWorkIsDone) {
  const Record run = RunShipped("slider-crank", kSimbody, 1e-8, 0.1);  // with a damper
  EXPECT_EQ(run.Text("outcome"), "finished");
  EXPECT_FALSE(reference::IsSet(run, "energy_error_max"));
}

TEST(PeerRuns, EndAtTheirLimits) {
  const Experiment experiment = reference::Single(reference::Shipped("four-bar"));
  Case one = reference::CaseOf(experiment, "four-bar", kSimbody, 1e-8, 10.0);
  one.limits.steps = 7;
  Record run = RunCase(experiment, one);
  EXPECT_EQ(run.Text("outcome"), "step-limit");
  EXPECT_EQ(run.Number("steps"), 7.0);
  one.limits = {.cpu_s = 1e-6};
  run = RunCase(experiment, one);
  EXPECT_EQ(run.Text("outcome"), "time-limit");
  EXPECT_LT(run.Number("t_reached"), 10.0);
}

TEST(PeerRuns, ThatGetStuckSayWhere) {
  // all five rows of Bennett's closure, of which three are redundant: Simbody loses their rank
  MechanismFile bennett = reference::Shipped("bennett");
  Experiment experiment = reference::Single(bennett);
  experiment.compile.redundancy = false;
  const Record run =
      RunCase(experiment, reference::CaseOf(experiment, "bennett", kSimbody, 1e-10, 10.0));
  EXPECT_EQ(run.Text("outcome"), "step-too-small");
  EXPECT_EQ(run.Text("message").find("peer/simbody: Unable to advance time past"), 0u)
      << run.Text("message");
  EXPECT_GT(run.Number("t_reached"), 0.1);
}

TEST(PeerRuns, AreEqualWhenRepeated) {
  const auto hash = [] { return RunShipped("bennett", kSimbody, 1e-8, 0.5).Text("state_hash"); };
  EXPECT_EQ(hash(), hash());
}

TEST(PeerRuns, AreTimedBesideOthers) {
  Experiment experiment = reference::Single(reference::Shipped("four-bar"));
  experiment.problems.front().horizons = {0.1};
  experiment.timing = {.repeats = 1, .methods = {kOdca, kSimbody}, .families = {}};
  experiment.timing.families = {{"ladder", {2}, {kOdca, kSimbody}}};
  for (const TimingGroup& group : TimingGroups(experiment)) {
    const std::vector<Record> records = TimeTogether(experiment, group);
    ASSERT_EQ(records.size(), 2u);
    for (const Record& record : records) {
      EXPECT_EQ(record.Text("outcome"), "finished") << group.name;
      EXPECT_GT(record.Number("rhs_ns_median"), 0.0);
      EXPECT_EQ(record.Number("wall_s_median") > 0.0, group.simulate);
      EXPECT_EQ(record.Number("dof"), records.front().Number("dof"));
    }
  }
}

TEST(PeerRuns, OfWhatCannotBeExpressedAreRowsOfTimingsToo) {
  Experiment experiment = reference::Single(reference::Shipped("driven-four-bar"));
  experiment.problems.front().horizons = {0.1};
  experiment.timing = {.repeats = 1, .methods = {kOdca, kSimbody}, .families = {}};
  const std::vector<Record> records = TimeTogether(experiment, TimingGroups(experiment).front());
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].Text("outcome"), "finished");
  EXPECT_EQ(records[1].Text("outcome"), "unsupported");
  EXPECT_EQ(records[1].Text("message"), kInexpressible.at("driven-four-bar"));
}

TEST(PeerRegistration, RefusesNamesThatAreNoPeersAndSecondPrograms) {
  for (const char* name : {"odca", "peer/none", "peer/simbody"}) {
    EXPECT_THROW(RegisterPeer(name, {}), std::invalid_argument) << name;
  }
}

}  // namespace peers_runs_test
}  // namespace loopbench::harness
