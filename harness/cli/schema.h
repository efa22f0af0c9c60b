// schema: keys that files of each kind may contain, as JSON Schema and as tables.
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

/// Names of the kinds, as in the files configs/schema/KIND.schema.json.
std::vector<std::string> SchemaKinds();

/// Returns the JSON Schema (draft 07) of a kind: the contents of its file in configs/schema/.
std::string SchemaOfKind(const std::string& kind);

/// Returns Markdown tables of the keys of files of these kinds: the contents of docs/fields.md.
std::string TablesOfKinds(const std::vector<std::string>& kinds);

}  // namespace loopbench::harness
