// Sweeps, ranges, families, inline mechanisms, exclusions and --set: what one file expands to.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "harness/run/run.h"
#include "mechanism/description/library.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace config_sweep_test {

/// A small experiment with one problem, and whatever else a test adds.
std::string Text(const std::string& more,
                 const std::string& mechanism = "\"mechanisms/four-bar.json\"",
                 const std::string& tolerances = "[1e-6, 1e-8]") {
  return R"({"name": "small", "problems": [{"mechanism": )" + mechanism + R"(, "horizon": 0.1}],
    "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "acceleration"}],
    "timing": {"repeats": 0}, "tolerances": )" +
         tolerances + more + "}";
}

std::vector<Experiment> Read(const std::string& text, const std::vector<Setting>& settings = {}) {
  return ParseExperiments(text, kConfigs / "e.json", settings);
}

std::string ErrorOf(const std::string& text, const std::vector<Setting>& settings = {}) {
  try {
    Read(text, settings);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

void ExpectWords(const std::string& error, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_NE(error.find(word), std::string::npos) << "no <" << word << "> in:\n" << error;
  }
}

const MechanismDescription& Described(const Experiment& experiment, std::size_t problem = 0) {
  return experiment.problems.at(problem).mechanism.description;
}

TEST(Ranges, AreEvenlySpacedWithExactEnds) {
  const std::string lin = R"({"lin": [0.001, 0.1, 4]})", log = R"({"log": [1e-6, 1e-12, 4]})";
  EXPECT_EQ(Read(Text("", "\"mechanisms/four-bar.json\"", log)).front().tolerances,
            (std::vector<double>{1e-6, 1e-8, 1e-10, 1e-12}));
  const std::vector<double> even =
      Read(Text("", "\"mechanisms/four-bar.json\"", lin)).front().tolerances;
  ASSERT_EQ(even.size(), 4u);
  EXPECT_EQ(even.front(), 0.001);
  EXPECT_EQ(even.back(), 0.1);
  // a third of the way; 4 ulp for the interpolation
  EXPECT_NEAR(even[1], 0.034, 4 * 0.034 * 2.3e-16);
}

TEST(Ranges, ThatAreNoneAreRefused) {
  const auto error = [](const std::string& range) {
    return ErrorOf(Text("", "\"mechanisms/four-bar.json\"", range));
  };
  ExpectWords(error(R"({"log": [0.1, 0, 3]})"), {"/tolerances/log/1: found 0", "> 2.2"});
  ExpectWords(error(R"({"lin": [1e-3, 1e-6]})"), {"/tolerances/lin", "three numbers"});
  ExpectWords(error(R"({"lin": [1e-3, 1e-6, 1]})"), {"/tolerances/lin/2: found 1", "2 to 10000"});
  ExpectWords(error(R"({"lin": [1e-3, 1e-6, 1000000]})"), {"found 1000000"});
  ExpectWords(error(R"({"lin": [1e-3, 1e-3, 2]})"), {"two different ends"});
  ExpectWords(error(R"({"lni": [1e-3, 1e-6, 2]})"),
              {"unknown key \"lni\"", "did you mean \"lin\""});
  ExpectWords(error("\"many\""), {"a number > 2.2", "and <= 0.1, a list"});
}

TEST(Families, MakeTheMechanismsOfTheLibrary) {
  const Experiment chain = Read(Text("", R"({"family": "chain", "bars": 10})")).front();
  EXPECT_EQ(chain.problems.front().name, "chain-10");
  const MechanismDescription expected = Chain(10);
  EXPECT_EQ(Described(chain).bodies.size(), expected.bodies.size());
  EXPECT_EQ(Described(chain).initial.coordinates.size(), expected.initial.coordinates.size());
  EXPECT_EQ(Described(chain).initial.held.size(), 8u);  // its degrees of freedom

  const Experiment grid =
      Read(Text("",
                R"({"family": "grid", "storeys": 3, "windows": 4, "angle": -1.0, "speed": 0.5})"))
          .front();
  EXPECT_EQ(grid.problems.front().name, Grid(3, 4, -1.0, 0.5).name);
  EXPECT_EQ(Described(grid).initial.coordinates.front().values,
            Grid(3, 4, -1.0, 0.5).initial.coordinates.front().values);
  EXPECT_EQ(Described(grid).initial.held.size(), 3u);
}

TEST(Families, WithSeveralCountsAreSeveralProblems) {
  const Experiment ladders =
      Read(Text("", R"({"family": "ladder", "windows": {"log": [1, 100, 3]}})")).front();
  ASSERT_EQ(ladders.problems.size(), 3u);
  EXPECT_EQ(ladders.problems[1].name, "ladder-10");
  EXPECT_EQ(Described(ladders, 2).bodies.size(), Ladder(100, 1.0, 1.0).bodies.size());
  const Experiment named = Read(Text("", R"({"family": "grid", "storeys": [1, 2], "windows": 3},
      "name": "wall")"))
                               .front();
  ASSERT_EQ(named.problems.size(), 2u);
  EXPECT_EQ(named.problems[1].name, "wall-2x3");
  EXPECT_NE(named.problems[0].mechanism.canonical, named.problems[1].mechanism.canonical);
}

TEST(Families, RunLikeOtherProblems) {
  const Experiment experiment = Read(Text("", R"({"family": "ladder", "windows": 2})")).front();
  for (const Case& one : Expand(experiment)) {
    EXPECT_EQ(RunCase(experiment, one).Text("outcome"), "finished");
  }
}

TEST(Families, OutOfBoundsAreRefused) {
  ExpectWords(ErrorOf(Text("", R"({"family": "chain", "bars": 2})")),
              {"/problems/0/mechanism/bars: found 2, expected an integer from 3"});
  ExpectWords(ErrorOf(Text("", R"({"family": "chian", "bars": 3})")), {"did you mean \"chain\""});
  ExpectWords(ErrorOf(Text("", R"({"family": "ladder", "bars": 3})")),
              {"unknown key \"bars\"", "no \"windows\""});
  ExpectWords(ErrorOf(Text("", R"({"family": "grid", "storeys": 1000, "windows": 1000})")),
              {"2001000 bodies", "at most 200000"});
}

TEST(InlineMechanism, IsReadWhereItStands) {
  const std::string pendulum = R"({"name": "p", "gravity": [0, -9.81],
    "bodies": [{"name": "bar", "mass": 2, "inertia": 1, "com": [0, -1]}],
    "joints": [{"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "bar"}}]})";
  const Experiment experiment = Read(Text("", pendulum)).front();
  EXPECT_EQ(experiment.problems.front().name, "p");
  EXPECT_EQ(Described(experiment).bodies[1].mass, 2.0);
  EXPECT_TRUE(experiment.problems.front().path.empty());
  std::string broken = pendulum;
  broken.replace(broken.find("\"mass\": 2"), 9, "\"mass\": 0");
  ExpectWords(ErrorOf(Text("", broken)),
              {"e.json:2: /problems/0/mechanism/bodies/0/mass: found 0, expected a number > 0"});
}

constexpr const char* kMass =
    R"({"name": "mass", "field": "/problems/0/mechanism/bodies/1/mass", "values": [1, 2.5]})";

TEST(Sweep, GoesThroughTheMechanismsFile) {
  const auto experiments = Read(Text(std::string(R"(, "sweep": [)") + kMass + "]"));
  ASSERT_EQ(experiments.size(), 2u);
  EXPECT_EQ(Described(experiments[0]).bodies[2].mass, 1.0);
  EXPECT_EQ(Described(experiments[1]).bodies[2].mass, 2.5);
  EXPECT_EQ(Described(experiments[1]).bodies[1].mass, 1.0);
  EXPECT_EQ(experiments[1].parameters.Number("mass"), 2.5);
  const Record keys = Expand(experiments[1]).front().keys;
  EXPECT_EQ(keys.Number("mass"), 2.5);
  EXPECT_EQ(keys.Text("mechanism"), "four-bar");
}

TEST(Sweep, CrossesAxesAndZipsInStep) {
  const auto experiments = Read(Text(std::string(R"(, "sweep": [)") + kMass + R"(,
      {"zip": [{"name": "wall", "field": "/limits/wall_s", "values": {"lin": [1, 3, 3]}},
               {"name": "kind_of", "field": "/comment", "values": ["a", "b", "c"]}]}])"));
  ASSERT_EQ(experiments.size(), 6u);
  std::vector<std::string> seen;
  for (const Experiment& one : experiments) {
    EXPECT_EQ(one.limits.cpu_s, one.parameters.Number("wall"));
    EXPECT_EQ(one.comment, one.parameters.Text("kind_of"));
    seen.push_back(one.parameters.Text("mass") + one.parameters.Text("wall") + one.comment);
  }
  EXPECT_EQ(seen, (std::vector<std::string>{"11a", "12b", "13c", "2.51a", "2.52b", "2.53c"}));
}

// wall_s is the former name of cpu_s: whichever a file has, either name sets it.
TEST(Settings, OfTheLimitOfTimeHaveTwoNames) {
  for (const std::string in_file :
       {"", R"(, "limits": {"cpu_s": 3})", R"(, "limits": {"wall_s": 3})"}) {
    for (const std::string name : {"cpu_s", "wall_s"}) {
      const auto experiments = Read(Text(in_file), {{"/limits/" + name, "7"}});
      EXPECT_EQ(experiments.front().limits.cpu_s, 7.0) << in_file << " " << name;
    }
  }
}

TEST(Sweep, StarGoesThroughAllElements) {
  const auto experiments = Read(Text(R"(, "sweep": [
      {"name": "mass", "field": "/problems/*/mechanism/bodies/*/mass", "values": [3, 4]}])"));
  ASSERT_EQ(experiments.size(), 2u);
  for (int body = 1; body <= 3; ++body) EXPECT_EQ(Described(experiments[1]).bodies[body].mass, 4.0);
}

TEST(Sweep, ValuesMayBeOfAnyKind) {
  const auto experiments = Read(Text(R"(, "sweep": [{"name": "scene", "field": "/problems",
      "values": [[{"mechanism": "mechanisms/pendulum.json", "horizon": 1}],
                 [{"mechanism": {"family": "chain", "bars": 3}, "horizon": 2}]]}])"));
  ASSERT_EQ(experiments.size(), 2u);
  EXPECT_EQ(experiments[0].problems.front().name, "pendulum");
  EXPECT_EQ(experiments[1].problems.front().name, "chain-3");
  EXPECT_EQ(experiments[1].parameters.Text("scene").substr(0, 14), "[{\"mechanism\":");
}

TEST(Sweep, MistakesNameTheAxisAndTheCombination) {
  const std::string text = Text(R"(,
    "sweep": [{"name": "mass", "field": "/problems/0/mechanism/bodies/1/mass",
               "values": [1, -2, -3]}])");
  const std::string error = ErrorOf(text);
  ExpectWords(error,
              {"e.json:4: /problems/0/mechanism/bodies/1/mass: found -2, expected a number > 0",
               "(a value of axis \"mass\")", "combination 2 of 3: mass = -2"});
  EXPECT_EQ(error.find("-3"), std::string::npos) << error;  // it stops at the first
}

TEST(Sweep, ThatCannotBeMeantIsRefused) {
  const auto error = [](const std::string& sweep) {
    return ErrorOf(Text(", \"sweep\": " + sweep));
  };
  ExpectWords(error(R"([{"name": "m", "field": "/problems/3/horizon", "values": [1]}])"),
              {"/sweep/0/field: found no element \"3\" in /problems"});
  ExpectWords(error(R"([{"name": "m", "field": "/tolerances/lin/0", "values": [1]}])"),
              {"/sweep/0/field: found no element \"lin\""});
  ExpectWords(error(R"([{"name": "m", "field": "/problem/0/horizon", "values": [1]}])"),
              {"found no \"problem\"", "did you mean \"problems\""});
  ExpectWords(error(R"([{"name": "rtol", "field": "/tolerances", "values": [1e-6]}])"),
              {"/sweep/0/name: found \"rtol\", expected a name that records do not use already"});
  ExpectWords(error(R"([{"name": "cost", "field": "/tolerances", "values": [1e-6]}])"),
              {"found \"cost\", expected a name that records do not use already"});
  ExpectWords(error(R"([{"name": "a=b", "field": "/tolerances", "values": [1e-6]}])"), {"letters"});
  ExpectWords(error(R"([{"name": "m", "field": "/tolerances", "values": []}])"),
              {"/sweep/0/values: found an empty array"});
  ExpectWords(error(R"([{"name": "m", "field": "/tolerances", "values": [1e-3, 0.001]}])"),
              {"/sweep/0: found 0.001 again"});
  ExpectWords(error(R"([{"name": "m", "field": "/problems/0/horizon", "values": [1, 1.0, 2]}])"),
              {"/sweep/0: found 1.0 again"});
  ExpectWords(error(R"([{"zip": [{"name": "a", "field": "/comment", "values": ["x", "y"]},
                                 {"name": "b", "field": "/name", "values": ["z"]}]}])"),
              {"/sweep/0/zip/1: found 1 values, expected 2, as many as \"a\" has"});
  ExpectWords(error(R"([{"name": "a", "field": "/limits", "values": [{}]},
                        {"name": "b", "field": "/limits/wall_s", "values": [1]}])"),
              {"/sweep: found \"a\" and \"b\" both setting /limits/wall_s"});
  const std::string many =
      R"({"name": "a", "field": "/limits/wall_s", "values": {"lin": [1, 2, 1000]}},
                        {"name": "b", "field": "/limits/steps", "values": {"lin": [1, 1000, 1000]}})";
  ExpectWords(error("[" + many + R"(, {"name": "c", "field": "/limits/memory_mb",
                                  "values": {"lin": [1, 2, 20]}}])"),
              {"/sweep: found 20000000 combinations, expected at most 10000000"});
  ExpectWords(error("[" + many + "]"),
              {"/sweep: found 1000000 combinations, expected at most 100000 to be held at once"});
}

