// Reports: what a page holds is what the records and the other commands say, whoever named things
// and however many there are.
#include "harness/figures/report.h"

#include <cmath>
#include <limits>
#include <random>

#include "harness/config/formulations.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/work_precision_records.h"

namespace loopbench::harness {
namespace report_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kHostile =
    "</script><script>alert(1)</script>\"'<b>&`$/\n\xe2\x80\xa8\xff{}\\";

/// Runs with series and timings; the last but one failed, the last is flagged.
std::vector<Record> SomeRecords() {
  std::vector<Record> records =
      work_precision_records::Store({1e-3, 1e-4, 1e-5, 1e-6, 1e-7}, {1, 2, 3, 4, 5});
  for (Record& record : records) {
    if (record.Text("kind") != "accuracy") continue;
    record.Set("series.drift_t", std::vector<double>{0.0, 1.0, 10.0});
    record.Set("series.drift", std::vector<double>{0.0, 1e-9, 1e-7});
  }
  records[6].Set("outcome", std::string("singular"));
  records[6].Set("message", std::string("rank lost"));
  records[8].Set("warnings", std::string("drift"));
  return records;
}

std::string PageOf(const std::vector<Record>& records, ReportOptions options = {.store = "here"}) {
  return ToHtml(MakeReport(records, options));
}

// An independent look at the buckets: no value between two kept neighbours is beyond the extremes
// that were kept of the whole, and each bucket's own are there.
TEST(Decimation, KeepsExtremesAndEnds) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const std::size_t n : {1u, 2u, 4u, 5u, 17u, 1000u, 12345u}) {
    std::vector<double> values(n);
    for (double& value : values) value = uniform(random);
    values[n / 2] = 1e6;
    values[n / 3] = -1e6;
    for (const std::size_t most : {4u, 10u, 64u, 101u}) {
      const std::vector<std::size_t> kept = KeepExtremes(values, most);
      EXPECT_LE(kept.size(), std::max<std::size_t>(most, 4));
      EXPECT_TRUE(std::ranges::is_sorted(kept));
      EXPECT_EQ(std::ranges::adjacent_find(kept), kept.end());
      EXPECT_EQ(kept.front(), 0u);
      EXPECT_EQ(kept.back(), n - 1);
      const auto has = [&](std::size_t i) { return std::ranges::binary_search(kept, i); };
      EXPECT_TRUE(has(static_cast<std::size_t>(std::ranges::max_element(values) - values.begin())));
      EXPECT_TRUE(has(static_cast<std::size_t>(std::ranges::min_element(values) - values.begin())));
      if (n <= most) {
        EXPECT_EQ(kept.size(), n);
      }
    }
  }
}

