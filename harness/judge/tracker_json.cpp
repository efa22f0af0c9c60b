#include "harness/judge/tracker_json.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace loopbench::harness {
namespace {

using TrackerDocument = nlohmann::ordered_json;

bool HasSpread(const TrackedValue& value) {
  return std::isfinite(value.lower) && std::isfinite(value.upper) && value.lower < value.upper;
}

std::string DumpTracker(const TrackerDocument& document) {
  return document.dump(2, ' ', false, TrackerDocument::error_handler_t::replace) + "\n";
}

}  // namespace

std::string ToCustomSmallerIsBetter(const std::vector<TrackedValue>& values) {
  TrackerDocument document = TrackerDocument::array();
  for (const TrackedValue& value : values) {
    TrackerDocument entry = {{"name", value.benchmark + " " + value.measure},
                             {"unit", value.unit.empty() ? "1" : value.unit},
                             {"value", value.value}};
    if (HasSpread(value)) entry["range"] = fmt::format("{} .. {}", value.lower, value.upper);
    document.push_back(std::move(entry));
  }
  return DumpTracker(document);
}

std::string ToBencherMetricFormat(const std::vector<TrackedValue>& values) {
  TrackerDocument document = TrackerDocument::object();
  for (const TrackedValue& value : values) {
    TrackerDocument metric = {{"value", value.value}};
    if (HasSpread(value)) {
      metric["lower_value"] = value.lower;
      metric["upper_value"] = value.upper;
    }
    const std::string measure =
        value.unit.empty() ? value.measure : fmt::format("{} ({})", value.measure, value.unit);
    document[value.benchmark][measure] = std::move(metric);
  }
  return DumpTracker(document);
}

}  // namespace loopbench::harness
