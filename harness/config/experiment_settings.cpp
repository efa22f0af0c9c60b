// "integrator", "jacobian", "limits", "compile", "series", "timing" and "precision" of an
// experiment file.
#include "harness/config/experiment_sections.h"
#include "harness/config/options.h"

namespace loopbench::harness {
namespace {

// float128 reaches some 1e-30
constexpr double kReach = 1e-30;
constexpr Range kReferences = {.min = kReach, .max = 1e-6};
// of runs in other scalars than double; what a narrow one cannot meet ends as step-too-small
constexpr Range kTolerancesOfLadders = {
    .min = kReach, .max = 0.1, .why = " (the reach of float128)"};
// A picture has fewer points across, and a record of some ten series stays below 2 MB.
constexpr int kMostPoints = 10'000;
constexpr std::int64_t kMaxSteps = 1'000'000'000'000;  // no run gets there

void ReadLimits(const JsonNode& root, Limits* limits) {
  const auto node = root.Optional("limits");
  if (!node || !node->ExpectObject({"cpu_s", "steps", "memory_mb", "wall_s"})) return;
  const auto cpu = node->Optional("cpu_s"), wall = node->Optional("wall_s");
  if (cpu && wall) node->FailAs("\"cpu_s\" and \"wall_s\"", "one of them: both limit CPU time");
  if (cpu) limits->cpu_s = cpu->Number(kPositive);
  if (wall) limits->cpu_s = wall->Number(kPositive);  // its former name
  if (const auto steps = node->Optional("steps")) {
    limits->steps = steps->Integer(1, kMaxSteps);
  }
  if (const auto memory = node->Optional("memory_mb")) {
    limits->memory_mb = memory->Number(kPositive);
  }
}

void ReadCompile(const JsonNode& root, CompileOptions* options) {
  const auto node = root.Optional("compile");
  if (!node || !node->ExpectObject({"planar", "welds", "immovable", "islands", "redundancy"}))
    return;
  if (const auto planar = node->Optional("planar")) options->planar = planar->Bool();
  if (const auto welds = node->Optional("welds")) options->welds = welds->Bool();
  if (const auto immovable = node->Optional("immovable")) options->immovable = immovable->Bool();
  if (const auto islands = node->Optional("islands")) options->islands = islands->Bool();
  if (const auto redundancy = node->Optional("redundancy")) {
    options->redundancy = redundancy->Bool();
  }
}

TimingFamily ReadFamily(const JsonNode& node) {
  static const NameList kFamilies = {"chain", "ladder"};
  constexpr int kLargest = 1'000'000;
  TimingFamily family;
  if (!node.ExpectObject({"family", "sizes", "columns"})) return family;
  if (const auto name = node.Required("family", "a family")) {
    const auto index = name->Choice(kFamilies, "a family");
    if (index) family.family = kFamilies.all()[static_cast<std::size_t>(*index)];
  }
  if (const auto sizes = node.Required("sizes", "a list of integers")) {
    // the smallest closed chain has three bars
    const int smallest = family.family == "chain" ? 3 : 1;
    for (const std::int64_t size : sizes->IntegerList(smallest, kLargest)) {
      family.sizes.push_back(static_cast<int>(size));
    }
  }
  if (const auto columns = node.Required("columns", "an array of columns")) {
    family.columns = ReadColumns(*columns);
  }
  return family;
}

void ReadTiming(const JsonNode& root, Timing* timing) {
  const auto node = root.Optional("timing");
  if (!node || !node->ExpectObject({"repeats", "tolerance", "horizon", "columns", "families"})) {
    return;
  }
  if (const auto repeats = node->Optional("repeats")) {
    timing->repeats = static_cast<int>(repeats->Integer(0, kMaxCount));
  }
  if (const auto tolerance = node->Optional("tolerance")) {
    timing->tolerance = tolerance->Number(kTolerances);
  }
  if (const auto horizon = node->Optional("horizon")) timing->horizon = horizon->Number(kPositive);
  if (const auto columns = node->Optional("columns")) timing->columns = ReadColumns(*columns);
  if (const auto families = node->Optional("families")) {
    for (const JsonNode& family : families->Elements("families")) {
      timing->families.push_back(ReadFamily(family));
    }
  }
}

void ReadPrecision(const JsonNode& root, const std::vector<double>& tolerances,
                   Precision* precision) {
  const auto node = root.Optional("precision");
  if (!node || !node->ExpectObject({"scalars", "tolerances", "horizon", "reference"})) return;
  precision->tolerances = tolerances;
  if (const auto scalars = node->Required("scalars", "a list of scalars")) {
    precision->scalars = ReadEnums<Scalar>(*scalars, "a scalar");
  }
  if (const auto given = node->Optional("tolerances")) {
    precision->tolerances = given->NumberList(kTolerancesOfLadders);
  }
  if (const auto horizon = node->Optional("horizon")) {
    precision->horizon = horizon->Number(kPositive);
  }
  if (const auto reference = node->Optional("reference")) {
    precision->reference = reference->Number(kReferences);
  }
}

}  // namespace

void ReadSettings(const JsonNode& root, Experiment* experiment) {
  if (const auto name = root.Optional("integrator")) {
    const std::vector<std::string> profiles = ProfileNames();
    const auto index = name->Choice(profiles, "an integrator profile");
    if (index) experiment->integrator = profiles[static_cast<std::size_t>(*index)];
  }
  if (const auto kind = root.Optional("jacobian")) {
    const auto& names = kNames<JacobianKind>;
    const auto index =
        kind->Choice(std::vector<std::string>(names.begin(), names.end()), "a kind of Jacobian");
    if (index) experiment->jacobian = static_cast<JacobianKind>(*index);
  }
  ReadLimits(root, &experiment->limits);
  ReadCompile(root, &experiment->compile);
  const auto series = root.Optional("series");
  if (series && series->ExpectObject({"points"})) {
    if (const auto points = series->Optional("points")) {
      experiment->series_points = static_cast<int>(points->Integer(2, kMostPoints));
    }
  }
  ReadTiming(root, &experiment->timing);
  ReadPrecision(root, experiment->tolerances, &experiment->precision);
}

}  // namespace loopbench::harness
