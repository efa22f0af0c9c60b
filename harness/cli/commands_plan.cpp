// plan: what a run would be, and about how long it would take.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "harness/cli/commands.h"
#include "harness/integrator/cpu_time.h"
#include "harness/record/json_object.h"
#include "harness/run/case_identity.h"
#include "harness/run/peers.h"
#include "harness/store/result_store.h"
#include "harness/suite/estimate.h"
#include "harness/suite/progress.h"
#include "harness/tables/fit.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

/// Everything that decides a run but the experiment's name: results of another file with the same
/// cases serve as well.
std::string SameRun(const Record& record) {
  std::string text = record.Text("content") + "\n";
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id") break;
    if (key != "experiment") text += key + "=" + record.Text(key) + "\n";
  }
  return text;
}

/// CPU time [s] of the unperturbed run by SameRun(), from an earlier store.
std::map<std::string, double> EarlierTimes(const std::filesystem::path& store) {
  std::map<std::string, double> times;
  if (store.empty()) return times;
  for (const Record& record : ReadRecords(store)) {
    // wall time depends on how many runs shared the processors
    if (record.Text("kind") != "accuracy" || std::isnan(record.Number("cpu_s"))) continue;
    times[SameRun(record)] = record.Number("cpu_s");
  }
  return times;
}

