// loopbench: the command line.

#include <CLI/CLI.hpp>

#include "harness/cli/commands.h"
#include "harness/cli/commands_schema.h"
#include "harness/cli/main_compare.h"
#include "harness/json/config_error.h"
#include "harness/record/provenance.h"
#include "harness/text/numeric_option.h"
#include "harness/text/terminal.h"

namespace {

using namespace loopbench::harness;

std::vector<Setting> ParseSettings(const std::vector<std::string>& texts) {
  std::vector<Setting> settings;
  for (const std::string& text : texts) settings.push_back(ParseSetting(text));
  return settings;
}

/// Repeatable, one value each: a second word would be the name of a file.
void AddSettings(CLI::App* app, std::vector<std::string>* settings) {
  app->add_option("--set", *settings, "Set a field before reading: /json/pointer=value")
      ->allow_extra_args(false);
}

CLI::Option* AddGate(CLI::App* app, std::string* gate) {
  return app
      ->add_option("--gate", *gate,
                   "doubts: exit with 1 if an accuracy run shown did not finish or has doubts")
      ->check(CLI::IsMember({"doubts"}));
}

/// Of work on a mechanism; experiments say their own ("limits").
void AddLimits(CLI::App* app, ProcessLimits* limits) {
  app->add_option("--cpu", limits->cpu_s, "CPU time for one mechanism file [s]")
      ->check(NumberFrom(0.001, 1e9))
      ->capture_default_str();
  app->add_option("--memory", limits->memory_mb, "Memory for one mechanism file [MiB]")
      ->check(NumberFrom(1.0, 1e9))
      ->capture_default_str();
}

Selection ParseSelection(const std::vector<std::string>& conditions) {
  Selection selection;
  for (const std::string& text : conditions) selection.push_back(ParseCondition(text));
  return selection;
}

constexpr const char* kFooter = R"(
Examples: (paths from the root of the repository)
  loopbench list configs/experiments/paper/paper.json
  loopbench plan configs/experiments/paper/paper.json --set /limits/cpu_s=5
  loopbench run configs/experiments/paper/paper.json --jobs 2 --filter mechanism=four-bar
  loopbench run big.json --shard 1/2 --out part1   (and 2/2 elsewhere)
  loopbench merge part1 part2 --out whole
  loopbench table results/runs/paper --where mechanism=four-bar,dead-centre --where rtol=1e-8
  loopbench plot results/runs/paper --out results/runs/paper/figures
  loopbench run configs/experiments/precision.json --precision-only --jobs 2
  loopbench verdict results/runs/paper --claims configs/experiments/paper/claims.json
  loopbench map results/runs/extremes --rules configs/experiments/extremes/map.json

Conditions are key=value or key=value,value; keys are the columns of drift.csv.
Exit codes: 0 done, 1 a gate failed, 2 could not measure or bad input.)";

constexpr const char* kTableFooter = R"(
Examples:
  loopbench table out --where rtol=1e-8 --group mechanism
  loopbench table out --columns mechanism,formulation,drift_position_max --format latex
  loopbench table out --kind timing --sort rhs_ns_median --format csv --out timing.csv

"ok?" is a run that finished with doubts: the lines below the table say why, column doubts has codes
(docs/design.md, section 6), --gate doubts ends with 1.
Any key of the records may be a column; a wrong one is answered with the list of all.
Every table ends with the command, machine, compiler, libraries and commit.)";

constexpr const char* kPlotFooter = R"(
Examples:
  loopbench plot out --out out/figures
  loopbench plot out --out work.svg --x rhs_evaluations --y drift_position_max --group formulation,coordinates
  loopbench plot out --out cost.pdf --where kind=timing --x bodies --y ns_per_body --group formulation

