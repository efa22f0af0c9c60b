// count, and experiments with generated execution, as users call them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace {

class CountTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    ::setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("XDG_CACHE_HOME");
    CommandLineTest::TearDown();
  }
};

TEST_F(CountTest, PrintsARowForEachRightHandSide) {
  const Ending ending =
      Call("count four-bar.json --coordinates joint --enforcement acceleration,velocity");
  ExpectEnding(ending, 0, {"flops", "depth", "odca", "lagrange", "reduction", "McMahon"});
  const Ending json = Call("count four-bar.json --formulation odca --format json");
  ExpectEnding(json, 0, {"\"flops\":", "\"additions\":", "\"flops_as_run\":"});
  EXPECT_EQ(std::ranges::count(json.text, '{'), 6);  // three levels, two coordinate sets
}

TEST_F(CountTest, BadInputIsNamedWithFileAndExpectation) {
  ExpectEnding(Call("count absent.json"), 2, {"absent.json"});
  const std::string before = ReadFile(folder_ / "four-bar.json");
  ExpectEnding(Call("count four-bar.json --out four-bar.json"), 2, {"four-bar.json"});
  EXPECT_EQ(ReadFile(folder_ / "four-bar.json"), before);
  EditMechanism("\"mass\": 1.0", "\"mass\": \"heavy\"");
  ExpectEnding(Call("count four-bar.json"), 2,
               {"four-bar.json", "/bodies/0/mass: found \"heavy\"", "expected a number > 0"});
  ExpectEnding(Call("count four-bar.json --enforcement postion"), 2, {"--enforcement", "postion"});
  ExpectEnding(Call("count"), 2, {"neither mechanisms nor --family"});
}

/// With light bodies on its loops, the rank of multipliers in absolute coordinates needs a
/// factorisation that iterates.
std::string Iterating() {
  std::string text = ReadFile(kConfigs / "mechanisms/double-wishbone.json");
  for (const std::string mass : {"\"mass\": 2.5", "\"mass\": 0.8"}) {
    text.replace(text.find(mass), mass.size(), "\"mass\": 1e-9");
  }
  return text;
}

TEST_F(CountTest, WhatIsNotRecordedIsARowWithTheReason) {
  Write("iterating.json", Iterating());
  ExpectEnding(Call("count iterating.json --formulation lagrange --coordinates absolute"), 2,
               {"not recorded", "more than 100000 operations"});
}

TEST_F(CountTest, LevelPositionHasItsNewtonStepBesideIt) {
  ExpectEnding(Call("count four-bar.json --enforcement projection"), 0, {"Newton step"});
}

/// Sparse multipliers of a chain grow by the same number for each body from ten bodies on; the
/// exponent is that of a line with an offset.
TEST_F(CountTest, FamiliesHaveExponentsAndCrossovers) {
  // above 16 bodies one rule makes all plans of chains (plan.h)
  const Ending ending = Call(
      "count --family chain --sizes 3,20,40 --enforcement acceleration --format jsonl --out "
      "chain.jsonl");
  ExpectEnding(ending, 0, {});
  std::map<std::string, std::vector<double>> exponents;
  for (const Record& row : ReadRecords(folder_ / "chain.jsonl")) {
    const Value* exponent = row.Find("exponent");
    if (exponent == nullptr) continue;
    exponents[std::get<std::string>(*row.Find("formulation")) + " " +
              std::get<std::string>(*row.Find("coordinates"))]
        .push_back(std::get<double>(*exponent));
  }
  EXPECT_NEAR(exponents["odca joint"].back(), 1.0, 0.2);
  EXPECT_NEAR(exponents["lagrange absolute"].back(), 1.0, 0.1);
  EXPECT_GT(exponents["lagrange joint"].back(), 1.8);
  ExpectEnding(Call("count --family chain --sizes 3,16 --enforcement acceleration"), 0,
               {"fewest operations at level acceleration, rank-revealing: from 3 bodies reduction, "
                "joint; from 16 bodies odca, joint (to 16)"});
  ExpectEnding(Call("plot chain.jsonl --x bodies --y flops_per_body --out chain.svg"), 0, {});
  ExpectEnding(Call("count --family chain"), 2, {"found no --sizes", "3 to 1000000"});
  ExpectEnding(Call("count --family chain --sizes 2"), 2, {"found 2", "bars of a closed chain"});
  ExpectEnding(Call("count --sizes 2"), 2, {"--family"});
}

/// Reduction of a serial arm in space contains Newton-Euler, composite rigid bodies, and a solution
/// by Cholesky. Published numbers of operations of general arms with revolute joints are upper
/// bounds: Luh, Walker and Paul (1980); Walker and Orin (1982), method 3; a symmetric solution.
TEST_F(CountTest, SerialArmsNeedFewerOperationsThanPublishedAlgorithms) {
  ExpectEnding(
      Call("count --family arm --sizes 2,3,6,10,20,40 --formulation reduction --enforcement "
           "acceleration --coordinates joint --format jsonl --out arms.jsonl"),
      0, {});
  int rows = 0;
  for (const Record& row : ReadRecords(folder_ / "arms.jsonl")) {
    const auto number = [&](const char* key) { return std::get<std::int64_t>(*row.Find(key)); };
    const std::int64_t n = number("bodies");
    EXPECT_LE(number("multiplications"),
              (150 * n - 48) + (12 * n * n + 56 * n - 27) + (n * n * n + 9 * n * n + 2 * n) / 6)
        << n;
    EXPECT_LE(number("additions"),
              (131 * n - 48) + (7 * n * n + 67 * n - 53) + (n * n * n + 6 * n * n - 7 * n) / 6)
        << n;
    ++rows;
  }
  EXPECT_EQ(rows, 6);
}