// A spike of one point in a million is on the page, wherever it is; gaps stay gaps.
TEST(Decimation, KeepsSpikesAndGaps) {
  std::vector<double> values(1'000'000, 0.0);
  for (const std::size_t at : {1u, 499'999u, 999'998u}) {
    values[at] = 1.0;
    const std::vector<std::size_t> kept = KeepExtremes(values, 50);
    EXPECT_TRUE(std::ranges::binary_search(kept, at)) << at;
    EXPECT_LE(kept.size(), 50u);
    values[at] = 0.0;
  }
  values.assign(1000, 1.0);
  std::fill(values.begin() + 400, values.begin() + 700, kNaN);
  values[450] = 7.0;
  const std::vector<std::size_t> kept = KeepExtremes(values, 20);
  EXPECT_TRUE(std::ranges::binary_search(kept, 450u));
  EXPECT_TRUE(std::ranges::any_of(kept, [&](std::size_t i) { return std::isnan(values[i]); }));
  EXPECT_EQ(KeepEvenly(5, 10), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(KeepEvenly(101, 3), (std::vector<std::size_t>{0, 50, 100}));
  EXPECT_TRUE(KeepEvenly(0, 3).empty());
}

double Luminance(const std::string& color) {
  const auto part = [&](std::size_t at) {
    const double v = std::stoi(color.substr(at, 2), nullptr, 16) / 255.0;
    return v <= 0.03928 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5);
}

TEST(Report, ColoursOfFormulationsAreSeenOnLightAndOnDarkPaper) {
  const std::string page = PageOf(SomeRecords());
  // values of variables in the rules of a selector, by the start of their names
  const auto values = [&](const std::string& selector, const std::string& name) {
    std::vector<std::string> found;
    for (std::size_t at = page.find(selector + " {"); at != std::string::npos;
         at = page.find(selector + " {", at + 1)) {
      const std::string rule = page.substr(at, page.find('}', at) - at);
      for (std::size_t k = rule.find(name); k != std::string::npos; k = rule.find(name, k + 1)) {
        found.push_back(rule.substr(rule.find('#', k), 7));
      }
    }
    return found;
  };
  for (const char* selector : {"\n:root", ":root[data-theme='dark']"}) {
    const std::vector<std::string> paper = values(selector, "--paper:");
    ASSERT_EQ(paper.size(), 1u) << selector;
    const std::vector<std::string> looks = values(selector, "--look-");
    ASSERT_EQ(looks.size(), 2 * FormulationNames().size());
    for (std::size_t i = 0; i < looks.size(); ++i) {
      const double a = Luminance(paper[0]) + 0.05, b = Luminance(looks[i]) + 0.05;
      EXPECT_GE(std::max(a, b) / std::min(a, b), 3.0) << selector << ' ' << looks[i];
      if (i % 2 == 1) {
        EXPECT_NE(looks[i], looks[i - 1]) << "joint and absolute coordinates";
      }
    }
  }
  ExpectWords(page, {"\"odca\":[\"--look-0\",\"--look-0-weak\"]"});
}

TEST(Report, CountsAreThoseOfTheTables) {
  const std::vector<Record> records = SomeRecords();
  const ReportData data = MakeReport(records, {.store = "here"});
  EXPECT_EQ(data.runs, 5u);
  EXPECT_EQ(data.failed, 1u);
  EXPECT_EQ(data.flagged, 1u);
  ASSERT_EQ(data.tables.size(), 2u);
  for (const ReportTable& table : data.tables) {
    EXPECT_EQ(table.rows.size(), MakeTable(records, {.kind = table.kind}).rows.size());
    EXPECT_EQ(table.names.size(), table.rows.size());
  }
  ASSERT_EQ(data.findings.size(), 2u);
  EXPECT_TRUE(data.findings[0].failed);
  ExpectWords(data.findings[0].text, {"rank lost"});
  EXPECT_EQ(data.findings[0].filter, "outcome=singular");
  EXPECT_EQ(data.findings[1].filter, "warnings~drift");
  // no motion is stored: how to get one
  ASSERT_EQ(data.problems.size(), 1u);
  EXPECT_FALSE(data.problems[0].picture.has_value());
  ExpectWords(data.problems[0].missing, {"\"output\"", "\"reference\""});
  ASSERT_EQ(data.costs.size(), 1u);
  const WorkPrecision judged = MakeWorkPrecision(records, {.error = "error_position_max"});
  ASSERT_EQ(data.costs[0].work_precision.problems.size(), judged.problems.size());
  for (std::size_t i = 0; i < judged.problems[0].rows.size(); ++i) {
    EXPECT_EQ(data.costs[0].work_precision.problems[0].rows[i].on_front,
              judged.problems[0].rows[i].on_front);
  }
}

// Names of rows contain the keys that differ. Every row belongs to a problem.
TEST(Report, NamesSayWhatDiffers) {
  std::vector<Record> records = SomeRecords();
  const ReportData data = MakeReport(records, {.store = "here"});
  for (const std::string& problem : data.tables[0].problems) EXPECT_EQ(problem, "four-bar, 10 s");
  std::vector<std::string> names = data.tables[0].names;
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
  // equal names, other mechanisms: two problems
  records[0].Set("problem_id", std::string("another"));
  const ReportData two = MakeReport(records, {.store = "here"});
  EXPECT_EQ(two.problems.size(), 2u);
}

// What is drawn is stated where it is less than what there is.
TEST(Report, StatesWhatWasDecimated) {
  std::vector<Record> records = SomeRecords();
  std::vector<double> t(5000), y(5000, 1e-9);
  for (std::size_t i = 0; i < t.size(); ++i) t[i] = static_cast<double>(i);
  y[1234] = 1.0;
  records[0].Set("series.drift_t", t);
  records[0].Set("series.drift", y);
  const ReportData data = MakeReport(records, {.store = "here", .most_points = 200});
  ASSERT_EQ(data.plots.size(), 1u);
  EXPECT_EQ(data.plots[0].points, 5012u);
  EXPECT_LE(data.plots[0].shown, 200u);
  double largest = 0.0;
  for (const ReportCurve& curve : data.plots[0].curves) {
    largest = std::max(largest, *std::ranges::max_element(curve.y));
  }
  EXPECT_EQ(largest, 1.0);
  ASSERT_EQ(data.remarks.size(), 1u);
  ExpectWords(data.remarks[0], {"of 5012 points"});
}

TEST(Report, HostileNamesAreText) {
  std::vector<Record> records = SomeRecords();
  for (Record& record : records) {
    record.Set("mechanism", std::string(kHostile));
    record.Set("experiment", std::string(kHostile));
    record.Set("machine", std::string(kHostile));
    if (record.Text("outcome") != "finished") record.Set("message", std::string(kHostile));
    record.Set("problem_id", std::string("../../../../etc/passwd"));
    record.Set("reference_file", std::string("../../x"));
    record.Set("trajectory", std::string("../../../etc/passwd"));
  }
  const std::size_t elements = CountOf(PageOf(SomeRecords()), "<script");
  for (const std::string store : {"here", kHostile}) {
    const std::string page = PageOf(records, {.store = store});
    EXPECT_EQ(CountOf(page, "<script"), elements);
    EXPECT_EQ(CountOf(page, "</script"), elements);
    EXPECT_EQ(CountOf(page, "alert(1)</"), 0u);
    EXPECT_EQ(CountOf(page, "<b>&`"), 0u);
    EXPECT_EQ(CountOf(page, "\xe2\x80\xa8"), 0u);
  }
  const ReportData data = MakeReport(records, {.store = "here"});
  for (const ReportProblem& problem : data.problems) EXPECT_FALSE(problem.picture.has_value());
}

TEST(Report, NumbersThatAreNoneAreGaps) {
  std::vector<Record> records = SomeRecords();
  records[0].Set("drift_position_max", kNaN);
  records[2].Set("drift_position_max", std::numeric_limits<double>::infinity());
  records[4].Set("drift_position_max", 1e-300);
  records[0].Set("series.drift", std::vector<double>{kNaN, INFINITY, 1e-300});
  for (const DataElement& element : ToJson(MakeReport(records, {.store = "here"}))) {
    for (const char* bad : {",nan", "[nan", ",inf", "[inf", "-nan"}) {
      EXPECT_EQ(CountOf(element.json, bad), 0u) << element.id << " " << bad;
    }
  }
}

TEST(Report, EmptyAndOtherStores) {
  std::vector<Record> timings = SomeRecords();
  std::erase_if(timings, [](const Record& one) { return one.Text("kind") != "timing"; });
  const ReportData data = MakeReport(timings, {.store = "here"});
  EXPECT_EQ(data.runs, 0u);
  EXPECT_EQ(data.tables.size(), 1u);
  ExpectWords(ToHtml(data), {"no accuracy runs"});
  Record odd;
  odd.Set("kind", std::string("else"));
  EXPECT_TRUE(MakeReport({odd}, {.store = "here"}).tables.empty());
}

TEST(Report, TheMapIsTheJudges) {
  const MapRules rules = ParseMapRules(
      R"({"title": "T", "methods": [{"label": "O", "select": {"formulation": "odca"}},
          {"label": "L", "select": {"formulation": "lagrange"}}],
          "groups": [{"label": "g", "rationale": "because", "criteria": [{"measure": "error_position_max", "limit": 1e-4}],
          "rows": [{"label": "r", "select": {"mechanism": "four-bar"}}]}]})",
      "rules");
  const std::vector<Record> records = SomeRecords();
  const ReportData data = MakeReport(records, {.store = "here", .rules = rules});
  ASSERT_TRUE(data.map.has_value());
  const RobustnessMap judged = MakeRobustnessMap(rules, records);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(data.map->cells[0][0][c].state, judged.cells[0][0][c].state);
    EXPECT_EQ(data.map->cells[0][0][c].reason, judged.cells[0][0][c].reason);
  }
}

