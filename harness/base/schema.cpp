#include "harness/base/schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace loopbench::harness {
namespace {

/// Returns whole numbers without ".0".
Json Plain(double number) {
  constexpr double kLargestPlain = 1e15;
  if (number == std::trunc(number) && std::abs(number) < kLargestPlain) {
    return static_cast<std::int64_t>(number);
  }
  return number;
}

std::string WordsOf(const Json& schema) { return schema.value("words", "any"); }

/// "a, b or c", and "a or b, or c" of an a that is "a or b" itself.
std::string Either(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string_view last = text.find(" or ") == text.npos ? " or " : ", or ";
    text += i == 0 ? "" : i + 1 == words.size() ? last : ", ";
    text += words[i];
  }
  return text;
}

/// "numbers > 0".
std::string Plural(std::string words) {
  for (const std::string_view one : {"number", "integer"}) {
    if (words.starts_with(one)) words.insert(one.size(), "s");
  }
  return words;
}

// Schema as a file for editors, and as tables for the documentation.

/// Returns the name of a schema from Named().
std::string NameOf(const Json& reference) {
  const std::string path = reference["$ref"];
  return path.substr(path.rfind('/') + 1);
}

/// Removes keys that are not in draft 07: words, and schemas of Named(), moved to `definitions`.
void TakeOwn(Json* node, Json* definitions) {
  if (!node->is_structured()) return;
  if (node->is_object() && node->contains("$ref") && node->contains("schema")) {
    Json named = std::move((*node)["schema"]);
    node->erase("schema");
    const std::string name = NameOf(*node);
    if (!definitions->contains(name)) {
      (*definitions)[name] = nullptr;  // reserves its position before the schemas that it refers to
      TakeOwn(&named, definitions);
      (*definitions)[name] = std::move(named);
    }
  }
  if (node->is_object() && node->contains("words") && (*node)["words"].is_string()) {
    node->erase("words");
  }
  for (Json& child : *node) TakeOwn(&child, definitions);
}

/// Returns the text as a table cell.
std::string Cell(const std::string& text) {
  std::string cell;
  for (const char c : text) cell += (c == '|' || c == '<' ? "\\" : "") + std::string(1, c);
  return cell;
}

std::string Table(const std::string& heading, const Json& object) {
  std::string text = fmt::format("{}\n\n{}\n\n", heading, object.value("description", ""));
  text += "| key | value | default | meaning |\n|---|---|---|---|\n";
  const Json required = object.value("required", Json::array());
  for (const auto& [key, field] : object["properties"].items()) {
    if (key == "$schema") continue;
    std::string standard = field.contains("default") ? '`' + FlatText(field["default"]) + '`' : "";
    std::erase(standard, '"');
    if (std::ranges::find(required, Json(key)) != required.end()) standard = "required";
    text += fmt::format("| `{}` | {} | {} | {} |\n", key, field.value("words", ""), standard,
                        Cell(field.value("description", "")));
  }
  return text + '\n';
}

/// Adds tables of the contained objects in the order of first use, except objects in `done`.
void AddTables(const Json& node, std::set<std::string>* done, std::string* text) {
  if (!node.is_structured()) return;
  const bool is_named = node.is_object() && node.contains("$ref") && node.contains("schema");
  const std::string name = is_named ? NameOf(node) : "";
  const bool has_table = is_named && node["schema"].contains("properties");
  if (has_table && !done->insert(name).second) return;
  if (has_table) *text += Table("### " + name, node["schema"]);
  for (const Json& child : node) AddTables(child, done, text);
}

}  // namespace

Json NumberSchema(const Range& range) {
  Json schema = {{"type", "number"}};
  if (std::isfinite(range.min)) {
    schema[range.above_min ? "exclusiveMinimum" : "minimum"] = Plain(range.min);
  }
  if (std::isfinite(range.max)) schema["maximum"] = Plain(range.max);
  schema["words"] = "number" + range.Text();
  return schema;
}

Json IntegerSchema(std::int64_t min, std::int64_t max) {
  return {{"type", "integer"},
          {"minimum", min},
          {"maximum", max},
          {"words", fmt::format("integer from {} to {}", min, max)}};
}

Json BoolSchema() { return {{"type", "boolean"}, {"words", "`true` or `false`"}}; }

Json TextSchema() { return {{"type", "string"}, {"minLength", 1}, {"words", "text"}}; }

Json PatternSchema(const std::string& expression) {
  return {{"type", "string"}, {"pattern", expression}, {"words", "text"}};
}

Json ChoiceSchema(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  for (const std::string& name : names) quoted.push_back('`' + name + '`');
  Json schema = {{"words", Either(quoted)}};
  if (names.size() == 1) {
    schema["const"] = names.front();
  } else {
    schema["enum"] = names;
  }
  return schema;
}

