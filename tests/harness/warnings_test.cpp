// Each warning is raised by its cause alone; runs of one problem judge each other;
// and the runs that the rules were made for have them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <string>
#include <vector>

#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"
#include "mechanism/description/library.h"
#include "tests/harness/records.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace warnings_test {

using namespace reference;
using enum Enforcement;

Record EndingAt(const std::vector<double>& pose, Record record) {
  return Changed(std::move(record), "series.final.bar1", pose);
}

/// A run without warnings: the four-bar, 20 s at 1e-8.
Record Sound(const std::string& enforcement = "acceleration",
             const std::string& coordinates = "joint") {
  Record record = RecordOf(
      "kind", "accuracy", "mechanism", "four-bar", "formulation", "odca", "enforcement",
      enforcement, "coordinates", coordinates, "rtol", 1e-8, "horizon", 20.0, "problem_id",
      "problem", "link_length", 1.0, "position_goal", 2.7e-15, "outcome", "finished", "t_reached",
      20.0, "steps", 500, "energy_error_max", 1e-6, "energy_error_relative", 1e-6, "energy_scale",
      1.0, "drift_position_max", enforcement == "projection" ? 1e-15 : 1e-8, "drift_rotation_max",
      0.0, "regularized_evaluations", 0, "singularity_distance_min", 0.75, "singularity_crossings",
      0, "ensemble_failed", 0, "growth_exponent", 2.3, "growth_regime", "truncation",
      "growth_resolved", false);  // a single run
  return EndingAt({0.1, 0.2, 3.0}, record);
}

/// The warnings of such a run with key, value, key, value, ...
template <class... Members>
std::string With(const std::string& enforcement, const Members&... members) {
  return OwnWarnings(Changed(Sound(enforcement), members...));
}

TEST(Warnings, ASoundRunHasNoneAtAnyLevel) {
  for (const char* level : {"acceleration", "velocity", "projection", "baumgarte"}) {
    EXPECT_EQ(OwnWarnings(Sound(level)), "") << level;
  }
}

TEST(Warnings, EnergyIsComparedWithWhatMoves) {
  constexpr double coarse = 1e-4;  // whose steps explain more than a hundredth
  EXPECT_EQ(With("velocity", "energy_error_max", 0.02, "rtol", coarse), "energy");
  EXPECT_EQ(With("velocity", "energy_error_max", 0.009, "rtol", coarse), "");
  // a slow motion has little kinetic energy, and moves the energy of its potential all the same
  EXPECT_EQ(With("velocity", "energy_error_max", 0.02, "energy_scale", 50.0, "rtol", coarse), "");
  // without a tolerance there is only the first limit
  EXPECT_EQ(With("velocity", "energy_error_max", 0.009, "rtol", Value(), "step", 0.1), "");
  // records of before
  EXPECT_EQ(With("velocity", "energy_scale", Value(), "energy_error_relative", 0.5), "energy");
}

TEST(Warnings, EnergyIsComparedWithStepsAndTolerance) {
  // nearly singular four-bar (ground 1.0000003) by multipliers, and by O-DCA, at 1e-8
  EXPECT_EQ(With("projection", "energy_error_max", 7.2e-4, "energy_scale", 53.0,
                 "energy_sensitivity", 53.0, "steps", 2987),
            "energy");
  EXPECT_EQ(With("projection", "energy_error_max", 1.2e-6, "energy_scale", 53.0,
                 "energy_sensitivity", 53.0, "steps", 2987),
            "");
  // slow motion errs by an absolute tolerance of position or speed
  EXPECT_EQ(With("projection", "energy_error_max", 1e-6, "energy_scale", 1e-6), "energy");
  EXPECT_EQ(With("projection", "energy_error_max", 1e-9, "energy_scale", 1e-6, "energy_sensitivity",
                 1e-3),
            "");
  EXPECT_EQ(With("projection", "energy_error_max", 1e-9, "energy_scale", 1e-6), "energy");
  // drift does work, and peers have tolerances of their own
  EXPECT_EQ(With("acceleration", "energy_error_max", 2e-5), "");
  EXPECT_EQ(With("velocity", "energy_error_max", 2e-5), "energy");
  const std::string simbody = "peer/simbody";
  EXPECT_EQ(With("velocity", "energy_error_max", 2e-5, "formulation", simbody), "");
}

