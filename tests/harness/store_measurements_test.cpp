// Benchmark JSON in, tracker JSON out.
#include <nlohmann/json.hpp>

#include "harness/base/store.h"
#include "harness/judge/judge.h"
#include "harness/run/timing.h"
#include "tests/harness/places.h"

namespace loopbench::harness::store_measurements_test {

using nlohmann::json;

const std::string kBenchmarks = ReadFile(kRoot / "tests/fuzz/seeds/measurement/runs.json");

TEST(BenchmarkJson, BecomesOneRecordPerBenchmark) {
  const std::vector<Record> records = ParseBenchmarkJson(kBenchmarks, "b.json");
  ASSERT_EQ(records.size(), 2u);
  const Record& a = records[0];
  EXPECT_EQ(a.Text("benchmark"), "a/3");
  EXPECT_EQ(a.Text("outcome"), "finished");
  EXPECT_EQ(a.Text("start_hash"), "00ff");
  EXPECT_EQ(a.Numbers("series.cpu_ns"), (std::vector<double>{1000, 3000, 2000}));
  EXPECT_EQ(a.Number("cpu_ns"), 2000.0);
  EXPECT_EQ(a.Number("bodies"), 3.0);
  EXPECT_EQ(a.Text("machine"), "M");
  EXPECT_EQ(a.Number("load_average"), 0.5);
  EXPECT_EQ(a.Find("iterations"), nullptr);
  const Record& b = records[1];
  EXPECT_EQ(b.Text("outcome"), "singular");
  EXPECT_EQ(b.Find("series.cpu_ns"), nullptr);
}

void ExpectRefused(const std::string& text, const std::string& words) {
  try {
    ParseBenchmarkJson(text, "b.json");
    ADD_FAILURE() << "accepted: " << text.substr(0, 200);
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find("b.json:"), 0u) << message;
    ExpectWords(message, {words});
    ExpectNone(message, {"json.exception"});
    EXPECT_LT(message.size(), 1000u) << message.substr(0, 1000);
  }
}

/// One run with these members beside its name.
std::string OneRun(const std::string& members) {
  return R"({"benchmarks": [{"name": "a", )" + members + "}]}";
}

TEST(BenchmarkJson, IsRefusedWithItsPlace) {
  ExpectRefused("", "b.json:1:1: found an empty file");
  ExpectRefused("{\"benchmarks\": [\n{]}", "b.json:2:2: found ']'");
  ExpectRefused("[]", "(top level): found an empty array");
  ExpectRefused(R"({"context": {}})", "found no \"benchmarks\"");
  ExpectRefused(R"({"benchmarks": 3})", "/benchmarks: found 3, expected an array");
  ExpectRefused(R"({"benchmarks": [7]})", "/benchmarks/0: found 7, expected an object");
  ExpectRefused(R"({"benchmarks": [{"cpu_time": 1}]})", "/benchmarks/0: found no \"name\"");
  ExpectRefused(R"({"benchmarks": [{"name": "a"}]})", "/benchmarks/0: found no \"cpu_time\"");
  ExpectRefused(R"({"benchmarks": [], "context": []})", "/context: found an empty array");
  ExpectRefused(R"({"benchmarks": [], "context": {"machine": 7}})", "/context/machine: found 7");
}

TEST(BenchmarkJson, TakesFiniteNumbersInKnownUnitsOnly) {
  ExpectRefused(OneRun(R"("cpu_time": NaN, "real_time": 1)"), "NaN and Infinity are not allowed");
  ExpectRefused(OneRun(R"("cpu_time": 1e999, "real_time": 1)"), "expected one that fits a double");
  ExpectRefused(OneRun(R"("cpu_time": null, "real_time": 1)"),
                "/benchmarks/0/cpu_time: found null, expected a number >= 0");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": "x")"), "/real_time: found \"x\"");
  ExpectRefused(OneRun(R"("cpu_time": -1, "real_time": 1)"), "/cpu_time: found -1");
  ExpectRefused(OneRun(R"("cpu_time": 1e308, "real_time": 1, "time_unit": "us")"),
                "/cpu_time: found 1e+308, expected a number >= 0 and <= 1e+100");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": 1, "time_unit": "fs")"),
                "/time_unit: found \"fs\", expected a unit of time: \"ns\", \"us\", \"ms\", \"s\"");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": 1, "bytes": null)"), "/bytes: found null");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": 1, "bytes": [1])"), "/bytes: found [1]");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": 1, "outcome": 1)"),
                "/outcome: found a counter, expected a name that records do not use");
  ExpectRefused(OneRun(R"("cpu_time": 1, "real_time": 1, "bytes": 1, "bytes": 2)"), "twice");
  ExpectRefused(OneRun(R"("error_occurred": "no")"), "/error_occurred: found \"no\"");
}