/// Experiments whose runs keep their motions.
std::string Moving(const std::string& formulations, const std::string& output) {
  return R"({"name": "moving", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": )" +
         formulations + R"(, "enforcement": "projection"}], "timing": {"repeats": 0},
    "output": {)" +
         output + R"(, "quantities": ["bodies"]}})";
}

class ReportCommand : public CommandLineTest {};

// The page of a run: its motions come from what the run has kept, and a damaged file is named.
TEST_F(ReportCommand, MotionsComeFromTheStore) {
  Write("moving.json", Moving(R"(["odca", "lagrange"])", "\"step\": 0.05"));
  ASSERT_EQ(Call("run moving.json --out out").code, 0);
  const Ending made = Call("report out");
  if (made.text.find("built without") != std::string::npos) GTEST_SKIP() << made.text;
  ASSERT_EQ(made.code, 0) << made.text;
  const std::string page = ReadFile(folder_ / "out/report.html");
  EXPECT_EQ(CountOf(page, "\"times\":[0,0.05,"), 2u);
  EXPECT_EQ(CountOf(page, "Permission is hereby granted"), 1u);  // uPlot's licence goes with it
  EXPECT_EQ(CountOf(page, " src=") + CountOf(page, "href=\"http") + CountOf(page, "@import"), 0u);
  for (const auto& entry : fs::directory_iterator(folder_ / "out/mechanisms")) {
    Expect("view " + entry.path().string() + " --out kept.html", 0);
  }
  for (const auto& entry : fs::directory_iterator(folder_ / "out/trajectories")) {
    WriteFileAtomically(entry.path(), "no trajectory\n", Onto::kAnyFile);
  }
  const Ending damaged = Call("report out --out damaged.html");
  EXPECT_EQ(damaged.code, 2) << damaged.text;
  ExpectWords(damaged.text, {"no motion"});
  EXPECT_EQ(CountOf(ReadFile(folder_ / "damaged.html"), "\"times\":[0,"), 0u);
}

