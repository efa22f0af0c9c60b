// What programs read: JSON of commands, completion, the manual page; and the nearest spelling of
// wrong words. Python and bash judge.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_documents_test {

class CliDocumentsTest : public CommandLineTest {
 protected:
  /// Returns the value of a Python expression of d, the document that the command prints.
  Ending Ask(const std::string& arguments, const std::string& expression) const {
    return Call(arguments +
                " 2>err.txt | python3 -c 'import json, sys; d = json.load(sys.stdin); "
                "print(" +
                expression + ")'");
  }
};

TEST_F(CliDocumentsTest, ListPlanCheckAndExplainAreOneDocumentEach) {
  EditMechanism("\"name\": \"four-bar\"", R"("name": "a \"b\"\n\u001b[31m \u6f22")");
  const std::string files = "tiny.json tiny.json";
  EXPECT_EQ(Ask("list --json " + files,
                "[len(e[\"cases\"]) for e in d[\"experiments\"]], "
                "repr(d[\"experiments\"][0][\"cases\"][0][\"mechanism\"])")
                .text,
            "[2, 2] 'a \"b\"\\n\\x1b[31m \xe6\xbc\xa2'\n");
  const Ending plan = Ask("estimate --json tiny.json",
                          "d[\"experiments\"][0][\"cases\"], "
                          "d[\"experiments\"][0][\"accuracy_seconds\"] > 0, "
                          "sum(l[\"runs\"] for l in d[\"experiments\"][0][\"lines\"])");
  EXPECT_EQ(plan.text, "2 True 2\n");
  Write("bad.json", R"({"name": 3, "problems": []})");
  EXPECT_EQ(Ask("check --json tiny.json bad.json four-bar.json claims.json",
                "d[\"ok\"], [f[\"ok\"] for f in d[\"files\"]], "
                "[f.get(\"found\", {}).get(\"kind\") for f in d[\"files\"]], "
                "\"bad.json\" in d[\"files\"][1][\"error\"]")
                .text,
            "False [True, False, True, True] ['experiment', None, 'mechanism', 'claims'] True\n");
  ExpectWords(ReadFile(folder_ / "err.txt"), {"bad.json"});
  Expect("check --json bad.json", 2);
  EXPECT_EQ(
      Ask("explain --json tiny.json four-bar.json",
          "[f[\"kind\"] for f in d[\"files\"]], d[\"files\"][0][\"cases\"], "
          "d[\"files\"][1][\"degrees_of_freedom\"][\"by_rank\"], len(d[\"files\"][1][\"joints\"]), "
          "len(d[\"files\"][1][\"loops\"]), d[\"files\"][1][\"start_outcome\"], "
          "d[\"files\"][1][\"gravity\"][1]")
          .text,
      "['experiment', 'mechanism'] 2 1 4 1 finished -9.81\n");
}

TEST_F(CliDocumentsTest, PlanCountsAllThatARunMakesAndKnowsHowRunsEnd) {
  Write("all.json", R"({"name": "all", "tolerances": [1e-4, 1e-8],
    "problems": [{"mechanism": "four-bar.json", "horizon": [1, 1000000]}],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}],
    "limits": {"cpu_s": 2, "steps": 1000}, "timing": {"repeats": 1, "horizon": 1}})");
  // a million seconds end after 1000 steps, which take less than a second, not by their CPU time
  EXPECT_EQ(Ask("estimate --json all.json",
                "[(e[\"cases\"], e[\"timings\"], e[\"timing_seconds\"] > 0, "
                "0 < e[\"accuracy_seconds\"] < 4) for e in d[\"experiments\"]]")
                .text,
            "[(4, 1, True, True)]\n");
#ifdef LOOPBENCH_PRECISIONS
  const Ending reference = Ask("estimate --json all.json --set '/reference={}' --filter horizon=1",
                               "d[\"experiments\"][0][\"references\"], "
                               "d[\"experiments\"][0][\"reference_seconds\"] > 0");
  EXPECT_EQ(reference.text, "1 True\n");
#endif
}

