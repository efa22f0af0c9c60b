// Runs one case with all its runs.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "harness/analysis/growth.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/config/options.h"
#include "harness/generate/generated.h"
#include "harness/integrator/arkode.h"
#include "harness/record/record.h"
#include "harness/reference/error_meter.h"
#include "harness/reference/reference.h"
#include "harness/run/ensemble.h"
#include "harness/run/side_by_side.h"
#include "harness/trajectory/trajectory.h"
#include "mechanism/formulation/forward_jacobian.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

// Run-level record keys besides the observers' measurements.

/// Writes the outcome of the run and the integrator's counters. Newton steps of a projection count
/// as evaluations, too.
void WriteCounts(const IntegratorResult& result, std::int64_t projection_steps, bool is_implicit,
                 Record& record);

/// Growth of drift over an ensemble, of which `failed` did not finish.
void WriteGrowth(const Growth& growth, int failed, Record& record);

/// Writes the exponent of a growth other than drift, known only in this run, without a verdict.
void WriteExponent(const std::string& key, const DriftSeries& series, double horizon, double scale,
                   Record& record);

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

/// Gives a system, after its start, the Jacobians for the Newton iteration of a case: none for
/// difference quotients or without iteration.
template <class Space>
void GiveJacobian(const std::string& integrator, JacobianKind kind,
                  const MechanismDescription& description, System<Space, double>& system) {
  const bool wanted = FindProfile(integrator)->is_implicit && kind == JacobianKind::kForward;
  if (wanted) system.UseJacobian(std::make_unique<ForwardJacobian<Space>>(description, system));
}

/// Gives a system, after its start and IntegrateWork(), the generated right-hand side of a method.
/// `mechanism` as RecordingSubject has it. Throws NotCovered (harness/generate/record.h).
template <class Space>
void GiveExecution(const Method& method, const MechanismDescription& description,
                   System<Space, double>& system, const void* mechanism = nullptr) {
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
}

/// Stores NotCovered as outcome and message of `result` instead of throwing it.
template <class Space>
void GiveExecution(const Method& method, const MechanismDescription& description,
                   System<Space, double>& system, IntegratorResult* result,
                   const void* mechanism = nullptr) {
  try {
    GiveExecution(method, description, system, mechanism);
  } catch (const generate::NotCovered& why) {
    result->outcome = Outcome::kInexpressible;
    result->message = why.what();
  }
}

/// Sets flops, numbers of operations by kind, and depth, as `loopbench count` has them.
void SetOperations(const generate::MethodCounts& counts, Record& record);

/// Records a method's right-hand side next to a start and sets its operations. Sets nothing if it
/// cannot be recorded.
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

/// Returns the absolute tolerance of each component of a system's present state. Empty if all have
/// the case's atol.
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
/// With a reference (harness/reference/), the unperturbed run is compared with it at the
/// reference's times, by dense output.
///
/// If the experiment requests output, the unperturbed run's trajectory is written to `trajectory`
/// (harness/trajectory/), unless that is empty.
///
/// Members of the ensemble run in batches on `threads` threads (side_by_side.h), which does not
/// change their bits. Other cases may run `beside` the unperturbed run.
///
/// Numerical failures are stored in the record; only misuse throws.
Record RunCase(const Experiment& experiment, const Case& entry,
               const Reference* reference = nullptr, const std::filesystem::path& trajectory = {},
               int threads = 1, SideBySide* beside = nullptr);

// One motion of a case: start, integration, observers, and their records.

/// Reference for the motion: one of these, or none.
struct ErrorReference {
  const Reference* reference = nullptr;     ///< with snapshots
  const PublishedSeries* series = nullptr;  ///< with times within the horizon
};

/// The case itself, or a member of its ensemble, which has fewer observers.
enum class RunKind { kCase, kMember };

/// `description` is the case's or the start of an ensemble member. Other runs may be `beside` it.
/// Parts connected through ground alone run one after another.
Run RunOnce(const Experiment& experiment, const Case& entry,
            const MechanismDescription& description, RunKind kind, SideBySide* beside,
            const ErrorReference& held = {}, const TrajectoryTask* trajectory = nullptr);

}  // namespace loopbench::harness
