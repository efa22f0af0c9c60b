// FromJsonLine: a flat object, read value by value. Nothing is built that could nest, so neither
// depth nor length of a line costs more than its bytes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "harness/json/json_document.h"
#include "harness/json/json_syntax.h"
#include "harness/record/excerpt.h"
#include "harness/record/measures.h"
#include "harness/record/record_checksum.h"
#include "harness/record/record_json.h"
#include "harness/text/file_format.h"

namespace loopbench::harness {
namespace {

using LineJson = nlohmann::ordered_json;

/// Of a run's line; before 1.0 it had no format.
const std::array<std::string, 2> kBeginnings = {
    fmt::format("{{\"format\":{},\"kind\":\"", kFileFormat), "{\"kind\":\""};

class RecordReader final : public nlohmann::json_sax<LineJson> {
 public:
  explicit RecordReader(std::string_view line) : line_(line) {
    LineJson::sax_parse(line.begin(), line.end(), this);
  }

  const std::string& error() const { return error_; }
  /// Nothing is wrong but that it stops too early.
  bool ends_early() const { return ends_early_; }
  bool Has(const std::string& key) const { return keys_.contains(key); }
  Record Take() { return std::move(record_); }

  bool null() override {
    if (place_ != Place::kArray) return Put(std::monostate{}, key_type_, "null");
    series_.push_back(std::numeric_limits<double>::quiet_NaN());
    return true;
  }
  bool boolean(bool value) override {
    return Put(value, ValueType::kFlag, value ? "true" : "false");
  }
  bool number_integer(number_integer_t value) override {
    return PutNumber(std::int64_t{value}, static_cast<double>(value), fmt::format("{}", value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    const std::string shown = fmt::format("{}", value);
    if (value > static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max())) {
      return Reject("an integer below 2^63", shown);
    }
    return PutNumber(static_cast<std::int64_t>(value), static_cast<double>(value), shown);
  }
  bool number_float(number_float_t value, const string_t& token) override {
    const std::string_view digits = std::string_view(token).substr(0, token.find_first_of("eE"));
    if (value == 0.0 && digits.find_first_of("123456789") != std::string_view::npos) {
      return Reject("0 or a number of at least 4.9e-324", ShortToken(token));
    }
    return PutNumber(value, value, ShortToken(token));
  }
  bool string(string_t& value) override {
    const std::string shown = '"' + Excerpt(value) + '"';
    return Put(std::move(value), ValueType::kText, shown);
  }
  bool binary(binary_t&) override { return false; }

  bool start_object(std::size_t) override {
    if (place_ != Place::kTop) return Reject(Expected(), "an object");
    place_ = Place::kObject;
    return true;
  }
  bool key(string_t& key) override {
    key_ = std::move(key);
    if (!keys_.insert(key_).second) return Reject("each key once", "it twice");
    key_type_ = TypeOf(key_);
    return true;
  }
  bool end_object() override {
    place_ = Place::kEnd;
    return true;
  }
  bool start_array(std::size_t) override {
    const bool may_be = key_type_ == ValueType::kNumbers || key_type_ == ValueType::kAny;
    if (place_ != Place::kObject || !may_be) return Reject(Expected(), "an array");
    place_ = Place::kArray;
    return true;
  }
  bool end_array() override {
    place_ = Place::kObject;
    record_.Append(std::move(key_), std::exchange(series_, {}));
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& error) override {
    ends_early_ = position > line_.size();
    const bool too_large = dynamic_cast<const LineJson::out_of_range*>(&error) != nullptr;
    error_ = too_large ? fmt::format("found the number {}, expected one that fits a double",
                                     ShortToken(token))
                       : Printable(SyntaxMessage(error.what(), line_, position));
    return false;
  }

 private:
  enum class Place { kTop, kObject, kArray, kEnd };

  bool PutNumber(Value value, double number, const std::string& shown) {
    if (place_ != Place::kArray) return Put(std::move(value), ValueType::kNumber, shown);
    series_.push_back(number);
    return true;
  }

  bool Put(Value value, ValueType type, const std::string& shown) {
    if (place_ != Place::kObject || (key_type_ != type && key_type_ != ValueType::kAny)) {
      return Reject(Expected(), shown);
    }
    if (key_ == "format" && value != Value(std::int64_t{kFileFormat})) {
      return Reject(fmt::format(kExpectedFormat, kFileFormat), shown);
    }
    if (key_ != "checksum" && key_ != "format") record_.Append(std::move(key_), std::move(value));
    return true;
  }

  std::string_view Expected() const {
    if (place_ == Place::kTop) return "a JSON object";
    return Describe(place_ == Place::kArray ? ValueType::kNumbers : key_type_);
  }

  bool Reject(std::string_view expected, const std::string& found) {
    error_ = place_ == Place::kTop ? "" : fmt::format("key '{}': ", Excerpt(key_));
    error_ += fmt::format("expected {}, found {}", expected, found);
    return false;
  }

  std::string_view line_;
  Record record_;
  std::string error_;
  bool ends_early_ = false;
  Place place_ = Place::kTop;
  std::string key_;
  ValueType key_type_ = ValueType::kAny;
  std::unordered_set<std::string> keys_;
  std::vector<double> series_;
};

}  // namespace

Record FromJsonLine(std::string_view line, bool* is_sealed) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  const bool has_checksum = VerifyChecksum(line);
  if (const std::string fault = EncodingFault(line); !fault.empty()) {
    throw std::runtime_error("column " + fault.substr(fault.find(':') + 1));
  }
  RecordReader reader(line);
  if (!reader.error().empty()) throw std::runtime_error(reader.error());
  if (!has_checksum && reader.Has("checksum")) {
    throw std::runtime_error(
        "the line was changed after it was written: found a checksum that does not end the line as "
        "it was written, expected ,\"checksum\":\"...\"} without blanks");
  }
  if (!has_checksum && reader.Has("format")) throw std::runtime_error(kWithoutChecksum);
  if (is_sealed != nullptr) *is_sealed = has_checksum;
  return reader.Take();
}

bool IsTornRecord(std::string_view line) {
  const bool begins = std::ranges::any_of(kBeginnings, [line](std::string_view beginning) {
    return line.starts_with(beginning) || beginning.starts_with(line);
  });
  return begins && RecordReader(line).ends_early();
}

}  // namespace loopbench::harness
