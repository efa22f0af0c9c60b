#include "harness/base/text.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

const BodyImage& ImageOf(const MechanismDescription& description, const Compiled& compiled,
                         const std::string& name) {
  const auto body = std::ranges::find(description.bodies, name, &BodyDescription::name);
  return compiled.bodies[static_cast<std::size_t>(body - description.bodies.begin())];
}

/// Returns the content common to all runs besides their keys.
Record CommonContent(const Experiment& experiment) {
  Record content = RecordOf(experiment.limits);
  content.Set("preprocess", ToString(experiment.compile));
  return content;
}

Record ProblemContent(const Experiment& experiment, const Case& entry) {
  Record content = CommonContent(experiment);
  content.Set("document", experiment.problems[entry.problem].mechanism.canonical);
  const Profile* profile = FindProfile(entry.integrator);
  if (profile != nullptr && profile->is_own && !IsPeer(entry.method)) {
    content.Set("butcher_table", ToString(profile->table));
  }
  return content;
}

}  // namespace

SimplifiedProblem SimplifyProblem(const MechanismDescription& description,
                                  const ObservedQuantities& observe, CompileOptions options) {
  const bool angles = !observe.branch_invariants.empty() || observe.closed_form.has_value();
  if (angles) options.islands = false;
  if (angles && description.space == SpaceKind::kSpatial) {  // no body may change its axes
    const bool redundancy = options.redundancy;
    options = CompileOptions::None();
    options.redundancy = redundancy;
  }
  SimplifiedProblem problem{Compile(description, options), observe};
  if (problem.compiled.done == CompileOptions::None()) return problem;
  const std::vector<BodyDescription>& bodies = problem.compiled.parts.front().description.bodies;
  for (AngleCombination& combination : problem.observe.branch_invariants) {
    // fixed terms add a constant, and only changes count
    std::erase_if(combination, [&](const auto& term) {
      return ImageOf(description, problem.compiled, term.first).part < 0;
    });
    for (auto& [name, factor] : combination) {
      name = bodies[ImageOf(description, problem.compiled, name).body].name;
    }
  }
  if (auto& form = problem.observe.closed_form) {
    const BodyImage& image = ImageOf(description, problem.compiled, form->body);
    if (image.part < 0) {
      form.reset();
    } else {
      form->body = bodies[image.body].name;
      form->down_angle -= image.turn;
    }
  }
  return problem;
}

std::string ToString(const CompileOptions& options) {
  std::string text;
  const auto add = [&](bool on, const char* name) {
    if (on) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(options.planar, "planar");
  add(options.welds, "welds");
  add(options.immovable, "immovable");
  add(options.islands, "islands");
  add(options.redundancy, "redundancy");
  return text.empty() ? "none" : text;
}

void SetCaseId(Record* keys, const std::string& content) {
  constexpr std::size_t kDigits = 8;
  keys->Set("case_id", Fnv1a(CaseId(*keys) + content));
  keys->Set("config_hash", content.substr(0, kDigits));
}

std::string AccuracyContent(const Experiment& experiment, const Case& entry) {
  Record content = ProblemContent(experiment, entry);
  content.Set("ensemble", std::int64_t{entry.ensemble});
  content.Set("seed", static_cast<std::int64_t>(entry.seed));
  content.Set("perturb", entry.perturb);
  for (const DrawnCoordinate& drawn : entry.between) {
    content.Set("between." + drawn.joint, std::vector<double>{drawn.from, drawn.to});
  }
  content.Set("branch_bound", entry.branch_bound);
  content.Set("series_points", std::int64_t{experiment.series_points});
  if (const auto& series = experiment.problems[entry.problem].series) {
    content.Set("reference_series", series->canonical);
  }
  if (experiment.reference) {
    content.Set("reference", experiment.reference->scalar);
    content.Set("reference_points", std::int64_t{experiment.reference->points});
    content.Set("reference_cpu_s", experiment.reference->cpu_s);
  }
  if (experiment.refine) content.Set("refine", std::string("true"));
  if (experiment.output) content.Set("output", ToString(*experiment.output));
  return CaseId(content);
}

Case Identified(const Experiment& experiment, Case entry) {
  SetCaseId(&entry.keys, AccuracyContent(experiment, entry));
  return entry;
}

std::string ProblemTimingContent(const Experiment& experiment, const Case& entry) {
  Record content = ProblemContent(experiment, entry);
  content.Set("repeats", std::int64_t{experiment.timing.repeats});
  return CaseId(content);
}

std::string FamilyTimingContent(const Experiment& experiment) {
  Record content = CommonContent(experiment);
  content.Set("repeats", std::int64_t{experiment.timing.repeats});
  return CaseId(content);
}

std::string LadderContent(const Experiment& experiment, const Case& entry,
                          const std::string& rungs) {
  Record content = ProblemContent(experiment, entry);
  content.Set("rungs", rungs);
  return CaseId(content);
}

std::string RunId(const Record& record) { return Fnv1a(record.Text("case_id") + CodeVersion()); }

}  // namespace loopbench::harness
