#include "harness/cli/long_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "harness/cli/report.h"
#include "harness/record/provenance.h"
#include "harness/store/result_store.h"
#include "harness/tables/table_view.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

using Write = std::function<void(std::string_view)>;

void RefuseWhatNeedsAllRows(const TableCommand& command, const SceneReader& reader) {
  const TableView& view = command.view;
  const std::string all =
      fmt::format("{}: found {} records", command.store.string(), reader.records());
  const bool is_flat = command.format == "csv" || command.format == "json";
  if (!is_flat) {
    throw ConfigError(fmt::format(
        "{}, expected at most {} for a table that people read: choose some with --where "
        "PARAMETER=..., or write all with --format csv",
        all, kMostHeld));
  }
  const std::string needs_all = !view.sort.empty()         ? "--sort"
                                : !view.group.empty()      ? "--group"
                                : !command.gate.empty()    ? "--gate"
                                : view.kind == "factorial" ? "--kind factorial"
                                                           : "";
  if (needs_all.empty()) return;
  throw ConfigError(fmt::format("{}, expected at most {} with {}: choose some with --where", all,
                                kMostHeld, needs_all));
}

/// Rows of one table, written as they come.
class RowWriter {
 public:
  RowWriter(const TableCommand& command, Write write)
      : view_(command.view), is_json_(command.format == "json"), write_(std::move(write)) {}

  void Add(const std::vector<Record>& records, const std::vector<std::string>& notes) {
    if (!columns_) Begin(records);
    if (!columns_) return;
    Table part{.columns = *columns_, .rows = RowsOf(records, view_)};
    if (part.rows.empty()) return;
    RequireKnownParameters(part);
    rows_ += part.rows.size();
    if (is_json_) {
      part.notes = notes;
      const std::string text = ToJson(part);  // "[...]\n"
      write_(has_rows_ ? ",\n" : "[");
      write_(std::string_view(text).substr(1, text.size() - 3));
    } else {
      const std::string text = ToCsv(part);
      write_(std::string_view(text).substr(has_rows_ ? text.find('\n') + 1 : 0));
    }
    has_rows_ = true;
  }
  void End(const std::vector<std::string>& notes) {
    if (!has_rows_) return;
    if (is_json_) return write_("]\n");
    for (const std::string& note : notes) write_("# " + note + "\n");
  }
  std::size_t rows() const { return rows_; }

 private:
  void Begin(const std::vector<Record>& records) {
    const Table table = MakeTable(records, view_);
    if (table.rows.empty()) return;
    view_.kind = KindOf(view_, records);
    columns_ = table.columns;
  }
  /// A key that was not there before is looked at: it may be a parameter, which has a column.
  void RequireKnownParameters(const Table& part) {
    if (!view_.columns.empty()) return;
    for (const Record& row : part.rows) {
      bool is_fresh = false;
      for (const auto& [key, value] : row.items()) is_fresh |= keys_.insert(key).second;
      if (!is_fresh) continue;
      for (const TableColumn& own : MakeTable({&row, 1}, {.kind = view_.kind}).columns) {
        if (std::ranges::find(*columns_, own.key, &TableColumn::key) != columns_->end()) continue;
        throw ConfigError(
            fmt::format("found \"{}\" in some scenes and not in the first ones: choose scenes of "
                        "one kind with --where experiment=..., or columns with --columns",
                        own.key));
      }
    }
  }

  TableView view_;
  bool is_json_, has_rows_ = false;
  Write write_;
  std::optional<std::vector<TableColumn>> columns_;
  std::unordered_set<std::string> keys_;  ///< of the rows so far
  std::size_t rows_ = 0;
};

}  // namespace

int WriteLongTable(const TableCommand& command, const SceneReader& reader,
                   const std::string& typed) {
  RefuseWhatNeedsAllRows(command, reader);
  std::vector<std::string> notes = Provenance(typed), warnings;
  if (command.format == "csv") {  // as RenderKept() does
    std::erase_if(notes, [](const std::string& note) { return note.starts_with("date: "); });
  }
  std::size_t rows = 0;
  const auto fill = [&](const Write& write) {
    RowWriter writer(command, write);
    reader.ForEach(
        [&](std::vector<Record> records) { writer.Add(Prepared(std::move(records)), notes); },
        &warnings);
    writer.End(notes);
    rows = writer.rows();
  };
  if (command.out.empty()) {
    fill([](std::string_view text) { PrintText(std::string(text)); });
  } else {
    WriteFileAtomically(command.out, fill);
    Print("wrote {}\n", command.out.string());
  }
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  if (rows > 0) return 0;
  PrintError("{}: no records match {}\n", command.store.string(), ToText(command.view.where));
  return 2;
}

Room::Room(std::filesystem::path store) : store_(std::move(store)) {
  std::ifstream info("/proc/meminfo");
  for (std::string word; info >> word;) {
    if (word == "MemAvailable:" && info >> free_) break;
  }
  free_ *= 1024.0;
}

void Room::Require(const std::string& found, std::uint64_t bytes) const {
  constexpr double kGrows = 4.0;  // a record in memory over its line, measured
  const double needed = kGrows * static_cast<double>(bytes);
  if (free_ == 0.0 || needed < 0.9 * free_) return;
  throw ConfigError(
      fmt::format("{}: found {}, which take some {:.1f} GB of memory, of which {:.1f} GB are free; "
                  "expected fewer: choose some with --where PARAMETER=..., or write all with table "
                  "--format csv",
                  store_.string(), found, needed * 1e-9, free_ * 1e-9));
}

std::optional<std::vector<Record>> LoadFew(const std::filesystem::path& store,
                                           const Selection& where) {
  struct TooMany {};
  if (!IsLarge(StoreFile(store))) return LoadRecords(store, where);
  if (!ChoosesLines(where) && SceneReader(store, where).records() > kMostHeld) return std::nullopt;
  try {
    return LoadRecords(store, where, [](std::size_t records, std::uint64_t) {
      if (records > kMostHeld) throw TooMany();
    });
  } catch (const TooMany&) {
    return std::nullopt;
  }
}

}  // namespace loopbench::harness