TEST(Warnings, TheLargestToleranceCounts) {
  const auto warnings = [](const auto&... tolerances) {
    return With("acceleration", tolerances..., "rtol", 1e-12, "energy_error_max", 1e-5,
                "drift_position_max", 1e-6);
  };
  EXPECT_NE(warnings(), "");
  EXPECT_NE(warnings("atol", 1e-12), "");
  EXPECT_EQ(warnings("atol", 1e-6), "");
  EXPECT_EQ(warnings("atol_length", 1e-12, "atol_angle", 1e-6), "");
}

TEST(Warnings, AMeasureThatIsNoNumberIsOne) {
  EXPECT_EQ(With("velocity", "energy_error_max", Value()), "energy");
  EXPECT_EQ(With("velocity", "energy_scale", Value()), "energy");
  EXPECT_EQ(With("velocity", "drift_position_max", Value()), "drift");
  EXPECT_EQ(With("velocity", "drift_rotation_max", Value()), "drift");
  EXPECT_EQ(With("projection", "position_goal", Value()), "drift");
  // nothing moves, and no energy is off
  EXPECT_EQ(With("velocity", "energy_error_max", 0.0, "energy_scale", 0.0), "");
}

TEST(Warnings, SingularPassagesCountBelowLevelPosition) {
  EXPECT_EQ(With("velocity", "singularity_crossings", 1), "singular-crossing");
  EXPECT_EQ(With("projection", "singularity_crossings", 1), "");
  EXPECT_EQ(With("acceleration", "singularity_distance_min", 1e-4), "singular-crossing");
  // drift of 4e-7 links misses a singular position by up to 1.3e-3: a parallelogram that left its
  // flat position as an antiparallelogram
  const auto missed = [](double distance, double drift) {
    return With("velocity", "singularity_distance_min", distance, "drift_position_max", drift,
                "link_length", 0.9);
  };
  EXPECT_EQ(missed(2.88e-4, 3.57e-7), "singular-crossing");
  EXPECT_EQ(missed(2e-3, 3.57e-7), "");
  // loops too large for the distance report regularized evaluations
  EXPECT_EQ(With("acceleration", "singularity_distance_min", Value(), "regularized_evaluations", 3),
            "singular-crossing");
  // reduction changes its independent set in regular motion too
  EXPECT_EQ(With("velocity", "mode_changes", 5), "");
}

TEST(Warnings, RegularizationAwayFromSingularPositions) {
  constexpr int some = 304;
  for (const char* level : {"acceleration", "velocity", "projection"}) {
    EXPECT_EQ(With(level, "regularized_evaluations", some), "regularized");
    EXPECT_EQ(With(level, "regularized_evaluations", some, "singularity_distance_min", 3.6e-4),
              "regularized");
  }
  EXPECT_EQ(With("projection", "regularized_evaluations", some, "singularity_distance_min", 1e-4),
            "");
  EXPECT_EQ(With("projection", "regularized_evaluations", some, "singularity_crossings", 1), "");
  EXPECT_EQ(
      With("projection", "regularized_evaluations", some, "singularity_distance_min", Value()), "");
}

TEST(Warnings, DriftBeyondWhatTheLevelPromises) {
  // Bennett's linkage at 1e-8 with its redundant rows kept: the least of six runs over 50 s, and
  // its sound neighbour, a crank-rocker driven at 3 rad/s over 20 s at 1e-6
  EXPECT_EQ(With("acceleration", "drift_position_max", 8.8e-3, "steps", 2110), "drift");
  EXPECT_EQ(With("acceleration", "drift_position_max", 3.04e-4, "rtol", 1e-6, "steps", 249,
                 "link_length", 1.2),
            "");
  // what is right at one level is not at the next
  EXPECT_EQ(With("velocity", "drift_position_max", 1e-5), "drift");
  EXPECT_EQ(With("acceleration", "drift_position_max", 1e-5), "");
  EXPECT_EQ(With("velocity", "drift_position_max", 5e-7), "");
  EXPECT_EQ(With("baumgarte", "drift_position_max", 1e-5), "drift");
  EXPECT_EQ(With("projection", "drift_position_max", 1e-9), "drift");
  // Simbody projects to a tenth of its tolerance, not to round-off
  const std::string simbody = "peer/simbody";
  EXPECT_EQ(With("projection", "drift_position_max", 1e-9, "formulation", simbody), "");
  EXPECT_EQ(With("projection", "drift_position_max", 2e-7, "formulation", simbody), "drift");
  // gains of 0.1 1/s forget within 20 s: nothing of this run
  EXPECT_EQ(With("baumgarte", "drift_position_max", 1e-5, "alpha", 0.1, "beta", 0.1), "");
  // lengths are those of the links
  EXPECT_EQ(With("velocity", "drift_position_max", 5e-7, "link_length", 1e-3), "drift");
  EXPECT_EQ(With("velocity", "drift_rotation_max", 1e-3), "drift");
}

