#include "harness/suite/reference_cases.h"

#include <fmt/format.h>

#include "harness/analysis/link_length.h"
#include "harness/reference/error_meter.h"
#include "harness/run/case_identity.h"
#include "harness/text/config_error.h"
#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {

ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store) {
  ReferenceCase reference;
  reference.scene = one.scene;
  reference.horizon = one.horizon;
  reference.id = ReferenceId(experiment.scenes[one.scene], one.horizon, *experiment.reference);
  reference.file = ReferencePath(store, reference.id);
  reference.keys.Set("kind", std::string("reference"));
  reference.keys.Set("experiment", experiment.name);
  reference.keys.Set("mechanism", one.mechanism);
  reference.keys.Set("horizon", one.horizon);
  reference.keys.Set("scalar", experiment.reference->scalar);
  SetCaseId(&reference.keys, reference.id);
  return reference;
}

std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store) {
  if (!experiment.reference) return std::nullopt;
  const ReferenceCase known = ReferenceOf(experiment, one, store);
  auto reference =
      ReadReference(known.file, known.id, experiment.scenes[one.scene].mechanism.description);
  if (reference) return reference;
  Reference none;
  none.outcome = "inexpressible";
  none.message = "it was not made";
  return none;
}

#ifdef LOOPBENCH_PRECISIONS

Record MakeOne(const Experiment& experiment, const ReferenceCase& one) {
  const MechanismDescription& user = experiment.scenes[one.scene].mechanism.description;
  std::optional<Reference> reference = ReadReference(one.file, one.id, user);
  if (!reference) {
    reference = MakeReference(user, one.horizon, LinkLength(user), *experiment.reference);
    WriteReference(one.file, one.id, user, *reference);
  }
  Record record = one.keys;
  record.Set("outcome", reference->outcome);
  record.Set("message", reference->message);
  record.Set("cpu_s", reference->cpu_s);
  record.Set("rhs_evaluations", reference->rhs_evaluations);
  WriteCertificate(*reference, record);
  return record;
}

void RequireReferences(const Experiment&) {}

#else

Record MakeOne(const Experiment&, const ReferenceCase& one) { return one.keys; }

void RequireReferences(const Experiment& experiment) {
  if (!experiment.reference) return;
  throw ConfigError(
      fmt::format("{}: /reference: found references, expected none: this program was built "
                  "without wide scalars (cmake -DLOOPBENCH_PRECISIONS=ON)",
                  experiment.path.string()));
}

#endif

}  // namespace loopbench::harness
