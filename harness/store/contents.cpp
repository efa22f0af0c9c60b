#include "harness/store/contents.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "harness/record/record_json.h"

namespace loopbench::harness {
namespace {

/// What names the case: all that stands before its case_id.
Record KeysBeforeId(const Record& record) {
  Record keys;
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id") break;
    keys.Set(key, value);
  }
  return keys;
}

/// The cases of equal keys.
struct Namesakes {
  std::set<std::string> case_ids;
  bool has_set = false;
};

Record ToldApart(const Record& record, const Namesakes& namesakes) {
  Record told = KeysBeforeId(record);
  told.Set("content", record.Text("content"));
  if (namesakes.has_set) told.Set("set", record.Text("set"));
  for (const auto& [key, value] : record.items()) told.Set(key, value);
  return told;
}

}  // namespace

std::vector<Record> WithContents(std::vector<Record> records) {
  std::map<std::string, Namesakes> all;
  std::vector<std::string> names;
  for (const Record& record : records) {
    const std::string case_id = record.Text("case_id");
    names.push_back(case_id.empty() ? "" : ToJsonLine(KeysBeforeId(record)));
    if (case_id.empty()) continue;
    Namesakes& namesakes = all[names.back()];
    namesakes.case_ids.insert(case_id);
    namesakes.has_set = namesakes.has_set || !record.Text("set").empty();
  }
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (names[i].empty() || all[names[i]].case_ids.size() == 1) continue;
    records[i] = ToldApart(records[i], all[names[i]]);
  }
  return records;
}

void ShareContents(std::vector<Record>* one, std::vector<Record>* other) {
  std::map<std::string, Namesakes> told;
  for (const std::vector<Record>* records : {one, other}) {
    for (const Record& record : *records) {
      Record bare;
      const Record keys = KeysBeforeId(record);
      for (const auto& [key, value] : keys.items()) {
        if (key != "content" && key != "set") bare.Set(key, value);
      }
      if (keys.Find("content") == nullptr) continue;
      told[ToJsonLine(bare)].has_set = keys.Find("set") != nullptr;
    }
  }
  for (std::vector<Record>* records : {one, other}) {
    for (Record& record : *records) {
      const auto namesakes = told.find(ToJsonLine(KeysBeforeId(record)));
      if (namesakes != told.end()) record = ToldApart(record, namesakes->second);
    }
  }
}

void RequireOneContent(const std::vector<Record>& records, const std::filesystem::path& store,
                       std::string_view command) {
  const auto told = std::ranges::find_if(records, [](const Record& record) {
    // references of a sweep differ in content alone, and nothing is judged by them
    return record.Text("kind") != "reference" && KeysBeforeId(record).Find("content") != nullptr;
  });
  if (told == records.end()) return;
  throw std::runtime_error(fmt::format(
      "{}: found {} {} more than once, run with different mechanisms, limits or ensembles; {} "
      "expected each case once: run them into stores of their own (--out)",
      store.string(), told->Text("mechanism"), told->Text("formulation"), command));
}

}  // namespace loopbench::harness
