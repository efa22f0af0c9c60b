#include "harness/cli/schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "harness/cli/command_line.h"
#include "harness/config/file_schemas.h"
#include "harness/judge/rule_schemas.h"
#include "harness/text/terminal.h"

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
       {"map", "robustness map", MapSchema},
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

void AddSchema(Commands& commands) {
  auto& kind = commands.Keep<std::string>();
  auto& tables = commands.Keep<bool>();
  CLI::App* app =
      commands.Add("schema", "Print the JSON Schema (draft 07) of a file type", [&](const Typed&) {
        PrintText(tables ? TablesOfKinds({kind}) : SchemaOfKind(kind));
        return 0;
      });
  app->add_option("kind", kind, "File type")->required()->check(CLI::IsMember(SchemaKinds()));
  app->add_flag("--tables", tables, "Tables of keys in Markdown instead");
}

}  // namespace loopbench::harness
