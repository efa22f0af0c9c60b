#include "harness/json/schema.h"

#include <fmt/format.h>

#include <cmath>

namespace loopbench::harness {
namespace {

/// Without a ".0" behind whole numbers, as a person writes them.
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
  const Json count = Named("count", IntegerSchema(2, kMostInRange));
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
  constexpr std::size_t kFew = 10;  // more is a limit for machines
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

}  // namespace loopbench::harness