TEST(BenchmarkJson, OfAnyDepthIsReadOrRefused) {
  const std::string deep(100'000, '['), end(100'000, ']');
  ExpectRefused(R"({"benchmarks": [], "context": )" + deep + end + "}", "nesting deeper than 64");
  ExpectRefused(R"({"benchmarks": )" + deep, "nesting deeper than 64");
}

TEST(BenchmarkJson, KeepsRunsThatWereSkipped) {
  const std::vector<Record> records = ParseBenchmarkJson(
      OneRun(R"("skipped": true, "skip_message": "no such size", "cpu_time": 0)"), "b.json");
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].Text("outcome"), "no such size");
}

std::vector<TrackedValue> Values() {
  return {{"case \"one\"", "time", "ns", 2.0, 1.0, 4.0},
          {"case \"one\"", "steps", "", 10.0, 10.0, 10.0},
          {"case two", "error", "J", 1e-300, 1e-300, std::numeric_limits<double>::infinity()}};
}

TEST(TrackerJson, CustomSmallerIsBetterHasNameUnitValue) {
  const json document = json::parse(ToCustomSmallerIsBetter(Values()));
  ASSERT_TRUE(document.is_array());
  ASSERT_EQ(document.size(), 3u);
  EXPECT_EQ(
      document[0],
      (json{{"name", "case \"one\" time"}, {"unit", "ns"}, {"value", 2.0}, {"range", "1 .. 4"}}));
  EXPECT_EQ(document[1], (json{{"name", "case \"one\" steps"}, {"unit", "1"}, {"value", 10.0}}));
  EXPECT_FALSE(document[2].contains("range"));
}

TEST(TrackerJson, BencherMetricFormatNestsMeasures) {
  const json document = json::parse(ToBencherMetricFormat(Values()));
  EXPECT_EQ(document, json::parse(R"json({
    "case \"one\"": {"time (ns)": {"value": 2.0, "lower_value": 1.0, "upper_value": 4.0},
                     "steps": {"value": 10.0}},
    "case two": {"error (J)": {"value": 1e-300}}
  })json"));
}

TEST(TrackRecords, TakesNumbersOfRunsThatFinished) {
  std::vector<Record> records = ParseBenchmarkJson(kBenchmarks, "b.json");
  records[0].Set("drift_position_max", 1e-9);
  const auto [values, left_out] = TrackRecords(records);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0].measure, "allocations");
  EXPECT_EQ(values[1].measure, "drift_position_max");
  EXPECT_EQ(values[1].unit, "m");
  EXPECT_EQ(values[2].measure, "cpu_ns");
  EXPECT_EQ(values[2].value, 2000.0);
  EXPECT_EQ(values[2].lower, 1000.0);
  EXPECT_EQ(values[2].upper, 3000.0);
  EXPECT_EQ(left_out, std::vector<std::string>{"benchmark b: outcome \"singular\""});
}

TEST(TrackRecords, NamesEveryValueThatIsNone) {
  const std::vector<double> sample = {1.0, std::nan(""), 3.0};
  for (const auto& [key, value, shown] : std::vector<std::tuple<std::string, Value, std::string>>{
           {"drift_position_max", std::string("oops"), "found \"oops\", expected a finite number"},
           {"drift_position_max", Value(), "found null"},
           {"drift_position_max", std::vector<double>{1.0}, "found 1 value"},
           {"drift_position_max", -1.0, "found -1"},
           {"steps", std::nan(""), "found nan"},
           {"steps", true, "found true"},
           {"instructions", std::int64_t{0}, "found 0, expected a finite number > 0"},
           {"series.cpu_ns", sample, "found 3 values (1 null or negative)"}}) {
    std::vector<Record> records = ParseBenchmarkJson(kBenchmarks, "b.json");
    records.pop_back();
    records[0].Set(key, value);
    const std::vector<std::string> left_out = TrackRecords(records).left_out;
    ASSERT_EQ(left_out.size(), 1u) << key;
    EXPECT_EQ(left_out[0].find("benchmark a/3: " + key + ": found "), 0u) << left_out[0];
    ExpectWords(left_out[0], {shown});
  }
}

TEST(TrackRecords, DoesNotPickOneOfTwoRecordsOfACase) {
  std::vector<Record> records = ParseBenchmarkJson(kBenchmarks, "b.json");
  records[1] = records[0];
  const auto [values, left_out] = TrackRecords(records);
  EXPECT_TRUE(values.empty());
  EXPECT_EQ(left_out.size(), 2u);
}

TEST(Callgrind, GivesTheTotal) {
  EXPECT_EQ(CallgrindInstructions("# callgrind format\nevents: Ir\nsummary: 9\n\ntotals: 291772\n",
                                  "cg.1"),
            291772);
  for (const char* text : {"", "events: Ir\n", "events: Dr\ntotals: 5\n", "events: Ir\ntotals: x",
                           "events: Ir\ntotals: 12x", "events: Ir\ntotals: -5",
                           "events: Ir\ntotals: 99999999999999999999"}) {
    try {
      CallgrindInstructions(text, "cg.1");
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find("cg.1: "), 0u);
    }
  }
}

}  // namespace loopbench::harness::store_measurements_test
