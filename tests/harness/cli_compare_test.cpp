// compare, fit and export as their users call them, and loopbench_bench where it is built.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_compare_test {

using ComparisonCommands = CommandLineTest;

TEST_F(ComparisonCommands, CompareARunWithItselfAndWithAPlantedDrift) {
  ASSERT_EQ(Call("run tiny.json --out base").code, 0);
  ASSERT_EQ(Call("run tiny.json --out new").code, 0);
  Expect("compare base new", 0, {"outcomes", "hashes", "NO CHANGE", "BASE: commit "});
  Expect("compare base new --format csv", 0, {"judgement,case,measure", "same,"});

  std::vector<Record> records = ReadRecords(folder_ / "new");
  records[0].Set("drift_position_max", 3.0 * records[0].Number("drift_position_max"));
  {
    ResultStore store(folder_ / "worse");
    for (const Record& record : records) store.Append(record);
  }
  Expect("compare base worse", 1,
         {"worse", "four-bar odca", "drift_position_max [m]", "REGRESSION: 1"});
  Expect("compare worse base", 0, {"better", "BETTER: 1 measure, none worse"});
  Expect("compare base worse --only counts --only hashes", 0, {"NO CHANGE"});
  Expect("compare base worse --only times", 2, {"INCONCLUSIVE"});
  Expect("export-metrics base --format bmf", 0,
         {"\"accuracy tiny four-bar odca", "drift_position_max (m)"});
  Expect("export-metrics base --out b.json", 0, {"wrote b.json"});
}

TEST_F(ComparisonCommands, RefuseWhatIsNotThere) {
  Write("b.json", R"({"benchmarks": []})");
  Write("text.json", "nothing");
  Expect("compare none.json b.json", 2, {"none.json: cannot be read: no such file"});
  Expect("compare b.json text.json", 2, {"text.json:1:"});
  Write("c.json", R"({"benchmarks": []})");
  Expect("compare b.json c.json", 2, {"INCONCLUSIVE"});
  Expect("compare b.json c.json --only speed", 2, {"--only"});
  Expect("fit-scaling b.json", 2, {"no family of right-hand sides"});
  Expect("export-metrics b.json", 2, {"nothing to export"});
  Expect("compare --help", 0, {"Examples:", "Exit status:"});
}

TEST_F(ComparisonCommands, APathIsNotComparedWithItself) {
  ASSERT_EQ(Call("run tiny.json --out out").code, 0);
  fs::create_symlink("out", folder_ / "link");
  fs::create_hard_link(folder_ / "out/results.jsonl", folder_ / "hard.jsonl");
  for (const char* other : {"out", "out/", "./out/results.jsonl", "link", "hard.jsonl"}) {
    Expect(std::string("compare out ") + other, 2,
           {"found 'out/results.jsonl' as BASE and as NEW, expected two files"});
  }
  fs::copy(folder_ / "out", folder_ / "copy", fs::copy_options::recursive);
  Expect("compare out copy", 0, {"NO CHANGE"});
  Expect("compare out copy --markdown both --junit both", 2, {"found \"both\" twice"});
  EXPECT_FALSE(fs::exists(folder_ / "both"));
  Expect("table out --out ''", 2, {"found an empty name, expected a file or folder"});
}