TEST(Exclude, LeavesOutCasesThatMatchAllConditions) {
  const std::string sweep = std::string(R"(, "sweep": [)") + kMass + "]";
  const auto count = [&](const std::string& rules) {
    std::size_t cases = 0;
    for (const Experiment& one : Read(Text(sweep + ", \"exclude\": " + rules))) {
      cases += Expand(one).size();
    }
    return cases;
  };
  EXPECT_EQ(count("[]"), 8u);
  EXPECT_EQ(count(R"([{"formulation": "lagrange", "rtol": 1e-8, "mass": [1, 2.5]}])"), 6u);
  EXPECT_EQ(count(R"([{"formulation": "lagrange"}, {"rtol": 1e-8}])"), 2u);
  EXPECT_EQ(count(R"([{"mass": 1}])"), 4u);
  EXPECT_EQ(Read(Text(sweep + R"(, "exclude": [{"mass": 1}])")).size(), 1u);
}

TEST(Exclude, RulesThatDoNothingOrTooMuchAreRefused) {
  ExpectWords(ErrorOf(Text(R"(, "exclude": [{"rtol": 1e-7}])")),
              {"/exclude/0: found a rule that matches no case"});
  ExpectWords(ErrorOf(Text(R"(, "exclude": [{"formulations": "odca"}])")),
              {"unknown key \"formulations\"", "did you mean \"formulation\""});
  ExpectWords(ErrorOf(Text(R"(, "exclude": [{"rtol": [1e-6, 1e-8]}])")),
              {"/exclude: found rules that match every case"});
  ExpectWords(ErrorOf(Text(R"(, "exclude": [{}])")), {"at least one condition"});
}