TEST_F(CountTest, PartsOfACountAddUp) {
  ExpectEnding(Call("count four-bar.json --format jsonl --out rows.jsonl"), 0, {});
  for (const Record& row : ReadRecords(folder_ / "rows.jsonl")) {
    const auto number = [&](const char* key) { return std::get<std::int64_t>(*row.Find(key)); };
    EXPECT_EQ(number("kinematics") + number("forces") + number("solve"), number("flops"));
    EXPECT_GT(number("kinematics"), 0);
    EXPECT_GT(number("solve"), 0);
    EXPECT_LE(number("solve_depth"), number("depth"));
  }
}

TEST_F(CountTest, TheManualPageAndTheCompletionKnowIt) {
  EXPECT_NE(Call("manual").text.find(".SS loopbench count"), std::string::npos);
  EXPECT_NE(Call("completion bash").text.find("count"), std::string::npos);
  ExpectEnding(Call("count --help"), 0, {"Examples:", "--formulation", "docs/operation-counts.md"});
}

/// Rows of a table in CSV by their keys, without notes.
std::map<std::string, std::string> RowsByKey(const std::string& csv) {
  std::map<std::string, std::string> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::size_t end = 0;
    for (int i = 0; i < 5; ++i) end = line.find(',', end) + 1;
    rows[line.substr(0, end - 1)] = line.substr(end);
  }
  return rows;
}

/// The gate without a clock. `loopbench count` writes the file anew (results/methods/README.md).
/// Rows that are not exact, where rounding decides an iteration or a pivot, are not compared. The
/// table is of the portable build; in others a few rows may not be exact.
class CountGate : public CountTest, public testing::WithParamInterface<std::string> {};

TEST_P(CountGate, CountsOfAllMechanismsAreThoseOfTheCommittedTable) {
  const fs::path kept = fs::path(LOOPBENCH_SOURCE_DIR) / "results/methods/counts.csv";
  const Ending now = Call("count '" + (kConfigs / "mechanisms").string() +
                          "'/*.json --format csv --out counts.csv --coordinates " + GetParam());
  ASSERT_EQ(now.code, 0) << now.text;
  const auto found = RowsByKey(ReadFile(folder_ / "counts.csv"));
  const auto expected = RowsByKey(ReadFile(kept));
  int exact = 0, rounded_here = 0;
  for (const auto& [key, counts] : expected) {
    if (key.find("," + GetParam() + ",") == std::string::npos) continue;
    if (!counts.ends_with(",yes,")) continue;
    const auto row = found.find(key);
    if (row != found.end() && row->second.ends_with(",no,")) {
      ++rounded_here;
      continue;
    }
    ++exact;
    EXPECT_EQ(row == found.end() ? "no row" : row->second, counts) << key;
  }
  EXPECT_GT(exact, 300);
  EXPECT_LE(rounded_here, 4);
  for (const auto& [key, counts] : found) EXPECT_TRUE(expected.contains(key)) << key << " is new";
}

INSTANTIATE_TEST_SUITE_P(Coordinates, CountGate, testing::Values("joint", "absolute"),
                         [](const auto& set) { return set.param; });

TEST_F(CountTest, GeneratedExecutionIsAFactorOfExperiments) {
  Write("both.json", R"({
    "name": "both", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "reduction"], "enforcement": "velocity",
                 "execution": ["library", "generated"]}],
    "timing": {"repeats": 0}})");
  ExpectEnding(Call("list both.json"), 0, {"execution", "generated"});
  ExpectEnding(Call("run both.json --out out"), 0, {});
  const Ending table = Call(
      "table out --format csv --columns formulation,execution,outcome,library_evaluations,"
      "rhs_evaluations");
  EXPECT_NE(table.text.find("odca,generated,finished,0,"), std::string::npos) << table.text;
  EXPECT_NE(table.text.find("reduction,generated,finished,0,"), std::string::npos) << table.text;
  EXPECT_NE(table.text.find("odca,,finished,,"), std::string::npos) << table.text;
}

