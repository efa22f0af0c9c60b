// "columns" of an experiment file.
#include <fmt/format.h>

#include "harness/config/experiment_sections.h"
#include "harness/config/formulations.h"

namespace loopbench::harness {
namespace {

/// One entry of "columns", whose cross product is meant.
struct ColumnLists {
  std::vector<std::string> formulations;
  std::vector<Enforcement> enforcements;
  std::vector<Coordinates> coordinates = {Column().coordinates};
  std::vector<SolverKind> solvers = {Column().solver};
  std::optional<BaumgarteGains> gains;
  std::vector<std::int64_t> threads = {Column().threads};
  std::vector<Execution> executions = {Column().execution};
};

/// Reports a level that a formulation does not have.
void RequireLevels(const JsonNode& node, ColumnLists& lists) {
  for (const std::string& formulation : lists.formulations) {
    const FormulationRow& row = *FindFormulation(formulation);
    for (const Enforcement level : lists.enforcements) {
      if (row.Has(level)) continue;
      std::vector<std::string_view> levels;
      for (const Enforcement own : row.levels) levels.push_back(ToString(own));
      node.FailAs(fmt::format("\"{}\" at level \"{}\"", formulation, ToString(level)),
                  fmt::format("a level that it has: {}", fmt::join(levels, ", ")));
    }
  }
}

/// Reports what a peer does not have: it has its own coordinates and solver.
void RequirePeersOwn(const JsonNode& node, ColumnLists& lists) {
  for (const std::string& formulation : lists.formulations) {
    if (!FindFormulation(formulation)->is_peer()) continue;
    const auto refuse = [&](std::string_view key, std::string_view found, std::string_view only) {
      node.FailAs(fmt::format("\"{}\" with {} \"{}\"", formulation, key, found),
                  fmt::format("\"{}\", or nothing: a peer has its own", only));
    };
    static const Column kOwn;
    for (const Coordinates set : lists.coordinates) {
      if (set != kOwn.coordinates) refuse("coordinates", ToString(set), ToString(kOwn.coordinates));
    }
    for (const SolverKind solver : lists.solvers) {
      if (solver != kOwn.solver) refuse("solver", ToString(solver), ToString(kOwn.solver));
    }
    for (const std::int64_t threads : lists.threads) {
      if (threads != kOwn.threads) refuse("threads", std::to_string(threads), "1");
    }
    for (const Execution execution : lists.executions) {
      if (execution != kOwn.execution) {
        refuse("execution", ToString(execution), ToString(kOwn.execution));
      }
    }
    if (lists.gains) node.FailAs(fmt::format("\"{}\" with gains", formulation), "no gains");
  }
}

/// Gains of Baumgarte's stabilisation, which only it has, and both or none.
void ReadGains(const JsonNode& node, ColumnLists& lists) {
  const auto alpha = node.Optional("alpha"), beta = node.Optional("beta");
  if (!alpha && !beta) return;
  const bool only = lists.enforcements == std::vector<Enforcement>{Enforcement::kBaumgarte};
  if (!only) {
    (alpha ? *alpha : *beta)
        .FailAs("gains of another level", "\"enforcement\": \"baumgarte\" beside them");
  }
  lists.gains.emplace();
  const auto a = node.Required("alpha", "a gain [1/s] beside \"beta\"");
  const auto b = node.Required("beta", "a gain [1/s] beside \"alpha\"");
  if (a) lists.gains->alpha = a->Number(kNotNegative);
  if (b) lists.gains->beta = b->Number(kNotNegative);
}

const Fields<ColumnLists>& ColumnFields() {
  static const Fields<ColumnLists> fields(
      "column", "A way of imposing the loops; lists expand as a cross product.",
      {{"formulation", FormulationChoices(&ColumnLists::formulations),
        "The algorithm that imposes them.", "a formulation"},
       {"enforcement", LevelChoices(&ColumnLists::enforcements),
        "The level at which constraints act.", "a level of enforcement"},
       {"coordinates",
        Choices(&ColumnLists::coordinates, NamesOf<Coordinates>(), "a coordinate set"),
        "Of the joints of a tree, or of every body."},
       {"solver", Choices(&ColumnLists::solvers, NamesOf<SolverKind>(), "a solver"),
        "For reduction: as-published is the fixed independent set, rank-revealing the automatic "
        "partition."},
       {"threads", IntegerList(&ColumnLists::threads, 1, kMostThreads),
        "That may work on one right-hand side; results have the same bits for any number."},
       {"execution", Choices(&ColumnLists::executions, NamesOf<Execution>(), "an execution"),
        "Right-hand sides by the library, or by C code generated from its text, without or with "
        "fused multiply-add (docs/operation-counts.md)."},
       {"alpha", NumberSchema(kNotNegative),
        "Gain on mismatches of speeds [1/s]; baumgarte only, beside beta."},
       {"beta", NumberSchema(kNotNegative),
        "Gain on mismatches of positions [1/s]; baumgarte only, beside alpha."},
       {"", By({{"dependencies", {{"alpha", {"beta"}}, {"beta", {"alpha"}}}}}, ReadGains)},
       {"", By(Json::object(), RequireLevels)},
       {"", By(Json::object(), RequirePeersOwn)}});
  return fields;
}

/// The cross product of an entry's lists, first key slowest.
std::vector<Column> ReadColumnEntry(const JsonNode& node) {
  std::vector<Column> columns;
  ColumnLists lists;
  if (!ColumnFields().Read(node, &lists)) return columns;
  for (const std::string& formulation : lists.formulations) {
    for (const Enforcement enforcement : lists.enforcements) {
      for (const Coordinates set : lists.coordinates) {
        for (const SolverKind solver : lists.solvers) {
          for (const std::int64_t threads : lists.threads) {
            for (const Execution execution : lists.executions) {
              columns.push_back({formulation, enforcement, set, solver, lists.gains,
                                 static_cast<int>(threads), execution});
            }
          }
        }
      }
    }
  }
  return columns;
}

}  // namespace

Json ColumnsSchema() { return Named("columns", OneOrMoreSchema(ColumnFields().Schema())); }

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
