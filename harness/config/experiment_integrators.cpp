// Integrators of an experiment file: Butcher tables, absolute tolerances, limits of steps.

#include "harness/base/text.h"
#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

/// A Butcher table while it is read.
struct TableDraft : ButcherTable {
  std::string comment;
};

/// Reads a number, or a quotient of integers as text.
double ReadCoefficient(const JsonNode& node) {
  if (!node.value().is_string()) return node.Number();
  const auto [upper, lower] = Quotient<std::int64_t>(node.value().get_ref<const std::string&>());
  if (upper && lower > 0) return static_cast<double>(*upper) / static_cast<double>(*lower);
  node.Fail("a number, or a fraction of integers as text, such as \"-1/6\"");
  return 0.0;
}

std::vector<double> ReadCoefficients(const JsonNode& node) {
  return Mapped<double>(node.Elements("coefficients"),
                        [](const JsonNode& element) { return ReadCoefficient(element); });
}

FieldValue<TableDraft> Coefficients(std::vector<double> ButcherTable::*member) {
  static const Json coefficient =
      EitherSchema({NumberSchema(), PatternSchema("^-?[0-9]+/0*[1-9][0-9]*$")});
  return {ArraySchema(coefficient, 1, kMaxStages),
          [=](const JsonNode& node, TableDraft& table) { table.*member = ReadCoefficients(node); }};
}

void ReadRows(const JsonNode& node, TableDraft& table) {
  for (const JsonNode& row : node.Elements("rows")) table.A.push_back(ReadCoefficients(row));
}

const Fields<TableDraft>& TableFields() {
  static const Json both = {
      {"dependencies", {{"b_embedded", {"embedded_order"}}, {"embedded_order", {"b_embedded"}}}}};
  static const Fields<TableDraft> fields(
      "butcher_table",
      "Explicit or diagonally implicit Runge-Kutta method. Coefficients are numbers, or fractions "
      "as text (\"1/6\"). The program also checks that the sizes agree, that c contains the row "
      "sums of A, and all order conditions up to both orders, to a relative 1e-9. Without "
      "b_embedded: fixed steps only.",
      {{"name",
        By(
            PatternSchema("^[a-z0-9_][a-z0-9_-]*$"),
            +[](const JsonNode& node, TableDraft& table) { table.name = node.Text(); }),
        "Name for records, different from other integrators.", "a name"},
       {"comment", Text(&TableDraft::comment), "Free text for readers."},
       {"A", By(ArraySchema(Coefficients(&ButcherTable::b).schema, 1, kMaxStages), ReadRows),
        "Coefficients, one row for each stage; zero above the diagonal.", "an array of rows"},
       {"b", Coefficients(&ButcherTable::b), "Weights of the solution.", "an array of numbers"},
       {"c", Coefficients(&ButcherTable::c), "Times of the stages, as parts of a step.",
        "an array of numbers"},
       {"b_embedded", Coefficients(&ButcherTable::b_embedded),
        "Weights of the embedded solution, for the error estimate."},
       {"order", Integer(&TableDraft::order, 1, kMaxOrder), "Order of the solution.",
        fmt::format("an integer from 1 to {}", kMaxOrder)},
       {"embedded_order", Integer(&TableDraft::embedded_order, 1, kMaxOrder),
        "Order of the embedded solution."},
       {"", Json(both)}});
  return fields;
}

/// Reads and registers a table; returns its name, or "" after errors.
std::string ReadTable(const JsonNode& node) {
  TableDraft table;
  // after other errors, a fault may be a consequence
  if (!TableFields().Read(node, &table) || !node.errors().empty()) return "";
  if (const auto fault = FaultOfIntegrator(table)) {
    const auto member = node.Optional(fault->key);
    (member ? *member : node).FailAs(fault->found, fault->expected);
    return "";
  }
  RegisterIntegrator(table);
  return table.name;
}

/// Returns the name of an integrator, a table or a file with a table; "" after errors.
std::string ReadIntegrator(const JsonNode& node, MechanismFiles& files) {
  if (node.value().is_object()) return ReadTable(node);
  const std::string name = node.value().is_string() ? node.value().get<std::string>() : "";
  if (FindProfile(name) != nullptr) return name;
  if (!name.ends_with(".json")) {
    node.Fail(fmt::format("an integrator profile: \"{}\"; a table of ARKODE (loopbench "
                          "integrators); or a Butcher table",
                          fmt::join(ProfileNames(), "\", \"")),
              NearestSpelling(name, IntegratorNames()));
    return "";
  }
  const std::filesystem::path path = files.Resolve(name);
  std::string table;
  ReadNamedFile(node, path, "a Butcher table",
                [&] { table = ReadDocument(files.Text(path), path.string(), ReadTable); });
  return table;
}

