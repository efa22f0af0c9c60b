#include "harness/config/experiment_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "harness/text/config_error.h"
#include "harness/text/spelling.h"

namespace loopbench::harness {
namespace {

/// An index as a JSON Pointer writes it.
std::optional<std::size_t> IndexOf(const std::string& token) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), index);
  const bool number = error == std::errc() && end == token.data() + token.size();
  if (!number || (token.size() > 1 && token.front() == '0')) return std::nullopt;
  return index;
}

std::string PlaceName(const std::string& pointer) { return pointer.empty() ? "the file" : pointer; }

std::vector<std::string> KeysOf(const Json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

FieldFault NoElement(const Json& array, const std::string& token, const std::string& pointer) {
  return {fmt::format("no element \"{}\" in {}", token, PlaceName(pointer)),
          array.empty() ? "another field: the array is empty"
                        : fmt::format("an index from 0 to {} or \"*\"", array.size() - 1),
          "", ""};
}

FieldFault NoKey(const Json& object, const std::string& token, const std::string& pointer) {
  const std::vector<std::string> keys = KeysOf(object);
  return {fmt::format("no \"{}\" in {}", token, PlaceName(pointer)),
          keys.empty() ? "another field: the object is empty"
                       : fmt::format("one of \"{}\"", fmt::join(keys, "\", \"")),
          NearestSpelling(token, keys), ""};
}

/// The name under which "limits" has a field: "cpu_s" was "wall_s" once, and either is accepted.
std::string NameInLimits(const Json& limits, const std::string& token) {
  const std::string other = token == "wall_s" ? "cpu_s" : token == "cpu_s" ? "wall_s" : token;
  return limits.contains(token) || !limits.contains(other) ? token : other;
}

}  // namespace

std::optional<std::vector<std::string>> PointerTokens(const std::string& pointer) {
  if (pointer.empty() || pointer.front() != '/') return std::nullopt;
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    if (pointer[i] == '/') {
      tokens.emplace_back();
    } else if (pointer[i] != '~') {
      tokens.back() += pointer[i];
    } else if (i + 1 < pointer.size() && (pointer[i + 1] == '0' || pointer[i + 1] == '1')) {
      tokens.back() += pointer[++i] == '0' ? '~' : '/';
    } else {
      return std::nullopt;
    }
  }
  return tokens;
}

bool ExperimentFields::TakeIn(Json& node, const std::string& pointer, FieldTargets* found) {
  const std::filesystem::path path = files_.Resolve(node.get<std::string>());
  try {
    if (!std::filesystem::is_regular_file(path)) {
      found->fault = {fmt::format("\"{}\" at {}", node.get<std::string>(), pointer),
                      fmt::format("a mechanism file ({} is none)", path.string()), "", "", true};
      return false;
    }
    Json document = files_.Document(path);
    node = std::move(document);
    origins_.TakeIn(pointer, path.string(), files_.Text(path));
    return true;
  } catch (const ConfigError& mistakes) {
    found->fault = FieldFault{"", "", "", mistakes.what(), true};
    return false;
  }
}

void ExperimentFields::Walk(Json& node, const std::vector<std::string>& tokens, std::size_t depth,
                            const std::string& pointer, FieldTargets* found) {
  if (found->fault) return;
  if (depth == tokens.size()) {
    found->pointers.push_back(pointer);
    found->made.push_back(pointer);
    return;
  }
  const bool at_mechanism = depth == 3 && tokens[0] == "scenes" && tokens[2] == "mechanism";
  if (at_mechanism && node.is_string() && !TakeIn(node, pointer, found)) return;
  const bool of_limits = depth == 1 && tokens[0] == "limits" && node.is_object();
  const std::string token = of_limits ? NameInLimits(node, tokens[depth]) : tokens[depth];
  if (node.is_array()) {
    const auto index = IndexOf(token);
    if (token == "*" && !node.empty()) {
      for (std::size_t i = 0; i < node.size(); ++i) {
        Walk(node[i], tokens, depth + 1, fmt::format("{}/{}", pointer, i), found);
      }
    } else if (index && *index < node.size()) {
      Walk(node[*index], tokens, depth + 1, pointer + "/" + token, found);
    } else {
      found->fault = NoElement(node, token, pointer);
    }
    return;
  }
  if (!node.is_object()) {
    found->fault = FieldFault{
        fmt::format("no \"{}\" in {}, which is {}", token, PlaceName(pointer),
                    node.dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 60)),
        "a field of an object or array", "", ""};
    return;
  }
  const std::string below = pointer + "/" + PointerToken(token);
  if (const auto member = node.find(token); member != node.end()) {
    Walk(*member, tokens, depth + 1, below, found);
    return;
  }
  // Points may have any name: a misspelt one would be made, and change nothing. And there is no
  // telling what an array that is not there should hold.
  const bool free_names = depth > 0 && tokens[depth - 1] == "points";
  const bool in_array = std::any_of(
      tokens.begin() + static_cast<std::ptrdiff_t>(depth) + 1, tokens.end(),
      [](const std::string& later) { return later == "*" || IndexOf(later).has_value(); });
  if (free_names || in_array) {
    found->fault = NoKey(node, token, pointer);
    return;
  }
  std::string whole = below;
  for (std::size_t i = depth + 1; i < tokens.size(); ++i) whole += "/" + PointerToken(tokens[i]);
  found->pointers.push_back(whole);
  found->made.push_back(below);
}

FieldTargets ExperimentFields::Find(const std::string& pointer) {
  FieldTargets found;
  const auto tokens = PointerTokens(pointer);
  if (!tokens) {
    found.fault = FieldFault{fmt::format("\"{}\"", pointer),
                             "a JSON Pointer such as /scenes/0/horizon", "", ""};
    return found;
  }
  Walk(document_, *tokens, 0, "", &found);
  return found;
}

void ExperimentFields::Set(const std::string& pointer, const Json& value) {
  Json* node = &document_;
  const std::vector<std::string> tokens = PointerTokens(pointer).value();
  for (const std::string& token : tokens) {
    node = node->is_array() ? &(*node)[*IndexOf(token)] : &(*node)[token];
  }
  *node = value;
}

}  // namespace loopbench::harness
