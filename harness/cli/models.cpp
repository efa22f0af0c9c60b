// Models of one problem, their certified motions, errors and records.
#include <unistd.h>

#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "harness/suite/advise.h"

#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

void AddModels(const MechanismFile& file, const std::string& name, bool is_exact,
               const std::string& assumption, const Simplified& simplified, ProblemModels* ladder) {
  for (std::size_t part = 0; part < simplified.parts.size(); ++part) {
    ProblemModel model;
    model.name = simplified.parts.size() == 1 ? name : fmt::format("{}-{}", name, part + 1);
    model.is_exact = is_exact;
    model.description = simplified.parts[part];
    model.description.name = fmt::format("{}-{}", file.description.name, model.name);
    const bool same_axes =
        simplified.R_WC.isIdentity(0.0) && model.description.space == file.description.space;
    // exact facts of bodies that still exist; only an exact model in one part has the expected
    // degrees of freedom
    const bool keeps_facts = is_exact && same_axes;
    const auto is_there = [&model](const std::string& body) {
      return Contains(model.description.bodies, body, &BodyDescription::name);
    };
    ObservedQuantities& known = model.observe = file.observe;
    std::erase_if(known.branch_invariants, [&](const AngleCombination& combination) {
      return !keeps_facts || !std::ranges::all_of(combination, [&](const auto& term) {
        return is_there(term.first);
      });
    });
    if (known.closed_form && (!keeps_facts || !is_there(known.closed_form->body))) {
      known.closed_form.reset();
    }
    if (!is_exact || simplified.parts.size() > 1) known.expected.reset();
    model.done = simplified.done;
    model.dropped = simplified.dropped;
    model.assumption = assumption;
    model.R_WC = simplified.R_WC;
    ladder->models.push_back(std::move(model));
  }
}

std::string Sentence(std::string text) {
  if (!text.empty() && text.back() != '.') text += '.';
  return text;
}

std::string CommentOf(const ProblemModel& model, const std::string& whole) {
  std::string text =
      fmt::format("{} of {}: {}", model.is_exact ? "Exact model" : "Simplified model", whole,
                  Sentence(Joined(model.done, "; ")));
  if (!model.dropped.empty()) text += " Removed: " + Sentence(Joined(model.dropped, "; "));
  if (!model.assumption.empty()) text += fmt::format(" Assumption: {}", Sentence(model.assumption));
  return text;
}

std::string List(const std::vector<std::string>& lines) {
  return Joined(lines, "",
                [](const std::string& line) { return "- " + EscapeMarkdown(line) + "\n"; });
}

std::string LadderName(const ProblemModels& ladder) {
  return ladder.models.front().description.name + "-models";
}

/// Returns a line per removed body: the new places of its points, and the points that no longer
/// exist.
std::vector<std::string> RemovedParts(const MechanismDescription& whole,
                                      const MechanismDescription& simplified) {
  std::vector<std::string> lines;
  for (const std::string& body : RemovedBodies(whole, simplified)) {
    std::vector<std::string> found, lost;
    for (const auto& [point, at] :
         std::ranges::find(whole.bodies, body, &BodyDescription::name)->points) {
      const FoundPoint now = FindPoint(simplified, body, point);
      if (now.body < 0) {
        lost.push_back(point);
      } else {
        AddNote(found, "{} on {}", point,
                now.body == kGround ? "ground" : simplified.bodies[now.body].name);
      }
    }
    AddNote(lines, "body {} is removed{}{}{}{}", body,
            found.empty() ? "" : "; its points: ", Joined(found, ", "),
            lost.empty() ? "" : "; removed points: ", Joined(lost, ", "));
  }
  return lines;
}

std::string PageOf(const ProblemModels& ladder, double horizon, const std::string& typed) {
  const MechanismDescription& whole = ladder.models.front().description;
  std::string page = fmt::format(
      "# Models of {}\n\nWritten by `{}`. `{}` runs all of them for {} s.\n\n"
      "| file | motion | bodies | joints | forces | model error [m] | evaluations |\n"
      "|---|---|---|---|---|---|---|\n",
      EscapeMarkdown(whole.name), EscapeMarkdown(typed), LadderFileName(ladder), horizon);
  for (const ProblemModel& model : ladder.models) {
    page +=
        fmt::format("| {}.json | {} | {} | {} | {} | {} | {} |\n", model.name,
                    model.is_exact ? "the same" : "changed", model.description.bodies.size() - 1,
                    model.description.joints.size(), model.description.forces.size(), model.error,
                    model.rhs_evaluations < 0 ? "" : std::to_string(model.rhs_evaluations));
  }
  if (ladder.models.front().rhs_evaluations >= 0) {
    page +=
        "\n*model error*: the largest distance of a named point from its place in the full model, "
        "at 50 times of an accurate run (multipliers at level projection, dormand-prince at "
        "1e-10); *evaluations*: right-hand sides of that run.\n";
  }
  for (std::size_t i = 1; i < ladder.models.size(); ++i) {
    const ProblemModel& model = ladder.models[i];
    page += fmt::format("\n## {}\n\n{}", model.name, List(model.done));
    if (!model.dropped.empty()) page += fmt::format("\nRemoved:\n\n{}", List(model.dropped));
    if (!model.assumption.empty()) {
      page += fmt::format("\nAssumption: {}\n", EscapeMarkdown(Sentence(model.assumption)));
    }
    const std::vector<std::string> gone = RemovedParts(whole, model.description);
    if (!gone.empty()) page += fmt::format("\nNames:\n\n{}", List(gone));
    if (!model.R_WC.isIdentity(0.0)) {
      const auto axis = [&](int i_axis) {
        const Eigen::Vector3d v = model.R_WC.col(i_axis);
        return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
      };
      page += fmt::format("\nIts x, y and z axes are {}, {} and {} in the full model.\n", axis(0),
                          axis(1), axis(2));
    }
  }
  return page;
}

