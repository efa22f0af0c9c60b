#include "harness/json/json_text.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kWidth = 100;  ///< characters of a line

/// On one line where it fits behind `used` characters, else one element per line.
std::string Written(const Json& value, std::size_t indent, std::size_t used) {
  const std::string flat = FlatText(value);
  if (used + flat.size() < kWidth || !value.is_structured() || value.empty()) return flat;
  const std::string margin(indent + 2, ' ');
  std::string text;
  for (auto child = value.begin(); child != value.end(); ++child) {
    const std::string key = value.is_object() ? Json(child.key()).dump() + ": " : "";
    text += (text.empty() ? "\n" : ",\n") + margin + key +
            Written(*child, indent + 2, margin.size() + key.size());
  }
  text += "\n" + std::string(indent, ' ');
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

}  // namespace

std::string FlatText(const Json& value) {
  if (!value.is_structured()) return value.dump();
  std::string text;
  for (auto child = value.begin(); child != value.end(); ++child) {
    text += text.empty() ? "" : ", ";
    if (value.is_object()) text += Json(child.key()).dump() + ": ";
    text += FlatText(*child);
  }
  return value.is_object() ? "{" + text + "}" : "[" + text + "]";
}

std::string JsonText(const Json& document) { return Written(document, 0, 0) + "\n"; }

}  // namespace loopbench::harness