TEST(Warnings, AReferenceJudgesFixedStepsToo) {
  const auto off = [](double error, const char* key = "error_position_max") {
    return With("acceleration", "rtol", Value(), "step", 0.01, "link_length", 0.35,
                "reference_error", 1e-15, "reference_error_angle", 1e-15, key, error);
  };
  EXPECT_EQ(off(0.012), "error");
  EXPECT_EQ(off(0.003), "");
  EXPECT_EQ(off(std::nan("")), "error");
  EXPECT_EQ(off(0.02, "error_angle_max"), "error");
  EXPECT_EQ(off(0.005, "error_angle_max"), "");
}

TEST(Warnings, EnsemblesThatFailOrDoNotResolveWhatTheyWereAskedFor) {
  EXPECT_EQ(With("velocity", "ensemble_failed", 16), "ensemble-failures");
  EXPECT_EQ(With("velocity", "ensemble_size", 16), "exponent");
  EXPECT_EQ(With("velocity", "ensemble_size", 16, "growth_resolved", true), "");
  EXPECT_EQ(With("velocity", "ensemble_size", 16, "growth_regime", "round-off"), "");
}

TEST(Warnings, AFailedRunHasItsOutcomeAndNoWarnings) {
  EXPECT_EQ(With("velocity", "energy_error_max", 9.0, "outcome", "singular"), "");
}

/// Columns of one problem: those at level projection and velocity agree, one took another branch.
std::vector<Record> Problem(double rtol, double wrong_angle) {
  std::vector<Record> records = {Sound("projection"), Sound("velocity"),
                                 Sound("velocity", "absolute")};
  for (Record& record : records) {
    record = Changed(record, "rtol", rtol, "energy_error_max", 100 * rtol);
  }
  records[0] = EndingAt({0.1, 0.2, 3.0 + 100 * rtol}, records[0]);
  records[2] = EndingAt({0.1, 0.2, wrong_angle}, records[2]);
  return records;
}

constexpr const char* kAlike = ":1 :1 :1 ";
constexpr const char* kApart = "disagreement:1 disagreement:1 disagreement:2 ";

std::string WarningsAndClusters(std::vector<Record> records) {
  SetWarnings(&records);
  std::string text;
  for (const Record& record : records) {
    text += record.Text("warnings") + ":" + record.Text("agreement") + " ";
  }
  return text;
}

TEST(Agreement, RunsThatEndElsewhereMakeAllOfTheirToleranceFlagged) {
  EXPECT_EQ(WarningsAndClusters(Problem(1e-8, 3.0)), kAlike);
  EXPECT_EQ(WarningsAndClusters(Problem(1e-8, 2.0)), kApart);
  // angles count with their turns
  EXPECT_EQ(WarningsAndClusters(Problem(1e-8, 3.0 + 2 * M_PI)), kApart);
  // 1e-3 is a thousand tolerances of 1e-6, and more of 1e-8
  EXPECT_EQ(WarningsAndClusters(Problem(1e-6, 3.0009)), kAlike);
  EXPECT_EQ(WarningsAndClusters(Problem(1e-8, 3.0009)), kApart);
  // no other run to compare with: another problem, another horizon, a failed run
  const std::vector<Record> apart = Problem(1e-8, 2.0);
  for (const Record& other :
       {Changed(apart[2], "problem_id", "other"), Changed(apart[2], "horizon", 10.0),
        Changed(apart[2], "outcome", "singular")}) {
    EXPECT_EQ(WarningsAndClusters({apart[0], apart[1], other}), ":1 :1 : ");
  }
  // lengths are compared over links
  std::vector<Record> records = Problem(1e-8, 3.0);
  records[2] = EndingAt({0.11, 0.2, 3.0}, records[2]);
  EXPECT_EQ(WarningsAndClusters(records), kApart);
  for (Record& record : records) record.Set("link_length", 1e4);
  EXPECT_EQ(WarningsAndClusters(records), kAlike);
}

