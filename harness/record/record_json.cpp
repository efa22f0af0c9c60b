#include "harness/record/record_json.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>
#include <vector>

#include "harness/record/record_checksum.h"
#include "harness/text/file_format.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

template <typename Json>
Json FromNumber(double number) {
  return std::isfinite(number) ? Json(number) : Json(nullptr);
}

template <typename Json>
Json FromValue(const Value& value) {
  const auto convert = [](const auto& held) -> Json {
    using Held = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<Held, std::monostate>) {
      return nullptr;
    } else if constexpr (std::is_same_v<Held, double>) {
      return FromNumber<Json>(held);
    } else if constexpr (std::is_same_v<Held, std::vector<double>>) {
      Json series = Json::array();
      for (const double number : held) series.push_back(FromNumber<Json>(number));
      return series;
    } else {
      return held;
    }
  };
  return std::visit(convert, value);
}

template <typename Json>
std::string Dump(const Record& record) {
  Json object = Json::object();
  for (const auto& [key, value] : record.items()) object[key] = FromValue<Json>(value);
  return object.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string ToJsonObject(const Record& record) { return Dump<nlohmann::ordered_json>(record); }

std::string ToJsonLine(const Record& record) {
  std::string object = ToJsonObject(record);
  const bool is_empty = record.items().empty();
  object.replace(0, 1, fmt::format("{{\"format\":{}{}", kFileFormat, is_empty ? "" : ","));
  return WithChecksum(std::move(object));
}

std::string CaseId(const Record& canonical_keys) {
  // nlohmann::json keeps its keys sorted.
  return Fnv1a(Dump<nlohmann::json>(canonical_keys));
}

}  // namespace loopbench::harness
