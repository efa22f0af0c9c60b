// Sections of an experiment: tolerances, limits, output, reference; and fields by pointer.

#include <cmath>

#include "harness/base/text.h"
#include "harness/config/benchmarks.h"
#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

// precision of float128: about 1e-30
constexpr double kReach = 1e-30;
constexpr Range kReferences = {.min = kReach, .max = 1e-6};
// for runs in scalars other than double; if a scalar is too narrow, the run ends as step-too-small
constexpr Range kTolerancesOfLadders = {
    .min = kReach, .max = 0.1, .why = " (the reach of float128)"};
constexpr std::int64_t kMaxSteps = 1'000'000'000'000;  // above any run

void CheckOneCpuLimit(const JsonNode& node, Limits&) {
  if (!node.Optional("cpu_s") || !node.Optional("wall_s")) return;
  node.FailAs("\"cpu_s\" and \"wall_s\"", "one of them: both limit CPU time");
}

void ReadSizes(const JsonNode& node, TimingFamily& family) {
  if (family.family.empty()) return;  // already reported
  const SizedFamily& of = SizedFamilyOf(family.family);
  for (const std::int64_t size : node.IntegerList(of.smallest, of.largest)) {
    family.sizes.push_back(static_cast<int>(size));
  }
}

/// Rule that `key` (a flag: if true) excludes all `others`, for the reason `why`.
template <class T>
FieldValue<T> Alone(const std::string& key, bool is_flag, const std::vector<std::string>& others,
                    const std::string& why) {
  Json condition = Requires({key}), excluded = Json::array();
  if (is_flag) condition["properties"] = {{key, {{"const", true}}}};
  for (const std::string& other : others) excluded.push_back(Requires({other}));
  return {{{"if", condition}, {"then", {{"not", {{"anyOf", excluded}}}}}},
          [=](const JsonNode& node, T&) {
            const auto given = node.Optional(key);
            if (!given || (is_flag && given->value() != true)) return;
            for (const std::string& other : others) {
              if (!node.Optional(other)) continue;
              node.FailAs(fmt::format("\"{}\" beside \"{}\"", key, other), "one of them: " + why);
            }
          }};
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
      "timing_family", "Family of mechanisms of several sizes; only right-hand sides are timed.",
      {{"family", Choice(&TimingFamily::family, NamesOfSizedFamilies(), "a family"), "Family.",
        "a family"},
       {"sizes", By(IntegerListSchema(1, kMaxCount), ReadSizes), TextOfSizedFamilies(),
        "a list of integers"},
       {"methods", Methods(&TimingFamily::methods), "Methods to be timed.", "an array of methods"},
       {"", Json::object({{"allOf", ranges}})}});
  return fields;
}

// "output" of an experiment file: rows of a trajectory.

constexpr int kMaxRows = 100'000'000;  // about 50 GB for a small mechanism
constexpr const char* kOneWay =
    "one of \"step\", \"number\", \"times\" and \"accepted_steps\": true";

int WaysOf(const OutputOptions& output) {
  return (output.step > 0.0) + (output.number > 0) + !output.times.empty() + output.accepted_steps;
}

/// Reports times that are given twice, missing or not ascending.
void RequireOneWay(const JsonNode& node, OutputOptions& output) {
  // invalid values are already reported
  const bool said = node.Optional("step") || node.Optional("number") || node.Optional("times");
  if (WaysOf(output) > 1) return node.FailAs("several definitions of times", kOneWay);
  if (WaysOf(output) == 0 && !said) return node.FailAs("no times", kOneWay);
  if (!std::ranges::is_sorted(output.times, std::ranges::less_equal())) {
    node.Optional("times")->FailAs("times that do not rise", "each later than the one before");
  }
  if (output.exact && output.accepted_steps) {
    node.FailAs("\"exact\" beside \"accepted_steps\"",
                "one of them: the ends of steps are exact as they are");
  }
}

Json OneWaySchema() {
  Json ways = Json::array();
  for (const char* key : {"step", "number", "times"}) ways.push_back(Requires({key}));
  ways.push_back(
      {{"required", {"accepted_steps"}}, {"properties", {{"accepted_steps", {{"const", true}}}}}});
  return {{"oneOf", ways}};
}

// "reference" of an experiment file: reference solution of the motion.