// Files of Google Benchmark name a machine only where the program wrote it.
TEST_F(ComparisonCommands, TimesOfNoOrAnotherMachineAreNotComparable) {
  std::string key = "machine";
  const auto write = [&](const std::string& name, const std::string& machine, int time,
                         int repetitions = 20) {
    std::string runs;
    for (int i = 0; i < repetitions; ++i) {
      const std::string ns = std::to_string(time * (100 + i % 3));
      runs += (i > 0 ? "," : "") + std::string(R"({"name":"a","cpu_time":)") + ns +
              ",\"real_time\":" + ns + "}";
    }
    Write(name, "{\"context\":{" + (machine.empty() ? "" : '"' + key + "\":\"" + machine + "\"") +
                    "},\"benchmarks\":[" + runs + "]}");
  };
  write("none.json", "", 1);
  write("slow-none.json", "", 10);
  write("here.json", "here", 1);
  write("same-here.json", "here", 1);
  write("slow-here.json", "here", 10);
  write("slow-there.json", "there", 10);
  const std::string unknown = "INCONCLUSIVE: 1 time not comparable: machine not known";
  Expect("compare none.json slow-none.json", 2, {unknown});
  Expect("compare none.json slow-here.json --junit j.xml", 2, {unknown});
  ExpectWords(ReadFile(folder_ / "j.xml"), {"errors=\"1\""});
  Expect("compare here.json slow-there.json", 2, {"1 time not comparable: another machine"});
  Expect("compare here.json slow-here.json", 1, {"REGRESSION: 1 measure"});
  Expect("compare here.json same-here.json", 0, {"NO CHANGE"});
  // one repetition of each decides from a factor of 4 on
  write("one.json", "here", 1, 1);
  write("one-slower.json", "here", 3, 1);
  write("one-slow.json", "here", 10, 1);
  Expect("compare one.json one-slower.json", 2, {"too few repetitions"});
  Expect("compare one.json one-slow.json", 1, {"ratio 10.000, samples far apart"});
  write("zero.json", "here", 0);
  Expect("compare here.json zero.json", 1, {"a time of 0 on one side"});
  write("zero-again.json", "here", 0);
  Expect("compare zero.json zero-again.json", 2, {"times of 0"});
  // a host is no machine: containers of one service have any name
  key = "host_name";
  write("host.json", "h", 1);
  write("slow-host.json", "h", 10);
  Expect("compare host.json slow-host.json", 2, {unknown});
}

TEST_F(ComparisonCommands, RefuseNumbersThatSwitchGatesOff) {
  ASSERT_EQ(Call("run tiny.json --out out").code, 0);
  fs::copy(folder_ / "out", folder_ / "copy", fs::copy_options::recursive);
  for (const char* ratio :
       {"nan", "-nan", "inf", "-inf", "0", "0.99", "-2", "1e400", "0x2", "2x", "''"}) {
    Expect(std::string("compare out copy --error-ratio=") + ratio, 2, {"--error-ratio"});
  }
  Expect("compare out copy --error-ratio 1.5", 0, {"NO CHANGE"});
  for (const char* from : {"nan", "inf", "-1", "1e400", "x"}) {
    Expect(std::string("fit-scaling b.json --min-size=") + from, 2, {"--min-size"});
  }
  for (const char* jobs : {"nan", "0", "-1", "1.5", "0x2", "4294967297", "1025", "''"}) {
    Expect(std::string("run tiny.json --out out --jobs=") + jobs, 2, {"--jobs"});
  }
}

TEST_F(ComparisonCommands, NameEveryDifference) {
  ASSERT_EQ(Call("run tiny.json --out base").code, 0);
  const std::vector<Record> records = ReadRecords(folder_ / "base");
  const auto with = [&](const std::string& name, const Value& value) {
    ResultStore store(folder_ / name);
    Record odd = records[0];
    odd.Set("drift_position_max", value);
    store.Append(odd);
    store.Append(records[1]);
  };
  // what no record can hold is refused where it is read
  for (const auto& [name, value, shown] :
       {std::tuple{"text", Value(std::string("oops")), "\"oops\""},
        {"list", Value(std::vector<double>{1.0}), "an array"}}) {
    with(name, value);
    const std::string place = std::string(name) + "/results.jsonl:1: key 'drift_position_max'";
    for (const std::string call :
         {"compare base ", "compare --allow-missing base ", "export-metrics "}) {
      Expect(call + name, 2, {place, "expected a number or null, found " + std::string(shown)});
    }
  }
  with("null", Value());
  Expect("compare base null", 1,
         {"worse", "drift_position_max", "null", "expected a finite number >= 0", "REGRESSION: 2",
          "new warnings"});
  Expect("compare null base", 1, {"different", "drift_position_max", "DIFFERENT: 1"});
  fs::copy(folder_ / "null", folder_ / "null2", fs::copy_options::recursive);
  Expect("compare null null2", 1, {"different", "in BASE and NEW", "DIFFERENT: 1"});
  Expect("export-metrics null --out b.json", 1,
         {"not exported: accuracy tiny four-bar odca", "drift_position_max: found null"});
  ASSERT_EQ(Call("run tiny.json --out half --filter formulation=odca").code, 0);
  const std::string missing = "  accuracy tiny four-bar lagrange";
  Expect("compare base half", 2, {"1 case only in BASE:", missing});
  Expect("compare half base", 2, {"1 case only in NEW:", missing, "1 case only in NEW"});
  Expect("compare half base --added", 0, {"1 case only in NEW:", missing, "NO CHANGE"});
  Expect("compare base half --format csv", 2, {"only in BASE,accuracy tiny four-bar lagrange"});
}

