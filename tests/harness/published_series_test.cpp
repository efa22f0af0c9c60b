// Runs held against published series: the shipped ones are met, planted errors are seen, and what a
// series does not have is left out.
#include "harness/config/published_series.h"

#include "harness/judge/analysis.h"
#include "tests/harness/cli_fixture.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::published_series_test {

using namespace reference;

const std::vector<std::string> kErrors = {
    "error_position_max", "error_position_end",     "error_position_rms", "error_rotation_max",
    "error_velocity_max", "error_displacement_max", "error_angle_max",    "error_angle_rate_max",
    "error_energy_max",   "error_phase_max",        "error_path_max"};

struct Held {
  Experiment experiment;
  Record Run(double rtol, double horizon, const std::string& profile = "ode45",
             Coordinates coordinates = Coordinates::kJoint) const {
    Case one = CaseOf(
        experiment, experiment.problems.front().name,
        {.formulation = "odca", .enforcement = Enforcement::kVelocity, .coordinates = coordinates},
        rtol, horizon);
    one.integrator = profile;
    return RunCase(experiment, one);
  }
  PublishedSeries& series() { return *experiment.problems.front().series; }
};

Held Against(const std::string& mechanism, const std::string& series) {
  Held held{Single(ReadMechanism(kConfigs / "mechanisms" / (mechanism + ".json")))};
  ExperimentProblem& problem = held.experiment.problems.front();
  problem.series = ReadPublishedSeries(kConfigs / "references" / (series + ".json"),
                                       &problem.mechanism.description);
  return held;
}

/// The keys among kErrors that the record has.
std::vector<std::string> ErrorsOf(const Record& record) {
  std::vector<std::string> found;
  for (const std::string& key : kErrors) {
    if (record.Find(key) != nullptr) found.push_back(key);
  }
  return found;
}

TEST(PublishedSeries, PrintedDigitsAreMetAndTellACoarseRunFromTheTruth) {
  struct Problem {
    const char *mechanism, *series, *profile;
    double horizon, fine, coarse;
  };
  // fine runs err less than a tenth of what is printed; coarse ones are told apart
  for (const Problem& problem :
       {Problem{"simple-pendulum", "iftomm-a01", "ode45", 10.0, 1e-11, 1e-4},
        Problem{"andrews-squeezer", "andrews-squeezer", "fehlberg-78", 0.03, 1e-14, 1e-4},
        Problem{"slider-crank", "sundials-slider-crank", "ode45", 10.0, 1e-11, 1e-3}}) {
    const Held held = Against(problem.mechanism, problem.series);
    for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
      const Record fine = held.Run(problem.fine, problem.horizon, problem.profile, coordinates);
      ASSERT_EQ(fine.Text("outcome"), "finished") << problem.series;
      EXPECT_LE(fine.Number("error_over_uncertainty"), 1.0) << problem.series;
      EXPECT_EQ(fine.Text("reference"), "published");
      EXPECT_EQ(fine.Text("reference_runs").find(problem.series), 0u);
      EXPECT_EQ(fine.Number("reference_valid_until"), problem.horizon);
      EXPECT_FALSE(HasWarning(fine, kErrorWarning)) << problem.series << fine.Text("warnings");
    }
    const Record coarse = held.Run(problem.coarse, problem.horizon);
    EXPECT_GT(coarse.Number("error_over_uncertainty"), 1.0) << problem.series;
  }
}

TEST(PublishedSeries, WhatItDoesNotHaveIsAbsent) {
  const Record points = Against("simple-pendulum", "iftomm-a01").Run(1e-8, 10.0);
  EXPECT_EQ(ErrorsOf(points), (std::vector<std::string>{"error_position_max", "error_position_end",
                                                        "error_position_rms"}));
  EXPECT_DOUBLE_EQ(points.Number("reference_error"), std::hypot(5e-7, 5e-7));
  const Record joints = Against("andrews-squeezer", "andrews-squeezer").Run(1e-8, 0.03);
  EXPECT_EQ(ErrorsOf(joints),
            (std::vector<std::string>{"error_angle_max", "error_angle_rate_max"}));
  EXPECT_EQ(joints.Find("reference_error"), nullptr);
  EXPECT_EQ(joints.Number("reference_error_angle"), 2e-9);
}

TEST(PublishedSeries, IsUsedAsFarAsTheHorizonGoesAndChangesNoBit) {
  Held held = Against("simple-pendulum", "iftomm-a01");
  const Record part = held.Run(1e-8, 1.2);
  EXPECT_EQ(part.Number("error_points"), 2);
  EXPECT_EQ(part.Number("reference_valid_until"), 1.0);
  EXPECT_EQ(part.Find("error_position_end"), nullptr) << "the horizon is behind the last time";
  const Record none = held.Run(1e-8, 0.25);
  EXPECT_EQ(none.Text("reference"), "none: \"iftomm-a01\" begins at 0.5 s, behind the horizon");
  EXPECT_EQ(ErrorsOf(none).size(), 0u);
  held.experiment.problems.front().series.reset();
  const Record alone = held.Run(1e-8, 1.2);
  for (const char* key : {"state_hash", "steps", "rhs_evaluations"}) {
    EXPECT_EQ(alone.Text(key), part.Text(key)) << key;
  }
}

