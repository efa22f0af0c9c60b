// Records of stores for the commands that show them, in memory or problem by problem, and files of
// tables and figures.
#include <sys/resource.h>
#include <unistd.h>

#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

using Write = std::function<void(std::string_view)>;

/// Omits the date in CSV.
std::vector<std::string> KeptNotes(std::vector<std::string> notes, const std::string& format) {
  if (format != "csv") return notes;
  std::erase_if(notes, [](const std::string& note) { return note.starts_with("date: "); });
  return notes;
}

void RefuseWhatNeedsAllRows(const TableCommand& command, const ProblemReader& reader) {
  const TableView& view = command.view;
  const bool is_flat = command.format == "csv" || command.format == "json";
  const std::string needs_all = !is_flat ? "for a table that people read: choose some with --where "
                                           "PARAMETER=..., or write all with --format csv"
                                : !view.sort.empty()       ? "with --sort"
                                : !view.group.empty()      ? "with --group"
                                : !command.gate.empty()    ? "with --fail-on"
                                : view.kind == "factorial" ? "with --kind factorial"
                                                           : "";
  if (needs_all.empty()) return;
  Reject("{}: found {} records of {:.1f} GB, expected at most {} that fit into memory {}{}",
         command.store.string(), reader.records(), 1e-9 * static_cast<double>(reader.bytes()),
         kMaxHeld, needs_all, is_flat ? ": choose some with --where" : "");
}

/// Writer of the rows of one table.
class ProblemRows {
 public:
  /// `samples`: a record of each set of keys.
  ProblemRows(const TableCommand& command, const std::vector<Record>& samples, Write write)
      : view_(command.view), is_json_(command.format == "json"), write_(std::move(write)) {
    RequireConditions("--where", view_.where, samples);
    view_.kind = KindOf(view_, samples);
    TableView all = view_;
    all.where.clear();
    columns_ = MakeTable(samples, all).columns;
  }

  void Add(const std::vector<Record>& records, const std::vector<std::string>& notes) {
    Table part{.columns = columns_, .rows = RowsOf(records, view_)};
    if (part.rows.empty()) return;
    if (is_json_) {
      part.notes = notes;
      const std::string text = ToJson(part);  // "[...]\n"
      write_(rows_ > 0 ? ",\n" : "[");
      write_(std::string_view(text).substr(1, text.size() - 3));
    } else {
      const std::string text = ToCsv(part);
      write_(std::string_view(text).substr(rows_ > 0 ? text.find('\n') + 1 : 0));
    }
    rows_ += part.rows.size();
  }
  void End(const std::vector<std::string>& notes) {
    if (is_json_) return write_("]\n");
    for (const std::string& note : notes) write_("# " + note + "\n");
  }
  std::size_t rows() const { return rows_; }

 private:
  TableView view_;
  bool is_json_;
  Write write_;
  std::vector<TableColumn> columns_;
  std::size_t rows_ = 0;
};

constexpr double kGrows = 4.0;  // memory of a record relative to its line, measured

/// True if records with `bytes` bytes of lines fit into free memory; 0: unknown.
bool Fit(std::uint64_t bytes, double free) {
  return free == 0.0 || kGrows * static_cast<double>(bytes) < 0.9 * free;
}

}  // namespace

int WriteLongTable(const TableCommand& command, const ProblemReader& reader,
                   const std::string& typed) {
  RefuseWhatNeedsAllRows(command, reader);
  const std::vector<std::string> notes = KeptNotes(Provenance(typed), command.format);
  std::vector<std::string> warnings;
  std::optional<OutputFile> file;
  if (!command.out.empty()) file.emplace(command.out);
  const auto write = [&file](std::string_view text) { file ? file->Write(text) : PrintText(text); };
  ProblemRows writer(command, reader.samples(), write);
  reader.ForEach(
      [&](std::vector<Record> records) {
        writer.Add(LatestWithWarnings(std::move(records)), notes);
      },
      &warnings);
  if (writer.rows() == 0) {  // an existing file stays unchanged
    PrintError("{}: no records match {}\n", command.store.string(), ToText(command.view.where));
    return 2;
  }
  writer.End(notes);
  if (file) {
    file->Finish();
    Print("wrote {}\n", command.out.string());
  }
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  return 0;
}

Loaded LoadOrScan(const std::filesystem::path& store, const Selection& where) {
  if (!IsLarge(StoreFile(store))) return {LoadRecords(store, where), {}};
  const double free = FreeMemory();
  struct TooMany {};
  if (ChoosesLines(where)) {
    try {
      return {LoadRecords(store, where,
                          [free](std::size_t records, std::uint64_t bytes) {
                            if (records > kMaxHeld || !Fit(bytes, free)) throw TooMany();
                          }),
              {}};
    } catch (const TooMany&) {
      // even the selection is too large
    }
  }
  ProblemReader reader(store, where);
  if (reader.records() > kMaxHeld || !Fit(reader.bytes(), free)) return {{}, std::move(reader)};
  return {LoadRecords(store, where), {}};
}