TEST(Agreement, FinerTolerancesDecideWhereDifferentEquationsAgree) {
  const auto both = [](std::vector<Record> finer, const std::vector<Record>& coarser) {
    finer.insert(finer.begin(), coarser.begin(), coarser.end());
    return WarningsAndClusters(finer);
  };
  EXPECT_EQ(both(Problem(1e-10, 3.0), Problem(1e-8, 2.0)), ":1 :1 disagreement:2 :1 :1 :1 ");
  // all coarse runs wrong alike
  std::vector<Record> alike = Problem(1e-8, 2.0);
  for (Record& record : alike)
    record.Set("series.final.bar1", alike[2].Numbers("series.final.bar1"));
  EXPECT_EQ(both(Problem(1e-10, 3.0), alike),
            "disagreement:1 disagreement:1 disagreement:1 :1 :1 :1 ");
  // one level and coordinate set makes one mistake, however many formulations make it
  std::vector<Record> same = Problem(1e-10, 3.0);
  same.resize(2);
  same[0] = same[1];
  EXPECT_EQ(both(same, Problem(1e-8, 2.0)), "disagreement:1 disagreement:1 disagreement:2 :1 :1 ");
}

TEST(Agreement, RunsThatWarningThemselvesDecideNothing) {
  // the third passed a singular position below level projection, and ended elsewhere
  std::vector<Record> records = Problem(1e-8, 2.0);
  records[2].Set("singularity_crossings", std::int64_t{1});
  EXPECT_EQ(WarningsAndClusters(records), ":1 :1 singular-crossing disagreement:2 ");
  // one that went the same way as level projection kept its branch
  records = Problem(1e-8, 3.0);
  records[2].Set("singularity_crossings", std::int64_t{1});
  EXPECT_EQ(WarningsAndClusters(records), kAlike);
  // but not where nobody's level keeps one
  records[0].Set("enforcement", std::string("velocity"));
  EXPECT_EQ(WarningsAndClusters(records), ":1 :1 singular-crossing:1 ");
  // if all runs have warnings, all are compared, and a majority clears none
  records = Problem(1e-8, 2.0);
  records[0].Set("enforcement", std::string("velocity"));
  for (Record& record : records) record.Set("singularity_crossings", std::int64_t{1});
  EXPECT_EQ(WarningsAndClusters(records),
            "singular-crossing disagreement:1 singular-crossing disagreement:1 "
            "singular-crossing disagreement:2 ");
}

TEST(Agreement, PeersTestifyUnlessTheirClosuresGiveWay) {
  const auto with_peer = [](const char* name, double angle) {
    std::vector<Record> records = Problem(1e-8, 3.0);
    records[2].Set("formulation", std::string(name));
    records[2] = EndingAt({0.1, 0.2, angle}, records[2]);
    return WarningsAndClusters(records);
  };
  EXPECT_EQ(with_peer("peer/simbody", 3.0), kAlike);
  EXPECT_EQ(with_peer("peer/simbody", 2.0), kApart);
  EXPECT_EQ(with_peer("peer/mujoco", 3.0), kAlike);
  EXPECT_EQ(with_peer("peer/mujoco", 2.0), ":1 :1 disagreement:2 ");
  // beside others that disagree it is no better than they
  std::vector<Record> records = Problem(1e-8, 2.0);
  records.push_back(records[0]);
  records[3].Set("formulation", std::string("peer/mujoco"));
  EXPECT_EQ(WarningsAndClusters(records),
            "disagreement:1 disagreement:1 disagreement:2 disagreement:3 ");
  // and alone it has nobody
  EXPECT_EQ(WarningsAndClusters({records[3], records[3]}), ": : ");
}

TEST(WarningNotes, NameRowsNumbersAndWhoAgrees) {
  std::vector<Record> records = Problem(1e-8, 2.0);
  records[1].Set("energy_error_max", 0.5);
  SetWarnings(&records);
  const std::vector<std::string> notes = WarningNotes(records, records);
  ASSERT_EQ(notes.size(), 3u);
  EXPECT_EQ(notes[1],
            "energy: error of the energy balance above 1 % of the exchanged energy, or larger than "
            "steps and tolerance explain: velocity/joint (50 %, at most 0.00021 % expected)");
  EXPECT_EQ(notes[2],
            "disagreement: four-bar rtol 1e-08 horizon 20: final states differ by 1 links or rad "
            "(bar1), more than 1000 tolerances; projection/joint, velocity/joint agree; "
            "no agreement: velocity/absolute");
  // a table of one row judges it by the others of the store
  EXPECT_EQ(WarningNotes(std::vector<Record>{records[2]}, records).back(), notes[2]);
  std::vector<Record> sound = {Sound()};
  SetWarnings(&sound);
  EXPECT_TRUE(WarningNotes(sound, sound).empty());
}

