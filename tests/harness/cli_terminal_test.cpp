// What a person sees on a terminal: tables as wide as it is, colours, progress, Ctrl-C.
#include "tests/harness/cli_fixture.h"
#include "tests/harness/pseudo_terminal.h"

namespace loopbench::harness::cli_terminal_test {

/// Cells of texts that have Latin letters, marks of U+0300 to U+036F and Chinese characters alone.
std::size_t Cells(const std::string& text) {
  std::size_t cells = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0u) == 0x80u) continue;
    if (byte == 0xCC || byte == 0xCD) continue;     // U+0300 to U+036F
    cells += byte >= 0xE4 && byte <= 0xE9 ? 2 : 1;  // U+4E00 to U+9FFF
  }
  return cells;
}

/// The lines of the first table (heading, rule, rows) and all others up to an empty line.
std::vector<std::string> TableLines(const std::string& text) {
  const std::size_t rule = std::min(text.find("\n--"), text.find("\n  --"));
  if (rule == std::string::npos) throw std::runtime_error("no table in " + text);
  const std::size_t heading = text.rfind('\n', rule - 1) + 1;
  const std::size_t end = std::min(text.find("\n\n", rule), text.size());
  std::vector<std::string> lines;
  for (std::size_t begin = heading; begin < end;) {
    const std::size_t next = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, next - begin));
    begin = next + 1;
  }
  return lines;
}

class CliTerminalTest : public CommandLineTest {
 protected:
  TerminalEnding See(const std::string& arguments, int columns, const std::string& before = "",
                     const std::function<std::string(const std::string&)>& look = {}) const {
    return OnTerminal(
        "cd '" + folder_.string() + "' && " + before + " '" LOOPBENCH_BINARY "' " + arguments,
        columns, look);
  }
};

TEST_F(CliTerminalTest, TablesAreAsWideAsTheTerminalAndNameWhatIsLeftOut) {
  const std::string piped = (Call("run tiny.json --out out"), Call("table out").text);
  ExpectNone(piped, {"left out"});
  const std::size_t whole = TableLines(piped).at(1).size();
  ASSERT_GT(whole, 80u);  // or this tests nothing
  for (const int columns : {24, 40, 60, 80, 100}) {
    const TerminalEnding seen = See("table out", columns);
    EXPECT_EQ(seen.code, 0) << seen.text;
    for (const std::string& line : TableLines(seen.text)) {
      EXPECT_LE(static_cast<int>(line.size()), columns) << seen.text;
    }
    const bool fits = static_cast<int>(whole) <= columns;
    EXPECT_EQ(
        seen.text.find("left out for a width of " + std::to_string(columns)) == std::string::npos,
        fits)
        << seen.text;
    // what differs between the two rows is what they are told apart by
    if (columns >= 40) {
      EXPECT_NE(TableLines(seen.text).at(2), TableLines(seen.text).at(3)) << seen.text;
    }
  }
  const std::string rows = piped.substr(0, piped.find("\ncommand: "));
  for (const TerminalEnding& seen : {See("table out", 300), See("table out --wide", 40)}) {
    EXPECT_EQ(seen.text.substr(0, seen.text.find("\ncommand: ")), rows);
  }
}

/// Commands that read a mechanism print from a child process, which has no terminal.
TEST_F(CliTerminalTest, TablesOfChildProcessesFitTheTerminal) {
  for (const std::string command :
       {"assemble four-bar.json", "explain four-bar.json", "view four-bar.json --format text",
        "advise four-bar.json --horizon 0.5 --max-error 1e-3"}) {
    constexpr int kRule = 1;
    EXPECT_LE(TableLines(See(command, 50).text).at(kRule).size(), 50u) << command;
    const TerminalEnding wide = See(command + " --wide", 50);
    EXPECT_EQ(wide.code, 0) << wide.text;
    ExpectNone(wide.text, {"left out"});
    EXPECT_GT(TableLines(wide.text).at(kRule).size(), 50u) << wide.text;  // or this tests nothing
  }
}

TEST_F(CliTerminalTest, ColourIsForTerminalsWithoutNoColorAndNeverInFiles) {
  Write("short.json", TinyWith(R"("limits": {"steps": 3})"));
  const TerminalEnding seen = See("run short.json --out out 2>&-", 120);
  ExpectWords(seen.text, {"\033[31mstep-limit"});
  for (const std::string& plain :
       {See("table out", 120, "NO_COLOR=1").text, See("table out", 120, "TERM=dumb").text,
        See("table out | cat", 120).text, Call("table out").text,
        ReadFile(folder_ / "out/drift.md"), ReadFile(folder_ / "out/drift.csv")}) {
    EXPECT_EQ(plain.find('\033'), std::string::npos) << plain;
    ExpectWords(plain, {"step-limit"});
  }
  ExpectWords(See("check-claims out --claims claims.json", 120).text, {"\033["});
}

