// JSON documents that commands print for programs, made of values, records and other documents.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Keys in the order in which they were added. Texts that are not UTF-8, NaN and infinity become
/// what they are in records (record_json.h).
class JsonObject {
 public:
  JsonObject() = default;
  explicit JsonObject(const Record& record);

  JsonObject& Add(std::string_view key, Value value);
  JsonObject& Add(std::string_view key, const std::vector<std::string>& texts);
  /// A document: an object, or a list of them.
  JsonObject& Add(std::string_view key, const JsonObject& object);
  JsonObject& Add(std::string_view key, const std::vector<JsonObject>& objects);

  /// Without line breaks.
  std::string Text() const { return "{" + members_ + "}"; }

 private:
  void Append(std::string_view key, const std::string& document);

  std::string members_;
};

/// A number of things, as a value.
inline Value Count(std::size_t number) { return static_cast<std::int64_t>(number); }

/// "[...]", an object a line.
std::string JsonList(const std::vector<JsonObject>& objects);

}  // namespace loopbench::harness
