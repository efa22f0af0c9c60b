// The top level of an experiment file.
#include <fmt/format.h>

#include "harness/config/experiment_sections.h"
#include "harness/config/file_schemas.h"
#include "harness/config/options.h"

namespace loopbench::harness {

namespace {

using File = ExperimentFile;

void ReadAllColumns(const JsonNode& node, File& file) {
  file.columns = file.timing.columns = ReadColumns(node);
}

void ReadPrecision(const JsonNode& node, File& file) {
  file.precision.tolerances = file.tolerances;
  PrecisionFields().Read(node, &file.precision);
}

/// Reports levels whose derivative an implicit profile asks for, and that have none.
void RequireDerivatives(const JsonNode& node, File& file) {
  const auto integrator = node.Optional("integrator");
  const Profile* profile = FindProfile(file.integrator);
  if (!integrator || profile == nullptr || !profile->is_implicit) return;
  if (file.jacobian != JacobianKind::kForward) return;
  for (const auto& columns : {file.columns, file.timing.columns}) {
    for (const Column& column : columns) {
      const LevelTraits& level = TraitsOf(column.enforcement);
      if (level.has_derivative) continue;
      integrator->FailAs(
          fmt::format("\"{}\" at level \"{}\", which has no derivative", profile->name, level.name),
          "\"jacobian\": \"finite-difference\" beside it");
      return;
    }
  }
}

}  // namespace

const Fields<ExperimentFile>& ExperimentFileFields() {
  static const Fields<File> fields(
      "experiment",
      "Which mechanisms, columns, tolerances and horizons are run. Lists expand as a cross "
      "product. The program checks more than this schema: that mechanism files exist and are "
      "valid, that scenes and columns are different, that fields of a sweep exist, that ranges "
      "have two different ends, and that every ensemble and exclusion matches a case.",
      {{"$schema", TextSchema(), "Address of this schema, for editors."},
       {"name", Text(&File::name), "Of the suite.", "a name"},
       {"comment", Text(&File::comment), "Free text for readers."},
       {"scenes", ScenesValue(), "What moves.", "an array of scenes"},
       {"columns", By(ColumnsSchema(), ReadAllColumns), "How the loops are imposed.",
        "an array of columns"},
       {"tolerances", NumberList(&File::tolerances, kTolerances),
        "rtol = atol of the integrator; above the spacing of doubles.", "a list of numbers"},
       {"integrator", Choice(&File::integrator, ProfileNames(), "an integrator profile"),
        "The profile: a Runge-Kutta pair with its norm and controller."},
       {"jacobian", Choice(&File::jacobian, NamesOf<JacobianKind>(), "a kind of Jacobian"),
        "Where implicit profiles have their Jacobians from; explicit ones have none."},
       {"limits", Object(&File::limits, LimitsFields())},
       {"compile", Object(&File::compile, CompileFields())},
       {"series", Section(SeriesFields())},
       {"timing", Object(&File::timing, TimingFields())},
       {"precision", By(PrecisionFields().Schema(), ReadPrecision)},
       {"ensembles", By(EnsemblesSchema(), ReadEnsembles), "Perturbed repetitions of cases."},
       {"sweep", SweepSchema(),
        "Axes that are crossed, the first one slowest; each combination of values is run as if "
        "the values stood in this file. Axes in a zip go in step. At most 100000 combinations."},
       {"exclude", ExclusionsSchema(),
        "Cases that match all conditions of a rule are left out. Keys are mechanism, formulation, "
        "enforcement, coordinates, solver, integrator, rtol, atol, horizon and the names of "
        "axes."},
       {"", By(Json::object(), RequireDerivatives)}});
  return fields;
}

Json ExperimentSchema() { return ExperimentFileFields().OwnSchema(); }

}  // namespace loopbench::harness