TEST_F(CliTerminalTest, HostileNamesNeitherActNorMoveColumns) {
  EditMechanism("\"name\": \"four-bar\"",
                R"("name": "a\n\u001b[31m\tb e\u0301\u0301 \u6f22\u5b57\u6f22")");
  Write("two.json", R"({"name": "two", "problems": [{"mechanism": "four-bar.json", "horizon": 0.1},
    {"mechanism": "four-bar.json", "name": "plain", "horizon": 0.1}], "tolerances": [1e-6],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}], "timing": {"repeats": 0}})");
  Expect("run two.json --out out", 0);
  for (const int columns : {30, 50, 80, 200}) {
    const TerminalEnding seen = See("table out --columns mechanism,steps", columns, "NO_COLOR=1");
    EXPECT_EQ(seen.code, 0);
    for (const char c : seen.text) {
      EXPECT_TRUE(c == '\n' || static_cast<unsigned char>(c) >= 0x20) << seen.text;
    }
    ExpectWords(seen.text, {"a\\n\\x1b[31m\\tb"});
    const std::vector<std::string> lines = TableLines(seen.text);
    ASSERT_GE(lines.size(), 4u);
    std::size_t ends = 0;  // numbers end where the rule does
    for (const std::string& line : lines) {
      EXPECT_LE(static_cast<int>(Cells(line)), columns) << seen.text;
      const bool has_number = std::isdigit(static_cast<unsigned char>(line.back())) != 0;
      if (has_number && line.find("  ") != std::string::npos) {
        ++ends;
        EXPECT_EQ(Cells(line), Cells(lines[1])) << seen.text;
      }
    }
    EXPECT_EQ(ends, 2u) << seen.text;
  }
}

TEST_F(CliTerminalTest, CtrlCKeepsWhatIsDoneAndSaysHowToGoOn) {
  // the long one is begun first, and ends by its limit; the others end beside it
  Write("long.json", R"({"name": "it's long", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": [0.5, 100000]}],
    "methods": [{"formulation": ["odca", "lagrange", "reduction"], "enforcement": "velocity"}],
    "exclude": [{"formulation": ["lagrange", "reduction"], "horizon": 100000}],
    "limits": {"cpu_s": 2, "steps": 100000000}, "timing": {"repeats": 0}})");
  const fs::path store = folder_ / "o ut/results.jsonl";
  const auto press = [&, pressed = false](const std::string&) mutable -> std::string {
    std::ifstream file(store);
    const auto lines = std::count(std::istreambuf_iterator<char>(file), {}, '\n');
    if (pressed || lines < 3) return "";
    pressed = true;
    return "\003";
  };
  const TerminalEnding seen =
      See("run long.json --out 'o ut' --jobs 2 --filter 'rtol<1'", 100, "exec", press);
  EXPECT_EQ(seen.code, 130) << seen.text;
  ExpectWords(seen.text,
              {"accuracy 0/4", "3 records kept in o ut/results.jsonl, 3 of them of this run"});
  ExpectWords(seen.text.substr(seen.text.find("accuracy 0/4")), {"now four-bar", "s left"});
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadRecords(store, &warnings).size(), 3u);
  EXPECT_TRUE(warnings.empty());
  // the command that it says, word for word
  const std::string say = "to resume: ";
  const std::size_t begin = seen.text.find(say) + say.size();
  const std::string command = seen.text.substr(begin, seen.text.find('\n', begin) - begin);
  const TerminalEnding again = OnTerminal("cd '" + folder_.string() + "' && " + command, 100);
  EXPECT_EQ(again.code, 0) << command << "\n" << again.text;
  ExpectWords(again.text, {"ran 1 case (1 not finished), 3 reused"});
  EXPECT_EQ(ReadRecords(store).size(), 4u);
}

TEST_F(CliTerminalTest, EveryLineOfProgressFitsTheTerminal) {
  const TerminalEnding seen = See("run tiny.json --out out >out.txt", 30);
  EXPECT_EQ(seen.code, 0) << seen.text;
  std::size_t lines = 0;
  for (std::size_t at = 0; (at = seen.text.find("\r\033[K", at)) != std::string::npos; ++lines) {
    at += 4;
    const std::size_t end = seen.text.find_first_of("\r\n", at);
    if (seen.text.compare(at, 8, "accuracy") == 0) {
      EXPECT_LT(end - at, 30u) << seen.text;
    }
  }
  EXPECT_GT(lines, 2u);
  ExpectNone(Call("run tiny.json --out other").text, {"elapsed"});
}

// Standard streams that are closed, full or without a reader: an exit code and a reason, never a
// signal, and never a line in a store.

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
  Expect("run tiny.json --out out", 0, {"ran 0 cases, 2 reused"});
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
  ExpectEnding(Shell("ulimit -f 1; \"$L\" run tiny.json --out beyond 2>&1 >/dev/null | cat"), 0,
               {"cannot write", "results.jsonl", "File too large"});
}

TEST_F(Streams, APipeWithoutReaderEndsTheOutputAndNotTheWork) {
  // the reader has gone before the program begins
  const std::string unread =
      "{ sleep 0.5; \"$L\" run tiny.json --out out; echo $? >code; } | true; cat code";
  const Ending ending = Shell(unread);
  EXPECT_EQ(ending.text.substr(ending.text.find('\n') + 1), "2\n") << ending.text;
  ExpectNone(ending.text, {"cannot write"});
  EXPECT_TRUE(fs::exists(folder_ / "out/drift.md"));
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

}  // namespace loopbench::harness::cli_terminal_test
