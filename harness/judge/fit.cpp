#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "harness/base/text.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kNarrowestText = 24;  ///< [cells]: a few words; headings are not broken

bool IsSameInAllRows(const Table& table, const TableColumn& column) {
  if (table.rows.size() < 2) return false;
  const std::string first = Cell(table.rows.front(), column);
  return std::ranges::all_of(table.rows,
                             [&](const Record& row) { return Cell(row, column) == first; });
}

/// Column with its preferred and its smallest width [cells].
struct Fitting {
  std::size_t widest = 0, narrowest = 0;
  bool stays = true;
};

std::vector<Fitting> Fittings(const Table& table, const std::vector<TableColumn>& columns,
                              std::size_t width) {
  std::vector<Fitting> fittings;
  for (const TableColumn& column : columns) {
    Fitting& one = fittings.emplace_back();
    one.widest = one.narrowest = TextColumn(column, table.rows).width;
    if (column.format != Format::kText) continue;
    one.narrowest = std::max(CellsOf(EscapeTerminal(column.header)),
                             std::min({one.widest, kNarrowestText, width}));
  }
  return fittings;
}

/// Returns the total width including gaps.
std::size_t Taken(const std::vector<Fitting>& columns, std::size_t Fitting::*width) {
  std::size_t sum = 0;
  for (const Fitting& one : columns) {
    if (one.stays) sum += (sum > 0 ? kColumnGap : 0) + one.*width;
  }
  return sum;
}

}  // namespace

std::vector<std::size_t> OrderOfLeaving(const Table& table) {
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  const auto outcome = std::ranges::find(columns, "outcome", &TableColumn::key);
  const auto rank = [&](std::size_t place) {
    int importance = columns[place].importance;
    if (outcome != columns.end() && columns.begin() + static_cast<std::ptrdiff_t>(place) <= outcome)
      ++importance;
    if (columns[place].key == "outcome") ++importance;
    return std::pair(!IsSameInAllRows(table, columns[place]), importance);
  };
  std::vector<std::size_t> places(columns.empty() ? 0 : columns.size() - 1);
  std::iota(places.rbegin(), places.rend(), std::size_t{1});
  std::ranges::stable_sort(places, {}, rank);
  return places;
}

std::string DroppedColumnsNote(const Table& table, const std::vector<std::size_t>& places) {
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::vector<std::string> gone, same;
  std::vector<std::size_t> in_order = places;
  std::ranges::sort(in_order);
  for (const std::size_t place : in_order) {
    const TableColumn& column = columns[place];
    const std::string value = Cell(table.rows.front(), column);
    const bool is_same = !value.empty() && IsSameInAllRows(table, column);
    (is_same ? same : gone).push_back(is_same ? column.header + " " + value : column.header);
  }
  std::string text = fmt::format("{}", fmt::join(gone, "; "));
  if (!same.empty()) {
    text +=
        fmt::format("{}the same in all rows: {}", gone.empty() ? "" : "; ", fmt::join(same, "; "));
  }
  return text;
}

Table FitWidth(Table table, std::size_t width) {
  const std::vector<TableColumn> columns = ColumnsUnderHeading(table);
  std::vector<Fitting> fittings = Fittings(table, columns, width);
  if (width == 0 || Taken(fittings, &Fitting::widest) <= width) return table;
  std::vector<std::size_t> left;
  for (const std::size_t place : OrderOfLeaving(table)) {
    if (Taken(fittings, &Fitting::narrowest) <= width) break;
    fittings[place].stays = false;
    left.push_back(place);
  }
  if (!left.empty()) {
    table.notes.insert(table.notes.begin(),
                       fmt::format("left out for a width of {} (--wide shows all): {}", width,
                                   DroppedColumnsNote(table, left)));
  }
  std::size_t room = width - std::min(width, Taken(fittings, &Fitting::narrowest));
  table.columns.clear();
  for (std::size_t place = 0; place < columns.size(); ++place) {
    const Fitting& one = fittings[place];
    if (!one.stays) continue;
    const std::size_t more = std::min(room, one.widest - one.narrowest);
    room -= more;
    table.columns.push_back(columns[place]);
    if (one.narrowest + more < one.widest) table.columns.back().most_cells = one.narrowest + more;
  }
  return table;
}

std::string ToScreen(const Table& table) {
  const Screen screen = OutputScreen();
  return ToText(FitWidth(table, screen.width), screen.colour);
}

}  // namespace loopbench::harness
