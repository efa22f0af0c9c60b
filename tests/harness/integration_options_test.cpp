// Absolute tolerances apart from relative ones, limits of steps and of Newton's iteration. Several
// integrators, steps of fixed length beside tolerances, and timings of every case as it is.
#include "harness/config/experiment_reader.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "mechanism/start/assembly.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/integrator_problems.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace integration_options_test {

Experiment SliderCrank(const std::string& rest, const std::string& coordinates = "joint",
                       const std::string& formulation = "lagrange") {
  return ParseExperiment(R"({"name": "e", "problems": [{"mechanism": "slider-crank.json",
      "horizon": 1}], "methods": {"formulation": ")" +
                             formulation + R"(", "enforcement": "velocity", "coordinates": ")" +
                             coordinates + R"("}, )" + rest + "}",
                         kConfigs / "mechanisms/e.json");
}

Record RunFirst(const Experiment& experiment) {
  const Record record = RunCase(experiment, Identified(experiment, Expand(experiment).front()));
  EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  return record;
}

/// Returns the absolute tolerances of the components of a mechanism's state.
std::vector<double> Atols(const Experiment& experiment) {
  const Case one = Expand(experiment).front();
  const MechanismDescription& description = experiment.problems[0].mechanism.description;
  const Mechanism<Planar, double> mechanism(description, one.method.coordinates);
  const Start<double> start = Assemble<Planar>(description, mechanism);
  const auto system = MakeFormulation<Planar>(one.method, mechanism);
  EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  return AtolsOf(one, description, *system);
}

/// A crank turns, a rod turns and slides in its slot. A body has an angle and two coordinates.
TEST(AbsoluteTolerances, BelongToTheQuantitiesOfTheState) {
  const std::string rest = R"("tolerances": 1e-6, "atol": {"length": 1e-7, "angle": 1e-8,
      "speed": 1e-4, "angular_speed": 1e-5})";
  EXPECT_EQ(Atols(SliderCrank(rest)), (std::vector{1e-8, 1e-8, 1e-7, 1e-5, 1e-5, 1e-4}));
  const std::vector<double> absolute = Atols(SliderCrank(rest, "absolute"));
  ASSERT_EQ(absolute.size(), 12u);
  EXPECT_EQ(std::vector(absolute.begin(), absolute.begin() + 3), (std::vector{1e-8, 1e-7, 1e-7}));
  EXPECT_EQ(std::vector(absolute.begin() + 6, absolute.begin() + 9),
            (std::vector{1e-5, 1e-4, 1e-4}));
  // missing quantities have the relative tolerance; one number needs no list
  EXPECT_EQ(Atols(SliderCrank(R"("tolerances": 1e-6, "atol": {"length": 1e-7})", "absolute"))[0],
            1e-6);
  EXPECT_TRUE(Atols(SliderCrank(R"("tolerances": 1e-6, "atol": 1e-7)")).empty());
}

/// Given as they are by default, they leave all bits; otherwise the steps change.
TEST(AbsoluteTolerances, ChangeTheRunAndItsIdentity) {
  const std::string quantities =
      R"("integrator": "dormand-prince", "tolerances": 1e-6, "atol": {"length": )";
  for (const char* formulation : {"lagrange", "reduction"}) {
    const auto run = [&](const std::string& rest) {
      return RunFirst(SliderCrank(rest, "absolute", formulation));
    };
    const Record standard = run(R"("integrator": "dormand-prince", "tolerances": 1e-6)");
    const Record number =
        run(R"("integrator": "dormand-prince", "tolerances": 1e-6, "atol": 1e-9)");
    const Record same = run(quantities + "1e-6}"), other = run(quantities + "1e-9}");
    EXPECT_EQ(standard.Number("atol"), 1e-6);
    EXPECT_EQ(standard.Find("atol_length"), nullptr);
    EXPECT_EQ(number.Number("atol"), 1e-9);
    EXPECT_EQ(same.Text("atol"), "");
    EXPECT_EQ(same.Number("atol_length"), 1e-6);
    EXPECT_EQ(other.Number("atol_angular_speed"), 1e-6);
    EXPECT_EQ(same.Text("state_hash"), standard.Text("state_hash")) << formulation;
    EXPECT_GT(number.Number("steps"), standard.Number("steps"));
    EXPECT_NE(other.Text("state_hash"), standard.Text("state_hash")) << formulation;
    std::set<std::string> ids;
    for (const Record& record : {standard, number, same, other}) ids.insert(record.Text("case_id"));
    EXPECT_EQ(ids.size(), 4u);
  }
}

