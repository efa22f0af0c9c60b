// explain: problems, methods, runs and measures of an experiment.
#include <sstream>

#include "harness/base/file_kind.h"
#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/observers/registry.h"

namespace loopbench::harness {
namespace {

std::string Numbers(const std::vector<double>& numbers) {
  return ListInWords(Mapped<std::string>(numbers, NumberCell));
}

void ExplainProblems(const Experiment& experiment) {
  Table table{
      .columns = Columns(
          "name=problem, space, bodies:integer, joints:integer, horizons=horizon [s], file")};
  for (const ExperimentProblem& problem : experiment.problems) {
    const MechanismDescription& description = problem.mechanism.description;
    AddRow({problem.name, description.space, description.bodies.size() - 1,
            description.joints.size(), Numbers(problem.horizons), problem.path},
           &table);
  }
  PrintSection("Problems", table, {.all = true});
}

constexpr std::pair<std::string_view, std::string_view> kWords[] = {
    {"joint", "joint coordinates, without one cut joint per loop, where drift appears."},
    {"absolute", "position and orientation of each body; drift can appear at each joint."},
    {"plain",
     "plain factorisations (reduction: fixed independent speeds); they fail or lose accuracy if "
     "constraints lose rank."},
    {"rank-revealing",
     "solvers that detect rank loss (reduction: independent speeds are chosen again)."}};

void ExplainMethods(const Experiment& experiment) {
  Table table{.columns = Columns("formulation, enforcement, coordinates, solver")};
  std::set<std::string_view> used;
  for (const Method& method : experiment.methods) {
    // a peer's name contains a slash; the solver is followed by threads and execution
    const std::string rest = ToString(method).substr(method.formulation.size() + 1);
    const std::size_t first = rest.find('/'), second = rest.find('/', first + 1);
    AddRow({method.formulation, rest.substr(0, first), rest.substr(first + 1, second - first - 1),
            rest.substr(second + 1)},
           &table);
    used.insert({method.formulation, ToString(method.enforcement), ToString(method.coordinates),
                 ToString(method.solver)});
  }
  PrintSection("Methods", table, {.all = true});
  const auto define = [&used](std::string_view word, std::string_view sentence) {
    if (used.contains(word)) Print("  {}: {}\n", word, sentence);
  };
  for (const FormulationRow& row : Formulations()) define(row.name, row.sentence);
  for (const LevelTraits& level : Levels()) define(level.name, level.sentence);
  for (const auto& [word, sentence] : kWords) define(word, sentence);
}

/// Returns the unit of a joint's coordinate, from the first problem with this joint.
std::string_view UnitOf(const Experiment& experiment, const std::string& joint) {
  for (const ExperimentProblem& problem : experiment.problems) {
    const MechanismDescription& description = problem.mechanism.description;
    const auto found = std::ranges::find(description.joints, joint, &JointDescription::name);
    if (found == description.joints.end()) continue;
    const auto words = ValueWords(found->type, description.space, false);
    if (words.size() == 1) return words.front().unit;
  }
  return "rad or m";
}

void ExplainRuns(const Experiment& experiment) {
  Print("\nRuns\n  integrators: {}\n", fmt::join(experiment.integrators, ", "));
  if (!experiment.tolerances.empty()) {
    const bool is_tied = experiment.atol == 0.0 && !experiment.atols;
    Print("  relative {}tolerances: {}\n", is_tied ? "and absolute " : "",
          Numbers(experiment.tolerances));
  }
  if (experiment.atol > 0.0) Print("  absolute tolerance: {:g}\n", experiment.atol);
  if (experiment.atols) {
    const auto& [length, angle, speed, angular_speed] = *experiment.atols;
    Print("  absolute tolerances (0: as relative): {:g} m, {:g} rad, {:g} m/s, {:g} rad/s\n",
          length, angle, speed, angular_speed);
  }
  if (!experiment.fixed_steps.empty()) {
    Print("  fixed steps without error control [s]: {}\n", Numbers(experiment.fixed_steps));
  }
  if (experiment.ensembles.empty()) {
    Print("  ensembles: none; a single run gives no confidence interval of growth exponents\n");
  }
  for (const EnsembleRule& rule : experiment.ensembles) {
    const std::vector<Case> cases = Expand(experiment);
    const auto count = static_cast<std::size_t>(std::count_if(
        cases.begin(), cases.end(), [&rule](const Case& one) { return Matches(rule, one); }));
    std::string start =
        fmt::format("each fixed coordinate perturbed by up to {:g} rad or m", rule.perturb);
    if (!rule.between.empty()) start.clear();
    for (const DrawnCoordinate& drawn : rule.between) {
      start += fmt::format("{}{} between {:g} and {:g} {}", start.empty() ? "" : ", ", drawn.joint,
                           drawn.from, drawn.to, UnitOf(experiment, drawn.joint));
    }
    Print("  ensembles: {}, {} runs each, seed {}; {}\n", WithCount(count, "case"), rule.size,
          rule.seed, start);
    Print("  ensemble_branch_kept counts runs within {:g} rad of a known branch\n",
          rule.branch_bound);
  }
  const Limits& limits = experiment.limits;
  Print("  limits of a run: {:g} s of CPU time, {} steps, {:g} MiB of memory\n", limits.cpu_s,
        limits.steps, limits.memory_mb);
}

void ExplainMeasures(const Experiment& experiment, const Selection& filter) {
  Print(
      "\nMeasures at each accepted step\n"
      "  drift [m, rad]: constraint violation, and its exponent of growth\n"
      "  energy error [J], rank and conditioning of the constraints, outcome\n"
      "  series for figures: {} points\n",
      experiment.series_points);
  for (const ObserverRow& row : RegisteredObservers()) Print("  {}: {}\n", row.name, row.sentence);
  if (const std::size_t rungs = CountRungs(experiment); rungs > 0) {
    Print("  precision: {} in several floating-point types; error and drift against tolerance\n",
          WithCount(rungs, "run"));
  }
  const std::size_t timings = CountTimings(experiment, filter);
  if (timings == 0) {
    Print("  no timings\n");
    return;
  }
  Print("  {}, one at a time: right-hand side [ns] and whole simulations, {} repetitions {}\n",
        WithCount(timings, "timing"), experiment.timing.repeats,
        experiment.timing.cases ? "of each case"
                                : fmt::format("at tolerance {}", experiment.timing.tolerance));
}

/// Returns the used values of an axis, each once, in their order.
std::vector<std::string> ValuesOf(const std::string& axis,
                                  const std::vector<Experiment>& experiments) {
  std::vector<std::string> values;
  std::set<std::string> known;
  for (const Experiment& one : experiments) {
    if (known.insert(one.parameters.Text(axis)).second) values.push_back(one.parameters.Text(axis));
  }
  return values;
}

void ExplainSweep(const Overview& overview) {
  const Experiment& first = overview.experiments.front();
  if (!first.parameters.items().empty()) {
    Print("\nSweep: {}; the first is described below\n",
          WithCount(overview.combinations, "combination"));
    for (const auto& [name, number] : overview.axes) {
      std::vector<std::string> values = ValuesOf(name, overview.experiments);
      constexpr std::size_t kMaxShown = 12;
      if (values.size() > kMaxShown) {
        const std::string last = values.back();
        values.resize(kMaxShown - 2);
        values.push_back("...");
        values.push_back(last);
      }
      Print("  {}: {}{}\n", name, fmt::join(values, ", "),
            overview.is_sample ? fmt::format(" ({} values, some shown)", number) : "");
    }
  }
  if (!first.exclusions.empty()) {
    Print("\nExcluded cases:");
    for (const Selection& rule : first.exclusions) Print(" [{}]", ToText(rule));
    Print("\n");
  }
}

void ExplainExperiment(const std::filesystem::path& path, const ExperimentFiles& files) {
  const Overview overview = MakeOverview(path, {{path}, files.settings, files.filter});
  const Experiment& first = overview.experiments.front();
  for (const Experiment& one : overview.experiments) CheckLadders(one);
  Print("{} ({})\n", first.name, path.string());
  if (!first.comment.empty()) Print("  {}\n", first.comment);
  Print("  {}: each combination of problem, horizon, method and tolerance\n",
        WithCount(overview.cases(), "case"));
  ExplainSweep(overview);
  ExplainProblems(first);
  ExplainMethods(first);
  ExplainRuns(first);
  ExplainMeasures(first, files.filter);
}

JsonObject ExperimentDocument(const std::filesystem::path& path, const ExperimentFiles& files) {
  const Overview overview = MakeOverview(path, {{path}, files.settings, files.filter});
  const Experiment& first = overview.experiments.front();
  const OtherRuns others(overview, files.filter);
  std::vector<JsonObject> problems, sweep;
  for (const ExperimentProblem& problem : first.problems) {
    const MechanismDescription& description = problem.mechanism.description;
    problems.push_back(JsonOf("name", problem.name, "file", problem.path, "space",
                              description.space, "bodies", description.bodies.size() - 1, "joints",
                              description.joints.size(), "horizons", problem.horizons));
  }
  for (const auto& [name, number] : overview.axes) {
    sweep.push_back(
        JsonOf("name", name, "count", number, "values", ValuesOf(name, overview.experiments)));
  }
  std::vector<std::string> methods =
      Mapped<std::string>(first.methods, [](const Method& method) { return ToString(method); });
  return JsonOf("file", path, "kind", "experiment", "name", first.name, "comment", first.comment,
                "cases", overview.cases(), "combinations", overview.combinations, "timings",
                others.timings, "precision_runs", others.rungs, "references",
                first.reference.has_value(), "sweep", sweep, "problems", problems, "methods",
                methods, "integrators", first.integrators, "tolerances", first.tolerances,
                "fixed_steps", first.fixed_steps, "limits",
                JsonOf("cpu_s", first.limits.cpu_s, "steps", first.limits.steps, "memory_mb",
                       first.limits.memory_mb));
}

/// Returns the document of a mechanism, as printed by its child process.
std::string MechanismText(const std::filesystem::path& path, ExplainView view,
                          const ProcessLimits& limits, int* code) {
  std::string text;
  const auto work = [&] {
    JsonObject document = JsonOf("file", path, "kind", "mechanism");
    view.document = &document;
    const int ended = ExplainMechanism(path, view);
    PrintText(document.Text());
    return ended;
  };
  *code = std::max(*code, TextFromChild(path.string(), limits, work, &text));
  if (!text.empty()) return text;
  return JsonOf("file", path, "kind", "mechanism", "error", "cut off").Text();
}

constexpr std::size_t kMaxRows = 40, kFirstRows = 30, kIndent = 2, kNarrowest = 24;

/// Breaks only the last column, for a pipe, and no name in it, so that names can be searched.
Table LastColumnBroken(Table table) {
  TableColumn& last = table.columns.back();
  if (last.format != Format::kText) return table;
  std::size_t taken = kIndent;
  for (std::size_t c = 0; c + 1 < table.columns.size(); ++c) {
    taken += TextWidth(table.columns[c], table.rows) + kColumnGap;
  }
  constexpr std::size_t kUsual = 100;
  last.most_cells = kUsual > taken + kNarrowest ? kUsual - taken : kNarrowest;
  for (const Record& row : table.rows) {
    for (const auto word : std::views::split(EscapeTerminal(row.Text(last.key)), ' ')) {
      last.most_cells = std::max(last.most_cells, CellsOf({word.begin(), word.end()}));
    }
  }
  return table;
}

struct ExplainCommand {
  ExperimentFiles files;
  ProcessLimits limits = kFileLimits;
  ExplainView view;
  bool json = false;

