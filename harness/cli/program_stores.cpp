#include "harness/cli/program_stores.h"

#include "harness/cli/options.h"
#include "harness/cli/report.h"
#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

constexpr const char* kTableFooter = R"(
Examples:
  loopbench table out --where rtol=1e-8 --group mechanism
  loopbench table out --where 'wall_s<0.02' --where 'drift_position_max<=1e-9'
  loopbench table out --columns mechanism,formulation,drift_position_max --format latex
  loopbench table out --kind timing --sort rhs_ns_median --format csv --out timing.csv

"ok?" is a run that finished with doubts: the lines below the table say why, column doubts has codes
(docs/reference/outcomes-and-warnings.md), --gate doubts exits with status 1.
Any key of the records may be a column; a wrong one is answered with the list of all.
Every table ends with the command, machine, compiler, libraries and commit.)";

constexpr const char* kPlotFooter = R"(
Examples:
  loopbench plot out --out out/figures
  loopbench plot out --out work.svg --x rhs_evaluations --y drift_position_max --group formulation,coordinates
  loopbench plot out --out cost.pdf --where kind=timing --x bodies --y ns_per_body --group formulation

Without --x and --y: angles and displacements of the run that is trusted most (finished, at level
position, at the finest tolerance), drift with its fitted exponents, and of runs in several scalars
error and drift against tolerance. Runs that failed are crosses, doubtful ones hollow marks. A figure that
cannot be drawn is reported with its reason, and the exit code is 2 after all others are drawn.)";

constexpr const char* kTradeoffFooter = R"(
Examples:
  loopbench run mine.json --out out               ("timing": {"cases": true} in mine.json)
  loopbench tradeoff out --figures
  loopbench tradeoff out --where 'rtol>1e-11' --cost rhs_equivalents --classes 1e-2,1e-5
  loopbench tradeoff out --error closed_form_error_max --per mechanism,horizon,mass --out tradeoff

Each accuracy run beside the timing of the same case, problem by problem (--per). Runs that failed
or have doubts are compared with nobody, and listed with the reason. A '*' stands on the Pareto
front. The overview has, per problem and class of errors, what the cheapest method of each formulation
costs, and how many times the cheapest of all. Below stands, from the records, what was equal among the
compared rows and what was not. All rows are in tradeoff.csv and tradeoff.md, the cheapest methods in
tradeoff-overview.csv, figures (error over cost, over tolerance, over time) in figures/.)";

constexpr const char* kTrajectoryFooter = R"(
Examples:
  loopbench trajectory out                                    ("output": {"step": 0.01} in the experiment)
  loopbench trajectory out --where formulation=odca --out csv
  loopbench trajectory out --out lines --format jsonl --columns joint:,energy: --every 10
  loopbench trajectory theirs.csv --mechanism my.json         (constraints, energy, speeds)
  loopbench trajectory theirs.csv --ours ours.csv --figure beside.svg --columns joint:

A store's trajectories are files of rows over time, in its folder trajectories/; without --out they
are listed. A trajectory of any program is CSV with a column "t [s]" and others that are called as
ours are, however few; `loopbench trajectory FILE.csv` prints those of a file. Held against a mechanism are the
poses of all bodies, or the coordinates of joints that lead to them.)";

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
docs/robustness-map.md explains cells and lists all keys of the rules.)";

}  // namespace

StoreOptions::StoreOptions(CLI::App& app) {
  merge_app_ = app.add_subcommand("merge", "Join the stores of shards");
  merge_app_->add_option("store", merge_.stores, "Folders of runs, or .jsonl files")->required();
  merge_app_->add_option("-o,--out", merge_.out, "Folder of the new store")->required();

  AddTable(app);
  AddPlot(app);
  AddTradeoff(app);
  AddTrajectory(app);

  verdict_app_ = app.add_subcommand("verdict", "Compare claims with stored records");
  verdict_app_->add_option("store", verdict_.store, "Folder of a run, or a .jsonl file")
      ->required();
  verdict_app_->add_option("--claims", verdict_.claims, "Rules (JSON)")->required();
  verdict_app_->add_option("-o,--out", verdict_.out, "Markdown file with all numbers");

  AddWide(verdict_app_);

  AddMap(app);
}

