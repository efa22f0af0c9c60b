#include "harness/store/merge_stores.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "harness/record/record_json.h"

namespace loopbench::harness {
namespace {

/// How a run ended when it was not by itself.
constexpr std::array<std::string_view, 5> kCutShort = {"time-limit", "process-time-limit",
                                                       "memory-limit", "crashed", "bad-answer"};

/// What two runs of one case by one program may differ in: times, the machine and how busy it was,
/// and how the command was typed.
constexpr std::array<std::string_view, 25> kMayDiffer = {
    "wall_s",          "cpu_s",         "wall_s_median",  "wall_s_min",
    "wall_s_p10",      "wall_s_p90",    "step_us_median", "rhs_ns_median",
    "rhs_ns_min",      "rhs_ns_p10",    "rhs_ns_p90",     "ns_per_body",
    "realtime_factor", "series.rhs_ns", "series.wall_s",  "aa_spread",
    "aa_spread_wall",  "load1",         "processors",     "governor",
    "noise",           "machine",       "libm",           "set",
    "experiment_index"};

/// The run, a member of its ensemble, or the reference of its ladder.
bool WasCutShort(const Record& record) {
  const std::string member = record.Text("ensemble_first_failed");
  const bool has_reference =
      record.Find("error_final") == nullptr || !std::isnan(record.Number("error_final"));
  return !has_reference || std::ranges::any_of(kCutShort, [&](std::string_view ending) {
    return record.Text("outcome") == ending || member.find(ending) != std::string::npos;
  });
}

bool MayDiffer(std::string_view key) {
  return std::ranges::find(kMayDiffer, key) != kMayDiffer.end();
}

std::string Shown(const Record& record, const std::string& key) {
  const Value* value = record.Find(key);
  if (value == nullptr) return "nothing";
  if (std::holds_alternative<std::vector<double>>(*value)) return "another series";
  return record.Text(key).empty() ? "null" : record.Text(key);
}

/// A key in which the records differ and may not, or "".
std::string Difference(const Record& one, const Record& other) {
  for (const auto& [first, second] : {std::pair(&one, &other), std::pair(&other, &one)}) {
    for (const auto& [key, value] : first->items()) {
      if (MayDiffer(key)) continue;
      const Value* found = second->Find(key);
      // as lines of a store, where NaN is null
      Record a, b;
      a.Set(key, value);
      if (found != nullptr) b.Set(key, *found);
      if (found == nullptr || ToJsonLine(a) != ToJsonLine(b)) return key;
    }
  }
  return "";
}

struct Kept {
  std::size_t place;
  const std::filesystem::path* file;
};

void RequireEqual(const Record& known, const std::filesystem::path& known_file, const Record& fresh,
                  const std::filesystem::path& fresh_file) {
  const std::string key = Difference(known, fresh);
  if (key.empty()) return;
  const bool other_library = known.Text("libm") != fresh.Text("libm");
  throw std::runtime_error(fmt::format(
      "{} and {}: case {} ({} {}) has {} {} in the first and {} in the second; {}",
      known_file.string(), fresh_file.string(), known.Text("id"), known.Text("mechanism"),
      known.Text("formulation"), key, Shown(known, key), Shown(fresh, key),
      other_library ? "they come from two mathematical libraries: merge one of them"
                    : "one of the stores is not what it says"));
}

}  // namespace

std::vector<Record> MergeStores(const std::vector<PartOfStore>& parts) {
  std::vector<Record> merged;
  std::map<std::string, Kept> kept;
  for (const PartOfStore& part : parts) {
    for (const Record& record : part.records) {
      const std::string id = record.Text("id");
      const auto [at, is_new] = kept.try_emplace(id, Kept{merged.size(), &part.file});
      if (id.empty() || is_new) {
        merged.push_back(record);
        continue;
      }
      Record& known = merged[at->second.place];
      if (WasCutShort(record) && !WasCutShort(known)) continue;
      if (!WasCutShort(record) && !WasCutShort(known)) {
        RequireEqual(known, *at->second.file, record, part.file);
      }
      known = record;
      at->second.file = &part.file;
    }
  }
  return merged;
}

}  // namespace loopbench::harness