TEST(PublishedSeries, PlantedErrorsAreMeasuredAndFlagged) {
  Held held = Against("simple-pendulum", "iftomm-a01");
  held.series().quantities[0].values[1] += 1e-3;
  // the rest is within the printed digits, 7e-7 m
  const Record fine = held.Run(1e-8, 10.0);
  EXPECT_NEAR(fine.Number("error_position_max"), 1e-3, 2e-6);
  EXPECT_TRUE(HasWarning(fine, kErrorWarning)) << "100 times a thousand tolerances";
  EXPECT_FALSE(HasWarning(held.Run(1e-5, 10.0), kErrorWarning))
      << "a tenth of a thousand tolerances";
  held.series().quantities[0].accuracy = 2e-3;
  const Record blunt = held.Run(1e-8, 10.0);
  EXPECT_FALSE(HasWarning(blunt, kErrorWarning)) << "it was claimed to no more";
  EXPECT_LE(blunt.Number("error_over_uncertainty"), 1.0);

  Held turned = Against("andrews-squeezer", "andrews-squeezer");
  turned.series().quantities[4].values[0] += 1e-3;
  const Record angle = turned.Run(1e-8, 0.03);
  EXPECT_NEAR(angle.Number("error_angle_max"), 1e-3, 1e-5);
  EXPECT_TRUE(HasWarning(angle, kErrorWarning));
  turned.series().quantities[4].values[0] += 2 * std::acos(-1.0) - 1e-3;
  EXPECT_LT(turned.Run(1e-8, 0.03).Number("error_angle_max"), 1e-4) << "a whole turn is none";
}

TEST(PublishedSeries, ClearsNoOtherWarning) {
  // it ends at the horizon and the run meets it; a singular passage remains one all the same
  Record record = Against("simple-pendulum", "iftomm-a01").Run(1e-9, 10.0);
  record.Set("singularity_crossings", std::int64_t{1});
  EXPECT_TRUE(OwnWarnings(record).find(kSingularWarning) != std::string::npos);
  record.Set("reference", std::string("long-double"));
  EXPECT_EQ(OwnWarnings(record).find(kSingularWarning), std::string::npos)
      << "a certified one does";
}

TEST(PublishedSeries, SpeedsAreThoseOfPointsAndJoints) {
  // n-four-bar starts with the tips of its cranks, 1 m up, at 1 m/s: O0 turns at -1 rad/s
  Held held{Single(ReadMechanism(kConfigs / "mechanisms/n-four-bar.json"))};
  const fs::path file = fs::path(testing::TempDir()) / "loopbench-speeds.json";
  WriteFileAtomically(file, R"({"name": "speeds", "source": "the start", "times": [0],
    "quantities": [
      {"body": "crank0", "point": "B", "axis": "x", "speed": true, "values": [1], "uncertainty": 1e-12},
      {"body": "crank0", "point": "B", "axis": "y", "speed": true, "values": [0], "uncertainty": 1e-12},
      {"body": "crank0", "axis": "angle", "speed": true, "values": [-1], "uncertainty": 1e-12},
      {"body": "crank0", "axis": "angle", "values": [1.5707963267948966], "uncertainty": 1e-12},
      {"joint": "O0", "speed": true, "values": [-1], "uncertainty": 1e-12},
      {"joint": "T1", "speed": true, "values": [0], "uncertainty": 10}]})");
  ExperimentProblem& problem = held.experiment.problems.front();
  problem.series = ReadPublishedSeries(file, &problem.mechanism.description);
  const Record record = held.Run(1e-8, 0.01);
  EXPECT_LE(record.Number("error_over_uncertainty"), 1.0);
  for (const char* key : {"error_velocity_max", "error_angular_velocity_max"}) {
    EXPECT_LE(record.Number(key), 1e-12) << key;
  }
  // the coupler stands still, the crank turns at -1: so does their pin, by the coupler
  EXPECT_NEAR(record.Number("error_angle_rate_max"), 1.0, 1e-12);
  fs::remove(file);
}

using PublishedSeriesCommands = CommandLineTest;

TEST_F(PublishedSeriesCommands, AreRunAndShownWhateverTheirNames) {
  WriteFileAtomically(folder_ / "s.json",
                      R"({"name": "a \"b\" <c> & `d` $e /f\ng", "source": "=1+1, 100 %",
 "times": [0, 0.05, 7], "quantities": [{"joint": "OA", "values": [0, 0, 0], "uncertainty": 1e3}]})");
  std::string experiment = ReadFile(folder_ / "tiny.json");
  experiment.insert(experiment.find('{') + 1, R"("reference": {"published_data": "s.json"},)");
  Write("held.json", experiment);
  Expect("check s.json held.json", 0, {"1 quantities at 3 times", "experiment"});
  Expect("run held.json --no-timing --out out", 0, {"results in out"});
  for (const std::string format : {"text", "csv", "markdown", "json", "latex"}) {
    const Ending table =
        Call("table out --columns reference,reference_runs,error_angle_max --format " + format);
    ExpectEnding(table, 0, {"published", "from the truth"});
  }
  ExpectEnding(
      Call("table out --kind all --where kind=reference --columns mechanism,reference_valid_until"),
      0, {});
  // another accuracy is another case
  Expect("run held.json --no-timing --out out", 0, {"ran 0 cases"});
  WriteFileAtomically(folder_ / "s.json", R"({"name": "s", "source": "x", "times": [0],
    "quantities": [{"joint": "OA", "values": [0], "uncertainty": 1e2}]})");
  const Ending again = Call("run held.json --no-timing --out out");
  ExpectNone(again.text, {"ran 0 cases"});
}

}  // namespace loopbench::harness::published_series_test
