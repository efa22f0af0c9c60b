// plan: what a run would be, and about how long it would take.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "harness/cli/commands.h"
#include "harness/integrator/cpu_time.h"
#include "harness/isolation/processes.h"
#include "harness/run/case_identity.h"
#include "harness/run/peers.h"
#include "harness/run/run_case.h"
#include "harness/store/result_store.h"
#include "harness/suite/progress.h"
#include "harness/tables/table.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

constexpr double kPilotFraction = 0.02;        ///< of the horizon, at first
constexpr double kPilotGrowth = 5.0;           ///< then longer
constexpr double kPilotEnough = 0.003;         ///< CPU time that says something [s]
constexpr double kPilotSeconds = 0.25;         ///< CPU time of one pilot run
constexpr std::size_t kPilotCombinations = 8;  ///< of a sweep; the others take the nearest one's
constexpr double kFamilySeconds = 0.02;        ///< batches of right-hand sides of one family member

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

/// What short runs say about the CPU time of a scene and a column.
struct Rate {
  double start_s = 0.0;   ///< before the first step
  double per_step = 0.0;  ///< per expected step (ExpectedSteps)
};

/// Short runs, each in a process of its own under the limits of its case.
class Pilot {
 public:
  explicit Pilot(const std::vector<Experiment>& experiments) : experiments_(experiments) {}

  /// Estimated CPU time of one run of the case [s].
  double Seconds(std::size_t experiment, const Case& one) {
    const std::size_t piloted = Nearest(experiment);
    const Experiment& like = experiments_[piloted];
    // another combination of a sweep may have other scenes
    const std::size_t scene = std::min(one.scene, like.scenes.size() - 1);
    const std::string key = fmt::format("{}/{}/{}/{}{}", piloted, scene, ToString(one.column),
                                        one.integrator, one.step > 0.0 ? "/fixed" : "");
    const auto known = rates_.find(key);
    const Rate rate = known != rates_.end()
                          ? known->second
                          : rates_.emplace(key, Measure(like, scene, one)).first->second;
    return rate.start_s + std::min(rate.per_step * ExpectedSteps(one), one.limits.cpu_s);
  }

  std::size_t runs() const { return rates_.size(); }
  /// A sentence for each pilot that its limits cut off.
  const std::vector<std::string>& cut_off() const { return cut_off_; }

 private:
  std::size_t Nearest(std::size_t experiment) const {
    const std::size_t count = experiments_.size();
    if (count <= kPilotCombinations) return experiment;
    const double step = static_cast<double>(count - 1) / (kPilotCombinations - 1);
    return static_cast<std::size_t>(
        std::round(std::round(static_cast<double>(experiment) / step) * step));
  }

  Rate Measure(const Experiment& experiment, std::size_t scene, const Case& like) {
    Rate rate;
    const auto work = [&](std::size_t) {
      const Rate found = Run(experiment, scene, like);
      return fmt::format("{} {}", found.start_s, found.per_step);
    };
    RunInProcesses(
        1, 1, work, [&](std::size_t) { return LimitsOfRuns(like.limits, like.column.threads); },
        [&](std::size_t, const ProcessResult& result) {
          if (result.ending == ProcessEnding::kAnswered &&
              std::sscanf(result.text.c_str(), "%lf %lf", &rate.start_s, &rate.per_step) == 2) {
            return;
          }
          // the cases will end so as well
          rate = {result.cpu_s, 0.0};
          cut_off_.push_back(fmt::format("{} {}: {}, {}", experiment.scenes[scene].name,
                                         ToString(like.column), OutcomeOf(result.ending),
                                         result.text));
        });
    return rate;
  }

  /// In the child.
  static Rate Run(const Experiment& experiment, std::size_t scene, const Case& like) {
    Case pilot = like;
    pilot.scene = scene;
    pilot.ensemble = 1;
    if (pilot.step > 0.0) {
      pilot.step = std::ranges::max(experiment.fixed_steps);
    } else if (!experiment.tolerances.empty()) {  // else it is that of the timings
      pilot.rtol = pilot.atol = std::ranges::max(experiment.tolerances);
    }
    const std::vector<double>& horizons = experiment.scenes[scene].horizons;
    const double horizon = *std::max_element(horizons.begin(), horizons.end());
    pilot.limits.cpu_s = std::min(kPilotSeconds, like.limits.cpu_s);
    // the first steps cost more than the later ones: longer, until the run is no longer short
    for (double fraction = kPilotFraction;; fraction = std::min(1.0, kPilotGrowth * fraction)) {
      pilot.horizon = fraction * horizon;
      const CpuLimit all(kPilotSeconds);
      const Record record = RunCase(experiment, pilot);
      const double reached = record.Number("t_reached"), spent = record.Number("cpu_s");
      const double start_s = all.cpu_s() - (std::isnan(spent) ? 0.0 : spent);
      // a run that fails at once costs its start, and so will the case
      if (!(reached > 0.0) || !(spent > 0.0)) return {start_s, 0.0};
      const bool failed = record.Text("outcome") != ToString(Outcome::kFinished);
      const bool enough = spent >= kPilotEnough || all.cpu_s() >= kPilotSeconds;
      if (enough || failed || fraction >= 1.0) {
        pilot.horizon = reached;
        return {start_s, spent / ExpectedSteps(pilot)};
      }
    }
  }

