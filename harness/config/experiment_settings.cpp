// "limits", "compile", "series", "timing" and "precision" of an experiment file.
#include <fmt/format.h>

#include "harness/config/experiment_sections.h"
#include "harness/config/limits_record.h"
#include "harness/config/sized_family.h"

namespace loopbench::harness {
namespace {

// float128 reaches some 1e-30
constexpr double kReach = 1e-30;
constexpr Range kReferences = {.min = kReach, .max = 1e-6};
// of runs in other scalars than double; what a narrow one cannot meet ends as step-too-small
constexpr Range kTolerancesOfLadders = {
    .min = kReach, .max = 0.1, .why = " (the reach of float128)"};
constexpr std::int64_t kMaxSteps = 1'000'000'000'000;  // no run gets there

void CheckOneCpuLimit(const JsonNode& node, Limits&) {
  if (!node.Optional("cpu_s") || !node.Optional("wall_s")) return;
  node.FailAs("\"cpu_s\" and \"wall_s\"", "one of them: both limit CPU time");
}

void ReadFormerName(const JsonNode& node, Limits& limits) { limits.cpu_s = node.Number(kPositive); }

void ReadSizes(const JsonNode& node, TimingFamily& family) {
  if (family.family.empty()) return;  // which has been said
  const SizedFamily& of = SizedFamilyOf(family.family);
  for (const std::int64_t size : node.IntegerList(of.smallest, of.largest)) {
    family.sizes.push_back(static_cast<int>(size));
  }
}

/// What accuracy cases say themselves.
constexpr const char* kOfCases[] = {"tolerance", "horizon", "columns"};

void RequireCasesAlone(const JsonNode& node, Timing& timing) {
  if (!timing.cases) return;
  for (const char* key : kOfCases) {
    if (!node.Optional(key)) continue;
    node.FailAs(fmt::format("\"cases\" beside \"{}\"", key),
                "one of them: cases are timed as they are");
  }
}

Json CasesAloneSchema() {
  Json others = Json::array();
  for (const char* key : kOfCases) others.push_back(Requires({key}));
  return {{"if", {{"required", {"cases"}}, {"properties", {{"cases", {{"const", true}}}}}}},
          {"then", {{"not", {{"anyOf", others}}}}}};
}

const Fields<TimingFamily>& TimingFamilyFields() {
  Json ranges = Json::array();
  for (const SizedFamily& family : SizedFamilies()) {
    if (family.smallest == 1 && family.largest == kMaxCount) continue;
    ranges.push_back(
        {{"if", {{"properties", {{"family", ChoiceSchema({family.name})}}}}},
         {"then",
          {{"properties", {{"sizes", IntegerListSchema(family.smallest, family.largest)}}}}}});
  }
  static const Fields<TimingFamily> fields(
      "timing_family", "Mechanisms of growing size, timed per right-hand side only.",
      {{"family", Choice(&TimingFamily::family, NamesOfSizedFamilies(), "a family"), "What grows.",
        "a family"},
       {"sizes", By(IntegerListSchema(1, kMaxCount), ReadSizes), TextOfSizedFamilies(),
        "a list of integers"},
       {"columns", Columns(&TimingFamily::columns), "Timed.", "an array of columns"},
       {"", Json::object({{"allOf", ranges}})}});
  return fields;
}

}  // namespace

const Fields<Limits>& LimitsFields() {
  static const Fields<Limits> fields(
      "limits", "When a case is given up.",
      {{"", By({{"not", Requires({"cpu_s", "wall_s"})}}, CheckOneCpuLimit)},
       {"cpu_s", Number(&Limits::cpu_s, kPositive),
        "CPU time of one run [s]. Waiting for a processor does not count."},
       {"steps", Integer(&Limits::steps, 1, kMaxSteps), "Accepted steps."},
       {"memory_mb", Number(&Limits::memory_mb, kPositive),
        "Address space of a case's process [MiB]."},
       {"wall_s", By(NumberSchema(kPositive), ReadFormerName), "The former name of cpu_s."}});
  return fields;
}

Record RecordOf(const Limits& limits) {
  Record record;
  LimitsFields().Show(limits, [&record](const std::string& key, const Json& value) {
    if (value.is_number_integer()) {
      record.Set(key, value.get<std::int64_t>());
    } else {
      record.Set(key, value.get<double>());
    }
  });
  return record;
}

const Fields<CompileOptions>& CompileFields() {
  static const Fields<CompileOptions> fields(
      "compile",
      "What is simplified before a run. The motion is the same but for rounding; records say in "
      "\"compiled\" what was found to save.",
      {{"planar", Bool(&CompileOptions::planar),
        "Spatial mechanisms that move in parallel planes become planar."},
       {"welds", Bool(&CompileOptions::welds), "Welded bodies become one."},
       {"immovable", Bool(&CompileOptions::immovable),
        "Rigid sub-structures on the ground become ground."},
       {"islands", Bool(&CompileOptions::islands),
        "Parts connected through ground at most run on their own, each with its own steps."},
       {"redundancy", Bool(&CompileOptions::redundancy),
        "Constraints that say at every position what others say are released."}});
  return fields;
}

const Fields<Experiment>& SeriesFields() {
  static const Fields<Experiment> fields(
      "series", "Values over time that records keep.",
      {{"points", Integer(&Experiment::series_points, 2, kMostPoints),
        "Points kept of a time series for figures."}});
  return fields;
}

const Fields<Timing>& TimingFields() {
  static const Fields<Timing> fields(
      "timing", "Timing runs, separate from those that measure accuracy.",
      {{"repeats", Integer(&Timing::repeats, 0, kMaxCount), "0: no timing."},
       {"tolerance", Number(&Timing::tolerance, kTolerances), "rtol = atol of the integrator."},
       {"horizon", Number(&Timing::horizon, kPositive),
        "Simulated time [s]; default: the shortest of each scene."},
       {"columns", Columns(&Timing::columns), "Default: those of the experiment."},
       {"cases", Bool(&Timing::cases),
        "Every accuracy case is timed as it is, with its own integrator, tolerance or step, and "
        "horizon; not beside tolerance, horizon and columns."},
       {"", By(CasesAloneSchema(), RequireCasesAlone)},
       {"families", ObjectList(&Timing::families, TimingFamilyFields(), "families")}});
  return fields;
}

const Fields<Precision>& PrecisionFields() {
  static const Fields<Precision> fields(
      "precision",
      "The columns in several scalars with one integrator (ode45), against a reference in "
      "float128. Planar mechanisms; one horizon per scene.",
      {{"scalars", Choices(&Precision::scalars, NamesOf<Scalar>(), "a scalar"),
        "One or several, narrowest first by custom.", "a list of scalars"},
       {"tolerances", NumberList(&Precision::tolerances, kTolerancesOfLadders),
        "Default: those of the experiment."},
       {"horizon", Number(&Precision::horizon, kPositive),
        "Simulated time [s]; default: the shortest of each scene."},
       {"reference", Number(&Precision::reference, kReferences), "Tolerance of the reference."}});
  return fields;
}

}  // namespace loopbench::harness