TEST_F(ComparisonCommands, NullSamplesEndTheComparison) {
  Write("null.jsonl",
        R"({"kind":"timing","mechanism":"a","case_id":"1","outcome":"finished",)"
        R"("series.wall_s":[null],"machine":"m","compiler":"c","flags":"f","libm":"l"})"
        "\n");
  fs::copy_file(folder_ / "null.jsonl", folder_ / "null2.jsonl");
  Expect("compare null.jsonl null2.jsonl", 1,
         {"different", "series.wall_s", "1 value (1 null or negative)", "expected finite times"});
  Expect("export-metrics null.jsonl", 2,
         {"series.wall_s: found 1 value (1 null", "nothing to export"});
}

TEST_F(ComparisonCommands, ExportNamesTheCasesThatFailed) {
  Write("b.json", R"({"benchmarks": [
    {"name": "a/1", "cpu_time": 1, "real_time": 1}, {"name": "a/2", "cpu_time": 4, "real_time": 4},
    {"name": "a/3", "error_occurred": true, "error_message": "singular"}]})");
  Expect("export-metrics b.json", 1,
         {"\"name\": \"benchmark a/1 cpu_ns\"",
          "b.json: not exported: benchmark a/3: outcome \"singular\""});
  Expect("export-metrics b.json --out t.json", 1, {"not exported: benchmark a/3", "wrote t.json"});
  Expect("fit-scaling b.json", 0, {"a/N", "2.00"});
}

TEST_F(ComparisonCommands, ABaselineIsRenewedHeldAgainstAndTested) {
  const std::string tiny = " --experiments tiny.json --dir kept";
  Expect("baseline check" + tiny, 2, {"kept/results.jsonl: no such file", "baseline renew"});
  const pid_t ended = ::fork();
  if (ended == 0) ::_exit(0);
  ::waitpid(ended, nullptr, 0);
  const std::string part = "kept/results.jsonl." + std::to_string(ended) + "-1.tmp";
  Write(part, "of a killed process");
  Expect("baseline renew" + tiny, 0, {"renewed kept/results.jsonl: 2 records"});
  EXPECT_FALSE(fs::exists(folder_ / part));
  Expect("baseline check" + tiny, 0, {"NO CHANGE"});
  Expect("baseline selftest" + tiny, 0,
         {"same: ", "caught: 3 times the drift", "caught: one step more",
          "caught: a run that fails", "caught: a case that is gone"});
  EditMechanism("\"mass\": 1.0,", "\"mass\": 1.01,");
  Expect("baseline check" + tiny, 2, {"ran another mechanism"});
  Expect("baseline check" + tiny + " --counts tiny.json --count-program ./none", 2,
         {"--counts tiny.json: ", "not found"});
  Expect("baseline chekc" + tiny, 2, {"check"});
  Expect("baseline check --dir kept", 2, {"--experiments is required"});
}

