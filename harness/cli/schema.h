// schema: what files of each kind may hold, as JSON Schema and as tables.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

/// The kinds, as the files configs/schema/KIND.schema.json name them.
std::vector<std::string> SchemaKinds();

/// The JSON Schema of a kind (draft 07): what configs/schema/ holds.
std::string SchemaOfKind(const std::string& kind);

/// The keys of files of these kinds as tables in Markdown: what docs/fields.md holds.
std::string TablesOfKinds(const std::vector<std::string>& kinds);

}  // namespace loopbench::harness
