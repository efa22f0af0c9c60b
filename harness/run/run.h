// Runs of one case: its identity, ensembles, peers, short runs, runs side by side.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/options.h"
#include "harness/generate/generated.h"
#include "harness/integrator/arkode.h"
#include "harness/judge/analysis.h"
#include "harness/observers/reference.h"
#include "harness/observers/trajectory.h"
#include "mechanism/formulation/forward_jacobian.h"
#include "mechanism/formulation/side_by_side.h"
#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/model.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

// A problem as it is run: simplified descriptions with their known solutions (docs/decisions/009).

struct SimplifiedProblem {
  Compiled compiled;
  /// With names and angles of simplified bodies: problems with known angles are never split.
  ObservedQuantities observe;
};

/// Problems with known angles, about the user's z, are not split, and spatial ones stay spatial.
SimplifiedProblem SimplifyProblem(const MechanismDescription& description,
                                  const ObservedQuantities& observe, CompileOptions options);

/// Returns the active simplifications, such as "planar, welds", or "none".
std::string ToString(const CompileOptions& options);

// Identity of runs.
//
// A case consists of its keys and its content: all other data that determine the run (mechanism,
// limits, ensemble, simplification, ...). "case_id" identifies both, "id" both and the program that
// ran them, "config_hash" the content alone.

/// Sets "case_id" and "content" (eight digits, for people to choose by) behind the keys.
/// @param content  from one of the functions below
void SetCaseId(Record* keys, const std::string& content);

/// The accuracy case with its id.
Case Identified(const Experiment& experiment, Case entry);

/// Returns the content of an accuracy case.
std::string AccuracyContent(const Experiment& experiment, const Case& entry);

/// Returns the content of timings of a problem, or of a family member, which its keys fully define.
std::string ProblemTimingContent(const Experiment& experiment, const Case& entry);
std::string FamilyTimingContent(const Experiment& experiment);

/// Returns the content of a precision study's levels. `rungs` names all: verdicts depend on them.
std::string LadderContent(const Experiment& experiment, const Case& entry,
                          const std::string& rungs);

/// "id" of a record: its case and this very program.
std::string RunId(const Record& record);

/// Results of one run.
struct Run {
  Record record;
  DriftSeries drift;
  /// Corrections of projections [m], energy balance [J] and largest kinetic energy [J].
  DriftSeries correction = {}, energy = {};
  double kinetic = 0.0;
  double min_violation = 0.0;  ///< smallest violation that projection can reach [link lengths]
  /// The problem's branch combinations (mechanism_reader.h) at the assembled start [rad], or empty.
  std::vector<double> branch_start = {};
};

/// Merges the runs of subsystems, which have their own steps. Work is summed (steps, evaluations,
/// wall time, rank). Drift is the maximum over the parts, at each time of each part's last value.
/// The worst outcome and the earliest end count. Energy errors and their reference energies are
/// summed (upper bounds). Series of corrections, energy and angles belong to one step sequence and
/// are omitted.
Run MergeParts(std::span<const Run> parts);

/// Returns the description of one member: fixed coordinates moved by uniform random amounts of at
/// most `perturb`, or coordinates in `between` drawn uniformly between their bounds. The same seed
/// and member give the same start everywhere.
///
/// Loops stay on their branch: a start is reached in steps of at most 0.1 rad or m, each assembled
/// from the extrapolated previous positions. Shorter paths take one step, with the description's
/// own guesses. If a step cannot be closed, the member has the drawn coordinates and those guesses.
MechanismDescription MemberStart(const MechanismDescription& description, const Case& entry,
                                 int member);

/// Statistics of the members, without the unperturbed run.
class EnsembleTally {
 public:
  /// `nominal` is the unperturbed run; its start determines the branch.
  EnsembleTally(const Run& nominal, double branch_bound)
      : branch_start_(nominal.branch_start), branch_bound_(branch_bound) {}

  /// `start` is the member's initial state.
  void Add(const Run& member, const MechanismDescription& start);

