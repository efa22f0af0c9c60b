#include "harness/record/json_object.h"

#include "harness/record/record_json.h"

namespace loopbench::harness {
namespace {

/// A value as JSON: what stands behind the key of an object that has no other.
std::string ValueText(Value value) {
  Record record;
  record.Set("", std::move(value));
  constexpr std::string_view kBefore = "{\"\":", kBehind = "}";
  const std::string text = ToJsonObject(record);
  return text.substr(kBefore.size(), text.size() - kBefore.size() - kBehind.size());
}

}  // namespace

JsonObject::JsonObject(const Record& record) {
  for (const auto& [key, value] : record.items()) Add(key, value);
}

void JsonObject::Append(std::string_view key, const std::string& document) {
  if (!members_.empty()) members_ += ',';
  members_ += ValueText(std::string(key)) + ':' + document;
}

JsonObject& JsonObject::Add(std::string_view key, Value value) {
  Append(key, ValueText(std::move(value)));
  return *this;
}

JsonObject& JsonObject::Add(std::string_view key, const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts) list += (list.empty() ? "" : ",") + ValueText(text);
  Append(key, "[" + list + "]");
  return *this;
}

JsonObject& JsonObject::Add(std::string_view key, const JsonObject& object) {
  Append(key, object.Text());
  return *this;
}

JsonObject& JsonObject::Add(std::string_view key, const std::vector<JsonObject>& objects) {
  Append(key, JsonList(objects));
  return *this;
}

std::string JsonList(const std::vector<JsonObject>& objects) {
  std::string list;
  for (const JsonObject& object : objects) list += (list.empty() ? "" : ",\n") + object.Text();
  return "[" + list + "]";
}

}  // namespace loopbench::harness
