#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <ranges>
#include <set>
#include <string_view>
#include <utility>

#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {

namespace {

constexpr std::size_t kLargestExact = 40;

/// Probability f(u; a, b) of each u from 0 to a b, when all orders of a + b different values are
/// equally likely: the largest is of the first sample with probability a / (a + b), above all b.
std::vector<double> ExactDistribution(std::size_t a, std::size_t b) {
  // rows[i] holds f(.; i, j) for the current j
  std::vector<std::vector<double>> rows(a + 1, std::vector<double>{1.0});
  for (std::size_t j = 1; j <= b; ++j) {
    std::vector<std::vector<double>> next(a + 1);
    next[0] = {1.0};
    for (std::size_t i = 1; i <= a; ++i) {
      next[i].assign(i * j + 1, 0.0);
      const double first = static_cast<double>(i) / static_cast<double>(i + j);
      for (std::size_t u = 0; u < next[i - 1].size(); ++u) {
        next[i][u + j] += first * next[i - 1][u];
      }
      for (std::size_t u = 0; u < rows[i].size(); ++u) next[i][u] += (1.0 - first) * rows[i][u];
    }
    rows = std::move(next);
  }
  return rows[a];
}

/// Sum over groups of equal values of t^3 - t.
double TieTerm(std::span<const double> a, std::span<const double> b) {
  std::map<double, double> counts;
  for (const std::span<const double> sample : {a, b}) {
    for (const double x : sample) ++counts[x];
  }
  double term = 0.0;
  for (const auto& [x, t] : counts) term += t * t * t - t;
  return term;
}

double NormalTail(double u, double a, double b, double ties) {
  const double n = a + b;
  const double variance = a * b / 12.0 * (n + 1.0 - ties / (n * (n - 1.0)));
  if (!(variance > 0.0)) return 1.0;  // all values equal
  return 0.5 * std::erfc((u - a * b / 2.0 - 0.5) / std::sqrt(2.0 * variance));
}

using TrackerDocument = nlohmann::ordered_json;

bool HasSpread(const TrackedValue& value) {
  return value.lower < value.upper && std::isfinite(value.lower) && std::isfinite(value.upper);
}

std::string DumpTracker(const TrackerDocument& document) {
  return document.dump(2, ' ', false, TrackerDocument::error_handler_t::replace) + "\n";
}

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

double Median(std::span<const double> sample) {
  const auto is_nan = [](double x) { return std::isnan(x); };
  if (sample.empty() || std::ranges::any_of(sample, is_nan)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::vector<double> sorted(sample.begin(), sample.end());
  std::ranges::sort(sorted);
  const std::size_t n = sorted.size();
  return n % 2 == 1 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
}

MannWhitneyResult MannWhitney(std::span<const double> a, std::span<const double> b) {
  MannWhitneyResult result;
  if (a.empty() || b.empty()) return result;
  std::vector<double> sorted(b.begin(), b.end());
  std::ranges::sort(sorted);
  for (const double x : a) {
    const auto [equal, above] = std::ranges::equal_range(sorted, x);
    result.u +=
        static_cast<double>(equal - sorted.begin()) + 0.5 * static_cast<double>(above - equal);
  }
  const double ties = TieTerm(a, b);
  result.exact = ties == 0.0 && std::max(a.size(), b.size()) <= kLargestExact;
  if (result.exact) {
    const std::vector<double> f = ExactDistribution(a.size(), b.size());
    const auto u = static_cast<std::ptrdiff_t>(result.u);
    result.p_greater = std::min(1.0, std::accumulate(f.begin() + u, f.end(), 0.0));
  } else {
    result.p_greater =
        NormalTail(result.u, static_cast<double>(a.size()), static_cast<double>(b.size()), ties);
  }
  return result;
}

double SmallestP(std::size_t a, std::size_t b) {
  double p = 1.0;
  for (std::size_t i = 1; i <= a; ++i) {
    p *= static_cast<double>(i) / static_cast<double>(b + i);
  }
  return p;
}

std::vector<double> HolmAdjusted(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [p](std::size_t i) { return p[i]; });
  std::vector<double> adjusted(p.size());
  double largest = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const double factor = static_cast<double>(p.size() - rank);
    largest = std::max(largest, std::min(1.0, factor * p[order[rank]]));
    adjusted[order[rank]] = largest;
  }
  return adjusted;
}

