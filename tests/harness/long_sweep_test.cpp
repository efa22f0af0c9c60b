// Sweeps of more combinations than are held at once, through the program.
#include "harness/base/record.h"
#include "harness/cli/commands.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::long_sweep_test {

constexpr const char* kPendulum = R"({
  "name": "pendulum", "space": "planar", "gravity": [0, -9.81],
  "ground": {"points": {"O": [0, 0]}},
  "bodies": [{"name": "bar", "mass": 1, "inertia": 0.1, "com": [0.5, 0], "points": {"A": [0, 0]}}],
  "joints": [{"name": "OA", "type": "revolute", "from": {"body": "ground", "at": "O"},
              "to": {"body": "bar", "at": "A"}}],
  "initial": {"coordinates": {"OA": 0}, "fixed": ["OA"]}
})";

/// 2 formulations, 33 x 33 = 1089 combinations, more than are held (kLongSweep); some are excluded.
std::string LongSweepText(const std::string& masses = R"({"lin": [1, 2, 33]})") {
  return R"({"name": "long", "problems": [{"mechanism": "pendulum.json", "horizon": 0.001}],
  "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "acceleration"}],
  "timing": {"repeats": 0}, "tolerances": [1e-6], "series": {"points": 2},
  "sweep": [
    {"name": "mass", "field": "/problems/0/mechanism/bodies/0/mass", "values": )" +
         masses + R"(},
    {"name": "inertia", "field": "/problems/0/mechanism/bodies/0/inertia",
     "values": {"lin": [0.1, 1, 33]}}],
  "exclude": [{"mass": 1, "formulation": "lagrange"}, {"inertia": 1}]})";
}
// of 33 masses and 32 inertias that are left, all with O-DCA, all but one mass with multipliers
constexpr std::size_t kAll = 32 * 33 + 32 * 32;

class LongSweeps : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Write("pendulum.json", kPendulum);
    Write("long.json", LongSweepText());
  }

  std::map<std::string, std::string> HashesOf(const std::string& store) const {
    std::map<std::string, std::string> hashes;
    for (const Record& one : ReadRecords(folder_ / store)) {
      EXPECT_TRUE(hashes.emplace(one.Text("case_id"), one.Text("state_hash")).second);
    }
    return hashes;
  }
};

TEST_F(LongSweeps, AreCountedWithoutBeingRead) {
  const std::string cases = std::to_string(kAll) + " cases";
  Expect("estimate long.json", 0,
         {"axis mass: 33 values", "1089 combinations", cases, "combinations stand for all"});
  Expect("check long.json", 0, {cases, "each value of each axis was read"});
  Expect("explain long.json", 0, {"1089 combinations", "(33 values, some shown)"});
  Expect("list long.json", 0, {cases, "--json lists every case"});
  const std::string listed = Call("list long.json --json").text;
  std::size_t count = 0;
  for (std::size_t at = 0; (at = listed.find("\"kind\":", at)) != std::string::npos; ++at) ++count;
  EXPECT_EQ(count, kAll);
  Expect("estimate long.json --filter 'mass<1.5' --filter formulation=odca", 0,
         {std::to_string(16 * 32) + " cases"});
  Expect("estimate long.json --filter mass=7", 2, {"no case matches mass=7"});
  Expect("estimate long.json --filter mas=1", 2, {"no such key"});
}