TEST(AbsoluteTolerances, AreNoneOfFixedSteps) {
  const Experiment experiment = SliderCrank(
      R"("tolerances": 1e-6, "fixed_steps": 0.01, "atol": {"length": 1e-9}, "refine": true)");
  const std::vector<Case> cases = Expand(experiment);
  ASSERT_EQ(cases.size(), 2u);
  EXPECT_TRUE(cases[0].atols && !cases[1].atols);
  EXPECT_EQ(cases[1].keys.Find("atol_length"), nullptr);
  // the finer run has a tenth of each tolerance
  const Experiment finer =
      SliderCrank(R"("tolerances": 1e-7, "atol": {"length": 1e-10}, "refine": false)");
  const Record coarse = RunCase(experiment, cases[0]), fine = RunCase(finer, Expand(finer).front());
  EXPECT_EQ(coarse.Number("refinement_difference"), DifferenceOf(coarse, fine).largest);
}

/// A large and a small component: the small one matters by its own tolerance.
TEST(AbsoluteTolerances, OfComponentsLimitTheirErrors) {
  const auto error = [](const std::vector<double>& atols) {
    TestOde ode(2, [](double t, auto, auto ydot) {
      ydot[0] = 0;
      ydot[1] = 1e-6 * std::cos(20 * t);
      return Outcome::kFinished;
    });
    IntegratorOptions options = WithTolerance("dormand-prince", 1e-6);
    options.rtol = 1e-10;
    options.atols = atols;
    State y{1, 0};
    EXPECT_EQ(Integrate(ode, 0, 1, y, options).outcome, Outcome::kFinished);
    return std::abs(y[1] - 5e-8 * std::sin(20.0));
  };
  EXPECT_LT(error({1e-6, 1e-13}), 1e-12);
  EXPECT_GT(error({1e-13, 1e-6}), 1e-9);
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, With(&IntegratorOptions::atols, {1e-6})),
               std::invalid_argument);
}

TEST(IntegrationOptions, LimitTheSteps) {
  for (const char* profile : {"ode45", "verner", "trbdf2"}) {
    TestOde ode = Pendulum();
    IntegratorOptions options = WithTolerance(profile, 1e-3);
    options.max_step = 0.02;
    options.initial_step = 1e-4;
    State y{1, 0, 0, 0};
    std::vector<double> times;
    const auto watch = [&](double t, auto) { return times.push_back(t), StepAction::kContinue; };
    EXPECT_EQ(Integrate(ode, 0, 1, y, options, watch).outcome, Outcome::kFinished);
    EXPECT_NEAR(times[1], 1e-4, 1e-18) << profile;
    double longest = 0;
    for (std::size_t i = 1; i < times.size(); ++i) {
      longest = std::max(longest, times[i] - times[i - 1]);
    }
    EXPECT_NEAR(longest, 0.02, 1e-15) << profile;
  }
}

/// One iteration is too few for a tight coefficient; a loose one needs fewer iterations.
TEST(IntegrationOptions, LimitNewtonsIteration) {
  const auto run = [](int most, double coefficient) {
    TestOde ode = Pendulum();
    IntegratorOptions options = WithTolerance("kvaerno-54", 1e-6);
    options.max_newton_iterations = most;
    options.newton_coefficient = coefficient;
    State y{1, 0, 0, 0};
    return Integrate(ode, 0, 1, y, options);
  };
  EXPECT_EQ(run(0, 0.01).newton_failures, 0);
  EXPECT_GT(run(1, 0.01).newton_failures, 0);
  EXPECT_GT(run(0, 1e-4).newton_iterations, run(0, 0.1).newton_iterations);
}

