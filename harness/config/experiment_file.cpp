// The top level of an experiment file.
#include <fmt/format.h>

#include <algorithm>

#include "harness/config/experiment_sections.h"
#include "harness/config/file_schemas.h"
#include "harness/config/options.h"
#include "harness/json/document_kind.h"

namespace loopbench::harness {

namespace {

using File = ExperimentFile;

void ReadAllColumns(const JsonNode& node, File& file) {
  file.columns = file.timing.columns = ReadColumns(node);
}

/// None is as good as no key: RequireSteps() says when that will not do.
void ReadAnyTolerances(const JsonNode& node, File& file) {
  const bool is_empty = node.value().is_array() && node.value().empty();
  if (!is_empty) file.tolerances = node.NumberList(kTolerances);
}

/// Reports an experiment that has neither tolerances nor steps.
void RequireSteps(const JsonNode& node, File&) {
  if (node.Optional("fixed_steps")) return;
  const auto tolerances = node.Required("tolerances", "a list of numbers, or \"fixed_steps\"");
  const bool is_empty = tolerances && tolerances->value().is_array() && tolerances->value().empty();
  if (is_empty) tolerances->Fail("at least one tolerance, or \"fixed_steps\" beside it");
}

/// Reports peers, which choose their own steps, where steps are fixed.
void RequireNoPeerOfFixedSteps(const JsonNode& node, File& file) {
  const auto steps = node.Optional("fixed_steps");
  if (!steps) return;
  for (const Column& column : file.columns) {
    const FormulationRow* row = FindFormulation(column.formulation);
    if (row == nullptr || !row->is_peer()) continue;
    steps->FailAs(fmt::format("fixed steps of \"{}\", which has its own integrator", row->name),
                  "\"tolerances\" alone, or an experiment of its own for peers");
    return;
  }
}

void ReadPrecision(const JsonNode& node, File& file) {
  file.precision.tolerances = file.tolerances;
  if (!PrecisionFields().Read(node, &file.precision)) return;
  if (file.precision.scalars.empty() || !file.precision.tolerances.empty()) return;
  if (node.Optional("tolerances")) return;  // has been reported
  node.FailAs("no \"tolerances\", and none in the experiment", "tolerances of the ladders");
}

FieldValue<File> Integrators() {
  FieldValue<File> value =
      RegisteredChoices(&File::integrators, ProfileNames, "an integrator profile");
  value.show = [](const File& file) { return Json(file.integrators.front()); };
  return value;
}

void ReadOutputOptions(const JsonNode& node, File& file) {
  OutputFields().Read(node, &file.output.emplace());
}

/// Reports levels whose derivative an implicit profile asks for, and that have none.
void RequireDerivatives(const JsonNode& node, File& file) {
  const auto integrator = node.Optional("integrator");
  if (!integrator || file.jacobian != JacobianKind::kForward) return;
  const auto implicit = std::ranges::find_if(
      file.integrators, [](const std::string& name) { return FindProfile(name)->is_implicit; });
  if (implicit == file.integrators.end()) return;
  const Profile* profile = FindProfile(*implicit);
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
  static const Json some_or_none = EitherSchema(
      {NumberListSchema(kTolerances), {{"type", "array"}, {"maxItems", 0}, {"words", "[]"}}});
  static const Json one_of_both = {
      {"if", {{"not", Requires({"fixed_steps"})}}},
      {"then",
       {{"required", {"tolerances"}}, {"properties", {{"tolerances", {{"minItems", 1}}}}}}}};
  static const Fields<File> fields(
      "experiment",
      "Which mechanisms, columns, tolerances and horizons are run. Lists expand as a cross "
      "product. The program checks more than this schema: that mechanism files exist and are "
      "valid, that scenes and columns are different, that fields of a sweep exist, that ranges "
      "have two different ends, and that every ensemble and exclusion matches a case.",
      DocumentRows<File>(
          {{"name", Text(&File::name), "Of the suite.", "a name"},
           {"comment", Text(&File::comment), "Free text for readers."},
           {"scenes", ScenesValue(), "What moves.", "an array of scenes"},
           {"columns", By(ColumnsSchema(), ReadAllColumns), "How the loops are imposed.",
            "an array of columns"},
           {"tolerances", By(some_or_none, ReadAnyTolerances),
            "rtol = atol of the integrator; above the spacing of doubles. May be left out, or be "
            "[], "
            "beside fixed_steps."},
           {"fixed_steps", NumberList(&File::fixed_steps, kPositive),
            "Lengths of steps [s]: each makes cases whose steps all have this length (the last is "
            "clipped), without error test, besides those of the tolerances. Not for peers."},
           {"", By(one_of_both, RequireSteps)},
           {"", By(Json::object(), RequireNoPeerOfFixedSteps)},
           {"refine", Bool(&File::refine),
            "Every case with a tolerance runs once more at a tenth of it. Records then contain "
            "refinement_difference, the largest difference of final poses. More than 1000 "
            "tolerances set the warning refinement."},
           {"integrator", Integrators(),
            "The profile, a Runge-Kutta pair with its norm and controller, or several, crossed "
            "with "
            "all else."},
           {"jacobian", Choice(&File::jacobian, NamesOf<JacobianKind>(), "a kind of Jacobian"),
            "Where implicit profiles have their Jacobians from; explicit ones have none."},
           {"limits", Object(&File::limits, LimitsFields())},
           {"compile", Object(&File::compile, CompileFields())},
           {"series", Section(SeriesFields())},
           {"timing", Object(&File::timing, TimingFields())},
           {"precision", By(PrecisionFields().Schema(), ReadPrecision)},
           {"reference", By(ReferenceFields().Schema(), ReadReferenceOptions)},
           {"output", By(OutputFields().Schema(), ReadOutputOptions)},
           {"", By(Json::object(), RequireOutput)},
           {"ensembles", By(EnsemblesSchema(), ReadEnsembles), "Perturbed repetitions of cases."},
           {"sweep", SweepSchema(),
            "Axes that are crossed, the first one slowest; each combination of values is run as if "
            "the values stood in this file. Axes in a zip go in step. At most 10000000 "
            "combinations."},
           {"exclude", ExclusionsSchema(),
            "Cases that match all conditions of a rule are left out. Keys are mechanism, "
            "formulation, "
            "enforcement, coordinates, solver, integrator, rtol, atol, step, horizon and the names "
            "of "
            "axes."},
           {"", By(Json::object(), RequireDerivatives)}}));
  return fields;
}

Json ExperimentSchema() { return ExperimentFileFields().OwnSchema(); }

}  // namespace loopbench::harness
