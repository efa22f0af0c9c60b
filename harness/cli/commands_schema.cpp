#include "harness/cli/commands_schema.h"

#include <map>

#include "harness/config/file_schemas.h"

namespace loopbench::harness {
namespace {

const std::map<std::string, Json (*)()> kSchemas = {{"mechanism", MechanismSchema},
                                                    {"experiment", ExperimentSchema},
                                                    {"benchmarks", BenchmarksSchema}};

}  // namespace

std::vector<std::string> SchemaKinds() { return {"mechanism", "experiment", "benchmarks"}; }

std::string SchemaOfKind(const std::string& kind) {
  return SchemaText("Loopbench " + kind, kSchemas.at(kind)());
}

std::string TablesOfKinds(const std::vector<std::string>& kinds) {
  std::vector<std::pair<std::string, Json>> schemas;
  for (const std::string& kind : kinds) schemas.emplace_back(kind, kSchemas.at(kind)());
  return SchemaTables(schemas);
}

}  // namespace loopbench::harness