  const std::vector<Experiment>& experiments_;
  std::map<std::string, Rate> rates_;
  std::vector<std::string> cut_off_;
};

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

struct Plan {
  std::vector<Line> lines;
  std::size_t cases = 0, runs = 0, timings = 0, known = 0;
  double seconds = 0.0, timing_seconds = 0.0;
};

void Add(const Case& one, double seconds, Plan* plan, std::map<std::string, std::size_t>* places) {
  const std::string column = ToString(one.column);
  const auto [place, fresh] = places->emplace(one.mechanism + "\n" + column, plan->lines.size());
  if (fresh) plan->lines.push_back({one.mechanism, column, 0, 0, 0.0});
  Line& line = plan->lines[place->second];
  const std::size_t runs = one.ensemble > 1 ? static_cast<std::size_t>(one.ensemble) + 1 : 1;
  ++line.cases;
  line.runs += runs;
  line.seconds += static_cast<double>(runs) * seconds;
  ++plan->cases;
  plan->runs += runs;
  plan->seconds += static_cast<double>(runs) * seconds;
}

Plan MakePlan(const std::vector<Experiment>& experiments, const PlanCommand& command,
              Pilot* pilot) {
  Plan plan;
  std::map<std::string, std::size_t> places;
  const std::map<std::string, double> earlier = EarlierTimes(command.from);
  Progress progress("plan", experiments.size());
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    const Experiment& experiment = experiments[i];
    for (const Case& one : SelectCases(experiment, command.files.filter)) {
      const auto known = earlier.find(SameRun(Identified(experiment, one).keys));
      plan.known += known != earlier.end() ? 1 : 0;
      Add(one, known != earlier.end() ? known->second : pilot->Seconds(i, one), &plan, &places);
    }
    // the first simulation of a timing warms up and is not counted by its repeats
    const std::vector<Case> timings = ExpandTiming(experiment);
    for (const Case& one : timings) {
      plan.timing_seconds += (experiment.timing.repeats + 1) * pilot->Seconds(i, one);
    }
    const std::size_t members = CountTimings(experiment) - timings.size();
    plan.timing_seconds += kFamilySeconds * static_cast<double>(members);
    plan.timings += CountTimings(experiment);
    progress.Step(experiment.name);
  }
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
               const PlanCommand& command, const Pilot& pilot) {
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
  PrintText(ToText(table) + "\n");
  for (const std::string& one : pilot.cut_off()) {
    Print("A pilot was cut off: {}. Its cases are counted with the CPU time it had taken.\n", one);
  }
  Print("{} cases, {} runs (an ensemble comes on top of the unperturbed run), {} timings\n",
        plan.cases, plan.runs, plan.timings);
  Print("estimated time: accuracy {} with one job, timings {}\n", Duration(plan.seconds),
        Duration(plan.timing_seconds));
  std::string source;
  if (!command.from.empty()) {
    source = fmt::format("{} of {} cases from {}", plan.known, plan.cases, command.from.string());
  }
  if (pilot.runs() > 0) {
    source += fmt::format(
        "{}{} pilots over {:g} % or more of the longest horizon at the loosest tolerance, scaled "
        "with the horizon and rtol^(-1/5){}",
        source.empty() ? "" : ", the rest from ", pilot.runs(), 100.0 * kPilotFraction,
        first.fixed_steps.empty() ? "" : ", or with the number of fixed steps");
  }
  Print("An estimate, from {}. Each run ends at {:g} s of CPU time at the latest.\n", source,
        first.limits.cpu_s);
}

}  // namespace

int PrintPlans(const PlanCommand& command) {
  for (const auto& path : command.files.paths) {
    const std::vector<Experiment> experiments =
        ReadSelected({{path}, command.files.settings, command.files.filter});
    RequirePeers(experiments);
    Pilot pilot(experiments);
    const Plan plan = MakePlan(experiments, command, &pilot);
    PrintPlan(experiments, plan, command, pilot);
  }
  return 0;
}

}  // namespace loopbench::harness
