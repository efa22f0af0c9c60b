#include "harness/base/record.h"

#include <cmath>
#include <limits>

#include "harness/base/json_document.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

Json FromNumber(double number) { return std::isfinite(number) ? Json(number) : Json(nullptr); }

Json FromValue(const Value& value) {
  const auto convert = [](const auto& held) -> Json {
    using Held = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<Held, std::monostate>) {
      return nullptr;
    } else if constexpr (std::is_same_v<Held, double>) {
      return FromNumber(held);
    } else if constexpr (std::is_same_v<Held, std::vector<double>>) {
      return Mapped<Json>(held, FromNumber);
    } else {
      return held;
    }
  };
  return std::visit(convert, value);
}

constexpr std::string_view kKey = "\"checksum\":\"";
constexpr std::size_t kDigits = 16, kSuffix = kKey.size() + kDigits + 2;  // with "}

/// Returns a value as JSON.
std::string ValueText(const Value& value) { return CompactText(FromValue(value)); }

}  // namespace

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

std::string Record::Described() const {
  return Joined(items_, ", ",
                [this](const auto& item) { return item.first + " = " + Text(item.first); });
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

std::string ToJsonObject(const Record& record) {
  Json object = Json::object();
  for (const auto& [key, value] : record.items()) object[key] = FromValue(value);
  return CompactText(object);
}

std::string ToJsonLine(const Record& record) {
  std::string object = ToJsonObject(record);
  const bool is_empty = record.items().empty();
  object.replace(0, 1, fmt::format("{{\"format\":{}{}", kRecordFormat, is_empty ? "" : ","));
  return WithChecksum(std::move(object));
}

std::string CaseId(const Record& canonical_keys) {
  auto items = canonical_keys.items();
  std::ranges::sort(items, {}, &std::pair<std::string, Value>::first);
  Record sorted;
  for (auto& [key, value] : items) sorted.Append(std::move(key), std::move(value));
  return Fnv1a(ToJsonObject(sorted));
}

std::string WithChecksum(std::string object) {
  object.pop_back();
  if (object.size() > 1) object += ',';
  const std::string checksum = Fnv1a(object);
  return object.append(kKey).append(checksum).append("\"}");
}

bool VerifyChecksum(std::string_view line) {
  if (line.size() <= kSuffix) return false;
  const std::string_view object = line.substr(0, line.size() - kSuffix),
                         end = line.substr(object.size());
  const std::string expected = Fnv1a(object);
  const std::string_view found = end.substr(kKey.size(), kDigits);
  const bool is_named = end.starts_with(kKey);
  if (is_named && found == expected) return true;
  constexpr std::string_view kChanged = "the line was changed after it was written: found ";
  if (is_named) {
    throw std::runtime_error(
        fmt::format("{}checksum \"{}\", expected \"{}\"", kChanged, Excerpt(found), expected));
  }
  if (found == expected) {
    throw std::runtime_error(fmt::format("{}the key {}, expected \"checksum\"", kChanged,
                                         Excerpt(end.substr(0, kKey.size() - 2))));
  }
  return false;
}

std::string Excerpt(std::string_view text) {
  constexpr std::size_t kMost = 80;
  std::string_view beginning = text.substr(0, kMost);
  // only whole characters, if there are any
  for (std::size_t cut = 0; cut < 4 && beginning.size() < text.size(); ++cut) {
    if (!ContinuesCharacter(text[beginning.size()])) break;
    beginning.remove_suffix(1);
  }
  if (EncodingFault(beginning).empty()) return Printable(std::string(beginning));
  std::string shown;
  for (const char c : beginning) {
    const auto byte = static_cast<unsigned char>(c);
    shown += byte >= 0x20 && byte < 0x7F ? std::string(1, c) : fmt::format("\\x{:02X}", byte);
  }
  return shown;
}

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
  Append(key, "[" + Joined(texts, ",", ValueText) + "]");
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
  return "[" + Joined(objects, ",\n", &JsonObject::Text) + "]";
}

}  // namespace loopbench::harness
