// "columns" of an experiment file.
#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

/// Gains of Baumgarte's stabilisation, which only it has, and both or none.
std::optional<BaumgarteGains> ReadGains(const JsonNode& node,
                                        const std::vector<Enforcement>& enforcements) {
  const auto alpha = node.Optional("alpha"), beta = node.Optional("beta");
  if (!alpha && !beta) return std::nullopt;
  const bool only = enforcements == std::vector<Enforcement>{Enforcement::kBaumgarte};
  if (!only) {
    (alpha ? *alpha : *beta)
        .FailAs("gains of another level", "\"enforcement\": \"baumgarte\" beside them");
  }
  BaumgarteGains gains;
  const auto a = node.Required("alpha", "a gain [1/s] beside \"beta\"");
  const auto b = node.Required("beta", "a gain [1/s] beside \"alpha\"");
  if (a) gains.alpha = a->Number(kNotNegative);
  if (b) gains.beta = b->Number(kNotNegative);
  return gains;
}

/// One entry of "columns": the cross product of its lists, first key slowest.
std::vector<Column> ReadColumnEntry(const JsonNode& node) {
  std::vector<Column> columns;
  if (!node.ExpectObject(
          {"formulation", "enforcement", "coordinates", "solver", "alpha", "beta"})) {
    return columns;
  }
  std::vector<FormulationKind> formulations;
  if (const auto named = node.Required("formulation", "a formulation")) {
    formulations = ReadEnums<FormulationKind>(*named, "a formulation");
  }
  std::vector<Enforcement> enforcements;
  if (const auto named = node.Required("enforcement", "a level of enforcement")) {
    enforcements = ReadEnums<Enforcement>(*named, "a level of enforcement");
  }
  const Column defaults;
  const auto coordinates =
      ReadEnums<Coordinates>(node, "coordinates", "a coordinate set", {defaults.coordinates});
  const auto solvers = ReadEnums<SolverKind>(node, "solver", "a solver", {defaults.solver});
  const auto gains = ReadGains(node, enforcements);
  for (const FormulationKind formulation : formulations) {
    for (const Enforcement enforcement : enforcements) {
      for (const Coordinates set : coordinates) {
        for (const SolverKind solver : solvers) {
          columns.push_back({formulation, enforcement, set, solver, gains});
        }
      }
    }
  }
  return columns;
}

}  // namespace

std::vector<Column> ReadColumns(const JsonNode& node) {
  std::vector<Column> columns;
  for (const JsonNode& element : node.OneOrMore("columns")) {
    for (const Column& column : ReadColumnEntry(element)) {
      const bool again = std::find(columns.begin(), columns.end(), column) != columns.end();
      if (again) {
        element.FailAs(ToString(column) + " again", "each column once");
      } else {
        columns.push_back(column);
      }
    }
  }
  return columns;
}

}  // namespace loopbench::harness