/// Reads published data of one problem; its errors are added to the experiment's errors.
void ReadSeriesOf(const JsonNode& node, const MechanismFiles& files, ExperimentProblem* problem) {
  const std::string named = node.Text();
  if (named.empty()) return;
  const std::filesystem::path path = files.Resolve(named);
  // names of an unreadable mechanism are unknown
  const MechanismDescription& mechanism = problem->mechanism.description;
  ReadNamedFile(node, path, "a published series", [&] {
    problem->series = ReadPublishedSeries(path, mechanism.bodies.size() > 1 ? &mechanism : nullptr);
  });
}

void ReadSeries(const JsonNode& node, ExperimentFile& experiment) {
  std::vector<ExperimentProblem>& problems = experiment.problems;
  if (node.value().is_string()) {
    if (problems.size() == 1) {
      ReadSeriesOf(node, *experiment.files, &problems.front());
    } else if (problems.size() > 1) {
      node.FailAs(fmt::format("one file for {} problems", problems.size()),
                  "an object with the file of each problem that has one, by the problem's name");
    }
    return;
  }
  if (!node.value().is_object()) {
    node.Fail("the path of a published series, or an object with one for each problem by its name");
    return;
  }
  NameList names;
  for (const ExperimentProblem& problem : problems) names.Add(problem.name);
  if (!node.ExpectObject(names)) return;
  if (node.value().empty()) node.Fail("at least one problem with its file");
  for (ExperimentProblem& problem : problems) {
    if (const auto file = node.Optional(problem.name)) {
      ReadSeriesOf(*file, *experiment.files, &problem);
    }
  }
}

const Fields<ReferenceOptions>& ReferenceFields() {
  static const NameList scalars({"as-needed", "long-double", "float128"});
  static const Fields<ReferenceOptions> fields(
      "reference",
      "Reference solution of each mechanism and horizon, at high order in a wide floating-point "
      "type, from three integrations: multipliers at two tolerances, O-DCA at one between them. "
      "Runs are compared with it where the three agree. Stored next to the store. Or published "
      "data.",
      {{"scalar", Choice(&ReferenceOptions::scalar, scalars, "a wide scalar"),
        "Floating-point type. float128 has 33 digits, takes about 50 times as long, and is for "
        "planar mechanisms; as-needed adds it if long-double does not certify to the end."},
       {"points", Integer(&ReferenceOptions::points, 2, kMaxPoints),
        "Number of times with errors, evenly from the start to the end."},
       {"cpu_s", Number(&ReferenceOptions::cpu_s, kPositive),
        "CPU time of each integration [s]. If it is exceeded, only the completed part is "
        "certified."},
       {"published_data", EitherSchema({TextSchema(), MapSchema(TextSchema(), 1)}),
        "Instead of a computed reference: path of published data (series.schema.json), relative "
        "to this file. For several problems, an object of paths by problem name. Problems "
        "without a path have no reference."},
       {"", Alone<ReferenceOptions>("published_data", false, {"scalar", "points", "cpu_s"},
                                    "what was published is not made")}});
  return fields;
}

void ReadReferenceOptions(const JsonNode& node, ExperimentFile& experiment) {
  ReferenceFields().Read(node, &experiment.reference.emplace());
  const auto series = node.Optional("published_data");
  if (!series) return;
  experiment.reference.reset();
  ReadSeries(*series, experiment);
}

// Fields of the document by JSON Pointer.

/// Returns an index of a JSON Pointer.
std::optional<std::size_t> IndexOf(const std::string& token) {
  const bool has_leading_zero = token.size() > 1 && token.front() == '0';
  return has_leading_zero ? std::nullopt : WholeNumber<std::size_t>(token);
}

std::string PlaceName(const std::string& pointer) { return pointer.empty() ? "the file" : pointer; }

