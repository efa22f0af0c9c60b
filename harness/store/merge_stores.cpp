#include "harness/store/merge_stores.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "harness/record/measures.h"
#include "harness/record/record_json.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"

namespace loopbench::harness {
namespace {

/// How a run ended when it was not by itself.
constexpr std::array<std::string_view, 5> kCutShort = {"time-limit", "process-time-limit",
                                                       "memory-limit", "crashed", "bad-answer"};

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
  const Measure* measure = FindMeasure(key);
  return measure != nullptr && measure->repeats == Repeats::kNever;
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

MergedStores::~MergedStores() {
  for (const auto& [part, descriptor] : open_) ::close(descriptor);
}

int MergedStores::Open(std::size_t part) const {
  const auto found = std::ranges::find(open_, part, &std::pair<std::size_t, int>::first);
  if (found != open_.end()) return found->second;
  constexpr std::size_t kMostOpen = 256;  // of the 1024 that a process usually may have
  const std::filesystem::path file = StoreFile(stores_[part]);
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) FailOn("read", file);
  if (open_.size() == kMostOpen) {
    ::close(open_.front().second);
    open_.pop_front();
  }
  open_.emplace_back(part, descriptor);
  return descriptor;
}

Record MergedStores::Read(const Kept& kept) const {
  std::string line(kept.place.length, '\0');
  const ssize_t length =
      ::pread(Open(kept.part), line.data(), line.size(), static_cast<off_t>(kept.place.offset));
  if (length != static_cast<ssize_t>(line.size())) FailOn("read", StoreFile(stores_[kept.part]));
  return FromJsonLine(line);
}

Record MergedStores::operator[](std::size_t i) const { return Read(kept_[i]); }

std::vector<std::filesystem::path> MergedStores::StoresOf(std::size_t i) const {
  std::vector<std::filesystem::path> stores = {stores_[kept_[i].part]};
  for (const std::size_t part : kept_[i].equals) stores.push_back(stores_[part]);
  return stores;
}

void MergedStores::Keep(const Record& record, Kept fresh, Kept* known) const {
  if (known->part != kNowhere) {
    if (fresh.was_cut_short && !known->was_cut_short) return;
    if (!fresh.was_cut_short && !known->was_cut_short) {
      RequireEqual(Read(*known), stores_[known->part], record, stores_[fresh.part]);
      fresh.equals = std::move(known->equals);
      fresh.equals.push_back(known->part);
    }
  }
  *known = std::move(fresh);
}

MergedStores::MergedStores(const std::vector<std::filesystem::path>& stores,
                           const std::vector<std::string>& order)
    : stores_(stores) {
  std::unordered_map<std::string, std::size_t> places;
  for (const std::string& id : order) places.emplace(id, places.size());
  kept_.resize(places.size());
  for (std::size_t part = 0; part < stores.size(); ++part) {
    const auto take = [&](const Record& record, const LinePlace& place) {
      ++read_;
      const std::string id = record.Text("id");
      std::size_t at = kept_.size();
      if (!id.empty()) at = places.try_emplace(id, at).first->second;
      if (at == kept_.size()) kept_.emplace_back();
      Keep(record, {part, place, WasCutShort(record)}, &kept_[at]);
    };
    std::vector<std::string> warnings;
    ForEachRecord(stores[part], take, &warnings);
    if (!warnings.empty()) {
      throw std::runtime_error(
          fmt::format("{}\n{}: expected a store as a run leaves it; if the run was interrupted, "
                      "give its command "
                      "again, which completes it, and merge then",
                      warnings.front(), stores[part].string()));
    }
  }
  for (const std::string& id : order) {
    if (kept_[places.at(id)].part == kNowhere) missing_.push_back(id);
  }
  std::erase_if(kept_, [](const Kept& kept) { return kept.part == kNowhere; });
}

}  // namespace loopbench::harness