TEST_F(CliDocumentsTest, CompareSaysInADocumentWhatItsExitCodeMeans) {
  Expect("run tiny.json --out a", 0);
  Expect("run tiny.json --out again", 0);
  const Ending same = Ask("compare --json a again",
                          "d[\"exit_code\"], d[\"conclusion\"], "
                          "all(f[\"judgement\"] == \"same\" for f in d[\"findings\"] "
                          "if f[\"judgement\"] != \"not measured\"), len(d[\"findings\"]) > 5");
  EXPECT_EQ(same.text, "0 NO CHANGE True True\n");
  Expect("run tiny.json --out b --set /tolerances=[1e-4]", 0);
  const Ending other = Ask("compare --json a b", "d[\"exit_code\"], len(d[\"only_in_base\"])");
  EXPECT_EQ(other.text.back(), '\n');
  const int code = Call("compare --json a b").code;
  EXPECT_EQ(other.text, std::to_string(code) + " 2\n");
}

TEST_F(CliDocumentsTest, WrongWordsAreAnsweredWithTheNearest) {
  Expect("tabel out", 2, {"loopbench: unknown command 'tabel'; did you mean 'table'?"});
  Expect("table out --fromat csv", 2,
         {"loopbench table: unknown option '--fromat'; did you mean '--format'?"});
  Expect("run tiny.json --out=o --job=2", 2,
         {"loopbench run: unknown option '--job'; did you mean '--jobs'?"});
  Expect("--versoin", 2, {"loopbench: unknown option '--versoin'; did you mean '--version'?"});
  const Ending far = Call("xyzzy");
  ExpectEnding(far, 2, {"unknown command 'xyzzy'\n"});
  const Ending hostile = Call("$(printf 'run\\033[31m')");
  EXPECT_EQ(hostile.code, 2);
  EXPECT_EQ(hostile.text.find('\033'), std::string::npos);
}

TEST_F(CliDocumentsTest, BashCompletesCommandsOptionsValuesAndFiles) {
  const auto complete = [&](const std::string& words, int word) {
    Write("ask.sh", "eval \"$('" LOOPBENCH_BINARY "' completion bash)\"\nCOMP_WORDS=(" + words +
                        ")\nCOMP_CWORD=" + std::to_string(word) +
                        "\n_loopbench\necho \"${COMPREPLY[*]}\"\n");
    return Call("--version > /dev/null; bash ask.sh").text;
  };
  EXPECT_EQ(complete("loopbench ta", 1), "table\n");
  EXPECT_EQ(complete("loopbench table out --fo", 3), "--format\n");
  EXPECT_EQ(complete("loopbench table out --format c", 4), "csv\n");
  EXPECT_EQ(complete("loopbench table out --format = la", 5), "latex\n");
  EXPECT_EQ(complete("loopbench table ou", 2), "\n");  // readline then completes names of files
  EXPECT_EQ(complete("loopbench run tiny.json --re", 3), "--rerun\n");
  EXPECT_EQ(complete("loopbench history sh", 2), "show\n");
  EXPECT_EQ(complete("loopbench history show --bra", 3), "--branch\n");
  EXPECT_EQ(complete("loopbench completion z", 2), "zsh\n");
}

TEST_F(CliDocumentsTest, TheManualPageHasEveryCommandAndOption) {
  const std::string page = Call("manual").text;
  EXPECT_TRUE(page.starts_with(".TH LOOPBENCH 1 ")) << page.substr(0, 80);
  for (const std::string command : {"run", "list", "estimate", "explain", "check", "table",
                                    "robustness", "compare", "advise", "completion", "manual"}) {
    ExpectWords(page, {".SS loopbench " + command});
  }
  ExpectWords(page, {"\\fB\\-\\-rerun\\fR"});
  const std::string own = Call("manual run").text;  // a part of it under a title of its own
  EXPECT_TRUE(own.starts_with(".TH LOOPBENCH\\-run 1 ")) << own.substr(0, 80);
  ExpectWords(page, {own.substr(own.find(".SS loopbench run"))});
  // nothing but macros of man(7) begins a line with a point, nothing at all with an apostrophe
  for (std::size_t at = page.find('\n'); at + 1 < page.size(); at = page.find('\n', at + 1)) {
    EXPECT_NE(page[at + 1], '\'');
    if (page[at + 1] != '.') continue;
    const std::string macro = page.substr(at + 2, 2);
    EXPECT_TRUE(std::isupper(static_cast<unsigned char>(macro[0])) != 0 || macro == "nf" ||
                macro == "fi")
        << page.substr(at + 1, 40);
  }
}

}  // namespace loopbench::harness::cli_documents_test
