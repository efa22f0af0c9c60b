// Tables look as written here, character by character, and those in LaTeX fit an article on A4.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/tables.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace table_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Record Row(const std::string& mechanism, const std::string& formulation, double rtol) {
  return RecordOf("mechanism", mechanism, "formulation", formulation, "coordinates", "joint",
                  "solver", "plain", "rtol", rtol, "horizon", 10.0, "outcome", "finished");
}

Table SmallTable() {
  Table table;
  table.title = "Drift";
  table.columns = {{"mechanism", "mechanism", Format::kText, {}},
                   {"outcome", "outcome", Format::kText, {{"finished", "ok"}}},
                   {"drift", "drift [m]", Format::kScientific, {}},
                   {"slope", "slope", Format::kExponent, {}},
                   {"steps", "steps", Format::kInteger, {}}};
  Record done =
      Changed(Row("four-bar", "odca", 1e-6), "drift", 2.0 / 975.0, "slope", 1.97, "steps", 412);
  Record failed = Changed(Row("a|b, \"\xc3\xa9\"", "odca", 1e-6), "outcome", "singular", "drift",
                          kNan, "slope", std::monostate{});
  table.rows = {done, failed};
  table.notes = {"commit 1234"};
  return table;
}

TEST(Table, TextIsAlignedWithNumbersOnTheRight) {
  EXPECT_EQ(ToText(SmallTable()),
            "Drift\n"
            "\n"
            "mechanism  outcome   drift [m]  slope  steps\n"
            "---------  --------  ---------  -----  -----\n"
            "four-bar   ok         2.05e-03   1.97    412\n"
            "a|b, \"\xc3\xa9\"   singular\n"
            "\n"
            "commit 1234\n");
}

TEST(Table, CsvQuotesWhereNecessaryAndKeepsEveryDigit) {
  EXPECT_EQ(ToCsv(SmallTable()),
            "mechanism,outcome,drift,slope,steps\n"
            "four-bar,finished,0.0020512820512820513,1.97,412\n"
            "\"a|b, \"\"\xc3\xa9\"\"\",singular,,,\n"
            "# commit 1234\n");
}

TEST(Table, MarkdownEscapesBarsAndAlignsNumbers) {
  EXPECT_EQ(ToMarkdown(SmallTable()),
            "## Drift\n"
            "\n"
            "| mechanism | outcome | drift [m] | slope | steps |\n"
            "| --- | --- | ---: | ---: | ---: |\n"
            "| four-bar | ok | 2.05e-03 | 1.97 | 412 |\n"
            "| a\\|b, \"\xc3\xa9\" | singular |  |  |  |\n"
            "\n"
            "commit 1234\n");
}

TEST(Table, CsvCellsThatLookLikeNotesAreQuoted) {
  Table table = SmallTable();
  table.rows[0].Set("mechanism", std::string("#1"));
  ExpectWords(ToCsv(table), {"\n\"#1\",finished"});
  table.notes = {"two\nlines"};
  EXPECT_TRUE(ToCsv(table).ends_with("# two\\nlines\n"));
}

TEST(Table, ColourMarksTheOutcomesOfFailedRunsOnlyAndTakesNoPlace) {
  const std::string text = ToText(SmallTable(), true);
  ExpectWords(text, {"a|b, \"\xc3\xa9\"   \033[31msingular\033[0m"});
  std::string plain = text;
  for (const std::string code : {"\033[31m", "\033[0m"}) {
    ASSERT_EQ(plain.find(code), plain.rfind(code));
    plain.erase(plain.find(code), code.size());
  }
  std::string expected = ToText(SmallTable());
  // the spaces of empty cells behind a coloured one are trimmed in both
  EXPECT_EQ(plain, expected);
}

TEST(Table, JsonIsAnArrayOfRowsWithEveryDigitAndProvenance) {
  Table table = SmallTable();
  EXPECT_EQ(ToJson(Table{}), "[]\n");
  table.notes = {"command: loopbench table out: x", "warning: \"noisy\""};
  const std::string provenance =
      "\"provenance\":\"command: loopbench table out: x\\nwarning: \\\"noisy\\\"\"}";
  EXPECT_EQ(ToJson(table),
            "[{\"mechanism\":\"four-bar\",\"outcome\":\"finished\","
            "\"drift\":0.0020512820512820513,\"slope\":1.97,\"steps\":412," +
                provenance +
                ",\n"
                "{\"mechanism\":\"a|b, \\\"\xc3\xa9\\\"\",\"outcome\":\"singular\",\"drift\":null,"
                "\"slope\":null,\"steps\":null," +
                provenance + "]\n");
}