  std::vector<Option> Options() {
    return {{"file", "Experiment or mechanism files (JSON)", &files.paths, kRequired},
            FilterOption(&files.filter),
            CpuOption(&limits),
            MemoryOption(&limits),
            SetOption(&files.settings),
            WideOption(),
            JsonOption(&json),
            {"--all", "Print all rows of long tables", &view.all},
            {"--statics", "Print the forces that hold a mechanism at its start", &view.statics},
            {"--range", "Joint whose coordinate is moved to its limits", &view.range}};
  }
};

/// Mechanisms are analysed in a child process under `limits`; returns 2 if a limit ended it.
int Explain(ExplainCommand& command, const Typed&) {
  auto& [files, limits, view, json] = command;
  int exit_code = 0;
  std::string documents;
  for (const auto& path : files.paths) {
    const bool is_mechanism = KindOfFile(path) == FileKind::kMechanism;
    if (is_mechanism && !(files.settings.empty() && files.filter.empty())) {
      Reject("{}: --set and --filter are for experiments, and this is a mechanism", path.string());
    }
    if ((view.statics || !view.range.empty()) && !is_mechanism) {
      Reject("{}: --statics and --range are for mechanisms, and this is an experiment",
             path.string());
    }
    if (json) {
      documents += (documents.empty() ? "" : ",\n") +
                   (is_mechanism ? MechanismText(path, view, limits, &exit_code)
                                 : ExperimentDocument(path, files).Text());
    } else if (is_mechanism) {
      const int code =
          PrintFromChild(path.string(), limits, [&] { return ExplainMechanism(path, view); });
      exit_code = std::max(exit_code, code);
    } else {
      ExplainExperiment(path, files);
    }
  }
  if (json) PrintText("{\"files\":[" + documents + "]}\n");
  return exit_code;
}

}  // namespace

std::string ShortNumber(double value) { return fmt::format("{:.6g}", value + 0.0); }

void PrintSection(const std::string& title, const Table& table, const ExplainView& view,
                  const char* key) {
  if (view.document != nullptr) {
    if (*key != '\0') view.document->Add(key, ObjectsOf(table.rows));
    return;
  }
  Print("\n{}\n", title);
  if (table.rows.empty()) {
    Print("  none\n");
    return;
  }
  Table shown = table;
  if (!view.all && table.rows.size() > kMaxRows) shown.rows.resize(kFirstRows);
  std::erase_if(shown.columns, [&shown](const TableColumn& column) {
    return std::ranges::all_of(shown.rows,
                               [&column](const Record& row) { return Cell(row, column).empty(); });
  });
  const Screen screen = OutputScreen();
  const std::size_t room = screen.width - std::min(screen.width, kIndent);
  std::istringstream text(
      ToText(screen.is_terminal ? FitWidth(shown, room) : LastColumnBroken(shown)));
  for (std::string line; std::getline(text, line);) {
    if (!line.empty()) Print("  {}\n", line);
  }
  if (shown.rows.size() < table.rows.size()) {
    Print("  ... and {} more rows (--all shows them)\n", table.rows.size() - shown.rows.size());
  }
}

void AddExplain(Commands& commands) {
  commands.Add("explain",
               "Describe an experiment or a mechanism (joints, loops, freedom, redundancy)",
               Explain);
}

}  // namespace loopbench::harness
