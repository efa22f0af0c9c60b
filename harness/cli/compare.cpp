// compare, fit and export: finished measurements.
#include "harness/cli/commands.h"

namespace loopbench::harness {
namespace {

const std::string kMeasurements = "Folder of a run, a .jsonl file, or JSON of Google Benchmark";

struct FitCommand {
  std::filesystem::path file, out;
  std::string format = "text";
  double from = 0.0;

  std::vector<Option> Options() {
    return {{"file", "JSON of Google Benchmark, or a result store with timings of families", &file,
             kRequired},
            {"--min-size", "Leave out sizes below [bodies]", &from, From(0.0, 1e9)},
            FormatOption(&format, {"text", "csv", "markdown"}),
            OutOption(&out),
            WideOption()};
  }
};

struct ExportCommand {
  std::filesystem::path file, out;
  std::string format = "customSmallerIsBetter";

  std::vector<Option> Options() {
    return {{"file", kMeasurements, &file, kRequired},
            FormatOption(&format, {"customSmallerIsBetter", "bmf"},
                         "Output format: github-action-benchmark or Bencher"),
            OutOption(&out)};
  }
};

struct CompareCommand {
  std::vector<std::filesystem::path> files;  ///< BASE and NEW, or NEW alone with a history
  std::filesystem::path base = {}, fresh = {}, history = {}, markdown = {}, junit = {};
  std::string branch = {}, format = "text";
  CompareOptions options = {};
  Selection where = {};
  bool json = false;