void StoreOptions::AddTable(CLI::App& app) {
  table_app_ = app.add_subcommand("table", "Print a table of stored records");
  table_app_->add_option("store", table_.store, "Folder of a run, or a .jsonl file")->required();
  table_app_
      ->add_option("--kind", table_.view.kind,
                   "What the rows are (default: drift, or what the store has)")
      ->check(CLI::IsMember(
          {"drift", "precision", "timing", "factorial", "models", "references", "all"}));
  table_app_->add_option("--format", table_.format, "How they are written")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json", "latex"}))
      ->capture_default_str();
  table_app_->add_option("--where", conditions_,
                         "Only records with key=value[,value] (or !=, <, <=, >, >=)");
  table_app_->add_option("--columns", table_.view.columns, "Keys of records, in this order: a,b,c")
      ->delimiter(',');
  table_app_->add_option("--group", table_.view.group, "One table per value of this key");
  table_app_->add_option("--sort", table_.view.sort, "Order by this key first");
  table_app_->add_flag("--descending", table_.view.descending, "Largest first")->needs("--sort");
  table_app_->add_option("-o,--out", table_.out, "File (default: the terminal)");
  AddGate(table_app_, &table_.gate);
  AddWide(table_app_);
  table_app_->footer(kTableFooter);
}

namespace {

void AddSize(CLI::App* app, std::string* size) {
  std::vector<std::string> names;
  for (const auto& [name, value] : FigureSizes()) names.push_back(name);
  app->add_option("--size", *size, "Width of figures: 85 mm or 178 mm, letters of 8 pt")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
}

}  // namespace

void StoreOptions::AddPlot(CLI::App& app) {
  plot_app_ = app.add_subcommand("plot", "Draw the standard figures, or one value against another");
  plot_app_->add_option("store", plot_.store, "Folder of a run, or a .jsonl file")->required();
  plot_app_
      ->add_option("-o,--out", plot_.out,
                   "Folder for the figures; with --x and --y also a file's name")
      ->required();
  plot_app_->add_option("--format", plot_.format, "svg (default) or pdf")
      ->check(CLI::IsMember({"svg", "pdf"}));
  AddSize(plot_app_, &plot_.size);
  plot_app_->add_option("--where", conditions_,
                        "Only records with key=value[,value] (or !=, <, <=, >, >=)");
  plot_app_->add_option("--x", plot_.free.x, "Key of the horizontal axis");
  plot_app_->add_option("--y", plot_.free.y, "Key of the vertical axis");
  plot_app_->add_option("--group", plot_.free.group, "One curve per value of these keys: a,b");
  plot_app_
      ->add_option("--log", plot_.free.log,
                   "Logarithmic axes (default: those that span two decades)")
      ->check(CLI::IsMember({"x", "y", "xy", "none"}));
  plot_app_->add_option_function<std::string>(
      "--title", [this](const std::string& title) { plot_.free.title = title; },
      "Title, \"\" for none (default: values that all records share)");
  plot_app_->footer(kPlotFooter);
}

void StoreOptions::AddTradeoff(CLI::App& app) {
  tradeoff_app_ = app.add_subcommand("tradeoff", "Compute work-precision tables and Pareto fronts");
  tradeoff_app_->add_option("store", tradeoff_.store, "Folder of a run, or a .jsonl file")
      ->required();
  TradeoffOptions& options = tradeoff_.options;
  tradeoff_app_->add_option("--error", options.error,
                            "Key that is the error (default: error_position_max, or what the store "
                            "has)");
  tradeoff_app_->add_option("--cost", options.cost,
                            "Key that is the cost: wall_s (default: the timed median), "
                            "rhs_equivalents, steps, ...");
  tradeoff_app_->add_option("--per", options.per, "Keys that make one problem: a,b")
      ->delimiter(',')
      ->capture_default_str();
  tradeoff_app_->add_option("--classes", options.classes, "Errors that the overview asks for: a,b")
      ->delimiter(',')
      ->check(NumberFrom(0.0, 1e300))
      ->capture_default_str();
  tradeoff_app_->add_option("--where", conditions_,
                            "Only records with key=value[,value] (or !=, <, <=, >, >=)");
  tradeoff_app_->add_option("-o,--out", tradeoff_.out, "Folder (default: that of the store)");
  tradeoff_app_->add_option("--format", tradeoff_.format, "How it is printed")
      ->check(CLI::IsMember({"text", "csv", "markdown", "json", "latex"}))
      ->capture_default_str();
  tradeoff_app_->add_flag("--all", tradeoff_.all, "Print every row");
  AddWide(tradeoff_app_);
  CLI::Option* figures = tradeoff_app_->add_flag("--figures", draws_tradeoff_, "Draw figures too");
  tradeoff_app_->add_option("--figure-format", drawn_as_, "svg or pdf")
      ->check(CLI::IsMember({"svg", "pdf"}))
      ->needs(figures)
      ->capture_default_str();
  AddSize(tradeoff_app_, &tradeoff_.size);
  tradeoff_app_->footer(kTradeoffFooter);
}