TEST(Table, LatexIsBooktabsWithEscapesAndMathematicalNumbers) {
  Table table = SmallTable();
  table.rows[1] =
      Changed(table.rows[1], "mechanism", "50%_of #1 & {x} ~^\\ $", "drift", 1e-6, "slope", -0.5);
  table.notes = {"flags 100 %\n\\end{tabular}"};
  EXPECT_EQ(ToLatex(table),
            "% needs \\usepackage{array,booktabs,longtable}\n"
            "{\\normalsize\\setlength{\\tabcolsep}{6pt}\n"
            "\\begin{longtable}{>{\\raggedright\\arraybackslash}p{120pt}lrrr}\n"
            "\\caption{Drift}\\label{tab:drift} \\\\\n"
            "\\toprule\n"
            "mechanism & outcome & drift [m] & slope & steps \\\\\n"
            "\\midrule\n"
            "\\endfirsthead\n"
            "\\toprule\n"
            "mechanism & outcome & drift [m] & slope & steps \\\\\n"
            "\\midrule\n"
            "\\endhead\n"
            "\\bottomrule\n"
            "\\endfoot\n"
            "four-\\allowbreak{}bar & ok & $2.05 \\times 10^{-3}$ & $1.97$ & $412$ \\\\\n"
            "50\\%\\_\\allowbreak{}of \\#1 \\& \\{x\\} \\textasciitilde{}\\textasciicircum{}"
            "\\textbackslash{} \\$ & singular & $1.00 \\times 10^{-6}$ & $-0.50$ &  \\\\\n"
            "\\end{longtable}}\n"
            "{\\footnotesize\\noindent flags 100 \\%\\textbackslash{}n\\textbackslash{}end\\{"
            "\\allowbreak{}tabular\\}\\allowbreak{}\\par}\n");
}

TEST(Table, GroupsAreTablesUnderHeadingsAndColumnsInListsForMachines) {
  Table table = SmallTable();
  table.columns.resize(2);
  table.group = "outcome";
  EXPECT_EQ(ToText(table),
            "Drift\n\n"
            "outcome = finished\n\n"
            "mechanism\n---------\nfour-bar\n\n"
            "outcome = singular\n\n"
            "mechanism\n---------\na|b, \"\xc3\xa9\"\n\n"
            "commit 1234\n");
  ExpectWords(ToMarkdown(table), {"### outcome = singular\n\n| mechanism |\n| --- |\n| a\\|b"});
  ExpectWords(ToLatex(table), {"\\label{tab:drift-2}"});
  table.columns.resize(1);
  EXPECT_TRUE(Render(table, "csv").starts_with("outcome,mechanism\nfinished,four-bar\n"));
  ExpectWords(Render(table, "json"), {"{\"outcome\":\"finished\",\"mechanism\":\"four-bar\","});
}

TEST(Table, EveryFormatEndsWithTheNotesOrHoldsThem) {
  Table table = SmallTable();
  table.notes = {"commit: 1234abcd"};
  for (const char* format : {"text", "csv", "markdown", "json", "latex"}) {
    ExpectWords(Render(table, format), {"1234abcd"});
  }
  EXPECT_THROW(Render(table, "html"), std::invalid_argument);
}

TEST(Table, EachFormatPrintsItsDigits) {
  Record row = RecordOf("x", 1234.5678);
  const auto print = [&](Format format) { return Cell(row, {"x", "x", format, {}}); };
  EXPECT_EQ(print(Format::kInteger), "1235");
  EXPECT_EQ(print(Format::kShortest), "1235");
  EXPECT_EQ(print(Format::kScientific), "1.23e+03");
  EXPECT_EQ(print(Format::kExponent), "1234.57");
  EXPECT_EQ(print(Format::kFixed), "1234.6");
  EXPECT_EQ(print(Format::kSeconds), "1235");
  row.Set("x", std::vector<double>{0.5, 1e-9});
  EXPECT_EQ(print(Format::kText), "0.5;1e-09");
  // as people write them, and four digits of computed values
  for (const auto& [number, text] :
       std::map<double, std::string>{{0.02 * std::pow(0.1, 0.5), "0.006325"},
                                     {1e-6, "1e-06"},
                                     {0.841188, "0.841188"},
                                     {-0.25, "-0.25"},
                                     {1e6, "1000000"},
                                     {12345.678, "12346"},
                                     {1e-7 * std::sqrt(10.0), "3.162e-07"}}) {
    EXPECT_EQ(NumberCell(number), text);
  }
}

std::string Keys(const std::vector<TableColumn>& columns) {
  std::string keys;
  for (const TableColumn& column : columns) keys += column.key + " ";
  return keys;
}