TEST(WarningNotes, ProblemsHaveTheirParametersAndRunsNoEmptyTolerance) {
  std::vector<Record> records;
  for (const double mass : {1.0, 10.0}) {
    for (const Record& run : Problem(1e-8, mass)) {
      Record swept = RecordOf("coupler_mass", mass);
      for (const auto& [key, value] : run.items()) swept.Set(key, value);
      swept.Set("problem_id", run.Text("problem_id") + std::to_string(mass));
      records.push_back(swept);
    }
  }
  SetWarnings(&records);
  const std::vector<std::string> notes = WarningNotes(records, records);
  ExpectWords(Joined(notes, "\n"), {"rtol 1e-08 horizon 20 coupler_mass 1: final states differ",
                                    "horizon 20 coupler_mass 10: final states"});
  Record step = RecordOf("enforcement", "velocity", "rtol",
                         std::numeric_limits<double>::quiet_NaN(), "step", 0.02 * std::sqrt(0.1));
  EXPECT_EQ(NameOfRow(step, {"enforcement", "rtol", "step"}), "velocity step 0.006325");
  step.Set("rtol", Value());
  EXPECT_EQ(NameOfRow(step, {"enforcement", "rtol", "step"}), "velocity step 0.006325");
}

TEST(WarningNotes, TheDistanceIsThatOfAnyTwoRunsInWhateverOrder) {
  // the first run lies between the others in one order, and at an end in another
  std::vector<double> ends = {-0.5, 0.0, 1.0, 3.0};
  do {
    std::vector<Record> records;
    for (const double x : ends) {
      records.push_back(
          EndingAt({x, 0.2, 3.0}, Changed(Sound(), "solver", "solver " + std::to_string(x))));
    }
    SetWarnings(&records);
    ExpectWords(WarningNotes(records, records).back(), {"differ by 3.5 links or rad (bar1)"});
  } while (std::ranges::next_permutation(ends).found);
}

TEST(Agreement, WhatIsNoNumberAgreesWithNothing) {
  for (const double odd : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    for (const bool both : {false, true}) {
      std::vector<Record> records = {Sound("projection"), Sound("velocity")};
      records[0] = EndingAt({0.1, odd, 3.0}, records[0]);
      if (both) records[1] = records[0];
      EXPECT_EQ(WarningsAndClusters(records), "disagreement:1 disagreement:2 ");
      EXPECT_TRUE(std::isinf(DifferenceOf(records[0], records[1]).largest));
      EXPECT_TRUE(std::isinf(LargestDifference(records).largest));
    }
  }
  std::vector<Record> records = {Sound("projection"), Sound("velocity")};
  records[1] = EndingAt({0.1, 0.2}, records[1]);
  EXPECT_EQ(WarningsAndClusters(records), "disagreement:1 disagreement:2 ");
}

TEST(WarningNotes, TablesMarkTheOutcomeInEveryFormat) {
  std::vector<Record> records = Problem(1e-8, 2.0);
  records[0].Set("rtol", 1e-6);  // alone at its tolerance
  SetWarnings(&records);
  const std::string text = ToText(MakeTable(records, {.compact = true}));
  ExpectWords(text, {"  ok   ", "  ok?  ", "no agreement"});
  const Table full = MakeTable(records, {});
  for (const char* format : {"csv", "markdown", "json", "latex"}) {
    ExpectWords(Render(full, format), {"disagreement"});
  }
  ExpectWords(ToMarkdown(full), {"| finished? |"});
  ExpectWords(ToText(full, true), {"\033[33mfinished?"});
  EXPECT_EQ(ToCsv(full).find("finished?"), std::string::npos);
  const Table bare = MakeTable(records, {.columns = {"outcome"}});
  ExpectWords(ToCsv(bare), {"2 of 3 runs finished with warnings"});
}

// What the rules were made for.

constexpr Coordinates kBoth[] = {Coordinates::kJoint, Coordinates::kAbsolute};

