#include <cmath>
#include <set>

#include "harness/base/text.h"
#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "harness/observers/trajectory.h"
#include "harness/run/run.h"
#include "harness/suite/suite.h"
#include "mechanism/description/outcome.h"
#include "mechanism/model/mechanism.h"

#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {
namespace {

/// Returns the planar mechanism of a problem for the ladder, in one piece.
MechanismDescription PlanarPart(const Experiment& experiment, const ExperimentProblem& problem) {
  CompileOptions options = experiment.compile;
  options.islands = false;
  const MechanismDescription description =
      SimplifyProblem(problem.mechanism.description, problem.mechanism.observe, options)
          .compiled.parts.front()
          .description;
  const auto refuse = [&](const char* found, const char* expected) {
    throw ConfigError(fmt::format("{}: /precision: problem \"{}\": found {}, expected {}",
                                  experiment.path.string(), problem.name, found, expected));
  };
  for (const JointDescription& joint : description.joints) {
    if (!IsBuiltIn(joint.type)) refuse("a joint of another program", "kinds in all scalars");
  }
  for (const ForceDescription& force : description.forces) {
    if (std::holds_alternative<OtherForce>(force)) {
      refuse("a force of another program", "forces in all scalars");
    }
  }
  if (description.space != SpaceKind::kPlanar) refuse("a spatial mechanism", "planar ones");
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  if (!mechanism.stop_times().empty()) {
    refuse("tables of time, at which steps would have to end", "mechanisms without them");
  }
  return description;
}

/// Throws ConfigError for a method whose formulation or projection level exists only in double.
void RequireScalars(const Experiment& experiment, const Method& method) {
  const auto refuse = [&](const std::string& expected) {
    throw ConfigError(fmt::format("{}: /precision: found {}, expected methods {}",
                                  experiment.path.string(), ToString(method), expected));
  };
  if (std::ranges::find(kLadderFormulations, method.formulation) == kLadderFormulations.end()) {
    refuse(fmt::format("of formulations in all scalars: {}", fmt::join(kLadderFormulations, ", ")));
  }
  if (!IsBuiltIn(method.enforcement)) refuse("at levels that come with Loopbench");
}

Record RungKeys(const Case& one, Scalar scalar, double tolerance) {
  Record keys = one.keys;
  keys.Set("kind", std::string("precision"));
  keys.Set("rtol", tolerance);
  keys.Set("atol", tolerance);
  keys.Set("scalar", std::string(ToString(scalar)));
  return keys;
}

void Write(const SweepLevel& rung, Record& record) {
  record.Set("outcome", std::string(ToString(rung.outcome)));
  record.Set("t_reached", rung.t_reached);
  if (!std::isnan(rung.error)) record.Set("error_final", rung.error);
  record.Set("error_dominated_by", rung.error_ruled_by);
  record.Set("drift_position_max", rung.drift);
  record.Set("drift_dominated_by", rung.drift_ruled_by);
  record.Set("steps", rung.steps);
  record.Set("rejected", rung.rejected);
  record.Set("rhs_evaluations", rung.rhs_evaluations);
  record.Set("restarts", rung.restarts);
  record.Set("wall_s", rung.wall_s);
  record.Set("cpu_s", rung.cpu_s);
}

/// Returns true for file names as written by runs; records from other sources are not trusted.
bool IsId(const std::string& text) {
  return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::filesystem::path MechanismPath(const std::filesystem::path& store_file,
                                    const std::string& problem_id) {
  return store_file.parent_path() / "mechanisms" / (problem_id + ".json");
}

/// Comment with the hash of all bytes of the file, computed with zeros in place of the hash.
constexpr std::string_view kChecksum = "Kept by a run; checksum ", kZeros = "0000000000000000";

void VerifyMechanism(const std::filesystem::path& file) {
  if (const std::string text = ReadFile(file); WithOwnHash(text) == text) return;
  throw ChangedFile(
      fmt::format("{}: the file was changed after its run wrote it: its checksum differs; remove "
                  "it: the same run writes it again",
                  file.string()));
}

}  // namespace

std::vector<LadderGroup> LadderGroups(const Experiment& experiment, const Selection& filter) {
  std::vector<LadderGroup> groups;
  for (const Case& one : ExpandLadders(experiment)) {
    LadderGroup group{{.description = {},
                       .method = one.method,
                       .horizon = one.horizon,
                       .precision = experiment.precision,
                       .limits = one.limits},
                      one.problem,
                      {}};
    const Precision& precision = group.task.precision;
    bool any = false;
    for (const Scalar scalar : precision.scalars) {
      for (const double tolerance : precision.tolerances) {
        group.keys.push_back(RungKeys(one, scalar, tolerance));
        any = any || Matches(group.keys.back(), filter);
      }
    }
    if (!any) continue;
    Record reference = RungKeys(one, Scalar::kFloat128, precision.reference);
    reference.Set("integrator", std::string("gragg"));
    group.keys.insert(group.keys.begin(), reference);
    std::string rungs;
    for (const Record& keys : group.keys) rungs += CaseId(keys);
    const std::string content = LadderContent(experiment, one, rungs);
    for (Record& keys : group.keys) SetCaseId(&keys, content);
    groups.push_back(std::move(group));
  }
  return groups;
}

std::size_t CountRungs(const Experiment& experiment) {
  std::size_t count = 0;
  for (const LadderGroup& group : LadderGroups(experiment)) count += group.keys.size();
  return count;
}

void CheckLadders(const Experiment& experiment) {
  const std::vector<Case> cases = ExpandLadders(experiment);
  if (cases.empty()) return;
  for (const Case& one : cases) RequireScalars(experiment, one.method);
  const auto compile = [&] {
    std::set<std::size_t> problems;
    for (const Case& one : cases) {
      if (problems.insert(one.problem).second)
        PlanarPart(experiment, experiment.problems[one.problem]);
    }
    return std::string();
  };
  const ProcessResult result = RunInProcess(LimitsOfRuns(experiment.limits, 1), compile);
  if (result.ending == ProcessEnding::kThrew) throw ConfigError(result.text);
}

void RequireLadders(const Experiment& experiment) {
#ifdef LOOPBENCH_PRECISIONS
  CheckLadders(experiment);
#else
  if (experiment.precision.scalars.empty()) return;
  throw ConfigError(
      fmt::format("{}: /precision: found runs in several scalars, expected none: this program was "
                  "built without them (cmake -DLOOPBENCH_PRECISIONS=ON)",
                  experiment.path.string()));
#endif
}

std::vector<Record> ClimbTogether([[maybe_unused]] const Experiment& experiment,
                                  const LadderGroup& group) {
  std::vector<Record> records = group.keys;
#ifdef LOOPBENCH_PRECISIONS
  LadderTask task = group.task;
  task.description = PlanarPart(experiment, experiment.problems[group.problem]);
  const Ladder ladder = RunLadder(task);
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (ladder.start != Outcome::kFinished) {
      records[i].Set("outcome", std::string(ToString(ladder.start)));
      records[i].Set("message", ladder.message);
    } else {
      Write(i == 0 ? ladder.reference : ladder.rungs[i - 1], records[i]);
    }
  }
#endif
  return records;
}

ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store) {
  ReferenceCase reference;
  reference.problem = one.problem;
  reference.horizon = one.horizon;
  const ExperimentProblem& problem = experiment.problems[one.problem];
  if (problem.series) {
    reference.id = Fnv1a(fmt::format("{}|{}|{}", problem.mechanism.canonical, one.horizon,
                                     problem.series->canonical));
  } else {
    reference.id = ReferenceId(problem, one.horizon, *experiment.reference);
    reference.file = ReferencePath(store, reference.id);
  }
  reference.keys.Set("kind", std::string("reference"));
  reference.keys.Set("experiment", experiment.name);
  reference.keys.Set("mechanism", one.mechanism);
  reference.keys.Set("horizon", one.horizon);
  if (!problem.series) reference.keys.Set("scalar", experiment.reference->scalar);
  SetCaseId(&reference.keys, reference.id);
  return reference;
}