TEST(Columns, DriftTableHasThePublishedOrder) {
  EXPECT_EQ(Keys(ColumnsOfKind("drift", false)),
            "experiment mechanism formulation enforcement coordinates solver integrator rtol atol "
            "horizon outcome t_reached warnings agreement drift_position_max drift_rotation_max "
            "drift_velocity_max "
            "drift_acceleration_max loop_closure_max correction_max worst_loop energy_error_max "
            "growth_exponent growth_spread growth_regime growth_resolved growth_hypothesis "
            "growth_hypothesis_resolved ensemble steps rejected rhs_evaluations rank_min rcond_min "
            "state_hash restarts branch_error_max "
            "closed_form_error_max message ");
}

TEST(Columns, TimingTableStartsWithTheSameKeys) {
  EXPECT_EQ(
      Keys(ColumnsOfKind("timing", false)),
      "experiment mechanism formulation enforcement coordinates solver integrator rtol atol "
      "horizon outcome t_reached bodies joints loops dof rhs_ns_median rhs_ns_p10 rhs_ns_p90 "
      "ns_per_body step_us_median wall_s_median realtime_factor repeats rhs_ns_min wall_s_min "
      "wall_s_p10 wall_s_p90 aa_spread aa_spread_wall calibration_ns calibration_wall_ns "
      "discarded_repetitions load1 "
      "processors governor noise ");
}

TEST(Columns, CompactTablesFitAHundredCharacters) {
  Record row = Changed(Row("general-seven-bar", "reduction", 1e-6), "enforcement", "acceleration",
                       "coordinates", "absolute", "outcome", "step-too-small");
  for (const char* key : {"drift_position_max", "energy_error_max", "rhs_ns_median"}) {
    row.Set(key, 123456.7);
  }
  for (const char* kind : {"drift", "timing"}) {
    const std::string text = ToText(Table{"", ColumnsOfKind(kind, true), {row}, {}});
    EXPECT_LE(text.find('\n'), 100u) << text;
  }
}

TEST(Select, FilterKeepsOrder) {
  const std::vector<Record> rows = {Row("a", "odca", 1e-8), Row("b", "odca", 1e-8),
                                    Row("a", "odca", 1e-6)};
  const std::vector<Record> chosen = Filter(rows, {ParseCondition("mechanism=a")});
  EXPECT_EQ(chosen, (std::vector<Record>{rows[0], rows[2]}));
}

TEST(Select, RowsAreSortedByMechanismHorizonFormulationAndFallingTolerance) {
  Record longer = Changed(Row("four-bar", "lagrange", 1e-6), "horizon", 100.0);
  Record unknown = Row("four-bar", "odca", kNan);
  const std::vector<Record> sorted = {Row("four-bar", "lagrange", 1e-6),
                                      Row("four-bar", "odca", 1e-6),
                                      Row("four-bar", "odca", 1e-12),
                                      unknown,
                                      longer,
                                      Row("toggle", "lagrange", 1e-6)};
  std::vector<Record> rows(sorted.rbegin(), sorted.rend());
  SortRows(&rows);
  ASSERT_EQ(rows.size(), sorted.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].Text("mechanism") + rows[i].Text("formulation") + rows[i].Text("rtol"),
              sorted[i].Text("mechanism") + sorted[i].Text("formulation") + sorted[i].Text("rtol"))
        << i;
  }
}

TEST(Select, NumbersWithinNamesAreOrderedByTheirSize) {
  std::vector<Record> rows;
  for (const char* name :
       {"chain-10", "ladder-1", "chain-3", "chain", "chain-100", "chain-3b", "chain-03"}) {
    rows.push_back(Row(name, "odca", 1e-6));
  }
  std::string order;
  SortRows(&rows);
  for (const Record& row : rows) order += row.Text("mechanism") + " ";
  EXPECT_EQ(order, "chain chain-3 chain-3b chain-03 chain-10 chain-100 ladder-1 ");
}

namespace fs = std::filesystem;

const char* const kHostile[] = {
    "four-bar",
    "\\input{x} 50% a_b^2 ~<>|&#$ {",
    "[1cm]",
    "*",
    "a\nb\t\x1b[31m",
    "e\xcc\x81 \xe6\xbc\xa2\xe5\xad\x97 \xc3\xa9\xc3\x9e",
    "--``''?`\"",
    "a-name-of-a-mechanism-that-never-ends-and-goes-on-and-on-until-the-page-is-full-of-it",
    "anamewithoutanyplacewhereitcouldbebrokenwhichisofcourselongerthanthewholelineisitself"};

