#include "harness/suite/reference_cases.h"

#include <fmt/format.h>

#include "harness/analysis/link_length.h"
#include "harness/reference/error_meter.h"
#include "harness/reference/series_meter.h"
#include "harness/run/case_identity.h"
#include "harness/text/config_error.h"
#include "harness/text/hash.h"
#include "mechanism/description/outcome.h"
#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {

ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store) {
  ReferenceCase reference;
  reference.scene = one.scene;
  reference.horizon = one.horizon;
  const ExperimentScene& scene = experiment.scenes[one.scene];
  if (scene.series) {
    reference.id = Fnv1a(
        fmt::format("{}|{}|{}", scene.mechanism.canonical, one.horizon, scene.series->canonical));
  } else {
    reference.id = ReferenceId(scene, one.horizon, *experiment.reference);
    reference.file = ReferencePath(store, reference.id);
  }
  reference.keys.Set("kind", std::string("reference"));
  reference.keys.Set("experiment", experiment.name);
  reference.keys.Set("mechanism", one.mechanism);
  reference.keys.Set("horizon", one.horizon);
  if (!scene.series) reference.keys.Set("scalar", experiment.reference->scalar);
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

namespace {

Record CertificateOf(const ExperimentScene& scene, const ReferenceCase& one) {
  Record record = one.keys;
  record.Set("outcome", std::string(ToString(Outcome::kFinished)));
  WriteCertificate(scene.mechanism.description, *scene.series, one.horizon, record);
  return record;
}

}  // namespace

bool HasReference(const Experiment& experiment, const Case& one) {
  return experiment.reference || experiment.scenes[one.scene].series;
}

#ifdef LOOPBENCH_PRECISIONS

Record MakeOne(const Experiment& experiment, const ReferenceCase& one) {
  const ExperimentScene& scene = experiment.scenes[one.scene];
  if (scene.series) return CertificateOf(scene, one);
  const MechanismDescription& user = scene.mechanism.description;
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

Record MakeOne(const Experiment& experiment, const ReferenceCase& one) {
  const ExperimentScene& scene = experiment.scenes[one.scene];
  return scene.series ? CertificateOf(scene, one) : one.keys;
}

void RequireReferences(const Experiment& experiment) {
  if (!experiment.reference) return;
  throw ConfigError(
      fmt::format("{}: /reference: found references, expected none: this program was built "
                  "without wide scalars (cmake -DLOOPBENCH_PRECISIONS=ON)",
                  experiment.path.string()));
}

#endif

}  // namespace loopbench::harness