constexpr int kRepeats = 20;  ///< timed runs of each model; the fastest counts

Choice Alike() {
  return {.method = {.formulation = "odca", .enforcement = Enforcement::kPosition}, .rtol = 1e-8};
}

/// Model with data on its motion, and its runs. Not movable: its parts refer to each other.
struct JudgedModel {
  const ProblemModel& model;
  CertainMotion certain;
  std::unique_ptr<TrialProblem> problem = nullptr;  ///< the bench refers to it
  std::unique_ptr<TrialBench> bench = nullptr;
  Trial trial = {};
  std::string fault = "";  ///< reason why there are no runs
};

/// Runs the model once if its motion is certified to the end.
std::unique_ptr<JudgedModel> Examined(const ProblemModel& model, double horizon,
                                      const ModelQuestion& question) {
  auto judged = std::make_unique<JudgedModel>(JudgedModel{
      model, MakeCertainMotion(model.description, horizon, question.cpu_s, question.what)});
  const Reference& reference = judged->certain.reference;
  if (judged->certain.horizon < horizon || !(horizon > 0.0)) {
    judged->fault =
        reference.message.empty()
            ? fmt::format("its motion is certified until {} s only", judged->certain.horizon)
            : reference.message;
    return judged;
  }
  judged->problem = std::make_unique<TrialProblem>(TrialProblem{
      .user = model.description, .reference = reference, .horizon = horizon, .points = {}});
  try {
    judged->bench = MakeTrialBench(*judged->problem);
    judged->trial = judged->bench->Try(Alike(), question.cpu_s);
  } catch (const std::runtime_error& error) {
    judged->fault = error.what();
    judged->bench = nullptr;
  }
  return judged;
}

Record KeysOf(const MechanismFile& file, const ProblemModel& model, const ModelQuestion& question) {
  const Choice alike = Alike();
  Record keys;
  Put(keys, "kind", "model", "mechanism", file.description.name, "model", model.name, "formulation",
      alike.method.formulation, "enforcement", alike.method.enforcement, "coordinates",
      alike.method.coordinates, "integrator", alike.integrator, "rtol", alike.rtol, "horizon",
      question.horizon);
  SetCaseId(&keys, Fnv1a(fmt::format("{}|{}|{}", file.canonical,
                                     MechanismText(model.description, model.observe, ""),
                                     question.accept)));
  return keys;
}

void WriteRun(const JudgedModel& judged, Record& record) {
  const Trial& trial = judged.trial;
  const MechanismDescription& description = judged.model.description;
  const bool has_run = judged.bench != nullptr;
  Put(record, "outcome", has_run ? ToString(trial.outcome) : "unsupported", "message", judged.fault,
      "model_motion", judged.model.is_exact ? "the same" : "changed", "bodies",
      description.bodies.size() - 1, "joints", description.joints.size());
  if (!has_run) return;
  Put(record, "error_position_max", trial.error, "steps", trial.steps, "rhs_evaluations",
      trial.rhs_evaluations, "wall_s", trial.wall_s);
}

/// Writes the error of the model relative to the full model, and whether it is accepted.
void WriteVerdict(const MechanismFile& file, const JudgedModel& whole, const JudgedModel& judged,
                  const ModelQuestion& question, Record& record) {
  if (&judged == &whole) return record.Set("model_verdict", std::string("full model"));
  record.Set("model_accepts", question.accept);
  const auto conclude = [&](const std::string& verdict) { record.Set("model_verdict", verdict); };
  if (!judged.fault.empty()) return conclude("rejected: " + judged.fault);
  const CausedError caused = ErrorOfModel(file.description, whole.certain.reference, judged.model,
                                          judged.certain.reference, {});
  record.Set("model_points", std::int64_t{caused.points});
  if (caused.points == 0) return conclude("rejected: it has no point of the full model");
  const double certified =
      whole.certain.reference.Certified().position + judged.certain.reference.Certified().position;
  Put(record, "model_error", caused.largest, "model_error_at", caused.point, "reference_error",
      certified, "reference_valid_until", caused.until);
  const bool accepted = caused.largest + certified <= question.accept;
  conclude(fmt::format("{} at {} m", accepted ? "accepted" : "rejected", question.accept));
}

}  // namespace