/// Records with a value under every column.
Table Filled(std::vector<TableColumn> columns, int rows) {
  Table table;
  table.title = "Drift of 50% of_all - 3 of 9 rows are flagged (marked ?, reasons below)";
  table.columns = std::move(columns);
  for (int i = 0; i < rows; ++i) {
    Record& row = table.rows.emplace_back();
    for (const TableColumn& column : table.columns) {
      if (column.format == Format::kText) {
        row.Set(column.key, std::string(kHostile[i % std::size(kHostile)]));
      } else {
        row.Set(column.key, -1.23456e-10 * (i + 1));
      }
    }
  }
  table.notes = {"command: 50 % \\end{longtable}\n"};
  return table;
}

std::vector<Table> Tables() {
  std::vector<Table> tables = {
      Filled(ColumnsOfKind("drift", false), 9), Filled(ColumnsOfKind("timing", false), 9),
      Filled(ColumnsOfKind("drift", true), 90), Filled(ColumnsOfKind("timing", true), 3),
      Filled(ColumnsOfKind("precision", true), 1)};
  tables.push_back(Filled(ColumnsOfKind("drift", true), 9));
  tables.back().group = "mechanism";
  tables.push_back(Filled({{"a", "a"}, {"b", "b [m]", Format::kScientific}}, 9));
  return tables;
}

TEST(TableLatex, RowsHaveAsManyCellsAsColumnsAndNoCharacterThatPdflatexLacks) {
  for (const Table& table : Tables()) {
    const std::string text = ToLatex(table);
    int depth = 0;
    std::size_t cells = 0;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = text.find('\n', begin);
      const std::string line = text.substr(begin, end - begin);
      begin = end + 1;
      if (line.starts_with('%')) continue;
      std::size_t here = 1;
      for (std::size_t i = 0; i < line.size(); ++i) {
        const bool escaped = i > 0 && line[i - 1] == '\\' && (i < 2 || line[i - 2] != '\\');
        if (escaped) continue;
        depth += line[i] == '{' ? 1 : line[i] == '}' ? -1 : 0;
        here += line[i] == '&' ? 1 : 0;
        const auto byte = static_cast<unsigned char>(line[i]);
        EXPECT_TRUE(byte >= 0x20 && (byte < 0x80 || byte == 0xC3 || (byte & 0xC0u) == 0x80u))
            << line;
      }
      if (line.ends_with("\\\\") && !line.starts_with("\\caption")) {
        if (cells == 0) cells = here;
        EXPECT_EQ(here, cells) << line;
      }
    }
    EXPECT_EQ(depth, 0) << text;
    ExpectWords(text, {"\\caption{", "\\label{tab:drift}"});
  }
}

TEST(TableLatex, ColumnsThatFindNoPlaceAreNamed) {
  const std::string text = ToLatex(Filled(ColumnsOfKind("drift", false), 9));
  ExpectWords(text, {"\\begin{landscape}", "% left out to fit the page: ", "state hash"});
}

TEST(TableLatex, CompilesWithoutOverfullBoxes) {
  if (std::system("command -v pdflatex >/dev/null") != 0) {
    GTEST_SKIP() << "no pdflatex (Debian: texlive-latex-recommended)";
  }
  const fs::path folder = fs::path(testing::TempDir()) / "loopbench-latex";
  fs::create_directories(folder);
  std::string text =
      "\\documentclass[a4paper,10pt]{article}\n\\usepackage{array,booktabs,longtable,lscape}\n"
      "\\begin{document}\n";
  for (const Table& table : Tables()) text += ToLatex(table) + "\n\\clearpage\n";
  WriteFileAtomically(folder / "tables.tex", text + "\\end{document}\n");
  // columns of long tables settle in two passes
  const std::string run = "cd '" + folder.string() +
                          "' && pdflatex -interaction=nonstopmode -halt-on-error tables.tex >out";
  ASSERT_EQ(std::system((run + " && " + run).c_str()), 0) << ReadFile(folder / "out");
  const std::string log = ReadFile(folder / "tables.log");
  ExpectWords(log, {"Output written"});
  constexpr double kMost = 10.0;  // [pt]; less is not seen on paper
  const std::string begin = "Overfull \\hbox (";
  for (std::size_t at = 0; (at = log.find(begin, at)) != std::string::npos; ++at) {
    EXPECT_LT(std::strtod(&log[at + begin.size()], nullptr), kMost) << log.substr(at, 300);
  }
  EXPECT_EQ(log.find("Overfull \\vbox"), std::string::npos);
  EXPECT_EQ(log.find("Float too large"), std::string::npos);
}

}  // namespace table_test
}  // namespace loopbench::harness
