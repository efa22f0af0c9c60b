// Sweeps, ranges, families, inline mechanisms, exclusions and --set: what one file expands to.
#include "harness/config/experiment_reader.h"
#include "harness/run/run.h"
#include "mechanism/description/library.h"
#include "tests/harness/places.h"

namespace loopbench::harness::config_sweep_test {

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
  return MessageOf([&] { Read(text, settings); });
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

TEST(InlineMechanism, IsReadWhereItStands) {
  const std::string pendulum = R"({"name": "p", "gravity": [0, -9.81],
    "bodies": [{"name": "bar", "mass": 2, "inertia": 1, "com": [0, -1]}],
    "joints": [{"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "bar"}}]})";
  const Experiment experiment = Read(Text("", pendulum)).front();
  EXPECT_EQ(experiment.problems.front().name, "p");
  EXPECT_EQ(Described(experiment).bodies[1].mass, 2.0);
  EXPECT_TRUE(experiment.problems.front().path.empty());
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
  const std::string error = ErrorOf(Text(R"(,
    "sweep": [{"name": "mass", "field": "/problems/0/mechanism/bodies/1/mass",
               "values": [1, -2, -3]}])"));
  ExpectWords(error,
              {"e.json:4: /problems/0/mechanism/bodies/1/mass: found -2, expected a number > 0",
               "(a value of axis \"mass\")", "combination 2 of 3: mass = -2"});
  ExpectNone(error, {"-3"});  // it stops at the first
}

// In addition to tests/broken/experiments.
TEST(Sweep, ThatCannotBeMeantIsRefused) {
  using Words = std::vector<std::string>;
  const std::pair<std::string, Words> refused[] = {
      {R"({"name": "m", "field": "/tolerances/lin/0", "values": [1]})",
       {"/sweep/0/field: found no element \"lin\""}},
      {R"({"name": "m", "field": "/problem/0/horizon", "values": [1]})",
       {"found no \"problem\"", "did you mean \"problems\""}},
      {R"({"name": "cost", "field": "/tolerances", "values": [1e-6]})",
       {"found \"cost\", expected a name that records do not use already"}},
      {R"({"name": "a=b", "field": "/tolerances", "values": [1e-6]})", {"letters"}},
      {R"({"name": "m", "field": "/tolerances", "values": [1e-3, 0.001]})",
       {"/sweep/0: found 0.001 again"}},
      {R"({"name": "m", "field": "/problems/0/horizon", "values": [1, 1.0, 2]})",
       {"/sweep/0: found 1.0 again"}},
      {R"({"name": "a", "field": "/limits", "values": [{}]},
          {"name": "b", "field": "/limits/wall_s", "values": [1]})",
       {"/sweep: found \"a\" and \"b\" both setting /limits/wall_s"}},
      {R"({"name": "a", "field": "/limits/wall_s", "values": {"lin": [1, 2, 1000]}},
          {"name": "b", "field": "/limits/steps", "values": {"lin": [1, 1000, 1000]}})",
       {"/sweep: found 1000000 combinations, expected at most 100000 to be held at once"}}};
  for (const auto& [axes, words] : refused) {
    ExpectWords(ErrorOf(Text(", \"sweep\": [" + axes + "]")), words);
  }
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

}  // namespace loopbench::harness::config_sweep_test
