#include "harness/judge/failure_map_report.h"

#include <fmt/format.h>

#include <cstdint>
#include <functional>

#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

std::string ColumnKey(std::size_t column) { return fmt::format("column{}", column); }

// `shown`, the number and the count, as far as there are any.
std::string MapCellText(const MapCell& cell, const std::string& shown) {
  std::string text = shown;
  for (const std::string& part : {DecidingNumber(cell), HoldingCount(cell)}) {
    if (!part.empty()) text += " " + part;
  }
  return text;
}

// Short, because a terminal is narrow: numbers without names and units, methods by letter.
std::string TerminalCell(const MapCell& cell) {
  if (cell.state == CellState::kNotApplicable) return "-";
  MapCell plain = cell;
  plain.decided.name = plain.decided.unit = "";
  if (cell.state == CellState::kNotMeasured) return MapCellText(plain, "?");
  if (cell.state != CellState::kHolds) return MapCellText(plain, cell.word);
  return MapCellText(plain, ClassText(cell) == "holds" ? "ok" : "ok: " + cell.outcome);
}

std::string MethodLetter(std::size_t column) {
  constexpr std::size_t kLetters = 26;
  const std::string letter(1, static_cast<char>('A' + column % kLetters));
  return column < kLetters ? letter : fmt::format("{}{}", letter, column / kLetters);
}

// The table's cells are texts that begin with their class.
std::string MapColour(const Record& row, const TableColumn& column) {
  const std::string text = row.Text(column.key);
  const std::string word = text.substr(0, text.find(' '));
  for (const RunEnding& ending : kRunEndings) {
    if (word != ending.word) continue;
    return ending.state == CellState::kStopped ? "33"  // yellow
           : ending.state == CellState::kLimit ? "35"  // magenta
                                               : "1;31";
  }
  if (word == "inaccurate") return "31";
  return word == "ok" || word == "ok:" ? "32" : "";
}

// The rows of one group under the methods.
void AddMapRows(const FailureMap& map, std::size_t group,
                const std::function<std::string(const MapCell&)>& text, Table* table) {
  for (std::size_t r = 0; r < map.cells[group].size(); ++r) {
    Record row;
    row.Set("group", map.rules.groups[group].label);
    row.Set("row", map.rules.groups[group].rows[r].label);
    for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
      row.Set(ColumnKey(c), text(map.cells[group][r][c]));
    }
    table->rows.push_back(std::move(row));
  }
}

std::vector<TableColumn> MatrixColumns(const FailureMap& map, bool letters) {
  std::vector<TableColumn> columns = {{"row", "extreme"}};
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    columns.push_back({ColumnKey(c), letters ? MethodLetter(c) : map.rules.columns[c].label});
  }
  return columns;
}

Table LimitTable(const FailureMap& map) {
  Table table{
      .title = "Limits",
      .columns = {
          {"row", "extreme"}, {"right", "right ending"}, {"demands", "decides"}, {"why", "why"}}};
  for (const MapGroup& group : map.rules.groups) {
    for (const MapRow& row : group.rows) {
      std::vector<std::string> demands;
      for (const Demand& demand : row.decides) demands.push_back(ToText(demand));
      AddRow({row.label, fmt::format("{}", fmt::join(row.right, " or ")),
              fmt::format("{}", fmt::join(demands, "; ")), row.why},
             &table);
    }
  }
  return table;
}

// Cells with a reason to be read: all but those that hold.
Table DetailTable(const FailureMap& map) {
  Table table{.title = "Cells that do not hold",
              .columns = {{"row", "extreme"},
                          {"column", "method"},
                          {"class", "class"},
                          {"number", "number"},
                          {"count", "hold"},
                          {"reason", "why"}}};
  EachCell(map, [&table](const MapGroup&, const MapRow& row, const MapColumn& column,
                         const MapCell& cell) {
    if (cell.state == CellState::kHolds) return;
    AddRow({row.label, column.label, cell.word + (cell.demanded ? " (must hold)" : ""),
            DecidingNumber(cell), HoldingCount(cell), cell.reason},
           &table);
  });
  return table;
}

// Cells that hold with a run that trust does not let read "ok": each to be explained.
Table DoubtTable(const FailureMap& map) {
  Table table{
      .title = "Cells that hold, with runs in doubt",
      .columns = {
          {"row", "extreme"}, {"column", "method"}, {"count", "in doubt"}, {"doubts", "doubts"}}};
  EachCell(map, [&table](const MapGroup&, const MapRow& row, const MapColumn& column,
                         const MapCell& cell) {
    if (!HoldsInDoubt(cell)) return;
    AddRow(
        {row.label, column.label, fmt::format("{} of {}", cell.doubted, cell.holding), cell.doubts},
        &table);
  });
  return table;
}

}  // namespace