double FreeMemory(bool with_own) {
  double free = 0.0, pages = 0.0;
  std::ifstream info("/proc/meminfo");
  for (std::string word; info >> word;) {
    if (word == "MemAvailable:" && info >> free) break;
  }
  free *= 1024.0;
  rlimit allowed{};
  if (::getrlimit(RLIMIT_AS, &allowed) != 0 || allowed.rlim_cur == RLIM_INFINITY) return free;
  std::ifstream("/proc/self/statm") >> pages;
  const double own = with_own ? 0.0 : pages * static_cast<double>(::getpagesize());
  const double left = std::max(1.0, static_cast<double>(allowed.rlim_cur) - own);
  return free == 0.0 ? left : std::min(free, left);
}

int PrintJson(const JsonObject& document) {
  PrintText(document.Text() + "\n");
  return 0;
}

void EraseEmptyColumns(const std::vector<std::string>& keys, Table* table) {
  std::erase_if(table->columns, [&](const TableColumn& column) {
    return Contains(keys, column.key) && std::ranges::all_of(table->rows, [&](const Record& row) {
             return Cell(row, column).empty();
           });
  });
}

std::vector<Record> LatestWithWarnings(std::vector<Record> records) {
  records = LatestRecords(records, CodeVersion());
  SortRows(&records);  // the store has the order in which runs ended
  SetWarnings(&records);
  return records;
}

std::vector<Record> LoadRecords(const std::filesystem::path& store, const Selection& where,
                                const ReadWatch& watch) {
  const std::filesystem::path file = StoreFile(store);
  const double free = FreeMemory();
  const auto require = [&](const std::string& found, std::uint64_t bytes) {
    if (Fit(bytes, free)) return;
    Reject(
        "{}: found {}, which take some {:.1f} GB of memory, of which {:.1f} GB are free; expected "
        "fewer: choose some with --where PARAMETER=..., or write all with table --format csv",
        store.string(), found, kGrows * static_cast<double>(bytes) * 1e-9, free * 1e-9);
  };
  if (IsLarge(file) && !ChoosesLines(where)) {
    require("all its records", std::filesystem::file_size(file));
  }
  std::vector<std::string> warnings;
  const auto look = [&](std::size_t records, std::uint64_t bytes) {
    if (watch) watch(records, bytes);
    require(fmt::format("{} records and more", records), bytes);
  };
  std::vector<Record> records = LatestWithWarnings(ReadRecords(store, where, &warnings, look));
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  return records;
}

void Deliver(const std::string& text, const std::filesystem::path& out) {
  if (out.empty()) return PrintText(text);
  WriteFileAtomically(out, text);
  Print("wrote {}\n", out.string());
}

Table WithProvenance(Table table, const std::string& typed) {
  std::ranges::move(Provenance(typed), std::back_inserter(table.notes));
  return table;
}

std::string RenderKept(Table table, const std::string& format) {
  table.notes = KeptNotes(std::move(table.notes), format);
  return Render(table, format);
}

void WriteTables(const std::vector<Record>& records, const std::filesystem::path& store,
                 const std::string& typed) {
  const bool is_file = store.extension() == ".jsonl";
  for (const std::string kind : {"drift", "precision", "timing"}) {
    Table full = MakeTable(records, {.kind = kind});
    if (full.rows.empty()) continue;
    full = WithProvenance(std::move(full), typed);
    for (const auto& [format, ending] : {std::pair{"csv", ".csv"}, {"markdown", ".md"}}) {
      std::filesystem::path file = store;
      file = is_file ? file.replace_extension(kind + ending) : file / (kind + ending);
      WriteFileAtomically(file, RenderKept(full, format));
    }
    const Table compact = MakeTable(records, {.kind = kind, .compact = true});
    PrintText(ToScreen(compact) + "\n");
  }
  for (const std::string& note : Provenance(typed)) Print("{}\n", note);
}

int WarningGate(const std::vector<Record>& rows) {
  std::size_t runs = 0, failed = 0, flagged = 0;
  for (const Record& row : rows) {
    if (row.Text("kind") != "accuracy") continue;
    ++runs;
    failed += HasFailed(row) ? 1 : 0;
    flagged += HasWarning(row) ? 1 : 0;
  }
  if (runs == 0) {
    throw ConfigError(
        "--fail-on warnings: found no accuracy run, expected one: such a gate cannot fail");
  }
  if (failed + flagged == 0) return 0;
  PrintError("--fail-on warnings: of {} runs {} did not finish and {} have warnings\n", runs,
             failed, flagged);
  return 1;
}

}  // namespace loopbench::harness