std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store) {
  if (!experiment.reference) return std::nullopt;
  const ReferenceCase known = ReferenceOf(experiment, one, store);
  auto reference =
      ReadReference(known.file, known.id, experiment.problems[one.problem].mechanism.description);
  if (reference) return reference;
  Reference none;
  none.outcome = "unsupported";
  none.message = "it was not made";
  return none;
}

bool HasReference(const Experiment& experiment, const Case& one) {
  return experiment.reference || experiment.problems[one.problem].series;
}

Record MakeOne(const Experiment& experiment, const ReferenceCase& one) {
  const ExperimentProblem& problem = experiment.problems[one.problem];
  const MechanismDescription& user = problem.mechanism.description;
  Record record = one.keys;
  if (problem.series) {
    record.Set("outcome", std::string(ToString(Outcome::kFinished)));
    WriteCertificate(user, *problem.series, one.horizon, record);
    return record;
  }
#ifdef LOOPBENCH_PRECISIONS
  std::optional<Reference> reference = ReadReference(one.file, one.id, user);
  if (!reference) {
    reference = MakeReference(user, one.horizon, LinkLength(user), *experiment.reference);
    WriteReference(one.file, one.id, user, *reference);
  }
  record.Set("outcome", reference->outcome);
  record.Set("message", reference->message);
  record.Set("cpu_s", reference->cpu_s);
  record.Set("rhs_evaluations", reference->rhs_evaluations);
  WriteCertificate(*reference, record);
#endif
  return record;
}