std::vector<std::string> KeysOf(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

FieldFault NoElement(const Json& array, const std::string& token, const std::string& pointer) {
  return {fmt::format("no element \"{}\" in {}", token, PlaceName(pointer)),
          array.empty() ? "another field: the array is empty"
                        : fmt::format("an index from 0 to {} or \"*\"", array.size() - 1),
          "", ""};
}

FieldFault NoKey(const Json& object, const std::string& token, const std::string& pointer) {
  const std::vector<std::string> keys = KeysOf(object);
  return {fmt::format("no \"{}\" in {}", token, PlaceName(pointer)),
          keys.empty() ? "another field: the object is empty"
                       : fmt::format("one of \"{}\"", fmt::join(keys, "\", \"")),
          NearestSpelling(token, keys), ""};
}

/// Returns the name of a field in "limits": "wall_s" is the former name of "cpu_s".
std::string NameInLimits(const Json& limits, const std::string& token) {
  const std::string other = token == "wall_s" ? "cpu_s" : token == "cpu_s" ? "wall_s" : token;
  return limits.contains(token) || !limits.contains(other) ? token : other;
}

/// Returns the tokens of a JSON Pointer, or nothing if it is invalid or "".
std::optional<std::vector<std::string>> PointerTokens(const std::string& pointer) try {
  std::vector<std::string> tokens;
  for (Json::json_pointer left(pointer); !left.empty(); left.pop_back()) {
    tokens.push_back(left.back());
  }
  std::ranges::reverse(tokens);
  return tokens.empty() ? std::nullopt : std::optional(tokens);
} catch (const Json::parse_error&) {
  return std::nullopt;
}

/// Replaces the path of a mechanism file by the file's document.
bool TakeIn(ExperimentDocument& document, Json& node, const std::string& pointer,
            FieldTargets* found) {
  const std::filesystem::path path = document.files.Resolve(node.get<std::string>());
  try {
    if (!std::filesystem::is_regular_file(path)) {
      found->fault = {fmt::format("\"{}\" at {}", node.get<std::string>(), pointer),
                      fmt::format("a mechanism file ({} is none)", path.string()), "", "", true};
      return false;
    }
    node = document.files.Document(path);
    document.origins.TakeIn(pointer, path.string(), document.files.Text(path));
    return true;
  } catch (const ConfigError& mistakes) {
    found->fault = FieldFault{"", "", "", mistakes.what(), true};
    return false;
  }
}

/// Follows the tokens of a pointer from `node`, which is at `depth`.
void Walk(ExperimentDocument& document, Json& node, const std::vector<std::string>& tokens,
          std::size_t depth, const std::string& pointer, FieldTargets* found) {
  if (found->fault) return;
  if (depth == tokens.size()) {
    found->pointers.push_back(pointer);
    found->made.push_back(pointer);
    return;
  }
  const bool at_mechanism = depth == 3 && tokens[0] == "problems" && tokens[2] == "mechanism";
  if (at_mechanism && node.is_string() && !TakeIn(document, node, pointer, found)) return;
  const bool of_limits = depth == 1 && tokens[0] == "limits" && node.is_object();
  const std::string token = of_limits ? NameInLimits(node, tokens[depth]) : tokens[depth];
  if (node.is_array()) {
    const auto index = IndexOf(token);
    if (token == "*" && !node.empty()) {
      for (std::size_t i = 0; i < node.size(); ++i) {
        Walk(document, node[i], tokens, depth + 1, fmt::format("{}/{}", pointer, i), found);
      }
    } else if (index && *index < node.size()) {
      Walk(document, node[*index], tokens, depth + 1, pointer + "/" + token, found);
    } else {
      found->fault = NoElement(node, token, pointer);
    }
    return;
  }
  if (!node.is_object()) {
    found->fault = FieldFault{fmt::format("no \"{}\" in {}, which is {}", token, PlaceName(pointer),
                                          CompactText(node).substr(0, 60)),
                              "a field of an object or array", "", ""};
    return;
  }
  const std::string below = pointer + "/" + PointerToken(token);
  if (const auto member = node.find(token); member != node.end()) {
    Walk(document, *member, tokens, depth + 1, below, found);
    return;
  }
  // Points may have any name: a misspelt one would have no effect. A missing array is unknown.
  const bool free_names = depth > 0 && tokens[depth - 1] == "points";
  const bool in_array = std::any_of(
      tokens.begin() + static_cast<std::ptrdiff_t>(depth) + 1, tokens.end(),
      [](const std::string& later) { return later == "*" || IndexOf(later).has_value(); });
  if (free_names || in_array) {
    found->fault = NoKey(node, token, pointer);
    return;
  }
  std::string whole = below;
  for (std::size_t i = depth + 1; i < tokens.size(); ++i) whole += "/" + PointerToken(tokens[i]);
  found->pointers.push_back(whole);
  found->made.push_back(below);
}

}  // namespace

