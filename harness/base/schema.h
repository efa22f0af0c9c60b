// JSON Schema (draft 07) of the fields of a file, for editors and documentation.
//
// For modules that read JSON, like json_reader.h. Schemas have two additional keys, which
// SchemaText() removes: "words" describes the value; "schema" is the target of Named(), moved to
// "definitions".
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/json_reader.h"

namespace loopbench::harness {

Json NumberSchema(const Range& range = {});
Json IntegerSchema(std::int64_t min, std::int64_t max);
Json BoolSchema();
/// Schema of a string that is not empty.
Json TextSchema();
/// Schema of a string that matches the regular expression.
Json PatternSchema(const std::string& expression);
/// Schema of one of these words; a single word is a constant.
Json ChoiceSchema(const std::vector<std::string>& names);
/// Schema of two or three numbers.
Json VectorSchema();
/// Schema for JsonNode::NumberList and IntegerList: one, several different numbers, or a range.
Json NumberListSchema(const Range& range = {});
Json IntegerListSchema(std::int64_t min, std::int64_t max);
/// Schema of {"lin": [from, to, count]} or {"log": ...}; `end`: schema of ends; `positive`: > 0.
Json SpacedSchema(const Json& end, bool positive);
/// Schema of an array with at least `least` and, unless it is 0, at most `most` elements.
Json ArraySchema(const Json& element, std::size_t least = 0, std::size_t most = 0);
/// Schema of one element, an array of one or more (`different`: each once), or `or_this`.
Json OneOrMoreSchema(const Json& element, bool different = false, const Json& or_this = nullptr);
/// Schema of an object with any keys, at least `least`.
Json MapSchema(const Json& value, std::size_t least = 0);
/// Schema of one of several alternatives.
Json EitherSchema(const std::vector<Json>& alternatives);
/// Schema of an object that has these keys.
Json Requires(const std::vector<std::string>& keys);
/// Schema with a name, which several schemas may refer to.
Json Named(const std::string& name, Json schema);

/// Field of an object. Without a name, `schema` is an additional condition on the object.
struct FieldSchema {
  std::string name;
  Json schema;
  std::string sentence;
  bool required = false;
  Json standard = nullptr;  ///< default; null: stated in the sentence
};
/// Returns the schema of an object with these fields only.
Json ObjectSchema(const std::string& sentence, const std::vector<FieldSchema>& fields);

/// Returns the text of configs/schema/*.schema.json, in lines of at most 100 characters.
std::string SchemaText(const std::string& title, const Json& object);
/// Returns Markdown tables of fields, one for each kind of file and for each object in it.
std::string SchemaTables(const std::vector<std::pair<std::string, Json>>& kinds);

}  // namespace loopbench::harness
