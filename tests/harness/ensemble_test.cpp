// Ensembles: starts that are drawn far away stay on their branch, and runs that leave it are
// counted.
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::ensemble_test {

using namespace reference;

Case Drawing(const std::string& joint, double from, double to) {
  Case one;
  one.ensemble = 100;
  one.seed = 3;
  one.between = {{joint, from, to}};
  return one;
}

double Held(const MechanismDescription& description) {
  return description.initial.coordinates.at(0).values.at(0);
}

/// Absolute angle of the coupler of a four-bar at its assembled start, within half a turn.
double CouplerAngle(const MechanismDescription& description) {
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(description, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  return std::remainder(kinematics.poses()[2].angle, 2 * kPi);
}

TEST(MemberStart, OfASmallPerturbationIsThePerturbedDescription) {
  const MechanismDescription description = Shipped("four-bar").description;
  Case one;
  one.ensemble = 16;
  one.seed = 5;
  one.perturb = 0.02;
  for (int member = 0; member < 4; ++member) {
    const MechanismDescription expected = Perturb(description, 0.02, 5, member);
    const MechanismDescription start = MemberStart(description, one, member);
    ASSERT_EQ(start.initial.coordinates.size(), expected.initial.coordinates.size());
    for (std::size_t j = 0; j < start.initial.coordinates.size(); ++j) {
      EXPECT_EQ(start.initial.coordinates[j].values, expected.initial.coordinates[j].values);
    }
  }
}

TEST(MemberStart, IsDrawnBetweenItsBoundsAndTheSameEverywhere) {
  const MechanismDescription description = Shipped("parallelogram").description;
  const Case one = Drawing("OA", -4.0, 1.0);
  std::set<double> drawn;
  double sum = 0.0;
  for (int member = 0; member < 100; ++member) {
    const double value = Held(MemberStart(description, one, member));
    EXPECT_GE(value, -4.0);
    EXPECT_LT(value, 1.0);
    EXPECT_EQ(value, Held(MemberStart(description, one, member)));
    drawn.insert(value);
    sum += value;
  }
  EXPECT_EQ(drawn.size(), 100u);
  // a uniform mean of 100: standard deviation 5 / sqrt(12) / 10
  EXPECT_NEAR(sum / 100, -1.5, 4 * 0.145);
  EXPECT_EQ(Held(MemberStart(description, one, 0)), -2.2086389071722405);
}

TEST(MemberStart, StaysOnTheBranchThroughPositionsWhereBranchesCross) {
  const MechanismDescription description = Shipped("parallelogram").description;
  const double coupler = CouplerAngle(description);
  // all round: through both positions with all bars in one line
  const Case one = Drawing("OA", -1.0707963267948966 - kPi, -1.0707963267948966 + kPi);
  int left_by_guesses = 0;
  for (int member = 0; member < 100; ++member) {
    const MechanismDescription start = MemberStart(description, one, member);
    EXPECT_LT(std::abs(std::remainder(CouplerAngle(start) - coupler, 2 * kPi)), 1e-9) << member;
    MechanismDescription guessed = description;  // from the description's own guesses instead
    guessed.initial.coordinates[0].values[0] = Held(start);
    left_by_guesses += std::abs(std::remainder(CouplerAngle(guessed) - coupler, 2 * kPi)) > 1e-3;
  }
  EXPECT_GT(left_by_guesses, 10);  // what the steps are for
}

TEST(MemberStart, ThatCannotBeReachedSaysSoItself) {
  // bars of 1 m on a ground of 1.5 m: coupler and rocker do not reach a crank that points away
  MechanismDescription description = Shipped("dead-centre").description;
  Case one;
  one.ensemble = 2;
  one.perturb = 0.0;
  const std::string joint =
      description.joints[static_cast<std::size_t>(description.initial.coordinates[0].joint)].name;
  one.between = {{joint, 2.5, 3.5}};
  const MechanismDescription start = MemberStart(description, one, 0);
  EXPECT_GE(Held(start), 2.5);
  const Mechanism<Planar, double> mechanism(start, Coordinates::kJoint);
  const Start<double> assembled = Assemble<Planar>(start, mechanism);
  EXPECT_EQ(assembled.outcome, Outcome::kInconsistentStart);
  EXPECT_FALSE(assembled.message.empty());
}

Case ParallelogramCase(const Experiment& experiment, const Method& method) {
  Case one = CaseOf(experiment, "parallelogram", method, 1e-8, 5.0);
  one.ensemble = 8;
  one.seed = 1;
  one.between = {{"OA", -1.4, -0.6}};
  return one;
}

TEST(Ensemble, CountsTheRunsThatStayOnTheirBranch) {
  const Method published = Published("lagrange", Coordinates::kJoint);
  const Record lost = RunCase(Paper(), ParallelogramCase(Paper(), published));
  EXPECT_EQ(lost.Number("ensemble_size"), 8);
  EXPECT_EQ(lost.Number("ensemble_started_off"), 0);
  EXPECT_EQ(lost.Number("ensemble_branch_bound"), 1e-6);
  EXPECT_LT(lost.Number("ensemble_branch_kept") + lost.Number("ensemble_failed"), 8);
  EXPECT_GT(lost.Number("ensemble_branch_error_max"), 0.1);

  Method position = Published("odca", Coordinates::kJoint);
  position.enforcement = Enforcement::kPosition;
  position.solver = SolverKind::kRankRevealing;
  Case one = ParallelogramCase(Paper(), position);
  const Record kept = RunCase(Paper(), one);
  EXPECT_EQ(kept.Number("ensemble_branch_kept"), 8);
  EXPECT_LE(kept.Number("ensemble_branch_error_max"), 1e-6);
  EXPECT_GT(kept.Number("ensemble_closed_form_error_max"), 0.0);
  EXPECT_GT(kept.Number("ensemble_energy_error_max"), 0.0);
  EXPECT_EQ(kept.Number("ensemble_failed"), 0);

  one.branch_bound = 1e-15;  // nothing is as near as that
  EXPECT_EQ(RunCase(Paper(), one).Number("ensemble_branch_kept"), 0);
}

/// Right-hand sides of several members are evaluated in lanes, projections of each by itself.
TEST(Ensemble, IsThatOfItsMembersOneByOneOnAnyNumberOfThreads) {
  for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kPosition}) {
    Method method = Published("odca", Coordinates::kJoint);
    method.enforcement = level;
    method.solver = SolverKind::kRankRevealing;
    Case one = CaseOf(Paper(), "four-bar", method, 1e-7, 2.0);
    one.ensemble = 21;
    one.perturb = 0.3;
    Experiment experiment = Paper();
    MechanismDescription& description = experiment.problems[one.problem].mechanism.description;
    const MechanismDescription nominal = description;
    double energy = 0.0, drift = 0.0;
    for (int member = 0; member < one.ensemble; ++member) {
      description = MemberStart(nominal, one, member);
      Case alone = one;
      alone.ensemble = 1;
      const Record record = RunCase(experiment, alone);
      ASSERT_EQ(record.Text("outcome"), "finished");
      energy = std::max(energy, record.Number("energy_error_max"));
      drift = std::max(drift, record.Number("drift_position_max"));
    }
    for (const int threads : {1, 3}) {
      const Record record = RunCase(Paper(), one, nullptr, {}, threads);
      EXPECT_EQ(record.Number("ensemble_failed"), 0);
      EXPECT_EQ(record.Number("ensemble_energy_error_max"), energy) << ToString(level);
      EXPECT_EQ(record.Number("ensemble_drift_position_max"), drift) << ToString(level);
    }
  }
}