TEST(IntegrationOptions, AreKeysOfTheCasesThatTheyAffect) {
  const std::string options = R"(, "integrator": ["ode45", "trbdf2"], "integration":
      {"max_step": 0.1, "initial_step": 0.001, "max_newton_iterations": 5,
       "newton_coefficient": 0.1})";
  std::vector<Case> cases =
      Expand(SliderCrank(R"("tolerances": 1e-6, "fixed_steps": 0.01)" + options));
  ASSERT_EQ(cases.size(), 4u);
  for (const Case& one : cases) {
    EXPECT_EQ(one.keys.Find("max_step") != nullptr, one.step == 0.0);
    EXPECT_EQ(one.keys.Find("initial_step") != nullptr, one.step == 0.0);
    EXPECT_EQ(one.keys.Find("max_newton_iterations") != nullptr, one.integrator == "trbdf2");
    EXPECT_EQ(one.keys.Find("newton_coefficient") != nullptr, one.integrator == "trbdf2");
    const IntegratorOptions given = OptionsOf(one, {});
    EXPECT_EQ(given.max_step, one.step == 0.0 ? 0.1 : 0.0);
    EXPECT_EQ(given.max_newton_iterations, 5);
    EXPECT_EQ(given.newton_coefficient, 0.1);
  }
  const Case plain = Expand(SliderCrank(R"("tolerances": 1e-6)")).front();
  EXPECT_EQ(Expand(SliderCrank(R"("tolerances": 1e-6, "integration": {})")).front().keys,
            plain.keys);
}

/// A crank-rocker whose crank turns by 0.15 and 0.8 rad a step. With one Jacobian a step, a third
/// of the long steps fail.
TEST(ImplicitFixedSteps, ConvergeAtLongStepsOfAFourBar) {
  const std::string mechanism = "/problems/0/mechanism";
  const Experiment experiment =
      ParseExperiments(
          R"({"name": "e", "problems": [{"mechanism": "four-bar.json", "horizon": 1}],
          "methods": {"formulation": ["odca", "lagrange", "reduction"],
                      "enforcement": ["acceleration", "velocity", "projection", "baumgarte"],
                      "coordinates": ["joint", "absolute"]},
          "integrator": ["trbdf2", "kennedy-carpenter-32", "kennedy-carpenter-43", "kvaerno-54",
                         "kennedy-carpenter-54", "ARKODE_SDIRK_5_3_4"],
          "fixed_steps": [0.01875, 0.1]})",
          kConfigs / "mechanisms/e.json",
          {{mechanism + "/ground/points/C", "[1, 0]"},
           {mechanism + "/bodies/0/points/B", "[0.4, 0]"},
           {mechanism + "/bodies/0/com", "[0.2, 0]"},
           {mechanism + "/bodies/1/points/B", "[1.2, 0]"},
           {mechanism + "/bodies/1/com", "[0.6, 0]"},
           {mechanism + "/initial/coordinates", R"({"OA": 0.5, "AB": 0.2, "BC": -2.54})"},
           {mechanism + "/initial/speeds", R"({"OA": 8})"}})
          .front();
  double renewed = 0.0;
  for (const Case& one : Expand(experiment)) {
    const Record record = RunCase(experiment, one);
    EXPECT_EQ(record.Text("outcome"), "finished")
        << ToString(one.method) << " " << one.integrator << ": " << record.Text("message");
    renewed = std::max(renewed, record.Number("newton_jacobians") - record.Number("steps"));
  }
  EXPECT_GT(renewed, 0.0) << "no case tests the renewal of Jacobians";
}

/// The four-bar with `rest`, which begins with a comma.
Experiment FourBar(const std::string& columns, const std::string& rest) {
  return ParseExperiment(
      R"({"name": "e", "problems": [{"mechanism": "four-bar.json", "horizon": [0.5, 1]}],
                           "methods": [)" +
          columns + "]" + rest + "}",
      kConfigs / "mechanisms/e.json");
}

constexpr const char* kOdca = R"({"formulation": "odca", "enforcement": "acceleration"})";

TEST(FixedSteps, AreCrossedWithIntegratorsBesideTolerances) {
  const Experiment experiment =
      FourBar(kOdca, R"(, "tolerances": [1e-4, 1e-6], "fixed_steps": [0.1, 0.03],
                        "integrator": ["ode45", "trbdf2"])");
  std::vector<std::string> found;
  for (const Case& one : Expand(experiment)) {
    if (one.horizon == 1.0) found.push_back(one.keys.Text("integrator") + " " + SettingOf(one));
  }
  EXPECT_EQ(found, (std::vector<std::string>{"ode45 0.0001", "ode45 1e-06", "ode45 step 0.1",
                                             "ode45 step 0.03", "trbdf2 0.0001", "trbdf2 1e-06",
                                             "trbdf2 step 0.1", "trbdf2 step 0.03"}));
  EXPECT_EQ(Expand(experiment).size(), 16u);
}