const Fields<Limits>& LimitsFields() {
  static const Fields<Limits> fields(
      "limits", "Limits at which a case is stopped.",
      {{"", By({{"not", Requires({"cpu_s", "wall_s"})}}, CheckOneCpuLimit)},
       {"cpu_s", Number(&Limits::cpu_s, kPositive),
        "CPU time of one run [s], without waiting for a processor."},
       {"steps", Integer(&Limits::steps, 1, kMaxSteps), "Number of accepted steps."},
       {"memory_mb", Number(&Limits::memory_mb, kPositive),
        "Address space of a case's process [MiB]."},
       {"wall_s",
        FieldValue<Limits>(NumberSchema(kPositive), Number(&Limits::cpu_s, kPositive).read),
        "Former name of cpu_s."}});
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
      "preprocess",
      "Simplifications before a run. The motion changes only by round-off. The record key "
      "\"compiled\" lists the simplifications.",
      {{"planar", Bool(&CompileOptions::planar),
        "Spatial mechanisms that move in parallel planes become planar."},
       {"welds", Bool(&CompileOptions::welds), "Welded bodies become one."},
       {"immovable", Bool(&CompileOptions::immovable),
        "Rigid sub-structures on the ground become ground."},
       {"islands", Bool(&CompileOptions::islands),
        "Parts that are connected at most through ground run separately, each with its own steps."},
       {"redundancy", Bool(&CompileOptions::redundancy),
        "Constraints that repeat other constraints at every position are released."}});
  return fields;
}

const Fields<Experiment>& SeriesFields() {
  static const Fields<Experiment> fields(
      "series", "Time series in records.",
      {{"points", Integer(&Experiment::series_points, 2, kMaxPoints),
        "Number of points of a time series, for figures."}});
  return fields;
}

const Fields<Timing>& TimingFields() {
  static const Fields<Timing> fields(
      "timing", "Timing runs, separate from accuracy runs.",
      {{"repeats", Integer(&Timing::repeats, 0, kMaxCount), "Repetitions; 0: no timing."},
       {"tolerance", Number(&Timing::tolerance, kTolerances),
        "Relative tolerance of the integrator; absolute one, too, unless atol is given."},
       {"horizon", Number(&Timing::horizon, kPositive),
        "Simulated time [s]; default: the shortest of each problem."},
       {"methods", Methods(&Timing::methods), "Methods; default: as in the experiment."},
       {"cases", Bool(&Timing::cases),
        "If true, every accuracy case is timed with its own integrator, tolerance or step, and "
        "horizon. Not together with tolerance, horizon or methods."},
       {"", Alone<Timing>("cases", true, {"tolerance", "horizon", "methods"},
                          "cases are timed as they are")},
       {"families", ObjectList(&Timing::families, TimingFamilyFields(), "families")}});
  return fields;
}

const Fields<Precision>& PrecisionFields() {
  static const Fields<Precision> fields(
      "precision",
      "Runs of the methods in several floating-point types with one integrator (ode45), compared "
      "with a reference in float128. Planar mechanisms; one horizon per problem.",
      {{"scalars", Choices(&Precision::scalars, NamesOf<Scalar>, "a scalar"),
        "Floating-point types, usually narrowest first.", "a list of scalars"},
       {"tolerances", NumberList(&Precision::tolerances, kTolerancesOfLadders),
        "Tolerances rtol = atol; default: as in the experiment."},
       {"horizon", Number(&Precision::horizon, kPositive),
        "Simulated time [s]; default: the shortest of each problem."},
       {"reference", Number(&Precision::reference, kReferences), "Tolerance of the reference."}});
  return fields;
}

