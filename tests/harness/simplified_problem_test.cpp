// Runs of simplified problems have the results of runs of the whole problems.
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::simplified_problem_test {

using namespace reference;

const Method kColumn{"odca", Enforcement::kVelocity, Coordinates::kJoint,
                     SolverKind::kRankRevealing};
constexpr double kTolerance = 1e-10;
/// Two runs at kTolerance over 1 s differ by their errors of integration.
constexpr double kSameRun = 1e3 * kTolerance;

Record RunWith(const MechanismFile& file, const CompileOptions& options) {
  Experiment experiment = Single(file);
  experiment.compile = options;
  return RunCase(experiment, CaseOf(experiment, file.description.name, kColumn, kTolerance, 1.0));
}

double LastAngle(const Record& record, const std::string& joint) {
  const std::vector<double>& angles = record.Numbers("series.angle." + joint);
  return angles.empty() ? std::nan("") : angles.back();
}

TEST(SimplifiedProblemTest, NothingToSaveLeavesTheRecordAsItWas) {
  const MechanismFile file = Shipped("four-bar");
  const Record on = RunWith(file, CompileOptions()), off = RunWith(file, CompileOptions::None());
  EXPECT_EQ(on.Find("preprocessed"), nullptr);
  EXPECT_EQ(on.Text("state_hash"), off.Text("state_hash"));
}

TEST(SimplifiedProblemTest, RunsMoveAsTheWholeProblems) {
  MechanismFile tilted = Shipped("four-bar");
  tilted.description = InSpace(tilted.description, {0.3, -0.4, 0.5});
  const struct {
    MechanismFile file;
    const char* preprocessed;
    std::vector<std::string> joints;
  } rows[] = {{tilted, "planar", {"OA", "AB", "BC"}},
              {Shipped("welded-four-bar"), "welds", {"OA", "AB", "BC", "OC"}},
              {Shipped("truss"), "immovable", {"D", "E"}}};
  for (const auto& [file, preprocessed, joints] : rows) {
    SCOPED_TRACE(preprocessed);
    const Record on = RunWith(file, CompileOptions()), off = RunWith(file, CompileOptions::None());
    EXPECT_EQ(on.Text("preprocessed"), preprocessed);
    EXPECT_EQ(off.Find("preprocessed"), nullptr);
    ASSERT_EQ(on.Text("outcome"), "finished") << on.Text("message");
    ASSERT_EQ(off.Text("outcome"), "finished") << off.Text("message");
    for (const std::string& joint : joints) {
      EXPECT_NEAR(LastAngle(on, joint), LastAngle(off, joint), kSameRun) << joint;
    }
    if (file.description.name == "four-bar") {
      EXPECT_EQ(on.Number("rank_min"), off.Number("rank_min"));
    }
  }
}

TEST(SimplifiedProblemTest, AnglesThatAreWatchedInSpaceKeepRedundancyReleased) {
  MechanismFile file = Shipped("bennett");
  file.observe.branch_invariants = {{{"link2", 1.0}}};
  const SimplifiedProblem problem =
      SimplifyProblem(file.description, file.observe, CompileOptions());
  CompileOptions expected = CompileOptions::None();
  expected.redundancy = true;
  EXPECT_EQ(problem.compiled.done, expected);
}

TEST(SimplifiedProblemTest, IslandsRunAloneAndAddUp) {
  CompileOptions options;
  options.islands = true;
  const Record parts = RunWith(Shipped("four-islands"), options);
  const Record whole = RunWith(Shipped("four-islands"), CompileOptions());
  const Record one = RunWith(Shipped("four-bar"), CompileOptions());
  EXPECT_EQ(parts.Text("preprocessed"), "islands");
  EXPECT_EQ(whole.Find("preprocessed"), nullptr);
  ASSERT_EQ(parts.Text("outcome"), "finished");
  // the same four-bar four times, but for where the ground's origin is
  EXPECT_NEAR(parts.Number("steps"), 4 * one.Number("steps"), 4.0);
  EXPECT_EQ(parts.Number("rank_min"), 8);
  EXPECT_EQ(whole.Number("rank_min"), 8);
  EXPECT_LT(parts.Number("energy_error_max"), kSameRun);
  for (const char* loop : {"OCa", "OCb", "OCc", "OCd"}) {
    EXPECT_NE(parts.Find(std::string("drift.loop.") + loop), nullptr) << loop;
  }
}

/// All keys of a run of the whole mechanism, except series and keys of one sequence of steps.
TEST(SimplifiedProblemTest, IslandsKeepTheCountsOfProjectionAndNewton) {
  Experiment experiment = Single(Shipped("four-islands"));
  experiment.compile = CompileOptions();
  experiment.compile.islands = true;
  Method method = kColumn;
  method.enforcement = Enforcement::kPosition;
  Case one = CaseOf(experiment, "four-islands", method, 1e-6, 0.2);
  const Record projected = RunCase(experiment, one);
  ASSERT_EQ(projected.Text("outcome"), "finished") << projected.Text("message");
  EXPECT_GT(projected.Number("correction_max"), 0.0);
  EXPECT_EQ(projected.Find("newton_iterations"), nullptr);
  one.integrator = "kennedy-carpenter-43";
  EXPECT_GT(RunCase(experiment, one).Number("newton_iterations"), 0.0);
}

TEST(SimplifiedProblemTest, ObservedAnglesFollowTheirBodies) {
  // what is observed is a small body welded to the pendulum at 0.3 rad
  MechanismFile file = Shipped("pendulum");
  MechanismDescription& d = file.description;
  d.bodies.push_back(Bar("tag", 0.1, 1e-9, 1e-9));
  JointDescription weld;
  weld.name = "W";
  weld.type = JointType::kWeld;
  weld.from = {1, {0.5, 0.0, 0.0}, {0.0, 0.0, 0.3}};
  weld.to.body = 2;
  d.joints.push_back(weld);
  file.observe.closed_form->body = "tag";
  file.observe.closed_form->down_angle += 0.3;
  for (const CompileOptions& options : {CompileOptions(), CompileOptions::None()}) {
    const Record record = RunWith(file, options);
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    // the tag's mass changes the pendulum's frequency by some 1e-9
    EXPECT_LT(record.Number("closed_form_error_max"), 1e-7) << ToString(options);
  }
}

TEST(MergePartsTest, TakesTheWorstAndAddsTheWork) {
  harness::Run a, b;
  for (harness::Run* run : {&a, &b}) {
    run->record.Set("rank_min", std::int64_t{2});
    run->record.Set("steps", std::int64_t{10});
    run->record.Set("wall_s", 0.5);
    run->record.Set("energy_error_max", 1e-3);
    run->record.Set("outcome", run == &a ? "finished" : "singular");
    run->record.Set("t_reached", run == &a ? 2.0 : 1.0);
    run->record.Set("drift_position_max", run == &a ? 1e-6 : 1e-5);
    run->record.Set("worst_loop", run == &a ? "x" : "y");
  }
  b.record.Set("message", "lost");
  a.drift = {{0.0, 1.0, 2.0}, {0.0, 3.0, 1.0}};
  b.drift = {{0.0, 0.5, 1.0}, {0.0, 2.0, 1.0}};
  const harness::Run parts[] = {a, b};
  const harness::Run whole = MergeParts(parts);
  EXPECT_EQ(whole.record.Text("outcome"), "singular");
  EXPECT_EQ(whole.record.Text("message"), "lost");
  EXPECT_EQ(whole.record.Number("t_reached"), 1.0);
  EXPECT_EQ(whole.record.Number("steps"), 20.0);
  EXPECT_EQ(whole.record.Number("rank_min"), 4.0);
  EXPECT_EQ(whole.record.Text("worst_loop"), "y");
  EXPECT_DOUBLE_EQ(whole.record.Number("energy_error_max"), 2e-3);
  EXPECT_EQ(whole.drift.t, (std::vector<double>{0.0, 0.5, 1.0, 2.0}));
  EXPECT_EQ(whole.drift.value, (std::vector<double>{0.0, 2.0, 3.0, 1.0}));
}

}  // namespace loopbench::harness::simplified_problem_test