TEST(FixedSteps, KeysTellCasesApartAndLeaveThoseOfTolerancesAsTheyWere) {
  const std::string tolerance = R"(, "tolerances": 1e-6)";
  const Case plain = Expand(FourBar(kOdca, tolerance)).front();
  EXPECT_EQ(plain.keys.Find("step"), nullptr);
  const Experiment both = FourBar(
      kOdca, tolerance + R"(, "fixed_steps": [0.1, 0.03], "integrator": ["ode45", "verner"])");
  std::set<std::string> ids;
  for (const Case& one : Expand(both)) ids.insert(Identified(both, one).keys.Text("case_id"));
  EXPECT_EQ(ids.size(), Expand(both).size());
  EXPECT_EQ(Expand(both).front().keys, plain.keys);
  EXPECT_TRUE(ids.contains(Identified(both, plain).keys.Text("case_id")));
  const Record fixed = Expand(both)[1].keys;
  EXPECT_EQ(fixed.Number("step"), 0.1);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(*fixed.Find("rtol")));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(*fixed.Find("atol")));
}

TEST(FixedSteps, MayStandAlone) {
  for (const char* rest :
       {R"(, "fixed_steps": 0.1)", R"(, "fixed_steps": 0.1, "tolerances": [])"}) {
    EXPECT_EQ(Expand(FourBar(kOdca, rest)).size(), 2u) << rest;
  }
}

TEST(FixedSteps, ExclusionsKnowThem) {
  const Experiment experiment =
      FourBar(kOdca, R"(, "fixed_steps": [0.1, 0.03], "exclude": [{"step": 0.1, "horizon": 1}])");
  EXPECT_EQ(Expand(experiment).size(), 3u);
}

TEST(FixedSteps, APeerHasItsOwnIntegratorOnce) {
  const Experiment experiment =
      FourBar(R"({"formulation": "peer/simbody", "enforcement": "projection"})",
              R"(, "tolerances": 1e-6, "integrator": ["ode45", "verner"])");
  EXPECT_EQ(Expand(experiment).size(), 2u);  // its two horizons
  EXPECT_EQ(ExpandTiming(experiment).size(), 1u);
}

/// A step that does not divide the horizon is clipped at the end: ceil(1 / 0.03) steps.
TEST(FixedSteps, ARunTakesThemAll) {
  const Experiment experiment = FourBar(kOdca, R"(, "fixed_steps": [0.1, 0.03],
      "integrator": ["ode45", "verner", "kennedy-carpenter-43"])");
  for (const Case& one : Expand(experiment)) {
    const Record record = RunCase(experiment, one);
    EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    EXPECT_EQ(record.Number("t_reached"), one.horizon);
    // 0.5 / 0.1 and 1 / 0.1 are whole up to rounding
    EXPECT_EQ(record.Number("steps"), std::ceil(one.horizon / one.step - 1e-9));
    EXPECT_EQ(record.Number("rejected"), 0.0) << "there is no error test";
    EXPECT_EQ(record.Number("step"), one.step);
    EXPECT_TRUE(std::isnan(record.Number("rtol")));
  }
}

/// Steps a third as long: order 5 divides the error by 3^5. A tenth of that is far above chance.
TEST(FixedSteps, ShorterOnesAreMoreAccurate) {
  const Experiment experiment = FourBar(kOdca, R"(, "fixed_steps": [0.06, 0.02])");
  const std::vector<Case> cases = Expand(experiment);
  const double coarse = RunCase(experiment, cases[2]).Number("drift_position_max");
  const double fine = RunCase(experiment, cases[3]).Number("drift_position_max");
  EXPECT_GT(coarse, 24.0 * fine) << coarse << " " << fine;
}

