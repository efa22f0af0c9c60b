// What users name reaches every medium as text and never as an instruction.
#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/judge/tables.h"
#include "tests/standard.h"

namespace loopbench::harness::escape_test {

using namespace std::string_literals;

TEST(Escape, TerminalsShowWhatWouldAct) {
  EXPECT_EQ(EscapeTerminal("four-bar, \xc3\xa9, \xe2\x86\x92, \xf0\x9f\x99\x82 \\n"),
            "four-bar, \xc3\xa9, \xe2\x86\x92, \xf0\x9f\x99\x82 \\n");
  EXPECT_EQ(EscapeTerminal("\x1b[31ma\0b\n\r\t\x7f"s), "\\x1b[31ma\\x00b\\n\\x0d\\t\\x7f");
  EXPECT_EQ(EscapeTerminal("\xc2\x9b 31m"), "\\u009b 31m");  // CSI in one character
  EXPECT_EQ(EscapeTerminal("\xe2\x80\xae"
                           "abc"),
            "\\u202eabc");                                                         // right to left
  EXPECT_EQ(EscapeTerminal("\x9b\xff\xc3"), "\\x9b\\xff\\xc3");                    // no UTF-8
  EXPECT_EQ(EscapeTerminal("\xc0\x9b\xed\xa0\x80"), "\\xc0\\x9b\\xed\\xa0\\x80");  // nor these
  EXPECT_EQ(EscapeTerminalLines("a\nb\x1b\n"), "a\nb\\x1b\n");
}

TEST(Escape, MarkdownBeginsNeitherMarkupNorHtml) {
  EXPECT_EQ(EscapeMarkdown("drift_position_max [m] <= 1e-3 & x#1 (a)"),
            "drift_position_max [m] <= 1e-3 & x#1 (a)");
  EXPECT_EQ(EscapeMarkdown("<b>a</b> <!-- &lt; &#60;"),
            "&lt;b>a&lt;/b> &lt;!-- &amp;lt; &amp;#60;");
  EXPECT_EQ(EscapeMarkdown("a\n# b"), "a\\\\n# b");
  EXPECT_EQ(EscapeMarkdown("_x_ *y* `z` ~w~ a|b $c$ \\d"),
            "\\_x\\_ \\*y\\* \\`z\\` \\~w\\~ a\\|b \\$c\\$ \\\\d");
  EXPECT_EQ(EscapeMarkdown("[a](http://b) [a]: b"), "[a\\](http://b) [a\\]: b");
  for (const char* begin : {"# a", "> a", "- a", "+ a", "=== a"}) {
    EXPECT_EQ(EscapeMarkdownParagraph("  "s + begin), "\\"s + begin);
  }
  EXPECT_EQ(EscapeMarkdownParagraph("12. a"), "12\\. a");
  EXPECT_EQ(EscapeMarkdownParagraph("12 a"), "12 a");
}

TEST(Escape, LatexHasNoCommandsOfNames) {
  EXPECT_EQ(EscapeLatex("\\input{x} 50% a_b^2 ~<>|&#$"),
            "\\textbackslash{}input\\{x\\} 50\\% a\\_b\\textasciicircum{}2 "
            "\\textasciitilde{}\\textless{}\\textgreater{}\\textbar{}\\&\\#\\$");
  EXPECT_EQ(EscapeLatex("[1cm] [2]"), "{}[1cm] [2]");  // else the space after the row before
  EXPECT_EQ(EscapeLatex("*a*"), "{}*a*");
  EXPECT_EQ(EscapeLatex("a\nb"), "a\\textbackslash{}nb");
}

TEST(Escape, CsvHasOneLinePerRowAndNoFormulas) {
  EXPECT_EQ(EscapeCsv("a,\"b\"#\nc"), "\"a,\"\"b\"\"#\\nc\"");
  EXPECT_EQ(EscapeCsv("=cmd|' /C calc'!A0"), "'=cmd|' /C calc'!A0");
  for (const char* text : {"+1+1", "-2+3", "@SUM(A1)"}) EXPECT_EQ(EscapeCsv(text), "'"s + text);
  for (const char* text : {"-1e-3", "+2", "-", "a=b", "", "-inf"}) EXPECT_EQ(EscapeCsv(text), text);
}

TEST(Escape, SeriesInCsvStayNumbers) {
  Table table;
  table.columns = {{"series.drift", "drift", Format::kShortest, {}},
                   {"name", "=name", Format::kText, {}}};
  Record row;
  row.Set("series.drift", std::vector<double>{-1.0, 2.0});
  row.Set("name", std::string("=1+1"));
  table.rows = {row};
  EXPECT_EQ(ToCsv(table), "series.drift,name\n-1;2,'=1+1\n");
}

TEST(Escape, TablesEscapeTitlesHeadersCellsHeadingsAndNotes) {
  const std::string evil = "\x1b[8m\n<b>|x";
  Table table;
  table.title = table.group = evil;
  table.columns = {{"name", evil, Format::kText, {}}, {evil, evil, Format::kText, {}}};
  table.notes = {evil};
  Record row;
  row.Set("name", evil);
  row.Set(evil, evil);
  table.rows = {row};
  for (const char* format : {"text", "csv", "markdown", "latex", "json"}) {
    const std::string text = Render(table, format);
    EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
    EXPECT_EQ(text.find("\n<b>"), std::string::npos) << text;
    EXPECT_NE(text.find("[8m"), std::string::npos) << text;
  }
  EXPECT_EQ(ToMarkdown(table).find("<b>"), std::string::npos) << ToMarkdown(table);
}

TEST(Escape, GnuplotShowsAnyText) {
  // two apostrophes in a row ended a string; '%' in the label of a tick was a format; digits after
  // a sign belonged to its number
  const std::string text = "''a'' 'b' \"c\" `touch pwned` \\n @d $e %s {f} $100 5\"4 r'12";
  const auto path = std::filesystem::path(testing::TempDir()) / "loopbench-escape.svg";
  const std::string script = "set title " + QuoteGnuplot(text) + "\nset xtics (" +
                             QuoteGnuplotTick("50% %g %d") + " 1)\nplot [0:2] x title " +
                             QuoteGnuplot("''") + "\n";
  const auto error = DrawWithGnuplot(path, {.page = {}, .script = script});
  ASSERT_FALSE(error) << *error;
  const std::string svg = ReadFile(path);
  EXPECT_NE(svg.find("<text>" + text + "</text>"), std::string::npos) << svg;
  EXPECT_NE(svg.find("<text>50% %g %d</text>"), std::string::npos) << svg;
  EXPECT_NE(svg.find("<text>''</text>"), std::string::npos) << svg;
  std::filesystem::remove(path);
}

TEST(Escape, FileNamesAreSlugsOfOneComponent) {
  for (const char* name : {"four-bar", "drift-four-bar-10s-rtol-1e-08", "a.b_c+d", "x--y"}) {
    EXPECT_EQ(FileName(name), name);
  }
  std::set<std::string> names;
  std::vector<std::string> others = {"a/b", "a b", "a-b", "../a", "/a",   "..",
                                     ".",   "",    ".a",  "-a",   "a\nb", "\xc3\xa9"};
  others.insert(others.end(), {"a\0b"s, "a\0c"s, std::string(300, 'x'), std::string(301, 'x')});
  for (const std::string& name : others) {
    const std::string file = FileName(name);
    EXPECT_EQ(file.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-."), std::string::npos);
    EXPECT_FALSE(file.empty() || file[0] == '.' || file[0] == '-') << file;
    EXPECT_LE(file.size(), 200u);
    EXPECT_TRUE(names.insert(file).second) << file << " twice";
  }
}

}  // namespace loopbench::harness::escape_test