namespace {

/// A name with its numeric part replaced by "N"; empty unless there is exactly one such part.
struct FamilyName {
  std::string name;
  double size = 0.0;
};

FamilyName Split(const std::string& benchmark) {
  FamilyName family;
  int numbers = 0;
  std::string gap;
  for (const auto each : std::views::split(benchmark, '/')) {
    const std::string_view part(each.begin(), each.end());
    double value = 0.0;
    const auto [rest, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    const bool is_number =
        error == std::errc() && rest == part.data() + part.size() && std::isfinite(value);
    if (is_number) family.size = value;
    numbers += is_number;
    family.name += gap + (is_number ? "N" : std::string(part));
    gap = "/";
  }
  if (numbers != 1) family.name.clear();
  return family;
}

/// Returns the name of a benchmark, or for a timing the equivalent name, with the number at the end
/// of the mechanism's name as a part ("chain-10" is "chain/10").
std::string BenchmarkNameOf(const Record& record) {
  if (record.Find("benchmark") != nullptr) return record.Text("benchmark");
  if (record.Text("kind") != "timing") return "";
  std::string name = record.Text("mechanism");
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  if (digits == 0 || digits == name.size() || name[digits - 1] != '-') return "";
  name[digits - 1] = '/';
  name = "rhs/" + name;
  for (const char* key : {"formulation", "enforcement", "coordinates", "solver", "integrator"}) {
    if (const std::string word = record.Text(key); !word.empty()) name += "/" + word;
  }
  for (const auto& [key, ending] : {std::pair("threads", "-threads"), {"execution", ""}}) {
    if (const std::string word = record.Text(key); !word.empty()) name += "/" + word + ending;
  }
  return name;
}

}  // namespace

std::vector<Record> FitFamilies(const std::vector<Record>& measured, double from) {
  std::vector<Record> rows;
  const auto name_of = [](const Record& record) { return Split(BenchmarkNameOf(record)).name; };
  for (const auto& [name, members] : GroupBy(measured, name_of)) {
    if (name.empty()) continue;
    std::vector<double> sizes, times;
    std::int64_t failed = 0;
    for (const Record& record : members) {
      const double bodies = record.Number("bodies");
      const double size = std::isnan(bodies) ? Split(BenchmarkNameOf(record)).size : bodies;
      const double time = Median(record.Numbers(
          record.Find("series.cpu_ns") != nullptr ? "series.cpu_ns" : "series.rhs_ns"));
      if (record.Text("outcome") != "finished" || std::isnan(time)) {
        ++failed;
      } else if (size >= from) {
        sizes.push_back(size);
        times.push_back(time);
      }
    }
    const PowerFit fit = FitPower(sizes, times);
    // a family with too few finished members has no exponent
    if (fit.sizes + failed < 2) continue;
    Record& row = rows.emplace_back();
    row.Set("family", name);
    row.Set("sizes", std::int64_t{fit.sizes});
    row.Set("failed", failed);
    if (fit.sizes < 2) continue;
    const auto largest = std::ranges::max_element(sizes) - sizes.begin();
    row.Set("bodies_min", std::round(fit.smallest * 1e6) / 1e6);
    row.Set("bodies_max", std::round(fit.largest * 1e6) / 1e6);
    row.Set("exponent", fit.exponent);
    row.Set("standard_error", fit.standard_error);
    row.Set("slope_min", fit.slope_min);
    row.Set("slope_max", fit.slope_max);
    row.Set("ns_per_body", times[static_cast<std::size_t>(largest)] / fit.largest);
  }
  return rows;
}

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

TrackedRecords TrackRecords(const std::vector<Record>& records) {
  TrackedRecords tracked;
  const std::set<std::string> repeated = RepeatedCases(records);
  for (const Record& record : records) {
    const std::string one = CaseText(record);
    const auto leave_out = [&](const std::string& why) {
      tracked.left_out.push_back(fmt::format("{}: {}", one.empty() ? "a nameless case" : one, why));
    };
    const bool is_repeated = repeated.contains(one);
    if (is_repeated || record.Text("outcome") != "finished") {
      leave_out(is_repeated ? "there more than once" : "outcome " + Shown(record, "outcome"));
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