/// Its energy is right to 1 %. The run at half the step tells that the final pose is not.
TEST(FixedSteps, WithoutAReferenceAreJudgedByHalfTheStep) {
  const Experiment experiment = ParseExperiment(
      R"({"name": "e", "problems": [{"mechanism": "spinning-crank.json", "horizon": 10}],
          "methods": [{"formulation": "odca", "enforcement": "projection"}],
          "tolerances": 1e-10, "fixed_steps": [0.025, 0.01]})",
      kConfigs / "mechanisms/e.json");
  const std::vector<Case> cases = Expand(experiment);
  const Record exact = RunCase(experiment, cases[0]), coarse = RunCase(experiment, cases[1]),
               fine = RunCase(experiment, cases[2]);
  EXPECT_GT(DifferenceOf(exact, coarse).largest, 0.03);
  EXPECT_EQ(coarse.Text("warnings"), "refinement");
  // the run at half the step has a 32nd of the error, by its order
  EXPECT_NEAR(coarse.Number("refinement_difference"), DifferenceOf(exact, coarse).largest, 0.005);
  EXPECT_LT(DifferenceOf(exact, fine).largest, 0.01);
  EXPECT_EQ(fine.Text("warnings"), "");
}

TEST(TimingOfCases, EveryAccuracyRowHasATimingRowOfItsKeys) {
  const Experiment experiment = FourBar(
      R"({"formulation": ["odca", "lagrange"], "enforcement": ["acceleration", "projection"]})",
      R"(, "tolerances": [1e-4, 1e-6], "fixed_steps": 0.1, "integrator": ["ode45", "verner"],
              "ensembles": [{"size": 4, "seed": 1, "perturb": 0.1}], "exclude": [{"integrator": "verner", "step": 0.1}],
              "timing": {"repeats": 2, "cases": true})");
  const std::vector<Case> cases = Expand(experiment);
  ASSERT_EQ(cases.size(), 40u);
  const std::vector<TimingGroup> groups = TimingGroups(experiment);
  ASSERT_EQ(groups.size(), 2u) << "one per horizon";
  std::size_t next = 0;
  for (const TimingGroup& group : groups) {
    for (const Case& timed : group.cases) {
      const Case& one = cases[next++];
      EXPECT_EQ(timed.keys.Text("kind"), "timing");
      EXPECT_NE(timed.keys.Text("case_id"), "");
      for (const auto& [key, value] : one.keys.items()) {
        if (key == "kind") continue;
        EXPECT_EQ(timed.keys.Text(key), one.keys.Text(key)) << key;
      }
      EXPECT_EQ(timed.ensemble, 1) << "a timing is of one run";
      EXPECT_EQ(OptionsOf(timed, {}).fixed_step, one.step);
    }
  }
  EXPECT_EQ(next, cases.size());
  EXPECT_EQ(CountTimings(experiment), cases.size());
}

/// A timing runs the same case as the accuracy run: it takes the same steps.
TEST(TimingOfCases, RunsTheCaseAsItIs) {
  const Experiment experiment = FourBar(kOdca, R"(, "tolerances": [1e-3, 1e-7], "fixed_steps": 0.1,
                        "integrator": ["ode45", "trbdf2"], "timing": {"repeats": 1, "cases": true})");
  const std::vector<Case> cases = Expand(experiment);
  std::size_t next = 0;
  for (const TimingGroup& group : TimingGroups(experiment)) {
    for (const Record& timed : TimeTogether(experiment, group)) {
      const Record run = RunCase(experiment, cases[next++]);
      EXPECT_EQ(timed.Text("outcome"), "finished");
      EXPECT_EQ(timed.Number("steps"), run.Number("steps")) << SettingOf(cases[next - 1]);
    }
  }
  EXPECT_EQ(next, cases.size());
}

Record FixedRun(const std::string& level, double drift) {
  return RecordOf("kind", "accuracy", "formulation", "odca", "enforcement", level, "coordinates",
                  "joint", "rtol", Value(), "step", 0.01, "horizon", 20.0, "problem_id", "problem",
                  "link_length", 2.0, "position_goal", 4e-15, "outcome", "finished", "steps",
                  2000.0, "drift_position_max", drift, "series.final.bar",
                  std::vector<double>{drift, 0.0, 0.0});
}

/// Errors of fixed steps have no expected size, so only a loop that has come apart is flagged. The
/// error of a projection does not depend on the step.
TEST(FixedSteps, PromiseNothingButTheProjection) {
  EXPECT_EQ(OwnWarnings(FixedRun("acceleration", 0.19)), "");
  EXPECT_EQ(OwnWarnings(FixedRun("acceleration", 0.21)), "drift");  // a tenth of a link
  EXPECT_EQ(OwnWarnings(FixedRun("acceleration", NAN)), "drift");
  EXPECT_EQ(OwnWarnings(FixedRun("projection", 9e-14)), "");  // 25 goals are 1e-13
  EXPECT_EQ(OwnWarnings(FixedRun("projection", 2e-13)), "drift");
}