void StoreOptions::AddTrajectory(CLI::App& app) {
  trajectory_app_ = app.add_subcommand(
      "trajectory", "List, write and check trajectories of runs or other programs");
  TrajectoryCommand& command = trajectory_;
  trajectory_app_->add_option("source", command.source, "Folder of a run, or a trajectory (.csv)")
      ->required();
  trajectory_app_->add_option("--where", conditions_,
                              "Only records with key=value[,value] (or !=, <, <=, >, >=)");
  trajectory_app_->add_option("-o,--out", command.out, "Folder to write to; of a .csv a file");
  trajectory_app_->add_option("--format", command.format, "Output format")
      ->check(CLI::IsMember({"csv", "jsonl"}))
      ->capture_default_str();
  trajectory_app_
      ->add_option("--columns", command.columns, "Only columns that begin so, and t: a,b")
      ->delimiter(',');
  trajectory_app_->add_option("--every", command.every, "Only each so many-th row")
      ->check(NumberFrom(1, 1'000'000'000));
  trajectory_app_->add_option("--mechanism", command.mechanism,
                              "Mechanism (JSON) that a trajectory is held against");
  trajectory_app_->add_option("--ours", command.ours, "Trajectory that another is laid beside");
  trajectory_app_
      ->add_option("--figure", command.figure, "Picture of both and their difference: .svg, .pdf")
      ->needs("--ours");
  trajectory_app_->footer(kTrajectoryFooter);
}

void StoreOptions::AddMap(CLI::App& app) {
  map_app_ = app.add_subcommand("map", "Tabulate which methods pass which stress tests");
  map_app_
      ->add_option("store", map_.store,
                   "Folder of a run, a .jsonl file, or failure-map.csv to draw it again")
      ->required();
  map_app_->add_option("--rules", map_.rules, "Rows, columns and limits (JSON)")->required();
  map_app_->add_option("-o,--out", map_.out, "Folder for failure-map.csv, .md and the picture");
  map_app_->add_option("--format", map_.format, "Figure format")
      ->check(CLI::IsMember({"svg", "pdf"}))
      ->capture_default_str();
  AddSize(map_app_, &map_.size);
  map_app_->add_flag("--gate", map_.gate, "Exit with 1 if a cell that must hold does not");
  AddWide(map_app_);
  map_app_->footer(kMapFooter);
}

std::optional<int> StoreOptions::Run(const std::string& typed) {
  table_.view.where = plot_.where = tradeoff_.options.where = trajectory_.where =
      ParseSelection(conditions_);
  if (draws_tradeoff_) tradeoff_.figures = drawn_as_;
  if (*merge_app_) return Merge(merge_);
  if (*table_app_) return PrintTable(table_, typed);
  if (*plot_app_) return Plot(plot_);
  if (*tradeoff_app_) return PrintTradeoff(tradeoff_, typed);
  if (*trajectory_app_) return ShowTrajectories(trajectory_, typed);
  if (*map_app_) return PrintMap(map_, typed);
  if (*verdict_app_) return PrintVerdicts(verdict_, typed);
  return std::nullopt;
}

}  // namespace loopbench::harness
