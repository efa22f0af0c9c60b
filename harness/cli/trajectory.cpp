// trajectory: output of a run over time, or an external trajectory checked against a mechanism.
#include "harness/base/json_document.h"
#include "harness/cli/commands.h"

namespace loopbench::harness {
namespace {

struct TrajectoryCommand {
  std::filesystem::path source, out, mechanism, ours, figure;
  Selection where;
  std::string format = "csv";
  std::vector<std::string> columns;
  int every = 1;

  std::vector<Option> Options() {
    return {{"source", "Folder of a run, or a trajectory (.csv)", &source, kRequired},
            WhereOption(&where),
            {"-o,--out", "Output folder; for a CSV source, output file", &out},
            {"--format", "Format of --out", &format, OneOf({"csv", "jsonl"}), Needs("--out")},
            {"--columns", "Only t and columns with these prefixes: a,b", &columns, kSplits},
            {"--every", "Only every N-th row", &every, From(1, 1e9), ShowsDefault(false),
             Needs("--out")},
            {"--mechanism", "Mechanism (JSON) to check a CSV trajectory against", &mechanism},
            {"--compare-with", "Trajectory to compare a CSV trajectory with", &ours,
             Excludes({"--out"})},
            {"--figure", "Figure of both trajectories and their difference: .svg, .pdf", &figure,
             Needs("--compare-with")},
            WideOption()};
  }
};

Value Maybe(const LargestAt& largest) { return largest.is_known ? Value(largest.value) : Value(); }
Value When(const LargestAt& largest) { return largest.is_known ? Value(largest.t) : Value(); }

std::vector<std::size_t> Chosen(const TrajectoryReader& reader, const TrajectoryCommand& command) {
  std::vector<std::size_t> chosen;
  const auto& columns = reader.columns();
  std::vector<bool> used(command.columns.size(), false);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    bool wanted = command.columns.empty() || i == reader.time();
    for (std::size_t k = 0; k < command.columns.size(); ++k) {
      if (!columns[i].Label().starts_with(command.columns[k])) continue;
      used[k] = wanted = true;
    }
    if (wanted) chosen.push_back(i);
  }
  const auto unused = std::ranges::find(used, false);
  if (unused == used.end()) return chosen;
  std::string known;
  for (const TrajectoryColumn& column : columns) known += "\n  " + column.Label();
  Reject("--columns: found \"{}\", expected the beginning of one of{}",
         command.columns[unused - used.begin()], known);
}

/// Copies files of any size row by row, with `notes` before the file's own notes.
int ExportOne(const std::filesystem::path& from, const std::filesystem::path& to,
              const TrajectoryCommand& command, std::vector<std::string> notes = {}) {
  TrajectoryReader reader(from);
  const std::vector<std::size_t> chosen = Chosen(reader, command);
  std::vector<TrajectoryColumn> columns;
  for (const std::size_t i : chosen) columns.push_back(reader.columns()[i]);
  const auto format =
      command.format == "jsonl" ? TrajectoryFormat::kJsonLines : TrajectoryFormat::kCsv;
  for (std::size_t i = 0; format == TrajectoryFormat::kJsonLines && i < columns.size(); ++i) {
    if (const std::string fault = EncodingFault(columns[i].Label()); !fault.empty()) {
      Reject<std::runtime_error>("{}: label {}, byte {}", from.string(), chosen[i] + 1,
                                 fault.substr(2));
    }
  }
  notes.insert(notes.end(), reader.notes().begin(), reader.notes().end());
  TrajectoryWriter writer(to, columns, notes, format);
  std::int64_t number = 0;
  for (std::vector<double> row, kept; reader.Next(&row);) {
    if (number++ % command.every != 0) continue;
    kept.clear();
    for (const std::size_t i : chosen) kept.push_back(row[i]);
    writer.Write(kept);
  }
  writer.Finish(reader.later_notes());
  Print("wrote {}: {} rows\n", to.string(), writer.rows());
  return 0;
}

/// Writes the trajectory of a case of `records` into --out.
void ExportCase(const Record& record, const std::vector<Record>& records,
                const std::filesystem::path& from, const TrajectoryCommand& command) {
  std::vector<std::string> words, notes;
  for (const char* key : {"mechanism", "formulation", "enforcement", "coordinates", "solver",
                          "integrator", "rtol", "step", "horizon"}) {
    words.push_back(record.Text(key));
  }
  for (const TableColumn& parameter : WithParameters({}, records)) {
    const std::string text = record.Text(parameter.key);
    if (parameter.key == "step" || text.empty()) continue;
    AddNote(notes, "{}: {}", parameter.key, text);
    AddNote(words, "{}-{}", parameter.key, text);
  }
  words.push_back(record.Text("config_hash"));
  std::erase(words, "");
  const std::string name = FileName(fmt::format("{}", fmt::join(words, "-")));
  ExportOne(from, command.out / (name + "." + command.format), command, notes);
}

int OfStore(const TrajectoryCommand& command, const std::string& typed) {
  std::vector<Record> records = LoadRecords(command.source, command.where);
  std::erase_if(records, [&](const Record& record) {
    return record.Text("trajectory").empty() || !Matches(record, command.where);
  });
  if (records.empty()) {
    Reject("{}: found no trajectory{}, expected records of an experiment with \"output\"",
           command.source.string(), command.where.empty() ? "" : " that meets --where");
  }
  const std::filesystem::path file = StoreFile(command.source);
  Table table;
  for (const char* key : {"mechanism", "formulation", "enforcement", "coordinates", "solver",
                          "rtol", "horizon", "outcome", "trajectory_rows", "trajectory_output",
                          "trajectory_interpolation_max", "trajectory_open", "trajectory"}) {
    table.columns.push_back(ColumnOf(key, records));
  }
  table.columns = TellingApart(WithParameters(std::move(table.columns), records), records);
  table.rows = records;
  int code = 0;
  for (const Record& record : records) {
    const std::filesystem::path from = TrajectoryOf(record, file);
    if (from.empty() || !std::filesystem::exists(from)) {
      PrintError("{}: missing; run --rerun all writes it\n",
                 (file.parent_path() / "trajectories" / record.Text("trajectory")).string());
      code = 2;
      continue;
    }
    try {
      VerifyTrajectory(record, from);
    } catch (const ChangedFile& changed) {
      PrintError("{}\n", changed.what());
      code = 2;
      continue;
    }
    if (!command.out.empty()) ExportCase(record, records, from, command);
  }
  if (command.out.empty()) {
    table.notes = {"files are in " + (file.parent_path() / "trajectories").string()};
    PrintText(ToScreen(WithProvenance(std::move(table), typed)) + "\n");
  }
  return code;
}

/// Returns the first labels, separated by commas.
std::string FirstOf(const std::vector<std::string>& labels) {
  constexpr std::size_t kMaxNamed = 6;
  return fmt::format("{}{}", fmt::join(labels | std::views::take(kMaxNamed), ", "),
                     labels.size() > kMaxNamed ? ", ..." : "");
}

void PrintCheck(const TrajectoryCommand& command, const std::string& typed) {
  const MechanismDescription user = ReadMechanism(command.mechanism).description;
  const TrajectoryCheck check = CheckTrajectory(command.source, user);
  Table table{
      .title = fmt::format("{} against {}: {} rows, {:g} s to {:g} s, by {}{}",
                           command.source.string(), user.name, check.rows, check.from, check.to,
                           check.source, check.has_speeds ? "" : ", without speeds"),
      .columns =
          Columns("joint, shift=mismatch [m]:scientific, shift_t=at [s]:seconds, rotation=rotation "
                  "[rad]:scientific, velocity=speed [m/s]:scientific, angular_velocity=turning "
                  "[rad/s]:scientific, coordinates=coordinates off:scientific")};
  for (const JointCheck& joint : check.joints) {
    AddRow({joint.joint, Maybe(joint.shift), When(joint.shift), Maybe(joint.rotation),
            Maybe(joint.velocity), Maybe(joint.angular_velocity), Maybe(joint.coordinates)},
           &table);
  }
  table.notes.push_back(
      check.no_energy.empty()
          ? fmt::format("energy: changes by {:.3e} J at most, at {:g} s; kinetic up to {:.3e} J",
                        check.energy.value, check.energy.t, check.kinetic)
          : "energy: not checked: " + check.no_energy);
  for (const auto& [label, apart] : check.energies) {
    if (!apart.is_known) continue;
    AddNote(table.notes, "{}: differs from the mechanism by {:.3e} J at most, at {:g} s", label,
            apart.value, apart.t);
  }
  if (!check.speeds.empty()) {
    const auto worst = std::ranges::max_element(
        check.speeds, {}, [](const ColumnCheck& speed) { return speed.apart.value; });
    AddNote(table.notes, "speeds: at most {:.3e} from the differences of positions, {} at {:g} s",
            worst->apart.value, worst->label, worst->apart.t);
  }
  if (!check.unchecked.empty()) {
    AddNote(table.notes, "{} not checked: {}", WithCount(check.unchecked.size(), "column"),
            FirstOf(check.unchecked));
  }
  for (const std::string& label : check.unknown) {
    table.notes.push_back("not of this mechanism, passed over: " + label);
  }
  PrintText(ToScreen(WithProvenance(std::move(table), typed)) + "\n");
}

/// Returns true for positions and speeds, which every row has. Forces and work may be unknown.
bool IsMotion(const std::string& label) {
  return label.starts_with("joint:") || label.starts_with("body:") || label.starts_with("point:");
}

/// Throws if `number`, interpolated from `column` from time `from` on, is not finite. Names the
/// line of the first such cell.
void RequireFinite(double number, const std::filesystem::path& file, std::size_t column,
                   double from) {
  if (std::isfinite(number)) return;
  TrajectoryReader reader(file);
  for (std::vector<double> row; reader.Next(&row);) {
    if (row[reader.time()] >= from) reader.RequireNumbers(row, std::array{column});
  }
  Reject<std::runtime_error>("{}: found {} between rows after t = {}, expected a finite number",
                             file.string(), number, from);
}

/// Names the columns of a trajectory whose indices are not in `compared`, for example those of
/// another unit.
void NoteOthers(const Trajectory& trajectory, const std::filesystem::path& path,
                const std::set<std::size_t>& compared, std::vector<std::string>& notes) {
  std::vector<std::string> labels;
  for (std::size_t i = 0; i < trajectory.columns.size(); ++i) {
    const TrajectoryColumn& column = trajectory.columns[i];
    if (i == trajectory.time || compared.contains(i)) continue;
    labels.push_back(column.kind.empty() ? column.component : column.Label());
  }
  if (labels.empty()) return;
  AddNote(notes, "{} of {} not compared: {}", WithCount(labels.size(), "column"), path.string(),
          FirstOf(labels));
}

int LayBeside(const TrajectoryCommand& command, const std::string& typed) {
  const Trajectory ours = ReadTrajectory(command.ours), theirs = ReadTrajectory(command.source);
  std::vector<SharedColumn> shared = SharedColumns(ours, theirs);
  std::set<std::size_t> in_ours, in_theirs;
  for (const SharedColumn& column : shared) {
    in_ours.insert(column.in_ours);
    in_theirs.insert(column.in_theirs);
  }
  std::erase_if(shared, [&](const SharedColumn& column) {
    return !command.columns.empty() &&
           std::ranges::none_of(command.columns, [&](const std::string& start) {
             return column.label.starts_with(start);
           });
  });
  if (shared.empty()) {
    Reject("{} and {}: found no column that both have, expected one{}", command.ours.string(),
           command.source.string(), command.columns.empty() ? "" : " of --columns");
  }
  Table table{.title = fmt::format("{} less {}", command.source.string(), command.ours.string()),
              .columns = Columns("column, largest=largest difference:scientific, t=at [s]:seconds, "
                                 "compared=rows:integer")};
  std::size_t most = 0, between = 0;
  for (std::size_t row = 0; row < theirs.rows(); ++row) {
    bool is_between = false;
    ValueAt(ours, ours.time, theirs.At(row, theirs.time), &is_between);
    between += is_between ? 1 : 0;
  }
  std::vector<std::string> whole_turns;
  for (const SharedColumn& column : shared) {
    LargestAt largest, turns;
    std::size_t compared = 0;
    const std::vector<double> apart = Differences(ours, theirs, column);
    for (std::size_t row = 0; row < apart.size(); ++row) {
      const double t = theirs.At(row, theirs.time), number = theirs.At(row, column.in_theirs);
      if (std::isnan(ValueAt(ours, ours.time, t))) continue;  // outside its times
      const double own = ValueAt(ours, column.in_ours, t);
      if (!IsMotion(column.label) && std::isnan(number) && std::isnan(own)) continue;
      RequireFinite(number, command.source, column.in_theirs, t);
      RequireFinite(own, command.ours, column.in_ours, FirstTimeFor(ours, t));
      ++compared;
      largest.Add(std::abs(apart[row]), t);
      if (column.unit == "rad") {
        turns.Add(std::round(std::abs(number - own - apart[row]) / (2 * std::numbers::pi)), t);
      }
    }
    if (turns.value > 0.0) {
      whole_turns.push_back(fmt::format("{}: besides, {:g} whole turns at {:g} s", column.label,
                                        turns.value, turns.t));
    }
    most = std::max(most, compared);
    AddRow({column.label, Maybe(largest), When(largest), compared}, &table);
  }
  if (most == 0) {
    Reject<std::runtime_error>("{}: found no row to compare, expected times of {}",
                               command.source.string(), command.ours.string());
  }
  if (most < theirs.rows()) {
    AddNote(table.notes, "{} of {} rows are not compared: {} has no such times",
            theirs.rows() - most, theirs.rows(), command.ours.string());
  }
  NoteOthers(ours, command.ours, in_ours, table.notes);
  NoteOthers(theirs, command.source, in_theirs, table.notes);
  if (between > 0) {
    AddNote(
        table.notes,
        "{} of {} rows are compared with cubics through the rows of {}, which has no such times",
        between, theirs.rows(), command.ours.string());
  }
  std::ranges::move(whole_turns, std::back_inserter(table.notes));
  PrintText(ToScreen(WithProvenance(std::move(table), typed)) + "\n");
  if (command.figure.empty()) return 0;
  // one axis has one unit
  std::vector<SharedColumn> drawn;
  constexpr std::size_t kMost = 4;
  for (const SharedColumn& column : shared) {
    if (column.unit == shared.front().unit && drawn.size() < kMost) drawn.push_back(column);
  }
  const std::string title = fmt::format("first: {}, second: {}", command.source.filename().string(),
                                        command.ours.filename().string());
  const auto fault = WriteFigure(command.figure, TrajectoryFigure(ours, theirs, drawn, title));
  if (fault) Reject<std::runtime_error>("{}: {}", command.figure.string(), *fault);
  Print("wrote {}: {} of {} columns\n", command.figure.string(), drawn.size(), shared.size());
  return 0;
}

int ShowTrajectories(const TrajectoryCommand& command, const Typed& typed) {
  const bool is_store = command.source.extension() != ".csv";
  if (!command.columns.empty() && command.out.empty() && command.ours.empty()) {
    throw ConfigError("--columns: found neither --out nor --compare-with, expected one of them");
  }
  if (!is_store && !command.where.empty()) {
    Reject("--where: found a trajectory, '{}', expected the folder of a run",
           command.source.string());
  }
  if (is_store) {
    if (command.mechanism.empty() && command.ours.empty()) return OfStore(command, typed.line);
    Reject("{}: found a store beside --mechanism or --compare-with, expected a trajectory (.csv)",
           command.source.string());
  }
  if (!command.mechanism.empty()) PrintCheck(command, typed.line);
  if (!command.ours.empty()) return LayBeside(command, typed.line);
  if (!command.out.empty()) return ExportOne(command.source, command.out, command);
  if (!command.mechanism.empty()) return 0;
  TrajectoryReader reader(command.source);
  std::int64_t rows = 0;
  for (std::vector<double> row; reader.Next(&row);) ++rows;
  Print("{}: {} rows of\n", command.source.string(), rows);
  for (const TrajectoryColumn& column : reader.columns()) {
    Print("  {}\n", column.kind.empty() ? column.component : column.Label());
  }
  return 0;
}

}  // namespace

void AddTrajectory(Commands& commands) {
  commands.Add("trajectory", "List, write and check trajectories of runs or other programs",
               ShowTrajectories);
}

}  // namespace loopbench::harness
