#include "harness/run/run_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "harness/analysis/agreement.h"
#include "harness/analysis/doubts.h"
#include "harness/analysis/link_length.h"
#include "harness/reference/error_meter.h"
#include "harness/reference/series_meter.h"
#include "harness/run/ensemble.h"
#include "harness/run/run_keys.h"
#include "harness/run/run_once.h"
#include "harness/run/side_by_side.h"
#include "harness/text/hash.h"

namespace loopbench::harness {

namespace {

/// Runs the members of a case's ensemble and hands them over in their order, with their starts.
template <class Keep>
void ForEachMember(const Experiment& experiment, const Case& one, int threads, const Keep& keep) {
  constexpr int kHeld = 1024;  // at most, of which runs wait to be handed over
  const int members = one.ensemble > 1 ? one.ensemble : 0;
  struct Member {
    MechanismDescription start;
    Run run;
  };
  std::vector<Member> held;
  for (int first = 0; first < members; first += kHeld) {
    held.assign(static_cast<std::size_t>(std::min(kHeld, members - first)), {});
    const auto run_member = [&](int i, SideBySide& beside) {
      Member& member = held[static_cast<std::size_t>(i)];
      member.start =
          MemberStart(experiment.scenes[one.scene].mechanism.description, one, first + i);
      member.run = RunOnce(experiment, one, member.start, &beside);
    };
    RunSideBySide(static_cast<int>(held.size()), threads, run_member);
    for (int i = 0; i < static_cast<int>(held.size()); ++i) {
      Member& member = held[static_cast<std::size_t>(i)];
      // its time was also that of those beside it
      if (member.run.record.Text("outcome") == ToString(Outcome::kTimeLimit)) {
        RunSideBySide(1, 1, [&](int, SideBySide& alone) { run_member(i, alone); });
      }
      keep(std::move(member.run), member.start);
    }
  }
}

/// What the case's errors are measured against, and in the record what that is certified to.
HeldAgainst WriteCertificateOf(const ExperimentScene& scene, const Case& one,
                               const Reference* reference, Record& record) {
  HeldAgainst held;
  if (scene.series) {
    WriteCertificate(scene.mechanism.description, *scene.series, one.horizon, record);
    if (scene.series->NumWithin(one.horizon) > 0) held.series = &*scene.series;
  } else if (reference != nullptr) {
    WriteCertificate(*reference, record);
    if (reference->NumTrusted() > 0) held.reference = reference;
  }
  return held;
}

bool HasFinished(const Record& run) { return run.Text("outcome") == ToString(Outcome::kFinished); }

/// The largest difference of final poses from a run at a tenth of the tolerance; infinite where
/// that run does not finish.
void WriteRefinement(const Experiment& experiment, Case one, Record& record) {
  one.rtol /= 10.0;
  one.atol /= 10.0;
  const Run finer =
      RunOnce(experiment, one, experiment.scenes[one.scene].mechanism.description, nullptr);
  record.Set("refinement_difference", HasFinished(finer.record)
                                          ? DifferenceOf(record, finer.record).largest
                                          : std::numeric_limits<double>::infinity());
}

}  // namespace

IntegratorOptions OptionsOf(const Case& one, const std::vector<double>& stop_times) {
  IntegratorOptions options;
  options.profile = one.integrator;
  options.fixed_step = one.step;
  const bool is_fixed = one.step > 0.0;
  options.rtol = is_fixed ? kToleranceOfFixedSteps : one.rtol;
  options.atol = is_fixed ? kToleranceOfFixedSteps : one.atol;
  options.step_limit = one.limits.steps;
  options.time_limit_s = one.limits.cpu_s;
  options.stop_times = stop_times;
  return options;
}

Record RunCase(const Experiment& experiment, const Case& one, const Reference* reference,
               const std::filesystem::path& trajectory, int threads) {
  const ExperimentScene& scene = experiment.scenes[one.scene];
  Record record = one.keys;
  record.Set("scene_id", Fnv1a(scene.mechanism.canonical));
  const double link = LinkLength(scene.mechanism.description);
  record.Set("link_length", link);
  record.Set("position_goal",
             4 * std::numeric_limits<double>::epsilon() * link *
                 static_cast<double>(scene.mechanism.description.bodies.size() - 1));
  const HeldAgainst held = WriteCertificateOf(scene, one, reference, record);
  std::optional<TrajectoryTask> task;
  if (experiment.output && !trajectory.empty()) {
    task.emplace(*experiment.output, trajectory,
                 fmt::format("{} {} {} {}", one.mechanism, ToString(one.column), one.integrator,
                             SettingOf(one)));
  }
  Run nominal =
      RunOnce(experiment, one, scene.mechanism.description, nullptr, held, task ? &*task : nullptr);
  for (const auto& [key, value] : nominal.record.items()) record.Set(key, value);

  if (experiment.refine && one.rtol > 0.0 && !IsPeer(record) && HasFinished(record)) {
    WriteRefinement(experiment, one, record);
  }

  std::vector<DriftSeries> runs;
  EnsembleTally tally(nominal, one.branch_bound);
  int failed = 0;
  ForEachMember(experiment, one, threads, [&](Run run, const MechanismDescription& start) {
    tally.Add(run, start);
    if (!HasFinished(run.record)) {
      ++failed;
    } else {
      runs.push_back(std::move(run.drift));
    }
  });
  if (one.ensemble <= 1) runs.push_back(nominal.drift);
  std::erase_if(runs, [](const DriftSeries& run) { return run.t.empty(); });
  if (!runs.empty()) {
    const double length = scene.mechanism.observe.length;
    GrowthOptions options;
    // the bound for round-off holds for some ten lengths of path; paths grow with the horizon
    options.round_off *= std::max(1.0, one.horizon / 10.0);
    WriteGrowth(AnalyseGrowth(runs, one.horizon, length, options), failed, record);
  }
  WriteExponent("energy_growth_exponent", nominal.energy, one.horizon, nominal.kinetic, record);
  WriteExponent("correction_growth_exponent", nominal.correction, one.horizon,
                scene.mechanism.observe.length, record);
  if (one.ensemble > 1) tally.Write(record);
  const DriftSeries envelope = Envelope(nominal.drift, experiment.series_points);
  record.Set("series.drift_t", envelope.t);
  record.Set("series.drift", envelope.value);
  if (HasFinished(record)) {
    record.Set("doubts", OwnDoubts(record));
  }
  return record;
}

}  // namespace loopbench::harness