/// "1.5 s", "12 min", "3.4 h".
std::string Duration(double seconds) {
  if (seconds < 0.1) return "less than 0.1 s";
  if (seconds < 100.0) return fmt::format("{:.2g} s", seconds);
  if (seconds < 6000.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

/// One line of the plan: the cases of a scene and column, over all combinations.
struct Line {
  std::string mechanism, column;
  std::size_t cases = 0, runs = 0;
  double seconds = 0.0;
};

std::size_t RunsOf(const Case& one) {
  return one.ensemble > 1 ? static_cast<std::size_t>(one.ensemble) + 1 : 1;
}

struct Plan {
  std::vector<Line> lines;
  std::size_t cases = 0, runs = 0, references = 0, rungs = 0, timings = 0, known = 0;
  double seconds = 0.0, reference_seconds = 0.0, ladder_seconds = 0.0, timing_seconds = 0.0;
};

/// @param seconds  of all runs of the case
void Add(const Case& one, double seconds, Plan* plan, std::map<std::string, std::size_t>* places) {
  const std::string column = ToString(one.column);
  const auto [place, fresh] = places->emplace(one.mechanism + "\n" + column, plan->lines.size());
  if (fresh) plan->lines.push_back({one.mechanism, column, 0, 0, 0.0});
  Line& line = plan->lines[place->second];
  const std::size_t runs = RunsOf(one);
  ++line.cases;
  line.runs += runs;
  line.seconds += seconds;
  ++plan->cases;
  plan->runs += runs;
  plan->seconds += seconds;
}

Plan MakePlan(const std::vector<Experiment>& experiments, const PlanCommand& command,
              Estimate* estimate) {
  Plan plan;
  std::map<std::string, std::size_t> places;
  std::set<std::string> references;
  const std::map<std::string, double> earlier = EarlierTimes(command.from);
  Progress progress("plan", {experiments.size(), {"", 0.0}}, 1);
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const Experiment& experiment = experiments[i];
    progress.Start(i);
    for (const Case& one : SelectCases(experiment, command.files.filter)) {
      const auto known = earlier.find(SameRun(Identified(experiment, one).keys));
      plan.known += known != earlier.end() ? 1 : 0;
      const auto runs = static_cast<double>(RunsOf(one));
      Add(one, known != earlier.end() ? runs * known->second : estimate->OfCase(i, one), &plan,
          &places);
      if (!experiment.reference) continue;
      const ReferenceCase reference = ReferenceOf(experiment, one, "results.jsonl");
      if (!references.insert(reference.id).second) continue;
      plan.reference_seconds += estimate->OfReference(i, reference);
    }
    for (const LadderGroup& ladder : LadderGroups(experiment, command.files.filter)) {
      plan.ladder_seconds += estimate->OfLadder(i, ladder);
      plan.rungs += ladder.keys.size();
    }
    for (const TimingGroup& group : TimingGroups(experiment)) {
      plan.timing_seconds += estimate->OfTiming(i, group);
    }
    plan.timings += CountTimings(experiment);
    progress.Done(i);
  }
  plan.references = references.size();
  return plan;
}

void PrintAxes(const std::vector<Experiment>& experiments) {
  if (experiments.front().parameters.items().empty()) return;
  for (const auto& [name, value] : experiments.front().parameters.items()) {
    std::set<std::string> values;
    for (const Experiment& one : experiments) values.insert(one.parameters.Text(name));
    Print("  axis {}: {} values\n", name, values.size());
  }
  Print("  {} combinations\n", experiments.size());
}

void PrintPlan(const std::vector<Experiment>& experiments, const Plan& plan,
               const PlanCommand& command, const Estimate& estimate) {
  const Experiment& first = experiments.front();
  Print("{}{}{}\n", first.name, first.comment.empty() ? "" : ": ", first.comment);
  PrintAxes(experiments);
  Print("  {} scenes, {} columns, {} tolerances", first.scenes.size(), first.columns.size(),
        first.tolerances.size());
  if (!first.fixed_steps.empty()) Print(", {} fixed steps", first.fixed_steps.size());
  if (first.integrators.size() > 1) Print(", {} integrators", first.integrators.size());
  Print("\n\n");
  Table table;
  table.columns = {{"mechanism", "mechanism", Format::kText, {}},
                   {"column", "column", Format::kText, {}},
                   {"cases", "cases", Format::kInteger, {}},
                   {"runs", "runs", Format::kInteger, {}},
                   {"seconds", "estimate [s]", Format::kShortest, {}}};
  for (const Line& line : plan.lines) {
    Record row;
    row.Set("mechanism", line.mechanism);
    row.Set("column", line.column);
    row.Set("cases", static_cast<std::int64_t>(line.cases));
    row.Set("runs", static_cast<std::int64_t>(line.runs));
    row.Set("seconds", std::round(line.seconds * 100.0) / 100.0);
    table.rows.push_back(row);
  }
  PrintText(ToScreen(table) + "\n");
  for (const std::string& one : estimate.cut_off()) {
    Print("A pilot was cut off: {}. Its cases are counted with the CPU time it had taken.\n", one);
  }
  Print("{} cases, {} runs (an ensemble comes on top of the unperturbed run), {} timings\n",
        plan.cases, plan.runs, plan.timings);
  Print("estimated time: accuracy {} with one job", Duration(plan.seconds));
  if (plan.references > 0) {
    Print(", {} references {}", plan.references, Duration(plan.reference_seconds));
  }
  if (plan.rungs > 0) {
    Print(", {} runs in several scalars {}", plan.rungs, Duration(plan.ladder_seconds));
  }
  Print(", timings {}\n", Duration(plan.timing_seconds));
  std::string source;
  if (!command.from.empty()) {
    source = fmt::format("{} of {} cases from {}", plan.known, plan.cases, command.from.string());
  }
  if (estimate.pilots() > 0) {
    source += fmt::format(
        "{}{} pilots over the first part of the longest horizon, at the loosest and the finest "
        "tolerance{}",
        source.empty() ? "" : ", the rest from ", estimate.pilots(),
        first.fixed_steps.empty() ? "" : ", or the longest fixed step");
  }
  Print("An estimate, from {}. Each run ends at {:g} s of CPU time at the latest.\n", source,
        first.limits.cpu_s);
}

JsonObject PlanDocument(const std::filesystem::path& path,
                        const std::vector<Experiment>& experiments, const Plan& plan,
                        const Estimate& estimate) {
  std::vector<JsonObject> lines;
  for (const Line& line : plan.lines) {
    lines.push_back(JsonObject()
                        .Add("mechanism", line.mechanism)
                        .Add("column", line.column)
                        .Add("cases", Count(line.cases))
                        .Add("runs", Count(line.runs))
                        .Add("seconds", line.seconds));
  }
  return JsonObject()
      .Add("file", path.string())
      .Add("name", experiments.front().name)
      .Add("combinations", Count(experiments.size()))
      .Add("cases", Count(plan.cases))
      .Add("runs", Count(plan.runs))
      .Add("accuracy_seconds", plan.seconds)
      .Add("references", Count(plan.references))
      .Add("reference_seconds", plan.reference_seconds)
      .Add("runs_in_several_scalars", Count(plan.rungs))
      .Add("several_scalars_seconds", plan.ladder_seconds)
      .Add("timings", Count(plan.timings))
      .Add("timing_seconds", plan.timing_seconds)
      .Add("cases_known", Count(plan.known))
      .Add("pilots", Count(estimate.pilots()))
      .Add("pilots_cut_off", estimate.cut_off())
      .Add("lines", lines);
}

}  // namespace

int PrintPlans(const PlanCommand& command) {
  std::vector<JsonObject> documents;
  for (const auto& path : command.files.paths) {
    const double begin = ThreadCpuSeconds();
    const std::vector<Experiment> experiments =
        ReadSelected({{path}, command.files.settings, command.files.filter});
    RequirePeers(experiments);
    Estimate estimate(experiments, Estimate::Budget());
    Plan plan = MakePlan(experiments, command, &estimate);
    plan.seconds += ThreadCpuSeconds() - begin;  // a run reads and expands the file too
    if (command.json) {
      documents.push_back(PlanDocument(path, experiments, plan, estimate));
    } else {
      PrintPlan(experiments, plan, command, estimate);
    }
  }
  if (command.json) PrintText(JsonObject().Add("experiments", documents).Text() + "\n");
  return 0;
}

}  // namespace loopbench::harness
