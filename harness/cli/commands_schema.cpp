#include "harness/cli/commands_schema.h"

#include <algorithm>
#include <array>

#include "harness/config/file_schemas.h"
#include "harness/judge/claims_reader.h"
#include "harness/judge/failure_map_reader.h"

namespace loopbench::harness {
namespace {

struct Kind {
  std::string name, title;
  Json (*schema)();
};

const std::array<Kind, 6>& Kinds() {
  static const std::array<Kind, 6> kinds = {
      {{"mechanism", "mechanism", MechanismSchema},
       {"experiment", "experiment", ExperimentSchema},
       {"benchmarks", "benchmarks", BenchmarksSchema},
       {"claims", "claims", ClaimsSchema},
       {"map", "failure map", MapSchema},
       {"series", "published series", PublishedSeriesSchema}}};
  return kinds;
}

const Kind& KindOf(const std::string& name) {
  return *std::ranges::find(Kinds(), name, &Kind::name);
}

}  // namespace

std::vector<std::string> SchemaKinds() {
  std::vector<std::string> names;
  for (const Kind& kind : Kinds()) names.push_back(kind.name);
  return names;
}

std::string SchemaOfKind(const std::string& kind) {
  return SchemaText("Loopbench " + KindOf(kind).title, KindOf(kind).schema());
}

std::string TablesOfKinds(const std::vector<std::string>& kinds) {
  std::vector<std::pair<std::string, Json>> schemas;
  for (const std::string& kind : kinds) schemas.emplace_back(kind, KindOf(kind).schema());
  return SchemaTables(schemas);
}

}  // namespace loopbench::harness