/// Whole runs have equal bits, except for the sign of zeros, in general and generated code, and
/// equal measures, also where constraints are regularized.
TEST_F(CountTest, GeneratedRunsHaveTheBitsOfGeneralOnes) {
  Write("bits.json", fmt::format(R"({{
    "name": "bits", "tolerances": [1e-8],
    "problems": [{{"mechanism": "{0}/andrews-squeezer.json", "horizon": 0.01}},
                 {{"mechanism": "{0}/bennett.json", "horizon": 0.3}},
                 {{"mechanism": "{0}/flyball-governor.json", "horizon": 0.1}},
                 {{"mechanism": "{0}/parallelogram-singular-start.json", "horizon": 0.5}},
                 {{"mechanism": "{0}/slider-crank.json", "horizon": 0.5}}],
    "methods": [{{"formulation": ["odca", "lagrange", "reduction"],
                 "enforcement": ["acceleration", "velocity", "projection"],
                 "execution": ["general", "generated"]}}],
    "timing": {{"repeats": 0}}}})",
                                 (kConfigs / "mechanisms").string()));
  Call("run bits.json --jobs 2 --out out");
  std::map<std::string, Record> first;
  int compared = 0;
  std::int64_t regularized = 0;
  for (const Record& row : ReadRecords(folder_ / "out")) {
    if (row.Text("outcome") == "unsupported") continue;
    const bool may_end = row.Text("mechanism") == "parallelogram-singular-start";
    EXPECT_TRUE(may_end || row.Text("outcome") == "finished") << row.Text("message");
    const std::string key =
        row.Text("mechanism") + " " + row.Text("formulation") + " " + row.Text("enforcement");
    const auto [other, is_first] = first.emplace(key, row);
    if (is_first) continue;
    for (const char* measure :
         {"outcome", "state_hash", "steps", "drift_position_max", "energy_error_max", "rank_min",
          "rcond_min", "regularized_evaluations"}) {
      const Value *general = other->second.Find(measure), *generated = row.Find(measure);
      ASSERT_EQ(general == nullptr, generated == nullptr) << key << " " << measure;
      if (general == nullptr) continue;
      EXPECT_EQ(*general, *generated) << key << " " << measure;
    }
    const Value* count = row.Find("regularized_evaluations");
    if (count != nullptr) regularized += std::get<std::int64_t>(*count);
    ++compared;
  }
  EXPECT_GE(compared, 38);
  EXPECT_GT(regularized, 0);
}

/// Drift at level projection is round-off.
TEST_F(CountTest, GeneratedRightHandSidesServeLevelPosition) {
  Write("position.json", R"({
    "name": "position", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "lagrange", "reduction"], "enforcement": "projection",
                 "execution": "generated"}],
    "timing": {"repeats": 0}})");
  ExpectEnding(Call("run position.json --out out"), 0, {});
  for (const Record& row : ReadRecords(folder_ / "out")) {
    EXPECT_EQ(std::get<std::string>(*row.Find("outcome")), "finished");
    EXPECT_LT(std::get<double>(*row.Find("drift_position_max")), 1e-14);
    EXPECT_LE(std::get<std::int64_t>(*row.Find("library_evaluations")), 3);
  }
}

/// A pendulum whose angle is prescribed: the work of its drive is all that is integrated.
TEST_F(CountTest, AMechanismWithoutStateRunsInEachExecution) {
  Write("driven.json", R"({
    "name": "driven", "space": "planar", "gravity": [0.0, -9.81], "ground": {"points": {"O": [0.0, 0.0]}},
    "bodies": [{"name": "bar", "mass": 1.3, "inertia": 0.7, "points": {"A": [0.6, 0.0]}}],
    "joints": [{"name": "J", "type": "revolute", "from": {"body": "ground", "at": "O"},
                "to": {"body": "bar", "at": "A"},
                "motion": {"type": "harmonic", "amplitude": 0.5, "omega": 2.0}}]})");
  Write("run.json", R"({
    "name": "run", "tolerances": [1e-8], "problems": [{"mechanism": "driven.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "lagrange", "reduction"],
                 "enforcement": ["acceleration", "projection"],
                 "execution": ["library", "general", "generated"]}],
    "timing": {"repeats": 1}})");
  ExpectEnding(Call("run run.json --out out"), 0, {});
  int rows = 0;
  for (const Record& row : ReadRecords(folder_ / "out")) {
    EXPECT_EQ(row.Text("outcome"), "finished") << row.Text("message");
    ++rows;
  }
  EXPECT_EQ(rows, 2 * 18);
  ExpectEnding(Call("count driven.json --coordinates joint"), 2,
               {"not recorded", "prescribed motions leave no state to integrate"});
}

TEST_F(CountTest, WhatIsNotGeneratedEndsByName) {
  Write("iterating.json", Iterating());
  Write("none.json", R"({
    "name": "none", "tolerances": [1e-6],
    "problems": [{"mechanism": "iterating.json", "horizon": 0.5}],
    "methods": [{"formulation": "lagrange", "enforcement": "projection", "coordinates": "absolute",
                 "execution": "generated"}],
    "timing": {"repeats": 0}})");
  Call("run none.json --out out");
  ExpectEnding(Call("table out --format csv --columns outcome,message"), 0,
               {"unsupported", "more than 100000 operations"});
  Write("typo.json", R"({
    "name": "typo", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "velocity", "execution": "generate"}]})");
  ExpectEnding(Call("check typo.json"), 2,
               {"/methods/0/execution", "found \"generate\"", "did you mean \"generated\""});
}

}  // namespace
}  // namespace loopbench::harness