TEST(Settings, ChangeFieldsBeforeReading) {
  const auto one = Read(Text(""), {{"/problems/0/horizon", "[2, 3]"},
                                   {"/limits/memory_mb", "512"},
                                   {"/problems/0/mechanism/gravity/1", "-1.5"},
                                   {"/integrator", "cash-karp"}})
                       .front();
  EXPECT_EQ(one.problems.front().horizons, (std::vector<double>{2.0, 3.0}));
  EXPECT_EQ(one.limits.memory_mb, 512.0);
  EXPECT_EQ(Described(one).gravity.y(), -1.5);
  EXPECT_EQ(one.integrators, std::vector<std::string>{"cash-karp"});
}

TEST(Settings, UnknownFieldsAreRefusedWithTheNearestSpelling) {
  ExpectWords(ErrorOf(Text(""), {{"/tolerance", "1"}}),
              {"unknown key \"tolerance\"", "did you mean \"tolerances\"", "(from --set)"});
  ExpectWords(ErrorOf(Text(""), {{"/problems/0/mechanism/bodies/0/points/b", "[1, 0]"}}),
              {"--set /problems/0/mechanism/bodies/0/points/b: found no \"b\"", "\"A\", \"B\""});
  ExpectWords(ErrorOf(Text(""), {{"/problems/0/horizn/0", "1"}}), {"did you mean \"horizon\""});
  ExpectWords(ErrorOf(Text(std::string(R"(, "sweep": [)") + kMass + "]"),
                      {{"/problems/0/mechanism/bodies/1/mass", "1"}}),
              {"axis \"mass\" sets again"});
  EXPECT_THROW(ParseSetting("nothing"), ConfigError);
  EXPECT_EQ(ParseSetting("/a=b=c").value, "b=c");
}

}  // namespace config_sweep_test
}  // namespace loopbench::harness
