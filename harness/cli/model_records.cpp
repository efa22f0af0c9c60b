#include "harness/cli/model_records.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "harness/advise/trials.h"
#include "harness/cli/advise_models.h"
#include "harness/cli/certain_motion.h"
#include "harness/config/mechanism_writer.h"
#include "harness/record/noise.h"
#include "harness/record/origin.h"
#include "harness/record/provenance.h"
#include "harness/run/case_identity.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

constexpr int kRepeats = 20;  ///< timed runs of each model; the fastest counts

Choice Alike() {
  return {.column = {.formulation = "odca", .enforcement = Enforcement::kPosition}, .rtol = 1e-8};
}

/// A model with what is known of its motion, and its runs. Stays where it is: its parts refer to
/// each other.
struct JudgedModel {
  const SceneModel& model;
  CertainMotion certain;
  std::unique_ptr<TrialScene> scene = nullptr;  ///< the bench refers to it
  std::unique_ptr<TrialBench> bench = nullptr;
  Trial trial = {};
  std::string fault = "";  ///< why there are no runs
};

/// Runs it once where its motion is certified to the end.
std::unique_ptr<JudgedModel> Examined(const SceneModel& model, double horizon,
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
  judged->scene = std::make_unique<TrialScene>(TrialScene{
      .user = model.description, .reference = reference, .horizon = horizon, .points = {}});
  try {
    judged->bench = MakeTrialBench(*judged->scene);
    judged->trial = judged->bench->Try(Alike(), question.cpu_s);
  } catch (const std::runtime_error& error) {
    judged->fault = error.what();
    judged->bench = nullptr;
  }
  return judged;
}

Record KeysOf(const MechanismFile& file, const SceneModel& model, const ModelQuestion& question) {
  const Choice alike = Alike();
  Record keys;
  keys.Set("kind", std::string("model"));
  keys.Set("mechanism", file.description.name);
  keys.Set("model", model.name);
  keys.Set("formulation", alike.column.formulation);
  keys.Set("enforcement", std::string(ToString(alike.column.enforcement)));
  keys.Set("coordinates", std::string(ToString(alike.column.coordinates)));
  keys.Set("integrator", alike.integrator);
  keys.Set("rtol", alike.rtol);
  keys.Set("horizon", question.horizon);
  SetCaseId(&keys, Fnv1a(fmt::format("{}|{}|{}", file.canonical,
                                     MechanismText(model.description, model.observe, ""),
                                     question.accept)));
  return keys;
}

void WriteRun(const JudgedModel& judged, Record& record) {
  const Trial& trial = judged.trial;
  record.Set("outcome",
             std::string(judged.bench == nullptr ? "inexpressible" : ToString(trial.outcome)));
  record.Set("message", judged.fault);
  record.Set("model_motion", std::string(judged.model.is_exact ? "the same" : "changed"));
  record.Set("bodies", static_cast<std::int64_t>(judged.model.description.bodies.size() - 1));
  record.Set("joints", static_cast<std::int64_t>(judged.model.description.joints.size()));
  if (judged.bench == nullptr) return;
  record.Set("error_position_max", trial.error);
  record.Set("steps", trial.steps);
  record.Set("rhs_evaluations", trial.rhs_evaluations);
  record.Set("wall_s", trial.wall_s);
}

/// What the model causes against the whole one, and whether that is accepted.
void WriteVerdict(const MechanismFile& file, const JudgedModel& whole, const JudgedModel& judged,
                  const ModelQuestion& question, Record& record) {
  if (&judged == &whole) return record.Set("model_verdict", std::string("the whole model"));
  record.Set("model_accepts", question.accept);
  const auto conclude = [&](const std::string& verdict) { record.Set("model_verdict", verdict); };
  if (!judged.fault.empty()) return conclude("refused: " + judged.fault);
  const CausedError caused = ErrorOfModel(file.description, whole.certain.reference, judged.model,
                                          judged.certain.reference, {});
  record.Set("model_points", std::int64_t{caused.points});
  if (caused.points == 0) return conclude("refused: it has no point of the whole one");
  const double certified =
      whole.certain.reference.Certified().position + judged.certain.reference.Certified().position;
  record.Set("model_error", caused.largest);
  record.Set("model_error_at", caused.point);
  record.Set("reference_error", certified);
  record.Set("trust_horizon", caused.until);
  const bool accepted = caused.largest + certified <= question.accept;
  conclude(fmt::format("{} at {} m", accepted ? "accepted" : "refused", question.accept));
}

/// Of a model that is all of the scene, not one of its parts.
void WriteRatios(const Trial& whole, const Trial& trial, Record& record) {
  if (whole.outcome != Outcome::kFinished || trial.outcome != Outcome::kFinished) return;
  record.Set("model_rhs_ratio", static_cast<double>(trial.rhs_evaluations) /
                                    static_cast<double>(whole.rhs_evaluations));
  record.Set("model_wall_ratio", trial.wall_s / whole.wall_s);
}

}  // namespace

std::vector<Record> RecordsOfModels(const MechanismFile& file, const SceneModels& models,
                                    const ModelQuestion& question) {
  std::vector<std::unique_ptr<JudgedModel>> all;
  all.push_back(Examined(models.models.front(), question.horizon, question));
  // where the whole motion is not certified to the end, all are compared as far as it is
  const double until = all.front()->certain.horizon;
  if (until > 0.0 && until < question.horizon) {
    all.front() = Examined(models.models.front(), until, question);
  }
  for (std::size_t i = 1; i < models.models.size(); ++i) {
    all.push_back(Examined(models.models[i], until, question));
  }
  const MachineState machine = ReadMachineState();
  // the whole model once more, last: what a difference of equals would be
  Trial again = all.front()->trial;
  for (int i = 0; i < kRepeats; ++i) {
    for (const auto& judged : all) {
      const bool ran = judged->bench != nullptr && judged->trial.outcome == Outcome::kFinished;
      if (ran) judged->bench->TimeAgain(&judged->trial);
    }
    if (all.front()->bench != nullptr) all.front()->bench->TimeAgain(&again);
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
    if (judged.bench != nullptr && !is_part) WriteRatios(whole, judged.trial, record);
    record.Set("aa_spread_wall", spread);
    record.Set("load1", machine.load1);
    record.Set("processors", std::int64_t{machine.processors});
    record.Set("governor", machine.governor);
    record.Set("noise", NoiseReasons(machine, std::nan(""), spread));
    record.Set("id", RunId(record));
    record.Set("version", CodeVersion());
    Stamp(record);
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace loopbench::harness