/// A tolerance says which differences are small; a step does not.
TEST(FixedSteps, NeitherJudgeNorAreJudgedByTheEndsOfOthers) {
  std::vector<Record> records = {FixedRun("acceleration", 0.1), FixedRun("projection", 0.0)};
  for (const double drift : {0.0, 0.01}) {
    records.push_back(FixedRun("acceleration", drift));
    records.back().Set("rtol", 1e-9);
    records.back().Set("step", Value());
  }
  const std::vector<Agreement> agreements = CompareFinalPoses(records);
  EXPECT_FALSE(agreements[0].flagged || agreements[1].flagged);
  EXPECT_EQ(agreements[0].cluster, 0);
  EXPECT_TRUE(agreements[2].flagged && agreements[3].flagged);
}

/// All runs of one integrator agree, none of the other: the first decide at their own tolerance.
TEST(Integrators, ThoseThatAllEndAlikeDecide) {
  const auto run = [](const std::string& integrator, const std::string& level, double at) {
    Record record = FixedRun(level, at);
    record.Set("rtol", 1e-9);
    record.Set("step", Value());
    record.Set("integrator", integrator);
    return record;
  };
  std::vector<Record> records = {run("a", "acceleration", 0.0), run("a", "projection", 0.0),
                                 run("b", "acceleration", 0.1), run("b", "projection", 0.2)};
  const auto flagged = [&] {
    std::string text;
    for (const Agreement& one : CompareFinalPoses(records)) text += one.flagged ? "x" : "-";
    return text;
  };
  EXPECT_EQ(flagged(), "--xx");
  records[3] = run("b", "projection", 0.1);
  EXPECT_EQ(flagged(), "xxxx") << "two integrators decide differently: numbers do not tell";
  records[1] = run("a", "acceleration", 0.0);
  EXPECT_EQ(flagged(), "xx--") << "equations of one kind decide nothing";
}

class FixedStepsProgram : public CommandLineTest {};

TEST_F(FixedStepsProgram, StandInEveryTableAndNowhereElse) {
  Write("steps.json", R"({"name": "steps", "tolerances": [1e-6], "fixed_steps": [0.05],
    "integrator": ["ode45", "verner"], "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}],
    "timing": {"repeats": 1, "cases": true}})");
  Expect("list steps.json", 0, {"integrator", "step [s]", "4 cases and 4 timings"});
  Expect("explain steps.json", 0, {"ode45, verner", "fixed steps", "of each case"});
  Expect("estimate steps.json", 0, {"1 tolerance, 1 fixed step, 2 integrators"});
  Expect("run steps.json --out out", 0, {"ran 8 cases", "step [s]", "verner"});
  ExpectEnding(
      Call("table out --where step=0.05 --columns integrator,rtol,step,steps --format csv"), 0,
      {"integrator,rtol,step,steps\node45,,0.05,10\nverner,,0.05,10\n"});
  for (const char* kind : {"drift", "timing"}) {
    const std::string csv = ReadFile(folder_ / fs::path("out") / (std::string(kind) + ".csv"));
    EXPECT_NE(csv.find(",horizon,step,outcome,"), std::string::npos) << csv.substr(0, 300);
  }
  Expect("plot out --out figures", 0);
  const auto drawn = std::ranges::count_if(
      fs::directory_iterator(folder_ / "figures"), [](const fs::directory_entry& file) {
        return file.path().filename().string().starts_with("drift-four-bar-0.5s-step-0.05s");
      });
  EXPECT_EQ(drawn, 2) << "each integrator has a figure of its own";
  Expect("run tiny.json --out tiny", 0);
  ExpectNone(ReadFile(folder_ / "tiny/drift.csv"), {",step,"});
}

TEST_F(FixedStepsProgram, PlansWithoutAnyTolerance) {
  Write("steps.json", R"({"name": "steps", "fixed_steps": [0.05, 0.1],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}]})");
  Expect("estimate steps.json", 0, {"0 tolerances, 2 fixed steps", "2 cases"});
}

}  // namespace integration_options_test
}  // namespace loopbench::harness
