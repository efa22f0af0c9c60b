#include "harness/record/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace loopbench::harness {

void Record::Set(std::string_view key, Value value) {
  const auto it = std::ranges::find(items_, key, &std::pair<std::string, Value>::first);
  if (it != items_.end()) {
    it->second = std::move(value);
  } else {
    items_.emplace_back(std::string(key), std::move(value));
  }
}

const Value* Record::Find(std::string_view key) const {
  const auto it = std::ranges::find(items_, key, &std::pair<std::string, Value>::first);
  return it == items_.end() ? nullptr : &it->second;
}

std::string Record::Text(std::string_view key) const {
  const Value* value = Find(key);
  if (value == nullptr) return "";
  if (const auto* text = std::get_if<std::string>(value)) return *text;
  if (const auto* flag = std::get_if<bool>(value)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(value)) return fmt::format("{}", *integer);
  if (const auto* number = std::get_if<double>(value)) return fmt::format("{}", *number);
  return "";
}

double Record::Number(std::string_view key) const {
  const Value* value = Find(key);
  if (value == nullptr) return std::numeric_limits<double>::quiet_NaN();
  if (const auto* flag = std::get_if<bool>(value)) return *flag ? 1.0 : 0.0;
  if (const auto* integer = std::get_if<std::int64_t>(value)) return static_cast<double>(*integer);
  if (const auto* number = std::get_if<double>(value)) return *number;
  return std::numeric_limits<double>::quiet_NaN();
}

const std::vector<double>& Record::Numbers(std::string_view key) const {
  static const std::vector<double> kEmpty;
  const Value* value = Find(key);
  if (value == nullptr) return kEmpty;
  const auto* series = std::get_if<std::vector<double>>(value);
  return series == nullptr ? kEmpty : *series;
}

}  // namespace loopbench::harness
