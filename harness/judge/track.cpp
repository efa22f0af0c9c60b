#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "harness/base/record.h"
#include "harness/judge/judge.h"

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

namespace {

bool IsTracked(Rule rule) {
  return rule == Rule::kCount || rule == Rule::kError || rule == Rule::kInstructions ||
         rule == Rule::kTime;
}

TrackedValue Tracked(const std::string& one, const Measure& measure, const Record& record) {
  TrackedValue value{one, std::string(measure.key), std::string(measure.heading.unit)};
  if (measure.rule == Rule::kTime) {
    const std::vector<double>& sample = record.Numbers(measure.key);
    value.measure = value.measure.substr(value.measure.find('.') + 1);
    value.value = Median(sample);
    value.lower = Quantile(sample, 0.1);
    value.upper = Quantile(sample, 0.9);
    value.least = *std::ranges::min_element(sample);
    value.calibration = CalibrationOf(record, measure.key);
  } else {
    value.value = value.lower = value.upper = value.least = record.Number(measure.key);
  }
  return value;
}

}  // namespace

TrackedRecords TrackRecords(const std::vector<Record>& records) {
  TrackedRecords tracked;
  std::map<std::string, int> times_there;
  for (const Record& record : records) ++times_there[CaseText(record)];
  for (const Record& record : records) {
    const std::string one = CaseText(record);
    const auto leave_out = [&](const std::string& why) {
      tracked.left_out.push_back(fmt::format("{}: {}", one.empty() ? "a nameless case" : one, why));
    };
    if (times_there[one] > 1) {
      leave_out("there more than once");
      continue;
    }
    if (record.Text("outcome") != "finished") {
      leave_out(fmt::format("outcome {}", Shown(record, "outcome")));
      continue;
    }
    for (const Measure& measure : Measures()) {
      if (!IsTracked(measure.rule)) continue;
      const Presence held = PresenceOf(record, measure);
      if (held == Presence::kFit) tracked.values.push_back(Tracked(one, measure, record));
      if (held != Presence::kUnfit) continue;
      leave_out(fmt::format("{}: found {}, expected {}", measure.key, Shown(record, measure.key),
                            Expected(measure.rule)));
    }
  }
  return tracked;
}

}  // namespace loopbench::harness
