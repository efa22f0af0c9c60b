// `loopbench migrate`: files with names of earlier versions are read afterwards, and nothing else
// of them has changed.
#include <sys/stat.h>
#include <unistd.h>

#include "harness/base/record.h"
#include "harness/suite/suite.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::migrate_test {

/// Returns the text with the old or the new name of each "<old|new>".
std::string WithNames(const std::string& text, bool is_new) {
  static const std::regex names("<([^|]*)\\|([^>]*)>");
  return std::regex_replace(text, names, is_new ? "$2" : "$1");
}

constexpr const char* kExperiment = R"({
  "name": "tiny",
  "<scenes|problems>": [{"mechanism": "old-bar.json",   "horizon": 0.5}],
  "<columns|methods>": [{"formulation": ["odca", "lagrange"],
               "enforcement": ["acceleration", "<position|projection>"], "solver": "<as-published|plain>"},
              {"formulation": "odca", "enforcement": "<position|projection>"}],
  "exclude": [{"enforcement": "<position|projection>", "solver": "<as-published|plain>"}],
  "ensembles": [{"size": 2, "seed": 1, "perturb": 1e-3, "<scenes|problems>": "four-bar",
                 "enforcement": "<position|projection>"}],
  "sweep": [{"name": "mass", "field": "/<scenes|problems>/0/mechanism/bodies/0/mass", "values": [1, 2]},
            {"name": "level", "field": "/<columns|methods>/1/enforcement",
             "values": ["<position|projection>", "velocity"]}],
  "tolerances": [1e-6], "<compile|preprocess>": {"planar": false},
  "timing": {"repeats": 0,
             "<columns|methods>": [{"formulation": "odca", "enforcement": "<position|projection>"}]}
})";

constexpr const char* kMap = R"({"title": "t", "<columns|methods>": [
  {"label": "O", "select": {"formulation": "odca", "solver": "<as-published|plain>"}}],
  "groups": [{"label": "g", "<must_hold|required>": "all", "<why|rationale>": "because", "rows": [
    {"label": "r", "select": {"mechanism": "four-bar"},
     "<right|expected_outcome>": ["finished", "<inexpressible|unsupported>"],
     "<decides|criteria>": [{"measure": "<error_shape_max|error_path_max>", "limit": 5,
                             "<of|relative_to>": "rtol"}]}]}]})";

class MigrateTest : public CommandLineTest {
 protected:
  /// The text of a file after it was migrated, and again: the second time changes nothing.
  std::string Migrated(const std::string& name, const std::string& text) const {
    Write(name, text);
    const Ending ending = Call("migrate '" + name + "'");
    EXPECT_EQ(ending.code, 0) << ending.text;
    const std::string now = ReadFile(folder_ / name);
    const auto written = fs::last_write_time(folder_ / name);
    const Ending again = Call("migrate '" + name + "'");
    EXPECT_EQ(again.code, 0);
    EXPECT_EQ(again.text, name + ": no old names\n");
    EXPECT_EQ(fs::last_write_time(folder_ / name), written);
    return now;
  }

  /// Migrates the text with old names, and expects the one with new names.
  void ExpectNewNames(const std::string& name, const std::string& text) const {
    EXPECT_EQ(Migrated(name, WithNames(text, false)), WithNames(text, true));
  }

  /// The mechanism of the fixture as earlier versions had it.
  std::string OldMechanism() const {
    std::string text = mechanism_;
    text.replace(text.find("\"fixed\""), 7, "\"held\"");
    return text;
  }

  static Record OldRecord(const std::string& formulation) {
    return RecordOf("kind", "accuracy", "mechanism", "four-bar", "formulation", formulation,
                    "enforcement", "position", "solver", "as-published", "rtol", 1e-6, "horizon",
                    1.0, "content", "c0", "outcome", "finished", "scene_id", "00ff", "doubts",
                    "energy softened singular-passage", "softened_evaluations", 3, "trust_horizon",
                    1.0, "drift_position_max", 1.25e-7, "message",
                    "at the position \"softened_steps\": \\ \"");
  }

  /// The line of a record as earlier versions wrote it.
  static std::string OldLine(const Record& record) {
    std::string line = ToJsonLine(record);
    line.replace(line.find("\"format\":2"), 10, "\"format\":1");
    line.resize(line.rfind(",\"checksum\":"));
    return WithChecksum(line + "}");
  }

  void WriteStore(const std::string& text) const {
    fs::create_directories(folder_ / "out");
    Write("out/results.jsonl", text);
  }
};

TEST_F(MigrateTest, AnOldExperimentIsReadAfterwards) {
  EXPECT_EQ(Migrated("old-bar.json", OldMechanism()), mechanism_);
  Write("old.json", WithNames(kExperiment, false));
  Expect("run old.json", 2, {"unknown key \"scenes\"", "loopbench migrate FILE"});
  ExpectNewNames("old.json", kExperiment);
  Expect("check old.json old-bar.json", 0, {"old.json: experiment"});
  Expect("migrate old.json old-bar.json tiny.json", 0, {"tiny.json: no old names"});
}

TEST_F(MigrateTest, OldRulesAreReadAfterwards) {
  ExpectNewNames("map.json", kMap);
  std::string claims = kTinyClaims;
  claims.replace(claims.find("partially_reproduced"), 20, "only_under");
  EXPECT_EQ(Migrated("claims.json", claims), kTinyClaims);
  Expect("check map.json claims.json", 0, {"robustness map of 1 row and 1 method"});
}

