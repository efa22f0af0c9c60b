// The table of measures: the built-in rows (measures.cpp), and those that programs add.
#include <algorithm>
#include <deque>
#include <map>
#include <string>

#include "harness/record/measures.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {
namespace {

using enum ValueType;

bool IsFamily(const Measure& measure) { return measure.key.ends_with('*'); }

std::string_view BeginningOf(const Measure& family) {
  return family.key.substr(0, family.key.size() - 1);
}

struct MeasureTable {
  MeasureTable() {
    for (const Measure& measure : BuiltInMeasures()) Add(measure);
  }
  void Add(const Measure& measure) {
    const Measure& row = rows.emplace_back(measure);
    if (!IsFamily(row)) by_key.emplace(row.key, &row);
  }

  std::deque<Measure> rows;
  std::map<std::string_view, const Measure*> by_key;
  std::deque<std::string> words;  ///< of rows that programs added
};

MeasureTable& AllMeasures() {
  static MeasureTable table;
  return table;
}

bool IsKey(std::string_view key) {
  if (key.ends_with('*')) key.remove_suffix(1);
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_.";
  return !key.empty() && key.find_first_not_of(kLetters) == std::string_view::npos;
}

/// Whether both are one key, or the new one a family that a known one belongs to.
bool Takes(const Measure& fresh, const Measure& known) {
  return fresh.key == known.key || (IsFamily(fresh) && known.key.starts_with(BeginningOf(fresh)));
}

/// Throws std::invalid_argument for `fresh[index]` unless it can join the table.
void RequireMeasure(std::span<const Measure> fresh, std::size_t index) {
  const Measure& measure = fresh[index];
  const auto refuse = [&](std::string_view found, std::string_view expected) {
    RefuseRow("measure", measure.key, found, expected);
  };
  if (!IsKey(measure.key)) refuse("no key", "a-z, 0-9, '_' and '.', perhaps '*' at the end");
  const auto known = [&](const Measure& other) { return Takes(measure, other); };
  if (std::ranges::any_of(Measures(), known) || std::ranges::any_of(fresh.first(index), known)) {
    refuse("a key that there is", "each key once");
  }
  if (measure.type == kAny) refuse("no type", "one");
  if (measure.merging.how != Merge::kWith) return;
  const auto other = std::ranges::find(fresh, measure.merging.with, &Measure::key);
  const Measure* with = other != fresh.end() ? &*other : FindMeasure(measure.merging.with);
  if (with == nullptr ||
      (with->merging.how != Merge::kLargest && with->merging.how != Merge::kSmallest)) {
    refuse("merged with no such key", "another whose largest or smallest value is taken");
  }
}

}  // namespace

const std::deque<Measure>& Measures() { return AllMeasures().rows; }

void AddMeasures(std::span<const Measure> fresh) {
  for (std::size_t i = 0; i < fresh.size(); ++i) RequireMeasure(fresh, i);
  const auto keep = [](std::string_view& text) { text = AllMeasures().words.emplace_back(text); };
  for (Measure measure : fresh) {
    keep(measure.key);
    keep(measure.heading.words);
    keep(measure.heading.unit);
    keep(measure.merging.with);
    AllMeasures().Add(measure);
  }
}

std::vector<const Measure*> AddedMeasures() {
  std::vector<const Measure*> added;
  for (std::size_t i = BuiltInMeasures().size(); i < Measures().size(); ++i) {
    added.push_back(&Measures()[i]);
  }
  return added;
}

const Measure* FindMeasure(std::string_view key) {
  if (const auto own = AllMeasures().by_key.find(key); own != AllMeasures().by_key.end())
    return own->second;
  const Measure* longest = nullptr;
  for (const Measure& measure : Measures()) {
    if (!IsFamily(measure) || !key.starts_with(BeginningOf(measure))) continue;
    if (longest == nullptr || measure.key.size() > longest->key.size()) longest = &measure;
  }
  return longest;
}

ValueType TypeOf(std::string_view key) {
  const Measure* measure = FindMeasure(key);
  return measure == nullptr ? kAny : measure->type;
}

bool IsReserved(std::string_view name) { return FindMeasure(name) != nullptr; }

std::string_view Describe(ValueType type) {
  switch (type) {
    case kAny:
      break;
    case kNumber:
      return "a number or null";
    case kText:
      return "a string or null";
    case kFlag:
      return "true, false or null";
    case kNumbers:
      return "an array of numbers";
  }
  return "null, a bool, a number, a string or an array of numbers";
}

}  // namespace loopbench::harness
