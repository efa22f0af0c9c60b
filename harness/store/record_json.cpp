#include "harness/store/record_json.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "harness/hash.h"

namespace loopbench::harness {
namespace {

using OrderedJson = nlohmann::ordered_json;

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

[[noreturn]] void Reject(const std::string& key, std::string_view expected,
                         const OrderedJson& found) {
  throw std::runtime_error(
      fmt::format("key '{}': expected {}, found {}", key, expected, found.dump().substr(0, 60)));
}

std::vector<double> ToSeries(const std::string& key, const OrderedJson& array) {
  std::vector<double> series;
  series.reserve(array.size());
  for (const OrderedJson& element : array) {
    if (element.is_null()) {
      series.push_back(std::numeric_limits<double>::quiet_NaN());
    } else if (element.is_number()) {
      series.push_back(element.get<double>());
    } else {
      Reject(key, "an array of numbers", element);
    }
  }
  return series;
}

Value ToValue(const std::string& key, const OrderedJson& json) {
  switch (json.type()) {
    case OrderedJson::value_t::null:
      return std::monostate{};
    case OrderedJson::value_t::boolean:
      return json.get<bool>();
    case OrderedJson::value_t::number_integer:
      return json.get<std::int64_t>();
    case OrderedJson::value_t::number_unsigned:
      if (json.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max()) {
        Reject(key, "an integer below 2^63", json);
      }
      return json.get<std::int64_t>();
    case OrderedJson::value_t::number_float:
      return json.get<double>();
    case OrderedJson::value_t::string:
      return json.get<std::string>();
    case OrderedJson::value_t::array:
      return ToSeries(key, json);
    default:
      Reject(key, "null, a bool, a number, a string or an array of numbers", json);
  }
}

}  // namespace

std::string ToJsonLine(const Record& record) { return Dump<OrderedJson>(record); }

Record FromJsonLine(std::string_view line) {
  OrderedJson object;
  try {
    object = OrderedJson::parse(line);
  } catch (const OrderedJson::exception& error) {
    throw std::runtime_error(fmt::format("not JSON ({})", error.what()));
  }
  if (!object.is_object()) {
    throw std::runtime_error(fmt::format("expected a JSON object, found {}", object.type_name()));
  }
  Record record;
  for (const auto& [key, value] : object.items()) record.Set(key, ToValue(key, value));
  return record;
}

std::string CaseId(const Record& canonical_keys) {
  // nlohmann::json keeps its keys sorted.
  return Fnv1a(Dump<nlohmann::json>(canonical_keys));
}

}  // namespace loopbench::harness