TEST_F(LongSweeps, RunInGroupsGoOnAndAreSharded) {
  const std::string all = std::to_string(kAll);
  Expect("run long.json --out whole --jobs 2", 0,
         {"ran " + all + " cases in", "No tables were written"});
  const auto whole = HashesOf("whole");
  EXPECT_EQ(whole.size(), kAll);
  Expect("run long.json --out whole", 0, {"ran 0 cases, " + all + " reused"});
  EXPECT_TRUE(fs::exists(folder_ / "whole/results.groups"));
  // without marks, and with marks of a store that is another one by now
  fs::remove(folder_ / "whole/results.groups");
  Expect("run long.json --out whole", 0, {"ran 0 cases, " + all + " reused"});
  std::string text = ReadFile(folder_ / "whole/results.jsonl");
  const std::size_t lines = 100;
  std::size_t end = 0;
  for (std::size_t i = 0; i < lines; ++i) end = text.find('\n', end) + 1;
  Write("whole/results.jsonl", text.substr(0, end));
  Expect("run long.json --out whole", 0,
         {"ran " + std::to_string(kAll - lines) + " cases", "100 reused"});
  EXPECT_EQ(HashesOf("whole"), whole);

  std::string parts;
  for (const std::string k : {"1", "2", "3"}) {
    Expect("run long.json --shard " + k + "/3 --out part" + k, 0);
    parts += " part" + k;
  }
  Expect("merge" + parts + " --out merged", 0, {"of 3 stores: " + all + " cases"});
  EXPECT_EQ(HashesOf("merged"), whole);
}

TEST_F(LongSweeps, GiveTheSameBitsInProcessesOfTheirOwn) {
  const std::string some = " long.json --filter 'mass<1.1' --out ";
  Expect("run" + some + "shared", 0, {" cases in "});
  const Ending alone = Call("run --isolate" + some + "alone");
  ExpectEnding(alone, 0, {" cases, 0 reused"});
  EXPECT_EQ(HashesOf("shared"), HashesOf("alone"));
}

TEST_F(LongSweeps, AFaultIsOneCasesOutcome) {
  const std::string fault = "env LOOPBENCH_FAULT='crash:mass=1.5'";
  ExpectEnding(Call("run long.json --filter formulation=odca --out faulty", fault), 0,
               {"(32 not finished)"});
  std::set<std::string> outcomes;
  std::size_t crashed = 0;
  for (const Record& one : ReadRecords(folder_ / "faulty")) {
    const bool is_planted = one.Number("mass") == 1.5;
    EXPECT_EQ(one.Text("outcome"), is_planted ? "crashed" : "finished");
    crashed += is_planted;
  }
  EXPECT_EQ(crashed, 32u);
  Expect("run long.json --filter formulation=odca --out faulty --rerun failed", 0,
         {"ran 32 cases"});
}

TEST_F(LongSweeps, AValueThatCannotBeIsRefusedBeforeAnythingRuns) {
  std::string masses = "[";
  for (int i = 1; i < 33; ++i) masses += std::to_string(i) + ", ";
  Write("long.json", LongSweepText(masses + "-33]"));
  Expect("run long.json --out none", 2,
         {"found -33, expected a number > 0", "combination 1057 of 1089"});
  EXPECT_FALSE(fs::exists(folder_ / "none"));
  Expect("run long.json --out none --fail-on warnings", 2, {"found -33"});
  Write("long.json", LongSweepText());
  Expect("run long.json --out none --fail-on warnings", 2, {"--fail-on warnings", "a sweep of"});
}

/// Rows of a CSV or JSON table, without where they came from.
std::set<std::string> RowsIn(const std::string& text) {
  std::istringstream lines(text);
  std::set<std::string> rows;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# ")) continue;
    if (line.starts_with("[")) line.erase(0, 1);
    rows.insert(line.substr(0, line.find(",\"provenance\"")));
  }
  return rows;
}

/// The record with other values of its keys and, if `extra` is set, a further number.
Record Changed(const Record& record, const std::map<std::string, Value>& values,
               const std::string& extra = "") {
  Record changed;
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" && !extra.empty()) changed.Set(extra, 0.5);
    const auto other = values.find(key);
    if (key != "checksum") changed.Set(key, other == values.end() ? value : other->second);
  }
  return changed;
}

