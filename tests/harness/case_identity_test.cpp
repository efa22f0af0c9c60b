// One identity everywhere: a case is its keys and its content, in stores, tables and judgements.
#include "harness/base/record.h"
#include "harness/config/experiment_reader.h"
#include "harness/run/run.h"
#include "harness/run/timing.h"
#include "harness/suite/suite.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::case_identity_test {

constexpr const char* kMass5 = " --set /problems/0/mechanism/bodies/0/mass=5";
constexpr const char* kMass1 = " --set /problems/0/mechanism/bodies/0/mass=1";

class CaseIdentity : public CommandLineTest {
 protected:
  /// A table's rows, without provenance.
  std::string Rows(const std::string& file) const {
    const std::string text = ReadFile(folder_ / file);
    return text.substr(0, text.find("\n#"));
  }
};

TEST_F(CaseIdentity, GoingBackShowsTheNumbersOfWhatWasAskedFor) {
  for (const auto& [there, back] :
       {std::pair<std::string, std::string>{kMass5, kMass1},
        {" --set '/limits={\"steps\":3}'", " --set '/limits={\"steps\":30000}'"}}) {
    fs::remove_all(folder_ / "out");
    Expect("run tiny.json --out out" + there, 0, {"ran 2 cases"});
    const std::string first = Rows("out/drift.csv");
    Expect("run tiny.json --out out" + back, 0, {"ran 2 cases"});
    EXPECT_NE(Rows("out/drift.csv"), first) << "other numbers, or nothing is shown";
    const Ending third = Call("run tiny.json --out out" + there);
    ExpectEnding(third, 0, {"ran 0 cases, 2 reused"});
    EXPECT_EQ(Rows("out/drift.csv"), first);
    EXPECT_EQ(first.find("config_hash"), std::string::npos) << "one content needs no name";
  }
}

TEST_F(CaseIdentity, TablesShowEveryContentAndTellThemApart) {
  for (const char* set : {kMass5, kMass1, kMass5}) {
    Expect(std::string("run tiny.json --out out") + set, 0);
  }
  Expect("table out", 0, {"config_hash", "bodies/0/mass=5", "bodies/0/mass=1"});
  const std::vector<Record> records = LatestRecords(ReadRecords(folder_ / "out"));
  ASSERT_EQ(records.size(), 4u);
  EXPECT_EQ(records[0].Text("config_hash"), records[1].Text("config_hash")) << "of one mechanism";
  EXPECT_NE(records[0].Text("config_hash"), records[2].Text("config_hash"));
  const std::string mass1 = records[2].Text("config_hash");
  Expect("table out --format csv --columns set,steps --where config_hash=" + mass1, 0,
         {"bodies/0/mass=1"});
  Write("map.json",
        R"({"title": "t", "methods": [{"label": "o", "select": {"formulation": "odca"}}],
    "groups": [{"label": "g", "rows": [{"label": "r", "select": {"mechanism": "four-bar"},
      "criteria": [{"measure": "drift_position_max", "limit": 1, "unit": "m"}], "rationale": "w"}]}]})");
  Expect("robustness out --rules map.json", 2, {"four-bar", "more than once"});
  // drawn together or judged together they would be one case with two results
  Expect("check-claims out --claims claims.json", 2, {"four-bar", "more than once"});
  Expect("table out --kind factorial", 2, {"--where config_hash="});
  Expect("plot out --out figures", 0);
  int figures = 0;
  for (const auto& file : fs::directory_iterator(folder_ / "figures")) {
    const std::string name = file.path().filename().string();
    if (!name.starts_with("drift-four-bar-0.5s-rtol-1e-06-config_hash-")) continue;
    ++figures;
    EXPECT_EQ(ReadFile(file.path()).find("config_hash " + mass1) != std::string::npos,
              name.find(mass1) != std::string::npos);
  }
  EXPECT_EQ(figures, 2) << "each content has a figure of its own";
}

TEST_F(CaseIdentity, FilesOfEqualNamesAreDifferentCases) {
  fs::create_directories(folder_ / "other");
  Write("other/tiny.json", kTinyExperiment);
  Write("other/four-bar.json", mechanism_);
  EditMechanism("\"mass\": 1.0", "\"mass\": 7.0");
  std::string first;
  for (const char* out : {"a", "b", "c"}) {
    const std::string call =
        std::string("run tiny.json other/tiny.json tiny.json --jobs 3 --out ") + out;
    Expect(call, 0, {"ran 4 cases", "config_hash"});
    const std::string rows = Rows(std::string(out) + "/drift.csv");
    EXPECT_EQ(std::ranges::count(rows, '\n'), 4);
    if (first.empty()) first = rows;
    EXPECT_EQ(rows, first);
  }
}

TEST_F(CaseIdentity, TimesAreThoseOfTheirContentToo) {
  const std::string run = "run tiny.json --timing-only --set /timing/repeats=1 --out out";
  Expect(run + kMass5, 0, {"ran 2 cases"});
  const std::string first = Rows("out/timing.csv");
  Expect(run + kMass1, 0, {"ran 2 cases"});
  Expect(run + kMass5, 0, {"ran 0 cases"});
  EXPECT_EQ(Rows("out/timing.csv"), first);
}