/// Runs that must finish.
Record Finished(const MechanismFile& file, const Method& method, double rtol, double horizon) {
  const Experiment experiment = Single(file);
  const Record record =
      RunCase(experiment, CaseOf(experiment, file.description.name, method, rtol, horizon));
  EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  return record;
}
Record RunProblem(const std::string& mechanism, const Method& method, double rtol, double horizon) {
  return Finished(ReadMechanism(kConfigs / "mechanisms" / (mechanism + ".json")), method, rtol,
                  horizon);
}

TEST(Warnings, FinalPosesAreTheSameInAllCoordinatesOfPlaneAndSpace) {
  for (const std::string mechanism : {"four-bar", "spatial-four-bar", "welded-four-bar"}) {
    std::vector<Record> records;
    for (const Coordinates coordinates : kBoth) {
      for (const Enforcement level : {kVelocity, kPosition}) {
        records.push_back(RunProblem(
            mechanism, {.formulation = "odca", .enforcement = level, .coordinates = coordinates},
            1e-9, 0.5));
      }
    }
    const std::size_t numbers = mechanism == "spatial-four-bar" ? 9 : 3;
    std::size_t bodies = 0;
    for (const auto& [key, value] : records.front().items()) {
      if (!key.starts_with("series.final.")) continue;
      ++bodies;
      EXPECT_EQ(records.front().Numbers(key).size(), numbers) << key;
    }
    EXPECT_GE(bodies, 3u) << mechanism;
    for (const Record& record : records) {
      EXPECT_EQ(record.Text("warnings"), "") << mechanism << " " << record.Text("enforcement");
      // some 30 steps, each with some tolerance of error
      EXPECT_LT(DifferenceOf(records.front(), record).largest, 100 * 1e-9) << mechanism;
      EXPECT_EQ(record.Number("singularity_crossings"), 0);
    }
  }
}

TEST(Warnings, PassagesAreSeenWhereNoStepEndsNearThem) {
  // the parallelogram goes flat within 2 s; steps at 1e-6 are a tenth of a radian
  const Record record = RunProblem("parallelogram", {.formulation = "odca"}, 1e-6, 2.0);
  EXPECT_GE(record.Number("singularity_crossings"), 1);
  EXPECT_TRUE(HasWarning(record, kSingularWarning)) << record.Text("warnings");
  const Method position{.formulation = "odca", .enforcement = kPosition};
  EXPECT_EQ(RunProblem("parallelogram", position, 1e-8, 2.0).Text("warnings"), "");
}

TEST(Warnings, RedundantRowsThatDriftedApartAreNoSingularPosition) {
  // drift of 1e-3 gives Bennett's redundant rows a rank of their own
  for (const Coordinates coordinates : kBoth) {
    const Record record =
        RunProblem("bennett", {.formulation = "odca", .coordinates = coordinates}, 1e-6, 50.0);
    EXPECT_GT(record.Number("drift_position_max"), 2e-4);
    EXPECT_GT(record.Number("singularity_distance_min"), 0.1);
    EXPECT_EQ(record.Text("warnings"), "");
  }
}

/// Bennett's redundant rows differ by the rounding of its file from the start on. Projection cannot
/// close them, and they are no drift.
TEST(Warnings, RoundingOfRedundantRowsIsNoDrift) {
  const std::string exact = ReadFile(kConfigs / "experiments/overconstrained/bennett-turning.json");
  const std::regex number(R"(-?\d\.\d{14,}(?!\d|e))");
  for (const int digits : {11, 12, 13}) {
    std::string rounded;
    auto rest = exact.cbegin();
    for (std::sregex_iterator found(exact.begin(), exact.end(), number), end; found != end;
         ++found) {
      rounded.append(rest, (*found)[0].first);
      rounded += fmt::format("{:.{}f}", std::stod(found->str()), digits);
      rest = (*found)[0].second;
    }
    rounded.append(rest, exact.cend());
    const MechanismFile file = ParseMechanism(rounded, "rounded.json");
    for (const Coordinates coordinates : kBoth) {
      const Method method{
          .formulation = "odca", .enforcement = kPosition, .coordinates = coordinates};
      const Record record = Finished(file, method, 1e-8, 2.0);
      EXPECT_EQ(record.Text("warnings"), "") << digits;
      EXPECT_GT(record.Number("drift_position_max"), 1e-14) << "round-off alone";
    }
  }
}