ProblemModels MakeModels(const MechanismFile& file,
                         const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                         const SimplifyOptions& options) {
  ProblemModels ladder;
  ProblemModel& whole = ladder.models.emplace_back();
  whole.name = "full";
  whole.description = file.description;
  whole.observe = file.observe;
  for (const SimplificationRule* idea : ideas) {
    ladder.ideas.emplace_back(idea, idea->apply(file.description, run, options));
    const Simplified& simplified = ladder.ideas.back().second;
    if (!simplified.applies()) continue;
    AddModels(file, std::string(idea->name), idea->is_exact, std::string(idea->assumption),
              simplified, &ladder);
  }
  const Simplified all = Combine(file.description, ideas, run, options);
  if (all.ideas.size() < 2) return ladder;  // it would equal that rule's model
  std::vector<std::string> assumptions =
      Mapped<std::string>(all.ideas, &SimplificationRule::assumption);
  std::erase(assumptions, "");
  AddModels(file, "combined", std::ranges::all_of(all.ideas, &SimplificationRule::is_exact),
            Joined(assumptions, "; "), all, &ladder);
  return ladder;
}

std::vector<std::string> RemovedBodies(const MechanismDescription& whole,
                                       const MechanismDescription& simplified) {
  std::vector<std::string> names = Mapped<std::string>(whole.bodies, &BodyDescription::name);
  names.erase(names.begin());  // ground
  std::erase_if(names, [&simplified](const std::string& name) {
    return Contains(simplified.bodies | std::views::drop(1), name, &BodyDescription::name);
  });
  return names;
}

void MeasureErrors(double horizon, double cpu_s, ProblemModels* ladder) {
  const MechanismDescription& whole = ladder->models.front().description;
  Track truth;
  for (ProblemModel& model : ladder->models) {
    const bool is_whole = &model == &ladder->models.front();
    Track track = TrackOf(model.description, model.R_WC, whole, horizon, cpu_s);
    model.rhs_evaluations = track.rhs_evaluations;
    model.worst = track.failure;
    if (is_whole) truth = std::move(track);
    if (is_whole || !model.worst.empty()) continue;
    if (!truth.failure.empty()) {
      model.worst = "the full model: " + truth.failure;
      continue;
    }
    const ModelError error = Compare(truth, track);
    model.error = error.points > 0 ? fmt::format("{:.1e}", error.distance) : "";
    model.worst = error.points > 0 ? error.point : "no point in common";
  }
}

std::string LadderFileName(const ProblemModels& ladder) {
  return FileName(LadderName(ladder)) + ".json";
}

void WriteModels(const ProblemModels& ladder, double horizon, const std::string& typed,
                 const std::filesystem::path& folder, bool force) {
  std::error_code error;
  const bool is_there = fs::exists(fs::symlink_status(folder, error)) &&
                        !(fs::is_directory(folder, error) && fs::is_empty(folder, error));
  if (is_there && !force) {
    Reject("{}: found a folder with files, expected a new one; --force puts the models among them",
           folder.string());
  }
  const std::string& whole = ladder.models.front().description.name;
  std::map<std::string, std::string> files;
  LadderFile experiment{LadderName(ladder),
                        fmt::format("Models of {}, the full model first (models.md).", whole),
                        {},
                        horizon};
  for (const ProblemModel& model : ladder.models) {
    const std::string file = model.name + ".json";
    const std::string comment =
        &model == &ladder.models.front() ? "The full model." : CommentOf(model, whole);
    files[file] = MechanismText(model.description, model.observe, comment);
    experiment.mechanisms.push_back(file);
  }
  const std::string run = LadderFileName(ladder);
  files[run] = LadderText(experiment);
  files["models.md"] = PageOf(ladder, horizon, typed);
  fs::path target = folder;
  if (!target.has_filename()) target = target.parent_path();  // "out/"
  const Unfinished fresh{fs::path(target).concat(fmt::format(".new-{}", ::getpid()))};
  for (const auto& [name, text] : files) WriteFileAtomically(fresh.path() / name, text);
  ReadExperiments(fresh.path() / run);
  if (is_there) {
    for (const auto& [name, text] : files) WriteFileAtomically(folder / name, text);
    return;
  }
  fs::rename(fresh.path(), target, error);
  if (error) {
    Reject<std::runtime_error>("cannot make '{}': {}", target.string(), error.message());
  }
}

