// JSON Schema, draft 07, as values: what fields.h says of a file, for editors and documents.
//
// For the rooms that read JSON, like json_reader.h. Schemas here have two keys of their own, which
// SchemaText() takes out: "words" says for people what a value may be, "schema" is what Named()
// refers to, and goes under "definitions".
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "harness/json/json_reader.h"

namespace loopbench::harness {

Json NumberSchema(const Range& range = {});
Json IntegerSchema(std::int64_t min, std::int64_t max);
Json BoolSchema();
/// A string that is not empty.
Json TextSchema();
/// A string that the regular expression finds.
Json PatternSchema(const std::string& expression);
/// One of these words; one of them alone is a constant.
Json ChoiceSchema(const std::vector<std::string>& names);
/// Two or three numbers.
Json VectorSchema();
/// What JsonNode::NumberList and IntegerList take: one, several that are different, or a range.
Json NumberListSchema(const Range& range = {});
Json IntegerListSchema(std::int64_t min, std::int64_t max);
/// {"lin": [from, to, count]} or {"log": ...} with ends like `end`, which `positive` says are.
Json SpacedSchema(const Json& end, bool positive);
/// An array of at least `least` elements and, unless it is 0, at most `most`.
Json ArraySchema(const Json& element, std::size_t least = 0, std::size_t most = 0);
/// One, or an array of at least one (`different`: each once), or something else.
Json OneOrMoreSchema(const Json& element, bool different = false, const Json& or_this = nullptr);
/// An object with any keys, or at least `least`.
Json MapSchema(const Json& value, std::size_t least = 0);
/// One of several.
Json EitherSchema(const std::vector<Json>& alternatives);
/// An object with these keys.
Json Requires(const std::vector<std::string>& keys);
/// A schema that has a name of its own and may stand in several places.
Json Named(const std::string& name, Json schema);

/// One row of an object's fields. Without a name `schema` is what the object must satisfy besides.
struct FieldSchema {
  std::string name;
  Json schema;
  std::string sentence;
  bool required = false;
  Json standard = nullptr;  ///< what it is where it is not there; null: said by the sentence
};
/// An object of these fields and no others.
Json ObjectSchema(const std::string& sentence, const std::vector<FieldSchema>& fields);

/// The whole file configs/schema/*.schema.json, of an object's schema: lines of at most 100
/// characters where that is possible.
std::string SchemaText(const std::string& title, const Json& object);
/// Markdown of kinds of files: a table of fields for each and one for each object in them.
std::string SchemaTables(const std::vector<std::pair<std::string, Json>>& kinds);

}  // namespace loopbench::harness
