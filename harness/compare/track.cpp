#include "harness/compare/track.h"

#include <algorithm>
#include <cmath>

#include "harness/compare/measures.h"
#include "harness/compare/statistics.h"
#include "harness/timing/noise.h"

namespace loopbench::harness {

std::vector<TrackedValue> TrackedValues(const std::vector<Record>& records) {
  std::vector<TrackedValue> values;
  for (const Record& record : records) {
    if (record.Text("outcome") != "finished") continue;
    for (const Measure& measure : Measures()) {
      const bool is_number = measure.rule == Rule::kCount || measure.rule == Rule::kError ||
                             measure.rule == Rule::kInstructions;
      TrackedValue value{CaseText(record), measure.key, measure.unit, 0.0, 0.0, 0.0};
      if (measure.rule == Rule::kTime) {
        const std::vector<double>& sample = record.Numbers(measure.key);
        if (sample.empty()) continue;
        value.measure = value.measure.substr(value.measure.find('.') + 1);
        value.value = Median(sample);
        value.lower = Quantile(sample, 0.1);
        value.upper = Quantile(sample, 0.9);
      } else if (is_number && std::isfinite(record.Number(measure.key))) {
        value.value = value.lower = value.upper = record.Number(measure.key);
      } else {
        continue;
      }
      values.push_back(std::move(value));
    }
  }
  return values;
}

}  // namespace loopbench::harness
