// Tables look as written here, character by character.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace table_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Record Row(const std::string& mechanism, const std::string& formulation, double rtol) {
  Record record;
  record.Set("mechanism", mechanism);
  record.Set("formulation", formulation);
  record.Set("coordinates", std::string("joint"));
  record.Set("solver", std::string("plain"));
  record.Set("rtol", rtol);
  record.Set("horizon", 10.0);
  record.Set("outcome", std::string("finished"));
  return record;
}

Table SmallTable() {
  Table table;
  table.title = "Drift";
  table.columns = {{"mechanism", "mechanism", Format::kText, {}},
                   {"outcome", "outcome", Format::kText, {{"finished", "ok"}}},
                   {"drift", "drift [m]", Format::kScientific, {}},
                   {"slope", "slope", Format::kExponent, {}},
                   {"steps", "steps", Format::kInteger, {}}};
  Record done = Row("four-bar", "odca", 1e-6);
  done.Set("drift", 2.0 / 975.0);
  done.Set("slope", 1.97);
  done.Set("steps", std::int64_t{412});
  Record failed = Row("a|b, \"\xc3\xa9\"", "odca", 1e-6);
  failed.Set("outcome", std::string("singular"));
  failed.Set("drift", kNan);
  failed.Set("slope", std::monostate{});
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
  EXPECT_NE(ToCsv(table).find("\n\"#1\",finished"), std::string::npos);
  table.notes = {"two\nlines"};
  EXPECT_TRUE(ToCsv(table).ends_with("# two\\nlines\n"));
}

TEST(Table, ColourMarksTheOutcomesOfFailedRunsOnlyAndTakesNoPlace) {
  const std::string text = ToText(SmallTable(), true);
  EXPECT_NE(text.find("a|b, \"\xc3\xa9\"   \033[31msingular\033[0m"), std::string::npos) << text;
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
  table.rows[1].Set("mechanism", std::string("50%_of #1 & {x} ~^\\ $"));
  table.rows[1].Set("drift", 1e-6);
  table.rows[1].Set("slope", -0.5);
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
  EXPECT_NE(ToMarkdown(table).find("### outcome = singular\n\n| mechanism |\n| --- |\n| a\\|b"),
            std::string::npos);
  EXPECT_NE(ToLatex(table).find("\\label{tab:drift-2}"), std::string::npos);
  table.columns.resize(1);
  EXPECT_TRUE(Render(table, "csv").starts_with("outcome,mechanism\nfinished,four-bar\n"));
  EXPECT_NE(Render(table, "json").find("{\"outcome\":\"finished\",\"mechanism\":\"four-bar\","),
            std::string::npos);
}

TEST(Table, EveryFormatEndsWithTheNotesOrHoldsThem) {
  Table table = SmallTable();
  table.notes = {"commit: 1234abcd"};
  for (const char* format : {"text", "csv", "markdown", "json", "latex"}) {
    EXPECT_NE(Render(table, format).find("1234abcd"), std::string::npos) << format;
  }
  EXPECT_THROW(Render(table, "html"), std::invalid_argument);
}

TEST(Table, EachFormatPrintsItsDigits) {
  Record row;
  row.Set("x", 1234.5678);
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
  Record row = Row("general-seven-bar", "reduction", 1e-6);
  row.Set("enforcement", std::string("acceleration"));
  row.Set("coordinates", std::string("absolute"));
  row.Set("outcome", std::string("step-too-small"));
  for (const char* key : {"drift_position_max", "energy_error_max", "rhs_ns_median"}) {
    row.Set(key, 123456.7);
  }
  for (const char* kind : {"drift", "timing"}) {
    const std::string text = ToText(Table{"", ColumnsOfKind(kind, true), {row}, {}});
    EXPECT_LE(text.find('\n'), 100u) << text;
  }
}

TEST(Select, NumbersCompareAsNumbersAndTextAsText) {
  const Record row = Row("four-bar", "odca", 1e-6);
  EXPECT_TRUE(Matches(row, {ParseCondition("rtol=1e-6")}));
  EXPECT_TRUE(Matches(row, {ParseCondition("rtol=0.000001"), ParseCondition("horizon=10")}));
  EXPECT_TRUE(Matches(row, {ParseCondition("formulation=lagrange,odca")}));
  EXPECT_FALSE(Matches(row, {ParseCondition("formulation=lagrange"), ParseCondition("rtol=1e-6")}));
  EXPECT_FALSE(Matches(row, {ParseCondition("absent=1")}));
  EXPECT_TRUE(Matches(row, {}));
  EXPECT_EQ(ToText(Selection{ParseCondition("rtol=1e-6,1e-8"), ParseCondition("horizon=10")}),
            "rtol=1e-6,1e-8 horizon=10");
}

TEST(Select, AFilterWithoutKeyOrValueIsRefused) {
  for (const char* text : {"rtol", "=1", "rtol="}) {
    EXPECT_THROW(ParseCondition(text), ConfigError) << text;
  }
}

TEST(Select, FilterKeepsOrder) {
  const std::vector<Record> rows = {Row("a", "odca", 1e-8), Row("b", "odca", 1e-8),
                                    Row("a", "odca", 1e-6)};
  const std::vector<Record> chosen = Filter(rows, {ParseCondition("mechanism=a")});
  EXPECT_EQ(chosen, (std::vector<Record>{rows[0], rows[2]}));
}

TEST(Select, RowsAreSortedByMechanismHorizonFormulationAndFallingTolerance) {
  Record longer = Row("four-bar", "lagrange", 1e-6);
  longer.Set("horizon", 100.0);
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

}  // namespace table_test
}  // namespace loopbench::harness
