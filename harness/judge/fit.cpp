#include "harness/judge/fit.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string_view>

#include "harness/analysis/scaling.h"
#include "harness/judge/statistics.h"

namespace loopbench::harness {

namespace {

/// A name with its numeric part replaced by "N".
struct FamilyName {
  std::string name;
  double size = 0.0;
};

/// `name` is empty when there is not exactly one numeric part.
FamilyName Split(const std::string& benchmark) {
  FamilyName family;
  int numbers = 0;
  for (std::size_t start = 0; start <= benchmark.size();) {
    const std::size_t end = std::min(benchmark.find('/', start), benchmark.size());
    const std::string_view part = std::string_view(benchmark).substr(start, end - start);
    double value = 0.0;
    const auto [rest, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    const bool is_number =
        error == std::errc() && rest == part.data() + part.size() && std::isfinite(value);
    if (is_number) family.size = value;
    numbers += is_number;
    family.name += (start > 0 ? "/" : "") + (is_number ? std::string("N") : std::string(part));
    start = end + 1;
  }
  if (numbers != 1) family.name.clear();
  return family;
}

/// Of a benchmark its own; of a timing the name that a benchmark of it would have, with the number
/// at the end of its mechanism's name as a part ("chain-10" is "chain/10").
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
  const std::string threads = record.Text("threads");
  if (!threads.empty()) name += "/" + threads + "-threads";
  if (const std::string word = record.Text("execution"); !word.empty()) name += "/" + word;
  return name;
}

struct Points {
  std::vector<double> sizes, times;
  std::int64_t failed = 0;
};

}  // namespace

std::vector<Record> FitFamilies(const std::vector<Record>& measured, double from) {
  std::vector<std::string> order;
  std::map<std::string, Points> families;
  for (const Record& record : measured) {
    const FamilyName family = Split(BenchmarkNameOf(record));
    if (family.name.empty()) continue;
    const auto [at, is_new] = families.try_emplace(family.name);
    if (is_new) order.push_back(family.name);
    const double bodies = record.Number("bodies");
    const double size = std::isnan(bodies) ? family.size : bodies;
    const double time = Median(record.Numbers(
        record.Find("series.cpu_ns") != nullptr ? "series.cpu_ns" : "series.rhs_ns"));
    if (record.Text("outcome") != "finished" || std::isnan(time)) {
      ++at->second.failed;
    } else if (size >= from) {
      at->second.sizes.push_back(size);
      at->second.times.push_back(time);
    }
  }
  std::vector<Record> rows;
  for (const std::string& name : order) {
    const Points& points = families[name];
    const PowerFit fit = FitPower(points.sizes, points.times);
    // a family of which too few finished is a row without an exponent
    if (fit.sizes + points.failed < 2) continue;
    Record row;
    row.Set("family", name);
    row.Set("sizes", std::int64_t{fit.sizes});
    row.Set("failed", points.failed);
    rows.push_back(row);
    if (fit.sizes < 2) continue;
    const auto largest = std::ranges::max_element(points.sizes) - points.sizes.begin();
    row.Set("bodies_min", std::round(fit.smallest * 1e6) / 1e6);
    row.Set("bodies_max", std::round(fit.largest * 1e6) / 1e6);
    row.Set("exponent", fit.exponent);
    row.Set("standard_error", fit.standard_error);
    row.Set("slope_min", fit.slope_min);
    row.Set("slope_max", fit.slope_max);
    row.Set("ns_per_body", points.times[static_cast<std::size_t>(largest)] / fit.largest);
    rows.back() = std::move(row);
  }
  return rows;
}

}  // namespace loopbench::harness