/// A rhombus whose ground is longer by 3e-7: its smallest singular value is 1.9 times the limit of
/// regularization. The end is from an independent integration in absolute coordinates at 1e-12.
TEST(Warnings, ARunAloneIsNearTheTruthOrWithWarnings) {
  const auto bar = [](const std::string& name, const std::string& mass) {
    return R"({"com": [0.5, 0], "points": {"p": [0, 0], "q": [1, 0]}, "name": ")" + name +
           R"(", "mass": )" + mass + R"(, "inertia": )" + fmt::format("{}", std::stod(mass) / 12) +
           "}";
  };
  const MechanismFile file = ParseMechanism(
      R"({"name": "near", "gravity": [0, -9.81], "ground": {"points": {"D": [1.0000003, 0]}},
      "bodies": [)" +
          bar("crank", "1") + "," + bar("coupler", "2") + "," + bar("rocker", "0.5") +
          R"(], "joints": [
      {"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "crank", "at": "p"}},
      {"name": "A", "type": "revolute", "from": {"body": "crank", "at": "q"}, "to": {"body": "coupler", "at": "p"}},
      {"name": "D", "type": "revolute", "from": {"body": "ground", "at": "D"}, "to": {"body": "rocker", "at": "p"}},
      {"name": "B", "type": "revolute", "from": {"body": "coupler", "at": "q"}, "to": {"body": "rocker", "at": "q"}, "cut": true}],
      "initial": {"coordinates": {"O": 1.3, "A": -1.3, "D": 1.3}, "fixed": ["O"]}})",
      "near.json");
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    const Method method{.formulation = formulation, .enforcement = kPosition};
    const Record record = Finished(file, method, 1e-8, 10.0);
    const double off =
        std::remainder(record.Numbers("series.final.crank").at(2) + 4.335613186e-8, 2 * M_PI);
    EXPECT_TRUE(std::abs(off) <= kMaxTolerances * 1e-8 || record.Text("warnings") != "")
        << formulation << " is off by " << off;
    // 3.5 kg of weight; momenta are less
    EXPECT_NEAR(record.Number("energy_sensitivity"), 3.5 * 9.81, 1e-12);
  }
}

/// Peaucellier's linkage through the position where its cell folds: below level projection runs
/// finish with small drift on another branch than level projection's, and lose energy on the way.
TEST(Warnings, TheStraightLineLinkageThatEndsOnAnotherBranch) {
  std::vector<Record> records;
  for (const Coordinates coordinates : kBoth) {
    for (const Enforcement level : {kVelocity, kPosition}) {
      const Method method{.formulation = level == kVelocity ? "reduction" : "odca",
                          .enforcement = level,
                          .coordinates = coordinates};
      records.push_back(RunProblem("peaucellier", method, 1e-8, 1.0));
    }
  }
  SetWarnings(&records);
  for (const Record& record : records) {
    const bool position = record.Text("enforcement") == "projection";
    EXPECT_EQ(HasWarning(record, kSingularWarning), !position);
    // two coordinate sets agree that have nothing against themselves: they decide
    EXPECT_EQ(HasWarning(record, kDisagreementWarning), !position) << record.Text("warnings");
    EXPECT_EQ(record.Number("agreement") == 1, position);
    EXPECT_EQ(HasWarning(record, kEnergyWarning), !position);
    EXPECT_FALSE(HasWarning(record, kDriftWarning));
  }
}

TEST(LinkLength, IsThatOfTheLongestBodyBetweenItsJointsWhereverItStands) {
  const auto length = [](const std::string& name) {
    return LinkLength(ReadMechanism(kConfigs / "mechanisms" / (name + ".json")).description);
  };
  EXPECT_DOUBLE_EQ(length("parallelogram"), 1.0);
  EXPECT_DOUBLE_EQ(length("driven-four-bar"), 1.2);  // the ground, 1 m, is no link
  EXPECT_DOUBLE_EQ(length("rod-pendulum"), 1.0);     // a massless rod
  MechanismDescription far =
      ReadMechanism(kConfigs / "mechanisms/driven-four-bar.json").description;
  for (BodyDescription& body : far.bodies) body.com *= 1e6;
  EXPECT_DOUBLE_EQ(LinkLength(far), 1.2);  // centres of mass count only where there is one joint
  EXPECT_DOUBLE_EQ(LinkLength(MechanismDescription{}), 1.0);
}

}  // namespace warnings_test
}  // namespace loopbench::harness
