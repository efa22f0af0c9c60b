#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "harness/base/store.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Returns the end of a large file, from a line's beginning: a megabyte, or two longer lines.
std::string LastLines(const std::filesystem::path& file, std::uintmax_t size) {
  std::ifstream in(file, std::ios::binary);
  for (std::uintmax_t length = 1 << 20;; length *= 4) {
    const std::uintmax_t taken = std::min(length, size);
    std::string text(static_cast<std::size_t>(taken), '\0');
    in.seekg(static_cast<std::streamoff>(size - taken));
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (!in) FailOn("read", file);
    const std::size_t begin = text.find('\n');
    if (taken == size) return text;
    if (begin != std::string::npos && text.find('\n', begin + 1) != std::string::npos) {
      return text.substr(begin + 1);
    }
  }
}

/// Counts line ends among the first bytes of a file.
int CountLines(const std::filesystem::path& file, std::uintmax_t bytes) {
  std::ptrdiff_t lines = 0;
  ForEachBlock(file, [&](std::string_view block) {
    const std::string_view counted = block.substr(0, bytes);
    lines += std::ranges::count(counted, '\n');
    bytes -= counted.size();
  });
  return static_cast<int>(lines);
}

/// Feeds the end of a file. Earlier lines are counted only for the error of an invalid line.
LineReader ReadEnd(const std::filesystem::path& file, const std::string& text,
                   std::uintmax_t before) {
  const auto feed = [&](int lines_before) {
    LineReader lines(
        file,
        [&file](const Record& record, const LinePlace&) {
          if (!record.Text("kind").empty()) return;
          throw std::runtime_error(
              fmt::format("{}: found a line without \"kind\", expected records", file.string()));
        },
        {}, lines_before);
    lines.Feed(text);
    lines.End();
    if (lines.is_handmade()) {  // lines with a checksum will follow
      throw std::runtime_error(fmt::format("{}: {}", file.string(), kWithoutChecksum));
    }
    return lines;
  };
  try {
    return feed(0);
  } catch (const std::runtime_error&) {
    if (before == 0) throw;
  }
  return feed(CountLines(file, before));
}

/// Adds a line end to a complete last record, removes a torn one. Other files stay unchanged.
void MendLastLine(const std::filesystem::path& file, int descriptor) {
  const std::uintmax_t size = std::filesystem::file_size(file);
  const std::string text = IsLarge(file) ? LastLines(file, size) : ReadFile(file);
  const LineReader lines = [&] {
    try {
      return ReadEnd(file, text, size - text.size());
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(
          fmt::format("{}\n'{}' is no store, or a damaged one: nothing was changed", error.what(),
                      file.string()));
    }
  }();
  if (!lines.warning().empty()) {
    const std::uintmax_t whole = size - (text.size() - lines.whole());
    if (::ftruncate(descriptor, static_cast<off_t>(whole)) != 0) {
      FailOn("mend the last line of", file);
    }
  } else if (!lines.is_ended()) {
    WriteAll(descriptor, "\n", file);
  }
}

/// Returns conditions on parameters, each with the text before its value in a line.
std::vector<std::pair<std::string, Condition>> OnParameters(const Selection& where) {
  std::vector<std::pair<std::string, Condition>> conditions;
  for (const Condition& condition : where) {
    const bool is_plain = condition.key.find_first_of("\"\\") == std::string::npos;
    if (FindMeasure(condition.key) != nullptr || !is_plain) continue;
    conditions.push_back({"\"" + condition.key + "\":", condition});
  }
  return conditions;
}

/// Key of a condition that no record so far has.
struct MissingKey {
  std::string name, before;  ///< before: the text before its value in a line
  bool is_ordered;           ///< true if a number is required

  bool MayBeIn(std::string_view line) const {
    const std::size_t at = line.find(before);
    return at != line.npos && !(is_ordered && line.substr(at + before.size()).starts_with("null"));
  }
  bool IsIn(const Record& record) const {
    return is_ordered ? !std::isnan(record.Number(name)) : record.Find(name) != nullptr;
  }
};

/// Returns true if a number among the case keys excludes the record.
bool IsExcluded(std::string_view line,
                const std::vector<std::pair<std::string, Condition>>& conditions) {
  const std::string_view keys = line.substr(0, line.find("\"case_id\":"));
  for (const auto& [before, condition] : conditions) {
    const std::size_t at = keys.find(before);
    if (at == std::string_view::npos) continue;
    double value = 0.0;
    const char* begin = keys.data() + at + before.size();
    const auto [end, fault] = std::from_chars(begin, keys.data() + keys.size(), value);
    if (fault != std::errc() || end == keys.data() + keys.size() || *end != ',') continue;
    Record record;
    record.Set(condition.key, value);
    if (!Matches(record, {condition})) return true;
  }
  return false;
}

/// Returns the keys of a case: all keys before its case_id.
Record KeysBeforeId(const Record& record) {
  Record keys;
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id") break;
    keys.Set(key, value);
  }
  return keys;
}

/// Cases with equal keys.
struct Namesakes {
  std::set<std::string> case_ids;
  bool has_set = false;
};

Record ToldApart(const Record& record, const Namesakes& namesakes) {
  Record told = KeysBeforeId(record);
  told.Set("config_hash", record.Text("config_hash"));
  if (namesakes.has_set) told.Set("set", record.Text("set"));
  for (const auto& [key, value] : record.items()) told.Set(key, value);
  return told;
}

/// Converts the sixteen digits to a number.
std::optional<std::uint64_t> NumberOfId(std::string_view id) {
  return id.size() == 16 ? WholeNumber<std::uint64_t>(id, 16) : std::nullopt;
}

}  // namespace

std::filesystem::path StoreFile(const std::filesystem::path& path) {
  return path.extension() == ".jsonl" ? path : path / "results.jsonl";
}

