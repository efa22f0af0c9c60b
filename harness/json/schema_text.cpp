// A schema as a file for editors, and as tables for people.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "harness/json/json_text.h"
#include "harness/json/schema.h"

namespace loopbench::harness {
namespace {

/// Of a schema that Named() made.
std::string NameOf(const Json& reference) {
  const std::string path = reference["$ref"];
  return path.substr(path.rfind('/') + 1);
}

/// Takes out what is no word of draft 07: the schemas that Named() brought along, in the order of
/// first use, and the words.
void TakeOwn(Json* node, Json* definitions) {
  if (!node->is_structured()) return;
  if (node->is_object() && node->contains("$ref") && node->contains("schema")) {
    Json named = std::move((*node)["schema"]);
    node->erase("schema");
    const std::string name = NameOf(*node);
    if (!definitions->contains(name)) {
      (*definitions)[name] = nullptr;  // its place, before those that it refers to
      TakeOwn(&named, definitions);
      (*definitions)[name] = std::move(named);
    }
  }
  if (node->is_object() && node->contains("words") && (*node)["words"].is_string()) {
    node->erase("words");
  }
  for (Json& child : *node) TakeOwn(&child, definitions);
}

/// As one cell of a table.
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

/// Tables of the objects within, in the order of first use, but for those among `done`.
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