  std::vector<Option> Options() {
    return {
        {"base", kMeasurements + "; omit BASE with --history or --branch", &files, kRequired,
         Most(2)},
        {"--history", "Take the last good state of this history as BASE", &history},
        {"--branch", "Last good state of a history on this git branch", &branch,
         Excludes({"--history"})},
        {"--markdown", "Write a summary for a pull request to this file too", &markdown},
        {"--junit", "Write JUnit XML for a CI server to this file too", &junit},
        {"--only", "Only this group (repeatable)", &options.only, OneOf(GroupNames())},
        {"--where", "Only records of both with key=value[,value] (or !=, <, <=, >, >=)", &where},
        {"--match",
         "KEY[,KEY]: keys by which cases are matched (default: all keys, and equal mechanisms and "
         "limits)",
         &options.match, kSplits},
        {"--allow-missing", "NEW may lack cases of BASE", &options.subset},
        {"--added", "NEW may have cases that BASE lacks (always with a history)", &options.added},
        {"--error-ratio", "Allowed on the same build", &options.error_ratio, From(1.0, 1e9)},
        FormatOption(&format, {"text", "csv", "markdown"}, "Output format (csv: all measures)"),
        WideOption(),
        JsonOption(&json)};
  }
};

/// Returns the numbers of compared values with each judgement, by groups of measures.
Table SummaryTable(const ComparisonReport& comparison) {
  Table table{.title = "Compared",
              .columns = Columns("group, same:integer, better:integer, worse:integer, "
                                 "different:integer, not_measured=not measured:integer")};
  for (const std::string& group : GroupNames()) {
    const auto is_in_group = [&group](const Finding& finding) {
      return GroupOf(finding.measure.rule) == group;
    };
    if (std::ranges::none_of(comparison.findings, is_in_group)) continue;
    const auto count = [&](Judgement judgement) { return comparison.Count(judgement, group); };
    AddRow({group, count(Judgement::kSame), count(Judgement::kBetter), count(Judgement::kWorse),
            count(Judgement::kDifferent), count(Judgement::kNotMeasured)},
           &table);
  }
  return table;
}

/// Returns red for judgements that make the comparison fail.
std::string JudgementColour(const Record& row, const TableColumn& column) {
  if (column.key != "judgement") return "";
  const std::string judgement = row.Text("judgement");
  if (judgement == ToString(Judgement::kBetter)) return "32";
  return judgement == ToString(Judgement::kSame) ? "" : "31";
}

Table FindingTable(const ComparisonReport& comparison, bool with_same) {
  Table table;
  table.colour = &JudgementColour;
  table.title = with_same ? "All measures" : "Changes";
  table.columns = Columns("judgement, case, measure, base, new, ratio:seconds, why");
  // regressions first: the most important result
  std::vector order = {Judgement::kWorse, Judgement::kDifferent, Judgement::kBetter};
  if (with_same) order.insert(order.end(), {Judgement::kNotMeasured, Judgement::kSame});
  for (const Judgement judgement : order) {
    for (const Finding& finding : comparison.findings) {
      if (finding.judgement != judgement) continue;
      const auto& [key, unit] = std::pair(finding.measure.key, finding.measure.heading.unit);
      AddRow({judgement, finding.one,
              unit.empty() ? std::string(key) : fmt::format("{} [{}]", key, unit), finding.base,
              finding.fresh, std::isfinite(finding.ratio) ? Value(finding.ratio) : Value(),
              finding.why},
             &table);
    }
  }
  return table;
}

/// Returns "12 hashes not measured: another compiler, ..." for each reason.
std::vector<std::string> ReasonNotes(const ComparisonReport& comparison) {
  std::vector<std::string> all, reasons;
  for (const Finding& finding : comparison.findings) {
    if (finding.judgement != Judgement::kNotMeasured) continue;
    AddNote(all, "{} not measured: {}", GroupOf(finding.measure.rule), finding.why);
    AddOnce(reasons, all.back());
  }
  return Mapped<std::string>(reasons, [&all](const std::string& reason) {
    return fmt::format("{} {}", std::ranges::count(all, reason), reason);
  });
}

void NoteCases(const std::string& what, const std::vector<std::string>& cases,
               std::vector<std::string>& notes) {
  if (cases.empty()) return;
  constexpr std::size_t kMaxNamed = 20;
  const bool all = cases.size() <= kMaxNamed;
  AddNote(notes, "{} {}{}", WithCount(cases.size(), "case"), what,
          all ? ":" : fmt::format(" (--format csv names all), the first {}:", kMaxNamed));
  for (const std::string& one : cases | std::views::take(kMaxNamed)) notes.push_back("  " + one);
}

/// Adds the origin of the records of one side; if one file has several origins, all are named.
void NoteOrigins(const std::string& side, const std::vector<Record>& records,
                 std::vector<std::string>& notes) {
  std::set<std::string> lines;
  for (const Record& record : records) {
    const Origin origin = OriginOf(record);
    std::vector<std::string> parts = {origin.machine, origin.compiler, origin.flags};
    if (!origin.commit.empty()) parts.insert(parts.begin(), "commit " + origin.commit);
    if (!origin.libm.empty()) parts.push_back("libm " + origin.libm);
    std::erase(parts, "");
    const bool is_known = !origin.machine.empty() || !origin.compiler.empty();
    lines.insert(side + ": " +
                 (is_known ? fmt::format("{}", fmt::join(parts, ", ")) : "origin not recorded"));
  }
  notes.insert(notes.end(), lines.begin(), lines.end());
}

/// Adds a note if one run is as a whole faster or slower, as by a changed speed of the machine.
void NoteCommonShift(const ComparisonReport& comparison, std::vector<std::string>& notes) {
  std::vector<double> ratios;
  for (const Finding& finding : comparison.findings) {
    if (finding.measure.rule == Rule::kTime && std::isfinite(finding.ratio)) {
      ratios.push_back(finding.ratio);
    }
  }
  constexpr std::size_t kMany = 5;
  constexpr double kShift = 0.01;  // half of the smallest reported effect
  const double shift = Median(ratios);
  if (ratios.size() < kMany || !(std::abs(shift - 1.0) > kShift)) return;
  AddNote(notes,
          "all times: median ratio {:.3f}; unless everything changed, the machine's speed did: "
          "repeat the run before believing single times",
          shift);
}

std::string Conclusion(const ComparisonReport& comparison, const CompareOptions& options) {
  const int code = comparison.ExitCode(options);
  const int worse = comparison.Count(Judgement::kWorse);
  const int different = comparison.Count(Judgement::kDifferent);
  if (code == 1 && worse == 0) return "DIFFERENT: " + WithCount(different, "measure");
  if (code == 1) {
    return "REGRESSION: " + WithCount(worse, "measure") +
           (different == 0 ? "" : fmt::format(", {} more different", different));
  }
  if (code == 2) return "INCONCLUSIVE: " + comparison.Obstacle(options);
  const int better = comparison.Count(Judgement::kBetter);
  const int undecided = comparison.Count(Judgement::kNotMeasured, "times");
  return (better > 0 ? "BETTER: " + WithCount(better, "measure") + ", none worse" : "NO CHANGE") +
         (undecided > 0 ? "; " + WithCount(undecided, "time") + " not compared" : "");
}

/// Filters the records of both sides. Rejects a key that neither side has.
void Choose(const Selection& where, const std::vector<std::string>& match,
            std::vector<Record>& base, std::vector<Record>& fresh) {
  std::vector<Record> both = base;
  both.insert(both.end(), fresh.begin(), fresh.end());
  for (const std::string& key : match) RequireKey("--match", key, both);
  if (where.empty()) return;
  RequireConditions("--where", where, both);
  base = Filter(base, where);
  fresh = Filter(fresh, where);
}

/// Returns the file of measurements in a folder or file.
std::filesystem::path FileOf(const std::filesystem::path& path) {
  return std::filesystem::is_directory(path) ? StoreFile(path) : path;
}

/// Returns the named base, or the last good state of the history with its description in `name`.
std::vector<Record> LoadBase(const CompareCommand& command, const std::vector<Record>& fresh,
                             std::string* name) {
  if (command.history.empty() && command.branch.empty()) {
    const std::filesystem::path base = FileOf(command.base);
    std::error_code none;
    if (std::filesystem::equivalent(base, FileOf(command.fresh), none)) {
      Reject("compare: found '{}' as BASE and as NEW, expected two files", base.string());
    }
    return LoadMeasurements(command.base);
  }
  const std::string machine = fresh.empty() ? "" : OriginOf(fresh.front()).machine;
  const bool only_times = command.options.only == std::vector<std::string>{"times"};
  return LastGoodRecords({command.history, command.branch}, machine, only_times, name);
}

JsonObject ComparisonDocument(const ComparisonReport& comparison, const CompareOptions& options,
                              const std::vector<std::string>& notes) {
  std::vector<JsonObject> findings =
      Mapped<JsonObject>(comparison.findings, [](const Finding& finding) {
        return JsonOf("judgement", finding.judgement, "case", finding.one, "measure",
                      finding.measure.key, "unit", finding.measure.heading.unit, "base",
                      finding.base, "new", finding.fresh, "ratio", finding.ratio, "why",
                      finding.why);
      });
  return JsonOf("conclusion", Conclusion(comparison, options), "exit_code",
                comparison.ExitCode(options), "groups", ObjectsOf(SummaryTable(comparison).rows),
                "findings", findings, "only_in_base", comparison.only_base, "only_in_new",
                comparison.only_fresh, "more_than_once", comparison.ambiguous, "other_config_hash",
                comparison.other_content, "other_settings", comparison.other_settings, "notes",
                notes);
}

/// Returns 2 if no exponent could be fitted.
int PrintFits(const FitCommand& command, const Typed& typed) {
  const std::vector<Record> benchmarks = LoadMeasurements(command.file);
  Table table{
      .title = "Time over size: ns = c bodies^exponent",
      .columns = Columns("family, sizes:integer, bodies_min=bodies from:integer, "
                         "bodies_max=to:integer, exponent:exponent, standard_error=std. "
                         "error:exponent, slope_min=local min:exponent, slope_max=local "
                         "max:exponent, ns_per_body=ns per body at largest:fixed, failed:integer")};
  table.rows = FitFamilies(benchmarks, command.from);
  if (table.rows.empty()) {
    Reject("{}: no family of right-hand sides with two sizes or more", command.file.string());
  }
  if (command.format != "text" || !command.out.empty()) {
    NoteOrigins("measured", benchmarks, table.notes);
    if (const double load = benchmarks.front().Number("load_average"); std::isfinite(load)) {
      AddNote(table.notes, "load average of the minute before: {:.1f}", load);
    }
    AddNote(table.notes, "command: {}", typed.line);
  }
  const bool on_screen = command.format == "text" && command.out.empty();
  Deliver(on_screen ? ToScreen(table) : Render(table, command.format), command.out);
  const auto is_fitted = [](const Record& row) { return row.Find("exponent") != nullptr; };
  return std::ranges::any_of(table.rows, is_fitted) ? 0 : 2;
}

/// Returns 1 if values were omitted, each named on standard error; 2 if nothing is left.
int ExportMeasurements(const ExportCommand& command, const Typed&) {
  std::vector<std::string> torn;
  auto [values, left_out] = TrackRecords(ReadMeasurements(command.file, &torn));
  left_out.insert(left_out.end(), torn.begin(), torn.end());
  for (const std::string& line : left_out) {
    PrintError("{}: not exported: {}\n", command.file.string(), line);
  }
  if (values.empty()) {
    PrintError("{}: nothing to export: no record that finished has a measure\n",
               command.file.string());
    return 2;
  }
  Deliver(command.format == "bmf" ? ToBencherMetricFormat(values) : ToCustomSmallerIsBetter(values),
          command.out);
  return left_out.empty() ? 0 : 1;
}

int ShowComparison(const CompareCommand& command, const Typed& typed) {
  std::vector<Record> fresh = LoadMeasurements(command.fresh);
  std::string base_name;
  std::vector<Record> base = LoadBase(command, fresh, &base_name);
  Choose(command.where, command.options.match, base, fresh);
  ShareContents(&base, &fresh);
  CompareOptions options = command.options;
  options.added |= !base_name.empty();  // a history grows and loses nothing
  const ComparisonReport comparison = Compare(base, fresh, options);
  const int code = comparison.ExitCode(options);

  std::vector<std::string> origins;
  NoteCommonShift(comparison, origins);
  NoteOrigins("BASE", base, origins);
  NoteOrigins("NEW", fresh, origins);
  std::vector<std::string> notes;
  if (!base_name.empty()) notes.push_back(base_name);
  notes.insert(notes.end(), origins.begin(), origins.end());
  if (!command.markdown.empty() && command.markdown == command.junit) {
    Reject("--markdown and --junit: found \"{}\" twice, expected two files",
           command.junit.string());
  }
  if (!command.markdown.empty()) {
    WriteFileAtomically(command.markdown,
                        ComparisonMarkdown(comparison, Conclusion(comparison, options), notes));
  }
  if (!command.junit.empty()) {
    WriteFileAtomically(command.junit, ComparisonJunit(comparison, options));
  }
  if (command.json) {
    PrintJson(ComparisonDocument(comparison, options, notes));
    return code;
  }
  notes = ReasonNotes(comparison);
  if (!base_name.empty()) notes.push_back(base_name);
  NoteCases("only in BASE", comparison.only_base, notes);
  NoteCases("only in NEW", comparison.only_fresh, notes);
  NoteCases("there more than once, not compared", comparison.ambiguous, notes);
  NoteCases("that ran another mechanism, limits or ensemble under equal keys, not compared",
            comparison.other_content, notes);
  NoteCases("compared although they ran with other settings", comparison.other_settings, notes);
  notes.insert(notes.end(), origins.begin(), origins.end());
  Table findings = FindingTable(comparison, command.format == "csv");
  if (command.format == "csv") {
    for (const auto& [judgement, cases] : {std::pair{"only in BASE", comparison.only_base},
                                           {"only in NEW", comparison.only_fresh},
                                           {"more than once", comparison.ambiguous},
                                           {"other content", comparison.other_content}}) {
      for (const std::string& one : cases) AddRow({judgement, one}, &findings);
    }
    PrintText(ToCsv(findings));
    PrintError("{}\n", Conclusion(comparison, options));
    return code;
  }
  if (command.format == "markdown") AddNote(notes, "command: {}", typed.line);
  const auto print = [&](const Table& table) {
    PrintText((command.format == "text" ? ToScreen(table) : ToMarkdown(table)) + "\n");
  };
  if (!findings.rows.empty()) print(findings);
  Table summary = SummaryTable(comparison);
  summary.notes = notes;
  print(summary);
  Print("{}\n", Conclusion(comparison, options));
  return code;
}

int PrintTypedComparison(CompareCommand& command, const Typed& typed) {
  const bool has_history = !command.history.empty() || !command.branch.empty();
  if (command.files.size() != (has_history ? 1u : 2u)) {
    throw ConfigError(has_history
                          ? "compare: found BASE beside a history, expected NEW alone"
                          : "compare: found NEW missing, expected BASE NEW, or NEW and --history");
  }
  command.fresh = command.files.back();
  if (!has_history) command.base = command.files.front();
  return ShowComparison(command, typed);
}

}  // namespace

std::vector<Record> LoadMeasurements(const std::filesystem::path& path) {
  std::vector<std::string> warnings;
  std::vector<Record> records = ReadMeasurements(path, &warnings);
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  VerifyFilesOf(records, FileOf(path));
  return records;
}

int PrintComparison(const std::filesystem::path& base, const std::filesystem::path& fresh,
                    const Typed& typed) {
  return ShowComparison({.files = {}, .base = base, .fresh = fresh}, typed);
}

void AddComparison(Commands& commands) {
  commands.Add("compare", "Compare results with a baseline and report regressions",
               PrintTypedComparison);
  commands.Add("fit-scaling", "Fit scaling exponents of right-hand sides against mechanism size",
               PrintFits);
  commands.Add("export-metrics", "Write measurements for a benchmark tracker", ExportMeasurements);
}

}  // namespace loopbench::harness