bool IsLarge(const std::filesystem::path& file) {
  constexpr std::uintmax_t kLarge = 32u << 20;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  return !error && size >= kLarge;
}

ResultStore::ResultStore(const std::filesystem::path& path, bool waits) : file_(StoreFile(path)) {
  MakeFolderOf(file_);
  descriptor_ = OpenLocked(file_, waits);
  try {
    MendLastLine(file_, descriptor_);
    SyncFolderOf(file_);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

ResultStore::~ResultStore() { LeaveToParent(); }

void ResultStore::LeaveToParent() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

void ResultStore::Append(const std::vector<Record>& records) {
  std::string text;
  for (const Record& record : records) text += ToJsonLine(record) + '\n';
  const std::lock_guard lock(mutex_);
  if (!IsStillNamed(descriptor_, file_)) {
    throw std::runtime_error(fmt::format(
        "'{}' was removed or replaced while this run was writing to it; give the command again",
        file_.string()));
  }
  const off_t before = ::lseek(descriptor_, 0, SEEK_END);
  try {
    WriteAll(descriptor_, text, file_);
    if (::fsync(descriptor_) != 0) FailOn("write to the disk", file_);
    appended_ += records.size();
  } catch (...) {
    // partial lines are removed: the next run finds complete records only
    [[maybe_unused]] const int failed = ::ftruncate(descriptor_, before);
    throw;
  }
}

std::vector<Record> LatestRecords(const std::vector<Record>& records, std::string_view version) {
  std::vector<Record> latest;
  std::map<std::string, std::size_t> place;
  for (const Record& record : records) {
    const std::string id = record.Text("case_id");
    const auto [at, is_new] = place.try_emplace(id, latest.size());
    if (id.empty() || is_new) {
      latest.push_back(record);
      continue;
    }
    Record& known = latest[at->second];
    const bool is_known_preferred = !version.empty() && known.Text("version") == version;
    if (!is_known_preferred || record.Text("version") == version) known = record;
  }
  return WithContents(std::move(latest));
}

bool ChoosesLines(const Selection& where) { return !OnParameters(where).empty(); }

LineReader::Wanted LinesThatMayMatch(const Selection& where) {
  return [conditions = OnParameters(where)](std::string_view line, const LinePlace&) {
    return !IsExcluded(line, conditions);
  };
}

std::vector<Record> ReadRecords(const std::filesystem::path& path, const Selection& where,
                                std::vector<std::string>* warnings, const ReadWatch& watch) {
  if (!ChoosesLines(where) || !IsLarge(StoreFile(path))) return ReadRecords(path, warnings);
  const LineReader::Wanted may_match = LinesThatMayMatch(where);
  std::vector<Record> records;
  std::uint64_t bytes = 0;
  std::vector<MissingKey> missing;
  for (const auto& [key, values, op] : where) {
    const bool is_ordered = op != Operator::kEqual && op != Operator::kUnequal;
    missing.push_back({key, "\"" + key + "\":", is_ordered});
  }
  ForEachRecord(
      path,
      [&](Record record, const LinePlace& place) {
        std::erase_if(missing, [&](const MissingKey& key) { return key.IsIn(record); });
        records.push_back(std::move(record));
        bytes += place.length;
        if (watch) watch(records.size(), bytes);
      },
      warnings,
      [&](std::string_view line, const LinePlace& place) {
        return records.empty() || may_match(line, place) ||
               std::ranges::any_of(missing, [&](const auto& key) { return key.MayBeIn(line); });
      });
  return records;
}

std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings) {
  std::vector<Record> records;
  ForEachRecord(
      path, [&records](Record record, const LinePlace&) { records.push_back(std::move(record)); },
      warnings);
  return records;
}

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
        if (key != "config_hash" && key != "set") bare.Set(key, value);
      }
      if (keys.Find("config_hash") == nullptr) continue;
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
    // references of a sweep differ only in content, and no judgement uses them
    return record.Text("kind") != "reference" &&
           KeysBeforeId(record).Find("config_hash") != nullptr;
  });
  if (told == records.end()) return;
  throw std::runtime_error(fmt::format(
      "{}: found {} {} more than once, run with different mechanisms, limits or ensembles; {} "
      "expected each case once: run them into stores of their own (--out)",
      store.string(), told->Text("mechanism"), told->Text("formulation"), command));
}

std::string_view TextUnder(std::string_view quoted_key, std::string_view line) {
  const std::size_t key = line.find(quoted_key);
  if (key == std::string_view::npos) return {};
  const std::size_t begin = key + quoted_key.size(), end = line.find('"', begin);
  return end == std::string_view::npos ? std::string_view() : line.substr(begin, end - begin);
}

std::optional<bool> FinishedRuns::Find(const std::string& id) {
  if (!is_read_) Read();
  is_read_ = true;
  const auto number = NumberOfId(id);
  const auto run = number ? finished_.find(*number) : finished_.end();
  return run == finished_.end() ? std::nullopt : std::optional(run->second);
}

void FinishedRuns::Read() {
  const bool is_large = IsLarge(StoreFile(path_));
  const auto keep = [this](std::string_view id, bool is_finished) {
    if (const auto number = NumberOfId(id)) finished_[*number] = is_finished;
  };
  const auto take = [&](const Record& record, const LinePlace&) {
    keep(record.Text("id"), record.Text("outcome") == "finished");
  };
  // lines of a large store are not parsed
  const auto look = [&](std::string_view line, const LinePlace&) {
    if (!is_large) return true;
    keep(TextUnder("\"id\":\"", line), TextUnder("\"outcome\":\"", line) == "finished");
    return false;
  };
  ForEachRecord(path_, take, nullptr, look);
}

}  // namespace loopbench::harness