std::vector<Record> RecordsOfModels(const MechanismFile& file, const ProblemModels& models,
                                    const ModelQuestion& question) {
  std::vector<std::unique_ptr<JudgedModel>> all;
  all.push_back(Examined(models.models.front(), question.horizon, question));
  // if the full motion is not certified to the end, all models are compared up to its trust horizon
  const double until = all.front()->certain.horizon;
  if (until > 0.0 && until < question.horizon) {
    all.front() = Examined(models.models.front(), until, question);
  }
  for (std::size_t i = 1; i < models.models.size(); ++i) {
    all.push_back(Examined(models.models[i], until, question));
  }
  const MachineState machine = ReadMachineState();
  // the full model again, last: apparent difference of equal models
  Trial again = all.front()->trial;
  for (int i = 0; i < kRepeats; ++i) {
    for (const auto& judged : all) {
      const bool ran = judged->bench != nullptr && judged->trial.outcome == Outcome::kFinished;
      if (ran) judged->bench->Remeasure(&judged->trial);
    }
    if (all.front()->bench != nullptr) all.front()->bench->Remeasure(&again);
  }
  const Trial& whole = all.front()->trial;
  const double spread = AaSpread({whole.wall_s}, {again.wall_s});
  std::vector<Record> records;
  for (const auto& one : all) {
    const JudgedModel& judged = *one;
    Record record = KeysOf(file, judged.model, question);
    WriteRun(judged, record);
    WriteVerdict(file, *all.front(), judged, question, record);
    const bool is_part = judged.model.name.starts_with("islands");
    const Trial& trial = judged.trial;
    const bool both_finished =
        whole.outcome == Outcome::kFinished && trial.outcome == Outcome::kFinished;
    if (judged.bench != nullptr && !is_part && both_finished) {
      Put(record, "model_rhs_ratio",
          static_cast<double>(trial.rhs_evaluations) / static_cast<double>(whole.rhs_evaluations),
          "model_wall_ratio", trial.wall_s / whole.wall_s);
    }
    Put(record, "aa_spread_wall", spread, "load1", machine.load1, "processors", machine.processors,
        "governor", machine.governor, "noise", NoiseReasons(machine, std::nan(""), spread));
    Put(record, "id", RunId(record), "version", CodeVersion());
    Stamp(record);
    records.push_back(std::move(record));
  }
  return records;
}

CertainMotion MakeCertainMotion([[maybe_unused]] const MechanismDescription& user,
                                [[maybe_unused]] double horizon, [[maybe_unused]] double cpu_s,
                                [[maybe_unused]] const std::string& what) {
#ifdef LOOPBENCH_PRECISIONS
  CertainMotion certain{.options = {.scalar = "long-double", .cpu_s = cpu_s}, .horizon = horizon};
  const int all = certain.options.points;
  const auto make = [&] {
    certain.reference = MakeReference(user, certain.horizon, LinkLength(user), certain.options);
    return certain.reference.trust_horizon;
  };
  // a reference is certified up to one of its output times, so the run needs the same times
  constexpr int kFewest = 41, kMaxEnds = 8;
  double end = make();
  for (int i = 0; i < kMaxEnds && end > 0.0 && end < certain.horizon; ++i) {
    const int trusted = static_cast<int>(certain.reference.NumTrusted());
    certain.options.points = trusted < kFewest ? all : trusted;
    certain.horizon = end;
    end = make();
  }
  certain.horizon = end;
  return certain;
#else
  Reject(
      "{} needs certified references: this program was built without wide scalars (cmake "
      "-DLOOPBENCH_PRECISIONS=ON)",
      what);
#endif
}

CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const ProblemModel& model, const Reference& reference,
                         const std::vector<std::string>& names) {
  CausedError error;
  const std::size_t count = std::min(whole_reference.NumTrusted(), reference.NumTrusted());
  if (count > 0) error.until = whole_reference.times[count - 1];
  for (std::size_t body = 1; body < whole.bodies.size(); ++body) {
    for (const auto& [point, at] : whole.bodies[body].points) {
      const std::string name = whole.bodies[body].name + "." + point;
      if (!names.empty() && !Contains(names, name)) continue;
      const FoundPoint found = FindPoint(model.description, whole.bodies[body].name, point);
      if (found.body < 0) continue;
      ++error.points;
      for (std::size_t k = 0; k < count; ++k) {
        const Frame& X = whole_reference.snapshots[k].bodies[body].pose;
        const Frame& Y = reference.snapshots[k].bodies[found.body].pose;
        const double off = (X.p + X.R * at - model.R_WC * (Y.p + Y.R * found.at)).norm();
        if (off <= error.largest) continue;
        error.largest = off;
        error.point = name;
      }
    }
  }
  return error;
}

}  // namespace loopbench::harness