TEST(Ensemble, KnowsNothingOfABranchWhereTheProblemDoesNot) {
  Case one = CaseOf(Paper(), "four-bar", Published("odca", Coordinates::kJoint), 1e-6, 0.1);
  one.ensemble = 2;
  one.perturb = 0.02;
  const Record record = RunCase(Paper(), one);
  EXPECT_EQ(record.Number("ensemble_size"), 2);
  EXPECT_EQ(record.Find("ensemble_branch_kept"), nullptr);
  EXPECT_GT(record.Number("ensemble_energy_error_max"), 0.0);
}

Run Member(double branch_start, double branch_error, const std::string& outcome = "finished") {
  Run run;
  run.record.Set("outcome", outcome);
  run.record.Set("branch_error_max", branch_error);
  run.record.Set("t_reached", 1.0);
  run.branch_start = {branch_start};
  return run;
}

TEST(EnsembleTally, CountsFinishedRunsOnTheBranchOfTheUnperturbedOne) {
  EnsembleTally tally(Member(0.5, 0.0), 1e-6);
  tally.Add(Member(0.5, 1e-6), Shipped("four-bar").description);
  tally.Add(Member(0.5 + 2 * kPi, 1e-9), Shipped("four-bar").description);
  tally.Add(Member(0.5, 2e-6), Shipped("four-bar").description);
  tally.Add(Member(0.5, 1e-9, "singular"), Shipped("four-bar").description);
  tally.Add(Member(1.5, 1e-9), Shipped("four-bar").description);
  Record record;
  tally.Write(record);
  EXPECT_EQ(record.Number("ensemble_size"), 5);
  EXPECT_EQ(record.Number("ensemble_failed"), 1);
  EXPECT_EQ(record.Number("ensemble_branch_kept"), 2);
  EXPECT_EQ(record.Number("ensemble_started_off"), 1);
  EXPECT_EQ(record.Number("ensemble_branch_error_max"), 2e-6);
  EXPECT_EQ(record.Text("ensemble_first_left"),
            "member 2 (OA = -1, AB = 0.841188, BC = 1.75733): finished at 1 s");
  EXPECT_EQ(record.Text("ensemble_first_failed"),
            "member 3 (OA = -1, AB = 0.841188, BC = 1.75733): singular at 1 s");
  EXPECT_EQ(record.Find("ensemble_closed_form_error_max"), nullptr);
}

TEST(EnsembleTally, DoesNotLoseAnErrorThatIsNotFinite) {
  EnsembleTally tally(Member(0.5, 0.0), 1e-6);
  tally.Add(Member(0.5, std::numeric_limits<double>::quiet_NaN()), Shipped("four-bar").description);
  tally.Add(Member(0.5, 1e-9), Shipped("four-bar").description);
  Record record;
  tally.Write(record);
  EXPECT_TRUE(std::isnan(record.Number("ensemble_branch_error_max")));
  EXPECT_EQ(record.Number("ensemble_branch_kept"), 1);
}

}  // namespace loopbench::harness::ensemble_test