Without --x and --y: angles and displacements of the run that is trusted most (finished, at level
position, at the finest tolerance), drift with its fitted exponents, and of runs in several scalars
error and drift against tolerance. Runs that failed are crosses, doubtful ones dashed. A figure that
cannot be drawn is reported with its reason, and the exit code is 2 after all others are drawn.)";

constexpr const char* kMapFooter = R"(
Examples: (paths from the root of the repository)
  loopbench map results/runs/extremes --rules configs/experiments/extremes/map.json
  loopbench map out --rules map.json --out out --format pdf
  loopbench map out --rules map.json --gate        (1 if a cell that must hold does not)

Rules name methods (columns), extremes (rows) and what decides about a row:
  {"title": "Extremes",
   "columns": [{"label": "O-DCA, position",
                "select": {"formulation": "odca", "enforcement": "position"}}],
   "groups": [{"label": "singular positions", "rows": [
     {"label": "parallelogram, 1e-8", "select": {"mechanism": "parallelogram", "rtol": 1e-8},
      "decides": [{"measure": "branch_error_max", "limit": 500, "of": "rtol", "unit": "rad"}],
      "why": "...", "must_hold": "all"}]}]}
"limit", "at_least" or "equal" compare a key of the record with a number, or with that many times
another key ("of"). "right": ["locked"] says how a run should end if not as finished.
Of several records that match a cell the worst decides. A cell
  holds         ended as it should, all measures within their limits
  singular, ... stopped early with that reason; time-limit, ...: did not end by itself
  inaccurate    finished, with a measure beyond its limit or not finite
  crashed, ...  no result
  ?             not measured: no record, too few ("cases"), or one without the measure
  -             not applicable, with the rules' reason
docs/extremes.md explains them, docs/design.md (section 6) has all keys of the rules.)";