void RequireReferences([[maybe_unused]] const Experiment& experiment) {
#ifndef LOOPBENCH_PRECISIONS
  if (!experiment.reference) return;
  throw ConfigError(
      fmt::format("{}: /reference: found references, expected none: this program was built "
                  "without wide scalars (cmake -DLOOPBENCH_PRECISIONS=ON)",
                  experiment.path.string()));
#endif
}

std::string WithOwnHash(std::string text) {
  const std::size_t at = text.find(kChecksum);
  if (at == std::string::npos) return text;  // format version 1.0
  text.replace(at + kChecksum.size(), kZeros.size(), kZeros);
  return text.replace(at + kChecksum.size(), kZeros.size(), Fnv1a(text));
}

MechanismDescription ReadKeptMechanism(const std::filesystem::path& file) {
  VerifyMechanism(file);
  return ReadMechanism(file).description;
}

void VerifyFilesOf(const std::vector<Record>& records, const std::filesystem::path& store_file) {
  std::set<std::filesystem::path> verified;
  for (const Record& record : records) {
    const std::filesystem::path mechanism = MechanismOf(record, store_file);
    const std::filesystem::path trajectory = TrajectoryOf(record, store_file);
    if (std::filesystem::exists(mechanism) && verified.insert(mechanism).second) {
      VerifyMechanism(mechanism);
    }
    if (std::filesystem::exists(trajectory)) VerifyTrajectory(record, trajectory);
  }
}

std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("problem_id");
  return IsId(id) ? MechanismPath(store_file, id) : std::filesystem::path();
}

std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file) {
  const std::string id = record.Text("reference_file");
  return IsId(id) ? ReferencePath(store_file, id) : std::filesystem::path();
}

void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file) {
  for (const Experiment& experiment : experiments) {
    if (!experiment.reference && !experiment.output) continue;
    for (const ExperimentProblem& problem : experiment.problems) {
      const auto path = MechanismPath(store_file, Fnv1a(problem.mechanism.canonical));
      if (std::filesystem::exists(path)) continue;
      try {
        // another process may have written it meanwhile
        WriteFileAtomically(
            path,
            WithOwnHash(MechanismText(problem.mechanism.description, problem.mechanism.observe,
                                      fmt::format("{}{}.", kChecksum, kZeros))),
            Onto::kAnyFile);
      } catch (const ConfigError&) {
      }
    }
  }
}

void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target) {
  for (const Record& record : records) {
    const std::filesystem::path to = MechanismOf(record, target);
    if (to.empty() || std::filesystem::exists(to)) continue;
    for (const std::filesystem::path& store : stores) {
      const std::filesystem::path from = MechanismOf(record, store);
      if (!std::filesystem::exists(from)) continue;
      const std::string text = ReadFile(from);
      if (WithOwnHash(text) != text) continue;
      WriteFileAtomically(to, text, Onto::kAnyFile);
      break;
    }
  }
}

}  // namespace loopbench::harness
