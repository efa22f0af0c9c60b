// Standard streams that are closed, full or without a reader: an exit code and a reason, never a
// signal, and never a line in a store.
#include <string>

#include "harness/base/store.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_streams_test {

class Streams : public CommandLineTest {
 protected:
  /// Runs a shell script in the test's folder, with the program as $L; its last command decides.
  Ending Shell(const std::string& script) const {
    return Call("", "( L='" LOOPBENCH_BINARY "'; " + script + " ) 2>&1; exit $?;");
  }
};

TEST(Printing, GoesThroughOnePlace) {
  int files = 0;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(LOOPBENCH_SOURCE_DIR) / "harness")) {
    const fs::path& path = entry.path();
    if (path.extension() != ".cpp" && path.extension() != ".h") continue;
    if (path.stem() == "terminal") continue;
    ++files;
    const std::string text = ReadFile(path);
    for (const char* way : {"fmt::print", "std::cout", "std::cerr", "std::printf", "fprintf",
                            "std::puts", "fputs", "stdout,", "stderr,"}) {
      EXPECT_EQ(text.find(way), std::string::npos)
          << path << " prints with " << way << "; use Print or PrintError of harness/base/text.h";
    }
  }
  EXPECT_GT(files, 100);
}

TEST_F(Streams, ClosedOnesKeepMessagesOutOfTheStore) {
  const Ending run =
      Shell("( exec >&- 2>&-; \"$L\" run tiny.json --out out ); code=$?; exit $code");
  EXPECT_EQ(run.code, 2) << run.text;  // the tables could not be printed
  ASSERT_EQ(ReadRecords(folder_ / "out").size(), 2u);
  ExpectEnding(Call("run tiny.json --out out"), 0, {"ran 0 cases, 2 reused"});
  ExpectEnding(Shell("\"$L\" list tiny.json 2>&1 <&- >&-"), 2, {"cannot write to standard output"});
}

TEST_F(Streams, FullOnesAreAnError) {
  ASSERT_EQ(Call("run tiny.json --out out").code, 0);
  for (const char* command : {"table out", "list tiny.json", "--help", "--version",
                              "run tiny.json --out out", "check-claims out --claims claims.json"}) {
    SCOPED_TRACE(command);
    ExpectEnding(Shell(std::string("\"$L\" ") + command + " 2>&1 >/dev/full"), 2,
                 {"cannot write to standard output"});
  }
  ExpectEnding(Shell("\"$L\" table out 2>&1 >/dev/full"), 2, {"No space left on device"});
  // the gate's answer is not lost with its words
  {
    ResultStore worse(folder_ / "worse");
    for (Record record : ReadRecords(folder_ / "out")) {
      record.Set("drift_position_max", 1.0);
      worse.Append(record);
    }
  }
  EXPECT_EQ(Shell("\"$L\" compare out worse >/dev/full").code, 1);
}

TEST_F(Streams, ErrorsThatCannotBePrintedKeepTheirExitCode) {
  EXPECT_EQ(Shell("\"$L\" list absent.json 2>/dev/full").code, 2);
  EXPECT_EQ(Shell("\"$L\" list absent.json 2>&-").code, 2);
  EXPECT_EQ(Shell("\"$L\" run tiny.json --out out 2>/dev/full >/dev/null").code, 0);
}

TEST_F(Streams, APipeWithoutReaderEndsTheOutputAndNotTheWork) {
  // the reader has gone before the program begins
  const std::string unread =
      "{ sleep 0.5; \"$L\" run tiny.json --out out; echo $? >code; } | true; cat code";
  const Ending ending = Shell(unread);
  EXPECT_EQ(ending.text.substr(ending.text.find('\n') + 1), "2\n") << ending.text;
  EXPECT_EQ(ending.text.find("cannot write"), std::string::npos) << ending.text;
  EXPECT_TRUE(fs::exists(folder_ / "out/drift.md"));
}

TEST_F(Streams, FilesBeyondTheLimitAreAnErrorWithTheirName) {
  ExpectEnding(Shell("ulimit -f 1; \"$L\" run tiny.json --out out 2>&1 >/dev/null | cat"), 0,
               {"cannot write", "results.jsonl", "File too large"});
}

#ifdef LOOPBENCH_BENCH_BINARY

TEST_F(Streams, OfTheBenchmarkProgramAreHeldToTheSame) {
  const std::string bench = "'" LOOPBENCH_BENCH_BINARY "' ";
  ExpectEnding(Shell(bench + "--help 2>&1 >/dev/full"), 2, {"cannot write to standard output"});
  ExpectEnding(Shell(bench + "--benchmark_list_tests 2>&1 >/dev/full"), 2,
               {"cannot write to standard output"});
  EXPECT_EQ(Shell(bench + "--families none.json 2>/dev/full").code, 2);
}

#endif

}  // namespace cli_streams_test
}  // namespace loopbench::harness