  /// Writes ensemble_size and ensemble_failed (did not finish). For finished members with a known
  /// solution, writes the largest branch, closed-form, energy and drift errors as ensemble_<key>.
  /// If a branch is known, adds ensemble_branch_bound [rad], ensemble_branch_kept (finished,
  /// started on the branch, never further from it than the bound) and ensemble_started_off (on
  /// another branch, finished or not). Keeps non-finite largest errors. ensemble_first_failed and
  /// ensemble_first_left (finished, not kept) give the first such member, its start with all
  /// digits, and its outcome.
  void Write(Record& record) const;

 private:
  bool StartsOnBranch(const Run& member) const;
  void KeepLargest(const Record& record);

  std::vector<double> branch_start_;
  double branch_bound_;
  std::int64_t size_ = 0, failed_ = 0, kept_ = 0, started_off_ = 0;
  std::string first_failed_, first_left_;
  Record largest_;
};

/// Calls run(i, beside) for each i < count: on several threads, and on each of them side by side,
/// as many as there are lanes (mechanism/formulation/side_by_side.h). Runs on one thread switch
/// where they Meet(); each has its own stack of 8 MiB. If memory is short, fewer runs alternate.
/// Returns when all have ended; rethrows the exception of the first run that threw. Sanitizers
/// follow one stack only: with them runs are sequential.
void RunSideBySide(int count, int threads, const std::function<void(int, SideBySide&)>& run);

// Runs one case for accuracy: start, integration, observers, record.

/// The mechanism with the formulation and level that a method names.
template <class Space>
std::unique_ptr<System<Space, double>> MakeFormulation(const Method& method,
                                                       const Mechanism<Space, double>& mechanism,
                                                       SideBySide* beside = nullptr) {
  return MakeFormulation<Space>(method.formulation, mechanism,
                                {.enforcement = method.enforcement,
                                 .solver = method.solver,
                                 .gains = method.gains,
                                 .threads = method.threads,
                                 .general = method.execution != Execution::kLibrary,
                                 .beside = beside});
}

/// Gives a system, after its start, Jacobians for Newton's iteration, unless by differences.
template <class Space>
void GiveJacobian(const std::string& integrator, JacobianKind kind,
                  const MechanismDescription& description, System<Space, double>& system) {
  const bool wanted = FindProfile(integrator)->is_implicit && kind == JacobianKind::kForward;
  if (wanted) system.UseJacobian(std::make_unique<ForwardJacobian<Space>>(description, system));
}

/// Gives a system, after its start and IntegrateWork(), the generated right-hand side of a method.
/// `mechanism` as RecordingSubject has it. Stores NotCovered as outcome of `result`.
template <class Space>
void GiveExecution(const Method& method, const MechanismDescription& description,
                   System<Space, double>& system, IntegratorResult* result,
                   const void* mechanism = nullptr) try {
  if (!IsGenerated(method.execution)) return;
  system.UseCompiled(std::make_unique<generate::GeneratedDerivative<Space>>(
      generate::RecordingSubject{.description = description,
                                 .coordinates = method.coordinates,
                                 .formulation = method.formulation,
                                 .options = system.options(),
                                 .mechanism = mechanism},
      system,
      method.execution == Execution::kGeneratedFma ? generate::Contraction::kFused
                                                   : generate::Contraction::kNone));
} catch (const generate::NotCovered& why) {
  result->outcome = Outcome::kInexpressible;
  result->message = why.what();
}

/// Sets flops, numbers of operations by kind, and depth, as `loopbench count` has them.
void SetOperations(const generate::MethodCounts& counts, Record& record);

/// Sets the operations of a method's right-hand side, recorded next to a start, if it can be.
void WriteOperations(const Method& method, const MechanismDescription& description,
                     const Start<double>& start, Record& record);

/// Method, tolerances and limits of a case, and the stop times of its mechanism.
IntegratorOptions OptionsOf(const Case& entry, const std::vector<double>& stop_times);

/// Limits steps where prescribed motions leave no freedom: joint coordinates may then be linear in
/// time, so that step control permits any step, but the work of the drives is not. Not if the case
/// has a longest step or fixed steps.
template <class Space>
void LimitSteps(const Case& entry, const Mechanism<Space, double>& mechanism,
                IntegratorOptions* options);

