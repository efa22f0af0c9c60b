// LaTeX tables fit an article on A4 at 10 pt: compiled where there is pdflatex, and by their
// structure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "harness/base/text.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace table_latex_test {

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
    EXPECT_NE(text.find("\\caption{"), std::string::npos);
    EXPECT_NE(text.find("\\label{tab:drift}"), std::string::npos);
  }
}

TEST(TableLatex, ColumnsThatFindNoPlaceAreNamed) {
  const std::string text = ToLatex(Filled(ColumnsOfKind("drift", false), 9));
  EXPECT_NE(text.find("\\begin{landscape}"), std::string::npos);
  EXPECT_NE(text.find("% left out to fit the page: "), std::string::npos);
  EXPECT_NE(text.find("state hash"), std::string::npos) << text.substr(0, 500);
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
  EXPECT_NE(log.find("Output written"), std::string::npos);
  constexpr double kMost = 10.0;  // [pt]; less is not seen on paper
  const std::string begin = "Overfull \\hbox (";
  for (std::size_t at = 0; (at = log.find(begin, at)) != std::string::npos; ++at) {
    EXPECT_LT(std::strtod(&log[at + begin.size()], nullptr), kMost) << log.substr(at, 300);
  }
  EXPECT_EQ(log.find("Overfull \\vbox"), std::string::npos);
  EXPECT_EQ(log.find("Float too large"), std::string::npos);
}

}  // namespace table_latex_test
}  // namespace loopbench::harness