int Main(int argc, char** argv) {
  CLI::App app{
      "Measures constraint drift and time of three formulations of closed-loop multibody dynamics.",
      "loopbench"};
  app.footer(kFooter);
  app.set_version_flag("--version", VersionText);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    // CLI11 reports a misspelt subcommand only as a missing one: name it
    std::string text = CLI::FailureMessage::simple(failed, error);
    for (const std::string& word : failed->remaining()) text += "unknown: " + word + "\n";
    return EscapeTerminalLines(text);
  });
  std::vector<std::string> conditions, settings;
  ExperimentFiles files;

  RunCommand run;
  bool no_timing = false, timing_only = false, precision_only = false;
  CLI::App* run_app =
      app.add_subcommand("run", "Run experiments, or go on with them; write records and tables");
  run_app->add_option("experiment", run.experiments, "Experiment files (JSON)")->required();
  run_app->add_option("--out", run.out,
                      "Folder for results.jsonl, drift.csv and timing.csv "
                      "(default: results/runs/NAME)");
  run_app->add_option("--jobs", run.suite.jobs, "Accuracy cases at once; timings run alone")
      ->check(NumberFrom(1, 1024))
      ->capture_default_str();
  run_app->add_option("--filter", conditions, "Only accuracy cases with key=value[,value]");
  AddSettings(run_app, &settings);
  std::string shard = "1/1", rerun = "none";
  run_app->add_option("--shard", shard, "k/n: the k-th of n parts, to be merged later")
      ->capture_default_str();
  run_app->add_option("--rerun", rerun, "Cases to run although the store has them")
      ->check(CLI::IsMember({"none", "failed", "all"}))
      ->capture_default_str();
  CLI::Option* gate = AddGate(run_app, &run.gate);
  run_app->footer(
      "A run that was interrupted goes on where it stopped: give the same command again.");
  CLI::Option* no = run_app->add_flag("--no-timing", no_timing, "Leave the timings out");
  CLI::Option* timings =
      run_app->add_flag("--timing-only", timing_only, "Only the timings")->excludes(no);
  timings->excludes(gate);  // which judges accuracy runs
  run_app->add_flag("--precision-only", precision_only, "Only the runs in several scalars")
      ->excludes(no)
      ->excludes(timings)
      ->excludes(gate);

  CLI::App* list_app = app.add_subcommand("list", "Show the cases of experiments");
  list_app->add_option("experiment", files.paths, "Experiment files (JSON)")->required();
  list_app->add_option("--filter", conditions, "Only cases with key=value[,value]");
  AddSettings(list_app, &settings);

  CheckCommand check;
  CLI::App* check_app =
      app.add_subcommand("check",
                         "Read configuration files of any kind, report errors; assemble "
                         "the starts of mechanisms and scenes");
  check_app->add_option("file", files.paths, "Files (JSON)")->required();
  check.limits = kFileLimits;
  bool no_assembly = false;
  check_app->add_flag("--no-assembly", no_assembly, "Read only, assemble no start");
  AddLimits(check_app, &check.limits);
  AddSettings(check_app, &settings);

  PlanCommand plan;
  CLI::App* plan_app =
      app.add_subcommand("plan", "Count cases and runs, estimate how long they take");
  plan_app->add_option("experiment", files.paths, "Experiment files (JSON)")->required();
  plan_app->add_option("--from", plan.from, "Earlier results whose times are used, not a pilot's");
  plan_app->add_option("--filter", conditions, "Only cases with key=value[,value]");
  AddSettings(plan_app, &settings);

  CLI::App* explain_app = app.add_subcommand(
      "explain", "Say what experiments run and measure, and what mechanisms are made of");
  explain_app->add_option("file", files.paths, "Experiment or mechanism files (JSON)")->required();
  explain_app->add_option("--filter", conditions, "Only cases with key=value[,value]");
  ProcessLimits explain_limits = kFileLimits;
  AddLimits(explain_app, &explain_limits);
  AddSettings(explain_app, &settings);
  bool explain_all = false;
  explain_app->add_flag("--all", explain_all, "Every row of long tables of a mechanism");

  std::string schema_kind;
  bool schema_tables = false;
  CLI::App* schema_app = app.add_subcommand(
      "schema", "Print what files of a kind may hold, as JSON Schema (draft 07) for editors");
  schema_app->add_option("kind", schema_kind, "Of files")
      ->required()
      ->check(CLI::IsMember(SchemaKinds()));
  schema_app->add_flag("--tables", schema_tables, "Tables of keys in Markdown instead");

  MergeCommand merge;
  CLI::App* merge_app = app.add_subcommand("merge", "Put the stores of shards together");
  merge_app->add_option("store", merge.stores, "Folders of runs, or .jsonl files")->required();
  merge_app->add_option("--out", merge.out, "Folder of the new store")->required();

  TableCommand table;
  CLI::App* table_app = app.add_subcommand("table", "Print a table of stored records");
  table_app->add_option("store", table.store, "Folder of a run, or a .jsonl file")->required();
  table_app
      ->add_option("--kind", table.view.kind,
                   "What the rows are (default: drift, or what the store has)")
      ->check(CLI::IsMember({"drift", "precision", "timing", "factorial", "all"}));
  table_app->add_option("--format", table.format, "How they are written")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json", "latex"}))
      ->capture_default_str();
  table_app->add_option("--where", conditions, "Only records with key=value[,value]");
  table_app->add_option("--columns", table.view.columns, "Keys of records, in this order: a,b,c")
      ->delimiter(',');
  table_app->add_option("--group", table.view.group, "One table per value of this key");
  table_app->add_option("--sort", table.view.sort, "Order by this key first");
  table_app->add_flag("--descending", table.view.descending, "Largest first")->needs("--sort");
  table_app->add_option("--out", table.out, "File (default: the terminal)");
  AddGate(table_app, &table.gate);
  table_app->footer(kTableFooter);

  PlotCommand plot;
  CLI::App* plot_app = app.add_subcommand(
      "plot", "Draw the standard figures of stored records, or one value against another");
  plot_app->add_option("store", plot.store, "Folder of a run, or a .jsonl file")->required();
  plot_app
      ->add_option("--out", plot.out, "Folder for the figures; with --x and --y also a file's name")
      ->required();
  plot_app->add_option("--format", plot.format, "svg (default) or pdf")
      ->check(CLI::IsMember({"svg", "pdf"}));
  plot_app->add_option("--where", conditions, "Only records with key=value[,value]");
  plot_app->add_option("--x", plot.free.x, "Key of the horizontal axis");
  plot_app->add_option("--y", plot.free.y, "Key of the vertical axis");
  plot_app->add_option("--group", plot.free.group, "One curve per value of these keys: a,b");
  plot_app
      ->add_option("--log", plot.free.log,
                   "Logarithmic axes (default: those that span two decades)")
      ->check(CLI::IsMember({"x", "y", "xy", "none"}));
  plot_app->add_option("--title", plot.free.title, "Title (default: what the records share)");
  plot_app->footer(kPlotFooter);

  VerdictCommand verdict;
  CLI::App* verdict_app = app.add_subcommand("verdict", "Hold claims against stored records");
  verdict_app->add_option("store", verdict.store, "Folder of a run, or a .jsonl file")->required();
  verdict_app->add_option("--claims", verdict.claims, "Rules (JSON)")->required();
  verdict_app->add_option("--out", verdict.out, "Markdown file with all numbers");

  MapCommand map;
  CLI::App* map_app =
      app.add_subcommand("map", "Show which method survives which extreme, and the number why");
  map_app->add_option("store", map.store, "Folder of a run, or a .jsonl file")->required();
  map_app->add_option("--rules", map.rules, "Rows, columns and limits (JSON)")->required();
  map_app->add_option("--out", map.out, "Folder for failure-map.csv, .md and the picture");
  map_app->add_option("--format", map.format, "Of the picture")
      ->check(CLI::IsMember({"svg", "pdf"}))
      ->capture_default_str();
  map_app->add_flag("--gate", map.gate, "Exit with 1 if a cell that must hold does not");
  map_app->footer(kMapFooter);

  ComparisonOptions comparison(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    const std::string typed = CommandLine(argc, argv);
    run.suite.filter = table.view.where = plot.where = ParseSelection(conditions);
    run.suite.timing = !no_timing && !precision_only;
    run.suite.accuracy = !timing_only && !precision_only;
    run.suite.precision = !timing_only;
    run.settings = files.settings = ParseSettings(settings);
    run.suite.set = fmt::format("{}", fmt::join(settings, " "));
    files.filter = ParseSelection(conditions);
    run.suite.shard = ParseShard(shard);
    run.suite.rerun = rerun == "all"      ? Rerun::kAll
                      : rerun == "failed" ? Rerun::kFailed
                                          : Rerun::kNone;
    if (const auto code = comparison.Run(typed)) return *code;
    if (*run_app) return Run(run, typed);
    if (*list_app) return List(files);
    plan.files = files;
    if (*plan_app) return PrintPlans(plan);
    if (*explain_app) return Explain(files, explain_all, explain_limits);
    if (*schema_app) {
      PrintText(schema_tables ? TablesOfKinds({schema_kind}) : SchemaOfKind(schema_kind));
      return 0;
    }
    if (*merge_app) return Merge(merge);
    check.files = files;
    check.assembly = !no_assembly;
    if (*check_app) return CheckFiles(check);
    if (*table_app) return PrintTable(table, typed);
    if (*plot_app) return Plot(plot);
    if (*map_app) return PrintMap(map, typed);
    return PrintVerdicts(verdict, typed);
  } catch (const std::exception& error) {
    PrintError("{}\n", Lines{error.what()});
    return 2;
  }
}

}  // namespace

int main(int argc, char** argv) {
  PrepareStreams();
  return FinishOutput(Main(argc, argv));
}