void ReadIntegrators(const JsonNode& node, ExperimentFile& experiment) {
  experiment.integrators.clear();
  for (const JsonNode& element : node.OneOrMore("integrators")) {
    const std::string name = ReadIntegrator(element, *experiment.files);
    if (name.empty()) continue;
    const bool again = std::ranges::count(experiment.integrators, name) > 0;
    again ? element.Fail("each value once") : experiment.integrators.push_back(name);
  }
}

void ReadAtol(const JsonNode& node, ExperimentFile& experiment) {
  if (node.value().is_object()) {
    AtolFields().Read(node, &experiment.atols.emplace());
  } else {
    experiment.atol = node.Number(kPositive);
  }
}

}  // namespace

FieldValue<ExperimentFile> IntegratorsValue() {
  Json named = PatternSchema(R"(^ARKODE_|\.json$)");
  named["words"] = "table of ARKODE, file";
  return {OneOrMoreSchema(
              EitherSchema({ChoiceSchema(ProfileNames()), named, TableFields().Schema()}), true),
          ReadIntegrators,
          [](const ExperimentFile& file) { return Json(file.integrators.front()); }};
}

FieldValue<ExperimentFile> AtolValue() {
  return By(EitherSchema({NumberSchema(kPositive), AtolFields().Schema()}), ReadAtol);
}

const Fields<AbsoluteTolerances>& AtolFields() {
  using Tolerances = AbsoluteTolerances;
  static const Fields<Tolerances> fields(
      "absolute_tolerances", "Absolute tolerances by quantity; default: as the relative tolerance.",
      {{"length", Number(&Tolerances::length, kPositive), "Of lengths [m]."},
       {"angle", Number(&Tolerances::angle, kPositive), "Of angles [rad] and of quaternions."},
       {"speed", Number(&Tolerances::speed, kPositive), "Of speeds [m/s]."},
       {"angular_speed", Number(&Tolerances::angular_speed, kPositive),
        "Of angular speeds [rad/s]."},
       {"", By(
                Json{{"minProperties", 1}}, +[](const JsonNode& node, Tolerances&) {
                  if (node.value().empty()) node.Fail("at least one quantity with its tolerance");
                })}});
  return fields;
}

const Fields<Integration>& IntegrationFields() {
  constexpr std::int64_t kMostIterations = 1000;
  constexpr Range kCoefficients = {.min = 0.0, .max = 1.0, .above_min = true};
  static const Fields<Integration> fields(
      "integration", "Options of all integrators of the experiment. Not for peers.",
      {{"max_step", Number(&Integration::max_step, kPositive),
        "Longest step [s]; default: ode45 a tenth of the horizon, others none."},
       {"initial_step", Number(&Integration::initial_step, kPositive),
        "Length of the first step [s]; default: chosen by the integrator."},
       {"max_newton_iterations", Integer(&Integration::max_newton_iterations, 0, kMostIterations),
        "Newton iterations in a stage of implicit integrators; 0: 8, and 50 with fixed steps."},
       {"newton_coefficient", Number(&Integration::newton_coefficient, kCoefficients),
        "Error at which the iteration ends, as a part of the tolerances."}});
  return fields;
}

bool UsesOption(std::string_view option, bool is_implicit, bool is_fixed) {
  if (option.ends_with("_step")) return !is_fixed;
  return is_implicit || option.find("newton") == std::string_view::npos;
}

void RequireUseOfIntegrators(const JsonNode& node, ExperimentFile& file) {
  const auto integrator = node.Optional("integrator"), integration = node.Optional("integration");
  bool any_implicit = false;
  for (const std::string& name : file.integrators) {
    const Profile& profile = *FindProfile(name);
    any_implicit = any_implicit || profile.is_implicit;
    if (profile.has_embedding() || file.tolerances.empty()) continue;
    integrator->FailAs(fmt::format("\"{}\", which has no embedding, beside \"tolerances\"", name),
                       "\"fixed_steps\" alone: without embedding there is no error estimate");
  }
  IntegrationFields().Show(Integration{}, [&](const std::string& key, const Json&) {
    const auto option = integration ? integration->Optional(key) : std::nullopt;
    if (!option || file.integrators.empty() || UsesOption(key, any_implicit, false)) return;
    option->FailAs("an option of implicit integrators", "an implicit integrator in \"integrator\"");
  });
  for (const char* key : {"atol", "integration"}) {
    const auto option = node.Optional(key);
    if (!option || file.precision.scalars.empty()) continue;
    option->FailAs(fmt::format("\"{}\" beside \"precision\"", key),
                   "one of them: runs in several scalars have one tolerance");
  }
}

}  // namespace loopbench::harness