TEST_F(CaseIdentity, GoingBackToAProgramShowsItsNumbers) {
  Expect("run tiny.json --out out --filter formulation=odca", 0);
  Record other = ReadRecords(folder_ / "out").front();
  const std::string steps = other.Text("steps");
  other.Set("version", std::string("0123456789abcdef"));
  other.Set("id", std::string("fedcba9876543210"));
  other.Set("steps", std::int64_t{123456});
  ResultStore(folder_ / "out").Append(other);
  const std::string run = "run tiny.json --out out --filter formulation=odca";
  Expect(run, 0, {"ran 0 cases, 1 reused"});
  const std::string table = Call("table out --format csv --columns formulation,steps").text;
  ExpectWords(table, {"odca," + steps});
  ExpectNone(table, {"123456"});
}

TEST_F(CaseIdentity, PlansTakeNoTimesOfOtherContents) {
  Expect(std::string("run tiny.json --out out") + kMass5, 0);
  Expect(std::string("estimate tiny.json --timings-from out") + kMass5, 0, {"2 of 2 cases"});
  Expect(std::string("estimate tiny.json --timings-from out") + kMass1, 0, {"0 of 2 cases"});
}

TEST_F(CaseIdentity, ComparisonsPairEqualContentsOnly) {
  Expect(std::string("run tiny.json --out five") + kMass5, 0);
  Expect(std::string("run tiny.json --out one") + kMass1, 0);
  Expect(std::string("run tiny.json --out both") + kMass1, 0);
  Expect(std::string("run tiny.json --out both") + kMass5, 0);
  Expect("compare five one", 2, {"2 cases that ran another mechanism"});
  Expect("compare five both", 2, {"INCONCLUSIVE: 2 cases only in NEW"});
  Expect("compare five both --added", 0, {"2 cases only in NEW", "NO CHANGE"});
  fs::copy(folder_ / "both", folder_ / "copy", fs::copy_options::recursive);
  Expect("compare both copy", 0, {"NO CHANGE"});
  Expect("export-metrics both", 0, {"bodies/0/mass=5", "bodies/0/mass=1"});
}

TEST_F(CaseIdentity, WhateverDecidesARunChangesEveryCaseId) {
  const std::string timing = R"(/timing={"repeats":1,"families":[{"family":"chain","sizes":[3],
      "methods":[{"formulation":"odca","enforcement":"acceleration"}]}]})";
  const std::string precision = R"(/precision={"scalars":["float","double"]})";
  const auto ids = [&](const std::string& change) {
    std::vector<Setting> settings = {ParseSetting(timing), ParseSetting(precision)};
    if (!change.empty()) settings.push_back(ParseSetting(change));
    const Experiment experiment = ReadExperiments(folder_ / "tiny.json", settings).front();
    const Case accuracy = Identified(experiment, Expand(experiment).front());
    const std::vector<TimingGroup> groups = TimingGroups(experiment);
    return std::vector<std::string>{accuracy.keys.Text("case_id"),
                                    groups.front().cases.front().keys.Text("case_id"),
                                    LadderGroups(experiment).front().keys.front().Text("case_id"),
                                    groups.back().cases.front().keys.Text("case_id")};
  };
  const std::vector<std::string> plain = ids("");
  EXPECT_EQ(std::set<std::string>(plain.begin(), plain.end()).size(), plain.size());
  EXPECT_EQ(ids(""), plain);
  EXPECT_EQ(ids("/comment=\"other words\""), plain);
  const std::string mass = "/problems/0/mechanism/bodies/0/mass=2";
  for (const std::string change : {mass.c_str(), "/limits/cpu_s=3", "/limits/steps=77",
                                   "/limits/memory_mb=1024", "/preprocess={\"welds\":false}"}) {
    const std::vector<std::string> changed = ids(change);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      const bool of_a_problem = i < 3;
      EXPECT_EQ(changed[i] != plain[i], of_a_problem || change != mass) << i << " " << change;
    }
  }
  for (const char* change :
       {R"(/ensembles=[{"size":4,"seed":1,"perturb":0.1}])", R"(/series={"points":17})"}) {
    EXPECT_NE(ids(change)[0], plain[0]) << change;
  }
  EXPECT_NE(ids(R"(/precision/scalars=["float","float128"])")[2], plain[2]);
}

TEST(RowOrder, IsTheSameWhicheverRunEndedFirst) {
  std::vector<Record> rows;
  const double none = std::numeric_limits<double>::quiet_NaN();
  for (const char* enforcement : {"acceleration", "projection"}) {
    for (const double alpha : {none, 1.0, 5.0, 10.0}) {
      for (const char* integrator : {"ode45", "trbdf2"}) {
        for (const std::int64_t file : {0, 1}) {
          Record row = RecordOf("mechanism", "four-bar", "enforcement", enforcement, "integrator",
                                integrator);
          if (!std::isnan(alpha)) row.Set("alpha", alpha);
          row.Set("case_id", std::to_string(rows.size()));
          row.Set("experiment_index", file);
          rows.push_back(row);
        }
      }
    }
  }
  SortRows(&rows);
  const std::vector<Record> sorted = rows;
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    std::ranges::shuffle(rows, random);
    SortRows(&rows);
    ASSERT_EQ(rows, sorted);
  }
}

}  // namespace loopbench::harness::case_identity_test
