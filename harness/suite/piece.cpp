#include "harness/suite/piece.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "harness/generate/compile.h"
#include "harness/isolation/fault.h"
#include "harness/record/noise.h"
#include "harness/record/origin.h"
#include "harness/record/provenance.h"
#include "harness/run/case_identity.h"
#include "harness/run/run_case.h"
#include "harness/suite/suite.h"
#include "harness/trajectory/trajectory.h"

namespace loopbench::harness {
namespace {

/// Costly cases go first, so that none is left to run alone at the end.
double CostOf(const Case& one) { return one.ensemble * ExpectedSteps(one); }

constexpr double kPatience = 2.0, kGrace_s = 2.0;  ///< LimitsOfRuns

/// A piece that waits for the compiler of generated code sleeps, and is not ended for that.
void AllowCompiler(const Column& column, ProcessLimits* limits) {
  if (column.execution != Execution::kLibrary) limits->idle_s += generate::kCompilerSeconds;
}

}  // namespace

ProcessLimits LimitsOfRuns(const Limits& limits, double runs) {
  return {.cpu_s = kPatience * runs * limits.cpu_s + kGrace_s, .memory_mb = limits.memory_mb};
}

Piece AccuracyPiece(const Experiment& experiment, const Case& one,
                    const std::filesystem::path& store) {
  const int runs = one.ensemble > 1 ? one.ensemble + 1 : 1;
  std::filesystem::path trajectory;
  if (experiment.output) trajectory = TrajectoryPath(store, RunId(one.keys));
  const auto work = [&experiment, one, store, trajectory](int threads) {
    const std::optional<Reference> reference = FindReference(experiment, one, store);
    Record record =
        RunCase(experiment, one, reference ? &*reference : nullptr, trajectory, threads);
    if (reference && !reference->snapshots.empty()) {
      record.Set("reference_file", ReferenceOf(experiment, one, store).id);
    }
    return std::vector<Record>{std::move(record)};
  };
  ProcessLimits limits = LimitsOfRuns(one.limits, runs * one.column.threads);
  AllowCompiler(one.column, &limits);
  return {.owed = {one.keys},
          .work = work,
          .limits = limits,
          .label = fmt::format("{} {} {}", one.mechanism, ToString(one.column), SettingOf(one)),
          .cost = CostOf(one),
          .trajectory = trajectory};
}

Piece ReferencePiece(const Experiment& experiment, const ReferenceCase& one) {
  Limits limits = experiment.limits;
  if (experiment.reference) limits.cpu_s = experiment.reference->cpu_s;
  constexpr double kWitnesses = 3.0;
  return {.owed = {one.keys},
          .work = [&experiment, one](int) { return std::vector<Record>{MakeOne(experiment, one)}; },
          .limits = LimitsOfRuns(limits, kWitnesses),
          .label = fmt::format("{} {} s", one.keys.Text("mechanism"), one.horizon),
          .cost = one.horizon,
          .product = one.file};
}

Piece TimingPiece(const Experiment& experiment, const TimingGroup& group) {
  Piece piece;
  for (const Case& one : group.cases) piece.owed.push_back(one.keys);
  // the first column is timed twice (noise.h)
  const int columns = static_cast<int>(group.cases.size()) + 1;
  int threads = 1;
  for (const Case& one : group.cases) threads = std::max(threads, one.column.threads);
  const int runs = columns * (experiment.timing.repeats + 1) * threads;
  // right-hand sides have no limit of their own; a minute per column is far beyond any
  constexpr double kDerivatives_s = 60.0;
  piece.limits = {kPatience * runs * experiment.limits.cpu_s + kDerivatives_s * columns * threads,
                  experiment.limits.memory_mb};
  for (const Case& one : group.cases) AllowCompiler(one.column, &piece.limits);
  piece.work = [&experiment, &group](int) { return TimeTogether(experiment, group); };
  piece.label = group.name;
  return piece;
}

Piece LadderPiece(const Experiment& experiment, const LadderGroup& group) {
  Piece piece;
  const Limits& limits = experiment.limits;
  piece.owed = group.keys;
  const auto runs = static_cast<double>(group.keys.size() + 1);  // there are two references
  piece.limits = LimitsOfRuns(limits, runs);
  piece.work = [&experiment, &group](int) { return ClimbTogether(experiment, group); };
  piece.label =
      fmt::format("{} {}", group.keys.front().Text("mechanism"), ToString(group.task.column));
  return piece;
}

std::string AnswerOf(const Piece& piece) {
  if (const auto garbage = PlantedFault(piece.owed.front())) return *garbage;
  std::string text;
  for (const Record& record : piece.work(piece.threads)) text += ToJsonLine(record) + '\n';
  return text;
}

std::vector<Record> RecordsOf(const Piece& piece, const ProcessResult& result,
                              const std::string& set) {
  std::vector<Record> records;
  std::string outcome(OutcomeOf(result.ending)), message = result.text;
  if (result.ending == ProcessEnding::kThrew) message = "threw: " + message;
  if (result.ending == ProcessEnding::kAnswered) {
    outcome = "bad-answer";
    message = "its process answered what is not its record";
    try {
      for (std::size_t start = 0; start < result.text.size();) {
        const std::size_t end = std::min(result.text.find('\n', start), result.text.size());
        records.push_back(FromJsonLine(std::string_view(result.text).substr(start, end - start)));
        start = end + 1;
      }
    } catch (const std::runtime_error&) {
      records.clear();
    }
  }
  const auto same_case = [](const Record& a, const Record& b) {
    return a.Text("case_id") == b.Text("case_id");
  };
  const bool good = std::ranges::equal(records, piece.owed, same_case);
  if (!good) records = piece.owed;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!good) {
      records[i].Set("outcome", outcome);
      records[i].Set("message", message);
      records[i].Set("wall_s", result.wall_s);
      records[i].Set("cpu_s", result.cpu_s);
    }
    records[i].Set("id", RunId(piece.owed[i]));
    records[i].Set("version", CodeVersion());
    if (!set.empty()) records[i].Set("set", set);
    records[i].Set("experiment_index", piece.experiment);
    Stamp(records[i]);
  }
  return records;
}

}  // namespace loopbench::harness