const Fields<OutputOptions>& OutputFields() {
  static const Fields<OutputOptions> fields(
      "output",
      "Trajectory of each case, as a CSV file next to the store. One of step, number, times and "
      "accepted_steps sets the times of rows.",
      {{"step", Number(&OutputOptions::step, kPositive), "Time between rows [s], from 0."},
       {"number", Integer(&OutputOptions::number, 2, kMaxRows),
        "Number of rows, evenly from the start to the end."},
       {"times", NumberList(&OutputOptions::times, {.min = 0.0}),
        "Ascending times [s]. Times beyond a horizon are left out."},
       {"accepted_steps", Bool(&OutputOptions::accepted_steps),
        "If true, one row for the end of each integrator step."},
       {"exact", Bool(&OutputOptions::exact),
        "If true, integrator steps end at the times, which changes the run. If false, rows are "
        "taken from dense output, and the run is unchanged."},
       {"quantities",
        Choices(&OutputOptions::quantities, NamesOf<OutputPart>, "a part of a trajectory"),
        "Quantities in each row; default: all."},
       {"axes", Choice(&OutputOptions::axes, NamesOf<OutputAxes>(), "axes"),
        "Axes of reactions: ground axes, or each joint's frame on its first body."},
       {"", By(OneWaySchema(), RequireOneWay)}});
  return fields;
}

void RequireOutput(const JsonNode& node, ExperimentFile& file) {
  const auto output = node.Optional("output");
  if (!output || !file.output) return;
  if (file.compile.islands) {
    output->FailAs("output of parts that run on their own",
                   "\"islands\": false in \"preprocess\": rows are of the whole mechanism");
  }
  double longest = 0.0;
  for (const ExperimentProblem& problem : file.problems) {
    for (const double horizon : problem.horizons) longest = std::max(longest, horizon);
  }
  if (file.output->step > 0.0 && longest / file.output->step > kMaxRows) {
    output->FailAs(fmt::format("{:.3g} rows", longest / file.output->step),
                   fmt::format("at most {}", kMaxRows));
  }
  for (const Method& method : file.methods) {
    const FormulationRow* row = FindFormulation(method.formulation);
    if (row == nullptr || !row->is_peer() || file.output->accepted_steps) continue;
    return output->FailAs(
        fmt::format("output at given times of \"{}\", which has its own integrator", row->name),
        "\"accepted_steps\": true");
  }
}

bool OutputOptions::Has(OutputPart part) const { return Contains(quantities, part); }

std::vector<double> OutputTimes(const OutputOptions& output, double horizon) {
  std::vector<double> times;
  if (output.number > 0) {
    for (int i = 0; i < output.number; ++i) times.push_back(horizon * i / (output.number - 1));
  } else if (output.step > 0.0) {
    // a last row beyond the end by round-off is moved to the end
    const double rows = horizon / output.step;
    const double last = std::floor(rows * (1 + 4 * std::numeric_limits<double>::epsilon()));
    for (std::int64_t i = 0; i <= static_cast<std::int64_t>(last); ++i) {
      times.push_back(std::min(horizon, output.step * static_cast<double>(i)));
    }
  } else {
    for (const double t : output.times) {
      if (t <= horizon) times.push_back(t);
    }
  }
  return times;
}

std::string ToString(const OutputOptions& output) {
  std::string text =
      fmt::format("{} {} {} {}", output.step, output.number, output.accepted_steps, output.exact);
  for (const double t : output.times) text += fmt::format(" {}", t);
  for (const OutputPart part : output.quantities) {
    text += fmt::format(" {}", kNames<OutputPart>[static_cast<std::size_t>(part)]);
  }
  return text + fmt::format(" {}", kNames<OutputAxes>[static_cast<std::size_t>(output.axes)]);
}

FieldValue<ExperimentFile> ReferenceValue() {
  return By(ReferenceFields().Schema(), ReadReferenceOptions);
}

FieldTargets ExperimentDocument::Find(const std::string& pointer) {
  FieldTargets found;
  const auto tokens = PointerTokens(pointer);
  if (!tokens) {
    found.fault = FieldFault{fmt::format("\"{}\"", pointer),
                             "a JSON Pointer such as /problems/0/horizon", "", ""};
    return found;
  }
  Walk(*this, json, *tokens, 0, "", &found);
  return found;
}

void ExperimentDocument::Set(const std::string& pointer, const Json& value) {
  Json* node = &json;
  const std::vector<std::string> tokens = PointerTokens(pointer).value();
  for (const std::string& token : tokens) {
    node = node->is_array() ? &(*node)[*IndexOf(token)] : &(*node)[token];
  }
  *node = value;
}

}  // namespace loopbench::harness