TEST_F(ComparisonCommands, BaselineKeepsWhatItMeasuresInANewFolderOnly) {
  const std::string tiny = " --experiments tiny.json --dir kept --keep-output ";
  Expect("baseline renew" + tiny + "kept", 2,
         {"--keep-output: found kept, the folder of the baseline"});
  EXPECT_FALSE(fs::exists(folder_ / "kept"));
  Expect("baseline renew" + tiny + "new", 0, {"renewed kept/results.jsonl"});
  EXPECT_EQ(ReadRecords(folder_ / "new").size(), 2u);
  const std::string baseline = ReadFile(folder_ / "kept/results.jsonl");
  Write("mine/run/notes", "mine");
  Write("mine/results.jsonl", "mine");
  EditMechanism("\"mass\": 1.0,", "\"mass\": 1.01,");
  for (const char* action : {"renew", "check", "selftest"}) {
    Expect("baseline " + std::string(action) + tiny + "mine", 2,
           {"--keep-output: found mine, which is not empty, expected a new folder"});
    Expect("baseline " + std::string(action) + tiny + "./kept/", 2, {"the folder of the baseline"});
    Expect("baseline " + std::string(action) + tiny + "tiny.json", 2,
           {"--keep-output: found tiny.json"});
  }
  EXPECT_EQ(ReadFile(folder_ / "mine/run/notes"), "mine");
  EXPECT_EQ(ReadFile(folder_ / "mine/results.jsonl"), "mine");
  EXPECT_EQ(ReadFile(folder_ / "kept/results.jsonl"), baseline);
  fs::create_directory(folder_ / "empty");
  Expect("baseline check" + tiny + "empty", 2, {"ran another mechanism"});
  EXPECT_EQ(ReadRecords(folder_ / "empty").size(), 2u);
}

TEST_F(ComparisonCommands, FilesMayStandBehindAnyOption) {
  ASSERT_EQ(Call("run tiny.json --out now").code, 0);
  ASSERT_EQ(Call("run tiny.json --out again").code, 0);
  Expect("compare --only outcomes now again", 0, {"NO CHANGE"});
  Expect("compare --where formulation=odca --only counts now again", 0, {"NO CHANGE"});
  Expect("table --where formulation=odca --columns formulation,steps now", 0, {"odca"});
  Expect("list --filter formulation=odca tiny.json", 0, {"odca"});
  Expect("run --filter formulation=odca tiny.json --out some", 0, {"ran 1 case"});
  Expect("baseline renew --experiments tiny.json tiny.json --dir kept", 0, {"renewed"});
}

TEST_F(ComparisonCommands, BaselineSaysWhatToBuildFirst) {
  fs::create_directories(folder_ / "tools");
  fs::copy_file(fs::path(LOOPBENCH_SOURCE_DIR) / "tools/baseline", folder_ / "tools/baseline");
  for (const char* command : {"check", "renew", "selftest"}) {
    Expect("", 2, {"no build/portable/harness/loopbench", "cmake --preset portable", "./check"},
           std::string("tools/baseline ") + command + " 2>&1; exit $?;");
  }
}

#ifdef LOOPBENCH_BENCH_BINARY

class BenchmarkProgram : public ComparisonCommands {
 protected:
  /// The benchmark program in the test's folder: the shell that would call loopbench ends before.
  Ending Bench(const std::string& arguments) const {
    return Call("", "('" LOOPBENCH_BENCH_BINARY "' " + arguments + ") 2>&1; exit $?; ");
  }
};

constexpr const char* kFamilies = R"({"name": "small", "states": "states.json", "groups": [
  {"family": "chain", "sizes": [3, 6, 12], "measure": ["rhs", "step"],
   "methods": [{"formulation": "odca", "enforcement": "acceleration"}]},
  {"mechanisms": ")" LOOPBENCH_SOURCE_DIR R"(/configs/mechanisms/toggle-singular-start.json",
   "measure": "rhs", "methods": [{"formulation": "reduction", "enforcement": "velocity"}]}]})";