// A mechanism or a motion that was changed beside the store is not shown as the run's.
TEST_F(ReportCommand, FilesBesideTheStoreAreVerified) {
  Write("moving.json", Moving("\"odca\"", "\"step\": 0.05"));
  ASSERT_EQ(Call("run moving.json --out out").code, 0);
  const auto only = [this](const char* kind) {
    return fs::directory_iterator(folder_ / "out" / kind)->path();
  };
  const auto change = [](const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = ReadFile(file);
    const std::size_t at = text.rfind(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFileAtomically(file, text.replace(at, from.size(), to), Onto::kAnyFile);
  };
  const fs::path trajectory = only("trajectories"), mechanism = only("mechanisms");
  const std::string sound = ReadFile(trajectory), whole = ReadFile(mechanism);
  Expect("trajectory out --out csv", 0, {"wrote csv/"});
  change(trajectory, "\n0.5,", "\n0.6,");
  Expect("trajectory out --out csv2", 2, {"trajectories/", "the file was changed"});
  EXPECT_FALSE(fs::exists(folder_ / "csv2"));
  Expect("merge out --out merged", 0, {"as the run that is kept wrote it"});
  EXPECT_FALSE(fs::exists(folder_ / "merged/trajectories"));
  const Ending moved = Call("report out --out page.html");
  if (moved.text.find("built without") != std::string::npos) GTEST_SKIP() << moved.text;
  ExpectEnding(moved, 2, {"wrote page.html", "the file was changed"});
  WriteFileAtomically(trajectory, sound, Onto::kAnyFile);
  Expect("report out --out page.html", 0);
  change(mechanism, "1.5", "1.7");
  Expect("report out --out page.html", 2, {"mechanisms/", "the file was changed"});
  WriteFileAtomically(mechanism, whole, Onto::kAnyFile);
  Expect("report out --out page.html", 0);
}

// What is merged moves as its parts did.
TEST_F(ReportCommand, MergedStoresKeepTheirMechanisms) {
  Write("moving.json", Moving(R"(["odca", "lagrange"])", "\"number\": 3"));
  ASSERT_EQ(Call("run moving.json --shard 1/2 --out one").code, 0);
  ASSERT_EQ(Call("run moving.json --shard 2/2 --out two").code, 0);
  ASSERT_EQ(Call("merge one two --out both").code, 0);
  EXPECT_EQ(NamesIn(folder_ / "both/mechanisms").size(), 1u);
  EXPECT_EQ(NamesIn(folder_ / "both/trajectories").size(), 2u);
}

TEST_F(ReportCommand, RefusesWhatItCannotRead) {
  Expect("report nowhere", 2);
  Write("odd.jsonl", "no record\n");
  Expect("report odd.jsonl --out odd.html", 2);
  EXPECT_FALSE(fs::exists(folder_ / "odd.html"));
}

}  // namespace report_test
}  // namespace loopbench::harness