TEST_F(LongSweeps, TablesProblemByProblemHaveTheRowsOfOneThatIsHeld) {
  Call("run long.json --out held");
  Call("run long.json --filter 'mass<1.1' --rerun all --out held");  // some cases twice
  // as many records again, of heavier bars: together more than are read at once
  std::string heavier;
  const auto reversed = [](const std::string& id) { return std::string(id.rbegin(), id.rend()); };
  for (const Record& one : ReadRecords(folder_ / "held")) {
    heavier += ToJsonLine(Changed(one, {{"mass", one.Number("mass") + 10.0},
                                        {"case_id", reversed(one.Text("case_id"))},
                                        {"problem_id", reversed(one.Text("problem_id"))}})) +
               "\n";
  }
  std::ofstream(folder_ / "held/results.jsonl", std::ios::app) << heavier;
  Call("table held --format csv --out held.csv");
  Call("table held --format json --out held.json");
  const ProblemReader reader(folder_ / "held", {});
  EXPECT_EQ(reader.samples().size(), 1u) << "all have the same keys";
  std::vector<std::string> warnings;
  int parts = 0;
  reader.ForEach([&parts](const std::vector<Record>&) { ++parts; }, &warnings);
  EXPECT_EQ(parts, 2) << "else nothing is put together";
  for (const std::string format : {"csv", "json"}) {
    const fs::path file = folder_ / ("long." + format);
    TableCommand command;
    command.store = folder_ / "held";
    command.format = format;
    command.out = file;
    EXPECT_EQ(WriteLongTable(command, reader, ""), 0);
    const std::string text = ReadFile(file);
    EXPECT_EQ(RowsIn(text), RowsIn(ReadFile(folder_ / ("held." + format))));
    EXPECT_EQ(text.starts_with("[{") && text.ends_with("}]\n"), format == "json");
    command.view.where = {Condition{"mass", {"7"}}};
    EXPECT_EQ(WriteLongTable(command, reader, ""), 2) << "nothing matches";
    EXPECT_EQ(ReadFile(file), text) << "so the file stays";
    command.view.where = {Condition{"nonsense", {"7"}}};
    EXPECT_THROW(WriteLongTable(command, reader, ""), ConfigError);
  }
  TableCommand people;
  people.store = folder_ / "held";
  EXPECT_THROW(WriteLongTable(people, reader, ""), ConfigError);
  TableCommand sorted = people;
  sorted.format = "csv";
  sorted.view.sort = "steps";
  EXPECT_THROW(WriteLongTable(sorted, reader, ""), ConfigError);
}

/// A parameter that the last record alone has is a column, and can be asked for.
TEST_F(LongSweeps, LateParametersHaveColumns) {
  Call("run long.json --filter 'mass<1.03' --out late");
  const Record last = Changed(ReadRecords(folder_ / "late").back(),
                              {{"case_id", std::string("0123456789abcdef")},
                               {"problem_id", std::string("fedcba9876543210")}},
                              "friction");
  std::ofstream(folder_ / "late/results.jsonl", std::ios::app) << ToJsonLine(last) << "\n";
  const ProblemReader reader(folder_ / "late", {});
  EXPECT_EQ(reader.samples().size(), 2u);
  TableCommand command;
  command.store = folder_ / "late";
  command.format = "csv";
  command.out = folder_ / "late.csv";
  EXPECT_EQ(WriteLongTable(command, reader, ""), 0);
  ExpectWords(ReadFile(command.out), {",friction,"});
  command.view.where = {Condition{"friction", {"0.5"}}};
  EXPECT_EQ(WriteLongTable(command, reader, ""), 0);
  EXPECT_EQ(RowsIn(ReadFile(command.out)).size(), 2u) << "the header and the one";
}

TEST(KeysOfLine, AreThoseOfTheObjectItself) {
  EXPECT_EQ(KeysOfLine(R"({"a":1,"b":"x\",\"c\":2","d":[1,"e"],"f":null})"), "\"a\"b\"d\"f");
}

}  // namespace loopbench::harness::long_sweep_test