/// Returns the absolute tolerance of each component of the state; empty for the case's atol.
template <class Space>
std::vector<double> AtolsOf(const Case& entry, const MechanismDescription& description,
                            const System<Space, double>& system) {
  if (!entry.atols) return {};
  const Mechanism<Space, double>& mechanism = system.mechanism();
  std::vector<double> q(mechanism.num_q()), u(mechanism.num_u());
  const auto set = [&](const Joint<Space, double>& joint, bool speeds, double* next, double length,
                       double angle) {
    const JointType type =
        joint.description < 0 ? JointType::kFree : description.joints[joint.description].type;
    const std::vector<ValueWord> words = ValueWords(type, description.space, speeds);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const bool is_prescribed = mechanism.DriveOf(joint, static_cast<int>(i)) >= 0;
      if (!is_prescribed) *next++ = words[i].is_length() ? length : angle;
    }
  };
  for (const Joint<Space, double>& joint : mechanism.joints()) {
    if (!joint.in_tree()) continue;
    set(joint, false, q.data() + joint.q_offset, entry.atols->length, entry.atols->angle);
    set(joint, true, u.data() + joint.u_offset, entry.atols->speed, entry.atols->angular_speed);
  }
  for (int i = 0; i < system.num_state_speeds(); ++i) q.push_back(u[system.state_speed(i)]);
  return q;
}

/// Runs the case and, if requested, its ensemble of perturbed starts. The record holds the keys,
/// the outcome and all measured values of the unperturbed run. Growth is analysed over the ensemble
/// (or over the single run, which resolves nothing). Limits hold for each run.
///
/// The unperturbed run is compared with a reference at its times, by dense output. If the
/// experiment requests output, its trajectory is written to `trajectory`, unless that is empty.
/// Members run in batches on `threads` threads, which does not change their bits. Other cases may
/// run `beside` the unperturbed run. Numerical failures are stored in the record; only misuse
/// throws.
Record RunCase(const Experiment& experiment, const Case& entry,
               const Reference* reference = nullptr, const std::filesystem::path& trajectory = {},
               int threads = 1, SideBySide* beside = nullptr);

// Short runs: nearly constant coordinates (simplify/model.h), errors of simplified models.

/// Runs the description for `duration` seconds by O-DCA at level projection, ode45 at 1e-6, in
/// joint coordinates. A run that ends earlier (its CPU time is limited to `cpu_s`) returns its data
/// so far and the reason. A run that cannot start returns no data.
ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s);

/// Named points of bodies at equal times, ground axes [m].
struct Track {
  std::string failure;  ///< reason if there is none
  std::vector<double> times;
  std::vector<std::vector<Eigen::Vector3d>> points;  ///< by time, in the order of `names`
  std::vector<std::string> names;                    ///< "<body>.<point>"
  std::int64_t rhs_evaluations = 0;
};

/// Runs the model by multipliers at level projection, dormand-prince at 1e-10. Steps end at the
/// compared times. `whole` selects the points: points of its bodies by their names in the model
/// (FindPoint), if the model has them.
Track TrackOf(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
              const MechanismDescription& whole, double horizon, double cpu_s);

struct ModelError {
  double distance = 0.0;  ///< the largest of any common point at any time [m]
  std::string point;      ///< which
  int points = 0;         ///< compared
};
ModelError Compare(const Track& whole, const Track& model);

// The peers of this build (docs/decisions/018). Their rows are among the formulations in every
// build, the programs only where CMake has LOOPBENCH_PEERS.

/// Makes a peer for a mechanism; it throws Inexpressible.
using PeerFactory = std::function<std::unique_ptr<Peer>(const MechanismDescription&)>;

/// Gives the row of that name its program, before loopbench::Main(). Throws std::invalid_argument
/// for a name that is no peer's or has one already.
void RegisterPeer(const std::string& name, PeerFactory make);

/// Returns null without an engine. Throws Inexpressible, and ConfigError for a missing engine.
std::unique_ptr<Peer> MakePeer(const std::string& formulation,
                               const MechanismDescription& description);

/// Does the same; stores Inexpressible as outcome and message of `result`, otherwise unchanged.
std::unique_ptr<Peer> TryPeer(const std::string& formulation,
                              const MechanismDescription& description, IntegratorResult* result);

/// Throws ConfigError if a method of an experiment names an engine that this build does not
/// contain. Every build can read such files, but not run them.
void RequirePeers(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