Json VectorSchema() { return Named("vector", ArraySchema(NumberSchema(), 2, 3)); }

Json SpacedSchema(const Json& end, bool positive) {
  const Json count = Named("count", IntegerSchema(2, kMaxInRange));
  const auto three = [&](const Json& one) {
    return ArraySchema(Json::array({one, one, count}), 3, 3);
  };
  Json schema = {
      {"type", "object"}, {"minProperties", 1}, {"maxProperties", 1}, {"words", "a range"}};
  if (positive) {
    schema["propertyNames"] = ChoiceSchema({"lin", "log"});
    schema["additionalProperties"] = three(end);
    return schema;
  }
  Json not_zero = end;
  not_zero["not"] = {{"const", 0}};
  schema["additionalProperties"] = false;
  schema["properties"] = {{"lin", three(end)}, {"log", three(not_zero)}};
  return schema;
}

Json NumberListSchema(const Range& range) {
  const Json one = NumberSchema(range);
  const bool positive = range.min > 0.0 || (range.min == 0.0 && range.above_min);
  return OneOrMoreSchema(one, true, SpacedSchema(one, positive));
}

Json IntegerListSchema(std::int64_t min, std::int64_t max) {
  Json end = IntegerSchema(min, max);
  end["type"] = "number";  // ranges are rounded
  return OneOrMoreSchema(IntegerSchema(min, max), true, SpacedSchema(end, min > 0));
}

Json ArraySchema(const Json& element, std::size_t least, std::size_t most) {
  Json schema = {{"type", "array"}};
  if (least > 0) schema["minItems"] = least;
  if (most > 0) schema["maxItems"] = most;
  schema["items"] = element;
  constexpr std::size_t kFew = 10;  // larger values are technical limits
  std::string count = least > 1 ? fmt::format("{} ", least) : "";
  if (least > 0 && most > least && most < kFew) count = fmt::format("{} to {} ", least, most);
  if (least > 1 && most == 0) count += "or more ";
  if (!element.is_array())
    schema["words"] = fmt::format("array of {}{}", count, Plural(WordsOf(element)));
  return schema;
}

Json OneOrMoreSchema(const Json& element, bool different, const Json& or_this) {
  Json several = ArraySchema(element, 1);
  if (different) several["uniqueItems"] = true;
  several["words"] = "several";
  return EitherSchema(or_this.is_null() ? std::vector<Json>{element, several}
                                        : std::vector<Json>{element, several, or_this});
}

Json MapSchema(const Json& value, std::size_t least) {
  Json schema = {{"type", "object"}};
  if (least > 0) schema["minProperties"] = least;
  schema["additionalProperties"] = value;
  schema["words"] = "by name: " + WordsOf(value);
  return schema;
}

Json EitherSchema(const std::vector<Json>& alternatives) {
  std::vector<std::string> words;
  for (const Json& one : alternatives) words.push_back(WordsOf(one));
  return {{"anyOf", alternatives}, {"words", Either(words)}};
}

Json Requires(const std::vector<std::string>& keys) { return {{"required", keys}}; }

Json Named(const std::string& name, Json schema) {
  // objects have a table of their own
  const bool is_table = schema.contains("properties");
  const std::string words = is_table ? fmt::format("[{0}](#{0})", name) : WordsOf(schema);
  return {{"$ref", "#/definitions/" + name}, {"schema", std::move(schema)}, {"words", words}};
}

Json ObjectSchema(const std::string& sentence, const std::vector<FieldSchema>& fields) {
  Json object = {{"type", "object"}, {"additionalProperties", false}};
  if (!sentence.empty()) object["description"] = sentence;
  Json required = Json::array(), properties = Json::object();
  for (const FieldSchema& field : fields) {
    if (field.name.empty()) {
      object.update(field.schema);
      continue;
    }
    if (field.required) required.push_back(field.name);
    Json& property = properties[field.name] = field.schema;
    if (!field.standard.is_null() && !field.required) {
      const Json& standard = field.standard;
      property["default"] = standard.is_number() ? Plain(standard.get<double>()) : standard;
    }
    if (!field.sentence.empty()) property["description"] = field.sentence;
  }
  if (!required.empty()) object["required"] = required;
  object["properties"] = properties;
  return object;
}

std::string SchemaText(const std::string& title, const Json& object) {
  Json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  schema.update(object);
  Json definitions = Json::object();
  TakeOwn(&schema, &definitions);
  schema["definitions"] = definitions;
  return JsonText(schema);
}

std::string SchemaTables(const std::vector<std::pair<std::string, Json>>& kinds) {
  std::string text;
  std::set<std::string> done;
  for (const auto& [kind, object] : kinds) {
    text += Table("## " + kind, object);
    AddTables(object, &done, &text);
  }
  return text;
}

}  // namespace loopbench::harness