std::string CountDoubts(const FailureMap& map) {
  std::size_t holding = 0, doubted = 0;
  EachCell(map, [&](const MapGroup&, const MapRow&, const MapColumn&, const MapCell& cell) {
    holding += cell.state == CellState::kHolds ? 1 : 0;
    doubted += HoldsInDoubt(cell) ? 1 : 0;
  });
  return fmt::format("{} of {} cells that hold have runs in doubt", doubted, holding);
}

std::string CountCells(const FailureMap& map) {
  std::string text;
  std::size_t total = 0;
  for (const CellState state : kCellStates) {
    std::size_t count = 0;
    EachCell(map, [&](const MapGroup&, const MapRow&, const MapColumn&, const MapCell& cell) {
      count += cell.state == state ? 1 : 0;
    });
    total += count;
    if (count > 0) {
      text += fmt::format("{} {} {}", text.empty() ? "" : ",", count, ToString(state));
    }
  }
  return fmt::format("{} cells:{}", total, text);
}

Table MapTable(const FailureMap& map) {
  Table table;
  table.title = map.rules.title;
  table.columns = MatrixColumns(map, true);
  table.columns.push_back({"group", "group"});
  table.group = "group";
  table.colour = &MapColour;
  for (std::size_t g = 0; g < map.cells.size(); ++g) AddMapRows(map, g, TerminalCell, &table);
  for (std::size_t c = 0; c < map.rules.columns.size(); ++c) {
    table.notes.push_back(fmt::format("{}  {}", MethodLetter(c), map.rules.columns[c].label));
  }
  table.notes.push_back("");
  table.notes.push_back(CountCells(map));
  table.notes.push_back(CountDoubts(map));
  for (const std::string& remark : map.remarks) table.notes.push_back("note: " + remark);
  return table;
}

Table MapCellTable(const FailureMap& map) {
  Table table;
  for (const char* key :
       {"group", "row",       "column", "state",   "class",     "outcome", "measure",
        "value", "unit",      "limit",  "ratio",   "t_reached", "holding", "records",
        "cases", "must_hold", "reason", "case_id", "doubted",   "doubts"}) {
    table.columns.push_back({key, key, Format::kShortest});
  }
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  EachCell(map, [&](const MapGroup& group, const MapRow& row, const MapColumn& column,
                    const MapCell& cell) {
    const Judged& decided = cell.decided;
    AddRow({group.label,         row.label,
            column.label,        std::string(ToString(cell.state)),
            cell.word,           cell.outcome,
            decided.measure,     decided.value,
            decided.unit,        decided.limit,
            decided.ratio,       cell.t_reached,
            count(cell.holding), count(cell.records),
            count(cell.cases),   cell.demanded,
            cell.reason,         cell.case_id,
            count(cell.doubted), cell.doubts},
           &table);
  });
  return table;
}

std::string MapMarkdown(const FailureMap& map, const std::vector<std::string>& notes) {
  std::string page = fmt::format("# {}\n\n", EscapeMarkdown(map.rules.title));
  if (!map.rules.comment.empty()) page += EscapeMarkdownParagraph(map.rules.comment) + "\n\n";
  page += CountCells(map) + ". " + CountDoubts(map) + ".\n\n";
  for (const std::string& remark : map.remarks) {
    page += "Note: " + EscapeMarkdown(remark) + ".\n\n";
  }
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    Table table;
    table.title = map.rules.groups[g].label;
    table.columns = MatrixColumns(map, false);
    AddMapRows(
        map, g, [](const MapCell& cell) { return MapCellText(cell, ClassText(cell)); }, &table);
    page += ToMarkdown(table) + "\n";
  }
  page += ToMarkdown(LimitTable(map)) + "\n";
  Table details = DetailTable(map);
  if (!details.rows.empty()) page += ToMarkdown(details);
  Table doubts = DoubtTable(map);
  if (!doubts.rows.empty()) page += "\n" + ToMarkdown(doubts);
  for (const std::string& note : notes) page += "\n" + EscapeMarkdownParagraph(note) + "\n";
  return page;
}

}  // namespace loopbench::harness