TEST_F(MigrateTest, AnOldStoreIsReadAfterwards) {
  WriteStore(OldLine(OldRecord("odca")) + "\n" + OldLine(OldRecord("lagrange")) + "\n");
  const fs::path file = folder_ / "out/results.jsonl";
  // read as it is, its warnings and crossings would be missing
  Expect("table out --fail-on warnings", 2, {"expected 2", "found 1", "loopbench migrate"});
  Expect("migrate out", 0, {"out/results.jsonl: 18 names replaced"});
  const std::string text = ReadFile(file);
  for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != text.npos; begin = end + 1) {
    EXPECT_TRUE(VerifyChecksum(std::string_view(text).substr(begin, end - begin)));
  }
  const std::vector<Record> records = ReadRecords(file);
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[1].Text("solver"), "plain");
  EXPECT_EQ(records[1].Text("enforcement"), "projection");
  EXPECT_EQ(records[1].Text("config_hash"), "c0");
  EXPECT_EQ(records[1].Text("problem_id"), "00ff");
  EXPECT_EQ(records[1].Text("warnings"), "energy regularized singular-crossing");
  EXPECT_EQ(records[1].Number("regularized_evaluations"), 3.0);
  EXPECT_EQ(records[1].Number("reference_valid_until"), 1.0);
  EXPECT_EQ(records[1].Number("drift_position_max"), 1.25e-7);
  EXPECT_EQ(records[1].Text("message"), OldRecord("odca").Text("message"));
  Expect("table out", 0, {"proj", "plain"});
  Expect("migrate out", 0, {"out/results.jsonl: no old names"});
  EXPECT_EQ(ReadFile(file), text);
}

TEST_F(MigrateTest, LineEndsAndTornLinesStay) {
  const std::string torn = R"({"format":1,"kind":"accuracy","doubts":"ene)";
  WriteStore(OldLine(OldRecord("odca")) + "\r\n\r\n" + torn);
  Expect("migrate out", 0, {"9 names replaced"});
  const std::string text = ReadFile(folder_ / "out/results.jsonl");
  const std::size_t end = text.find('\r');
  EXPECT_TRUE(VerifyChecksum(std::string_view(text).substr(0, end)));
  EXPECT_EQ(text.substr(end), "\r\n\r\n" + torn);
}

TEST_F(MigrateTest, MechanismsOfAStoreKeepTheirChecksum) {
  WriteStore(OldLine(OldRecord("odca")) + "\n");
  fs::create_directories(folder_ / "out/mechanisms");
  std::string mechanism = OldMechanism();
  mechanism.insert(mechanism.find("\"comment\": \"") + 12,
                   "Kept by a run; checksum 0000000000000000. ");
  Write("out/mechanisms/00ff.json", WithOwnHash(mechanism));
  Expect("migrate out", 0, {"00ff.json: 1 names replaced"});
  EXPECT_EQ(ReadKeptMechanism(folder_ / "out/mechanisms/00ff.json").name, "four-bar");
}

TEST_F(MigrateTest, ValuesOfASweepFollowItsField) {
  ExpectNewNames("sweep.json", R"({"<scenes|problems>": [], "sweep": [
    {"values": ["<position|projection>", "velocity"], "field": "/<columns|methods>/0/enforcement/0"},
    {"values": ["position"], "field": "/<scenes|problems>/0/mechanism/name"}]})");
  ExpectNewNames("claims.json",
                 R"({"claims": [{"checks": [{"select": {"<content|config_hash>": "a"},
    "relative_to": {"solver": "<as-published|plain>", "<content|config_hash>": "b"}}]}]})");
}

TEST_F(MigrateTest, NamesOfTheUserStay) {
  const std::string text = R"({"name": "scenes", "comment": "as-published doubts",
    "bodies": [{"name": "held", "mass": 1, "points": {"right": [0, 0], "columns": [1, 0]}}],
    "joints": [{"name": "of", "to": "held", "from": "ground", "type": "revolute"}],
    "initial": {"coordinates": {"held": 0.5, "of": 1}, "fixed": ["held", "position"]}})";
  EXPECT_EQ(Migrated("named.json", text), text);
}

TEST_F(MigrateTest, OtherFilesAreRefusedAsTheyAre) {
  Record record = OldRecord("odca");
  {
    ResultStore store(folder_ / "changed.jsonl");
    store.Append(record);
  }
  std::string changed = ReadFile(folder_ / "changed.jsonl");
  changed.replace(changed.find("1.25e-07"), 8, "1.25e-09");
  record.Set("warnings", std::string("a sweep's axis of this name"));
  const std::pair<const char*, std::string> files[] = {
      {"collision.jsonl", OldLine(record) + "\n"},
      {"text.json", "columns: 3\n"},
      {"both.json", R"({"columns": [], "methods": []})"},
      {"changed.jsonl", changed},
      {"text.jsonl", "scene_id\nscene_id\n"}};
  for (const auto& [name, text] : files) {
    Write(name, text);
    Expect(std::string("migrate tiny.json ") + name, 2, {name, "tiny.json: no old"});
    EXPECT_EQ(ReadFile(folder_ / name), text);
  }
  for (const char* name : {"none.json", "/dev/null", "pipe.json"}) {
    if (std::string_view(name) == "pipe.json") {
      ASSERT_EQ(::mkfifo((folder_ / name).c_str(), 0600), 0);
    }
    Expect(std::string("migrate ") + name, 2, {name, "expected a regular file"});
  }
  WriteStore(OldLine(OldRecord("odca")) + "\n");
  const int lock = OpenLocked(folder_ / "out/results.jsonl");
  Expect("migrate out", 2, {"results.jsonl", "process"});
  ::close(lock);
}

}  // namespace loopbench::harness::migrate_test
