// Absolute tolerances apart from relative ones, limits of steps and of Newton's iteration.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "mechanism/start/assembly.h"
#include "tests/harness/integrator_problems.h"
#include "tests/harness/places.h"

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
  IntegratorOptions options;
  options.atols = {1e-6};
  TestOde ode = Pendulum();
  State y{1, 0, 0, 0};
  EXPECT_THROW(Integrate(ode, 0, 1, y, options), std::invalid_argument);
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

}  // namespace integration_options_test
}  // namespace loopbench::harness
