#include "harness/figures/distinct_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/analysis/doubts.h"
#include "harness/record/measures.h"
#include "harness/tables/table.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

constexpr int kFinest = 4096;  ///< cells of an axis: finer than any screen

bool IsPositive(double value) { return value > 0.0 && std::isfinite(value); }

}  // namespace

DistinctPoints::DistinctPoints(const FreeFigure& wanted, std::size_t most)
    : axes_{wanted.x, wanted.y}, group_(KeysIn(wanted.group)), most_(most) {
  keys_ = {"kind", "outcome", "doubts", wanted.x, wanted.y};
  keys_.insert(keys_.end(), group_.begin(), group_.end());
  keys_.insert(keys_.end(), kCaseKeys.begin(), kCaseKeys.end());
}

void DistinctPoints::Add(const Record& record) {
  ++seen_;
  Record slim;
  for (const auto& [key, value] : record.items()) {
    // what nobody else has is a parameter, which labels and remarks name
    const bool is_shown = std::ranges::find(keys_, key) != keys_.end() || !FindMeasure(key);
    if (!is_shown) continue;
    if (std::holds_alternative<std::vector<double>>(value)) {
      throw ConfigError(
          fmt::format("{}: found a series, expected single values of more than {} "
                      "records: choose some with --where",
                      key, most_));
    }
    slim.Set(key, value);
  }
  if (!cells_.insert(KeyOf(slim)).second) return;
  kept_.push_back(std::move(slim));
  while (kept_.size() > most_) Coarsen();
}

std::string DistinctPoints::CellOf(const Record& record, int axis) const {
  const std::string& key = axes_[static_cast<std::size_t>(axis)];
  const double value = record.Number(key);
  if (!std::isfinite(value)) return record.Text(key);  // a text, or nothing
  const Span& span = spans_[static_cast<std::size_t>(axis)];
  const auto cell = [this](double at, double from, double to) {
    return to > from ? std::floor((at - from) / (to - from) * parts_) : 0.0;
  };
  const double size =
      IsPositive(value) ? cell(std::log(value), span.least_size, span.largest_size) : -1.0;
  return fmt::format("{},{}", cell(value, span.least, span.largest), size);
}

std::string DistinctPoints::KeyOf(const Record& record) const {
  std::string key = fmt::format("{}{}|", HasFailed(record), HasDoubt(record));
  for (const std::string& one : group_) key += record.Text(one) + "|";
  // while all are kept, each is its own
  if (parts_ == 0) return key + std::to_string(seen_);
  return key + CellOf(record, 0) + "|" + CellOf(record, 1);
}

void DistinctPoints::Coarsen() {
  parts_ = parts_ == 0 ? kFinest : parts_ / 2;
  if (parts_ == 0) {
    throw ConfigError(
        fmt::format("found more than {} curves, expected fewer: choose another --group", most_));
  }
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    Span span{INFINITY, -INFINITY, INFINITY, -INFINITY};
    for (const Record& record : kept_) {
      const double value = record.Number(axes_[axis]);
      if (!std::isfinite(value)) continue;
      span.least = std::min(span.least, value);
      span.largest = std::max(span.largest, value);
      if (!IsPositive(value)) continue;
      span.least_size = std::min(span.least_size, std::log(value));
      span.largest_size = std::max(span.largest_size, std::log(value));
    }
    spans_[axis] = span;
  }
  cells_.clear();
  std::erase_if(kept_, [this](const Record& one) { return !cells_.insert(KeyOf(one)).second; });
}

}  // namespace loopbench::harness