TEST_F(BenchmarkProgram, WritesJsonThatTheCommandsTake) {
  Write("families.json", kFamilies);
  const auto bench = [this](const std::string& arguments) {
    return Bench("--families families.json " + arguments);
  };
  ExpectEnding(bench("--save-states"), 0, {"wrote 4 hashes to states.json"});
  // a saved hash that does not match is an error of its benchmarks, with both hashes
  std::string states = ReadFile(folder_ / "states.json");
  const std::size_t hash = states.find("\"chain/3/joint\": \"") + 18;
  states.replace(hash, 16, "00000000deadbeef");
  Write("states.json", states);

  // repetitions make aggregates, and the spread of allocations that are always 0 is NaN
  const std::string run = "--benchmark_min_time=0.001 --benchmark_repetitions=2 ";
  ExpectEnding(bench(run + "--benchmark_out=out.json"), 0, {"saved is 00000000deadbeef"});
  const std::string text = ReadFile(folder_ / "out.json");
  ExpectNone(text, {"NaN"});
  ExpectWords(text, {"allocations"});
  const std::vector<Record> records = ReadMeasurements(folder_ / "out.json");
  ASSERT_EQ(records.size(), 7u);
  int failed = 0;
  for (const Record& record : records) {
    const std::string name = record.Text("benchmark");
    const bool refused = name.find("chain/3/") != std::string::npos;
    failed += refused;
    EXPECT_EQ(record.Text("outcome") == "finished", !refused) << name << record.Text("outcome");
    EXPECT_EQ(record.Find("ns_per_body") != nullptr, !refused) << name;
    EXPECT_EQ(record.Find("bytes") != nullptr, !refused) << name;
    if (refused) continue;
    EXPECT_EQ(record.Text("start_hash").size(), 16u) << name;
    EXPECT_EQ(record.Numbers("series.cpu_ns").size(), 2u) << name;
    EXPECT_FALSE(record.Text("machine").empty());
    EXPECT_EQ(record.Number("allocations"), 0.0) << name;
  }
  EXPECT_EQ(failed, 2);

  Expect("fit-scaling out.json", 0,
         {"rhs/chain/N/odca/acceleration/joint/rank-revealing", "exponent"});
  Write("same.json", text);
  Expect("compare out.json same.json", 2, {"times not measured: too few repetitions"});
  Expect("export-metrics out.json", 1,
         {"\"unit\": \"ns\"", "not exported: benchmark rhs/chain/3/odca"});
  // nothing is said of how the library was built, but how this program was
  const Ending list = bench("--benchmark_filter=rhs/chain/6 --benchmark_min_time=0.001");
  ExpectEnding(list, 0, {"assertions: o"});
  ExpectNone(list.text, {"DEBUG"});
  ExpectEnding(
      bench("--benchmark_filter=rhs/chain/6 --benchmark_min_time=0.001 --benchmark_out=/dev/full"),
      2, {"cannot write '/dev/full'"});
  // the same JSON on the terminal, where nothing else may stand
  const Ending terminal = bench(run + "--benchmark_format=json 2>/dev/null");
  EXPECT_EQ(ParseBenchmarkJson(terminal.text, "terminal").size(), 7u);
}

TEST_F(BenchmarkProgram, RefusesBadInput) {
  const auto bench = [this](const std::string& arguments, const std::string& word) {
    SCOPED_TRACE(arguments);
    ExpectEnding(Bench(arguments), 2, {word});
  };
  Write("bad.json", R"({"name": "n", "groups": [{"familiy": "chain"}]})");
  bench("--families none.json", "none.json: cannot be read: no such file");
  bench("--families bad.json", "did you mean \"family\"");
  bench("--families", "expected a file");
  bench("--benchmark_filter=nothing_like_it", "");
  bench("--faimlies=bad.json", "--faimlies");
  bench("--benchmark_out=no/such/folder/b.json", "cannot write 'no/such/folder/b.json'");
  for (const char* time : {"nan", "inf", "-1", "1e300", "x"}) {
    bench(std::string("--benchmark_min_time=") + time, "--benchmark_min_time: found");
  }
  ExpectEnding(Bench("--help"), 0, {"Examples:", "--families"});
}

#endif

}  // namespace loopbench::harness::cli_compare_test
