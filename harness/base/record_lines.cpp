#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <unordered_set>

#include "harness/base/json_document.h"
#include "harness/base/store.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

// FromJsonLine: parses a flat object value by value, in linear time.

using LineJson = nlohmann::ordered_json;

/// Beginnings of a run's line; before 1.0 lines had no format.
const std::array<std::string, 2> kBeginnings = {
    fmt::format("{{\"format\":{},\"kind\":\"", kRecordFormat), "{\"kind\":\""};

class RecordReader final : public nlohmann::json_sax<LineJson> {
 public:
  explicit RecordReader(std::string_view line) : line_(line) {
    LineJson::sax_parse(line.begin(), line.end(), this);
  }

  const std::string& error() const { return error_; }
  /// True if the only fault is that the text stops too early.
  bool ends_early() const { return ends_early_; }
  bool Has(const std::string& key) const { return keys_.contains(key); }
  Record Take() { return std::move(record_); }

  bool null() override {
    if (place_ != Place::kArray) return Put(std::monostate{}, key_type_, "null");
    series_.push_back(std::numeric_limits<double>::quiet_NaN());
    return true;
  }
  bool boolean(bool value) override {
    return Put(value, ValueType::kFlag, value ? "true" : "false");
  }
  bool number_integer(number_integer_t value) override {
    return PutNumber(std::int64_t{value}, static_cast<double>(value), fmt::format("{}", value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    const std::string shown = fmt::format("{}", value);
    if (value > static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max())) {
      return Reject("an integer below 2^63", shown);
    }
    return PutNumber(static_cast<std::int64_t>(value), static_cast<double>(value), shown);
  }
  bool number_float(number_float_t value, const string_t& token) override {
    const std::string_view digits = std::string_view(token).substr(0, token.find_first_of("eE"));
    if (value == 0.0 && digits.find_first_of("123456789") != std::string_view::npos) {
      return Reject("0 or a number of at least 4.9e-324", ShortToken(token));
    }
    return PutNumber(value, value, ShortToken(token));
  }
  bool string(string_t& value) override {
    const std::string shown = '"' + Excerpt(value) + '"';
    return Put(std::move(value), ValueType::kText, shown);
  }
  bool binary(binary_t&) override { return false; }

  bool start_object(std::size_t) override {
    if (place_ != Place::kTop) return Reject(Expected(), "an object");
    place_ = Place::kObject;
    return true;
  }
  bool key(string_t& key) override {
    key_ = std::move(key);
    if (!keys_.insert(key_).second) return Reject("each key once", "it twice");
    key_type_ = TypeOf(key_);
    return true;
  }
  bool end_object() override {
    place_ = Place::kEnd;
    return true;
  }
  bool start_array(std::size_t) override {
    const bool may_be = key_type_ == ValueType::kNumbers || key_type_ == ValueType::kAny;
    if (place_ != Place::kObject || !may_be) return Reject(Expected(), "an array");
    place_ = Place::kArray;
    return true;
  }
  bool end_array() override {
    place_ = Place::kObject;
    record_.Append(std::move(key_), std::exchange(series_, {}));
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& error) override {
    ends_early_ = position > line_.size();
    const bool too_large = dynamic_cast<const LineJson::out_of_range*>(&error) != nullptr;
    error_ = too_large ? fmt::format("found the number {}, expected one that fits a double",
                                     ShortToken(token))
                       : Printable(SyntaxMessage(error.what(), line_, position));
    return false;
  }

 private:
  enum class Place { kTop, kObject, kArray, kEnd };

  bool PutNumber(Value value, double number, const std::string& shown) {
    if (place_ != Place::kArray) return Put(std::move(value), ValueType::kNumber, shown);
    series_.push_back(number);
    return true;
  }

  bool Put(Value value, ValueType type, const std::string& shown) {
    if (place_ != Place::kObject || (key_type_ != type && key_type_ != ValueType::kAny)) {
      return Reject(Expected(), shown);
    }
    if (key_ == "format" && value != Value(std::int64_t{kRecordFormat})) {
      return Reject(fmt::format(kExpectedFormat, kRecordFormat), shown);
    }
    if (key_ != "checksum" && key_ != "format") record_.Append(std::move(key_), std::move(value));
    return true;
  }

  std::string_view Expected() const {
    if (place_ == Place::kTop) return "a JSON object";
    return Describe(place_ == Place::kArray ? ValueType::kNumbers : key_type_);
  }

  bool Reject(std::string_view expected, const std::string& found) {
    error_ = place_ == Place::kTop ? "" : fmt::format("key '{}': ", Excerpt(key_));
    error_ += fmt::format("expected {}, found {}", expected, found);
    return false;
  }

  std::string_view line_;
  Record record_;
  std::string error_;
  bool ends_early_ = false;
  Place place_ = Place::kTop;
  std::string key_;
  ValueType key_type_ = ValueType::kAny;
  std::unordered_set<std::string> keys_;
  std::vector<double> series_;
};

constexpr std::size_t kAtOnce = 4096;  ///< records, and the rest of their last problem

/// Outcomes of runs that were ended from outside.
constexpr std::array<std::string_view, 5> kCutShort = {"time-limit", "process-time-limit",
                                                       "memory-limit", "crashed", "invalid-result"};

/// True if the run, a member of its ensemble or the reference of its ladder ended so.
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

/// Returns a key in which the records differ although they must not, or "".
std::string Difference(const Record& one, const Record& other) {
  for (const auto& [first, second] : {std::pair(&one, &other), std::pair(&other, &one)}) {
    for (const auto& [key, value] : first->items()) {
      if (MayDiffer(key)) continue;
      const Value* found = second->Find(key);
      // compare as lines of a store, where NaN is null
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
                    : "one of the stores is inconsistent"));
}

}  // namespace

LineReader::LineReader(std::filesystem::path file, Take take, Wanted wanted, int lines_before)
    : file_(std::move(file)),
      take_(std::move(take)),
      wanted_(std::move(wanted)),
      number_(lines_before) {}

void LineReader::Feed(std::string_view text) {
  for (std::size_t end; (end = text.find('\n')) != std::string_view::npos;
       text.remove_prefix(end + 1)) {
    std::string_view line = text.substr(0, end);
    if (!rest_.empty()) line = rest_.append(line);
    TakeLine(line);
    offset_ += line.size() + 1;
    rest_.clear();
  }
  rest_ += text;
}

void LineReader::End() {
  is_ended_ = rest_.empty();
  if (is_ended_) return;
  TakeLine(rest_);
  if (warning_.empty()) offset_ += rest_.size();
}

void LineReader::TakeLine(std::string_view line) {
  ++number_;
  const LinePlace place{offset_, line.size()};
  if (line.empty() || line == "\r" || (wanted_ && !wanted_(line, place))) return;
  Record record;
  bool is_sealed = false;
  try {
    record = FromJsonLine(line, &is_sealed);
  } catch (const std::runtime_error& error) {
    const std::string message =
        fmt::format("{}:{}: {}: '{}'", file_.string(), number_, error.what(), Excerpt(line));
    if (is_ended_ || !IsTornRecord(line)) throw std::runtime_error(message);
    warning_ = message + " (torn last line, skipped)";
    return;
  }
  has_sealed_ = has_sealed_ || is_sealed;
  if (!is_sealed && first_bare_ == 0) first_bare_ = number_;
  if (has_sealed_ && first_bare_ > 0) {
    throw std::runtime_error(fmt::format("{}:{}: {} (other lines have one)", file_.string(),
                                         first_bare_, kWithoutChecksum));
  }
  if (record.items().empty()) {
    throw std::runtime_error(fmt::format("{}:{}: found a record without values, expected some",
                                         file_.string(), number_));
  }
  take_(std::move(record), place);
}

void ForEachRecord(const std::filesystem::path& path, const LineReader::Take& take,
                   std::vector<std::string>* warnings, const LineReader::Wanted& wanted) {
  const std::filesystem::path file = StoreFile(path);
  LineReader reader(file, take, wanted);
  if (!IsLarge(file)) {
    reader.Feed(ReadFile(file));
  } else {
    NoteInput(file);
    ForEachBlock(file, [&reader](std::string_view block) { reader.Feed(block); });
  }
  reader.End();
  if (warnings != nullptr && !reader.warning().empty()) warnings->push_back(reader.warning());
}

Record FromJsonLine(std::string_view line, bool* is_sealed) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  const bool has_checksum = VerifyChecksum(line);
  if (const std::string fault = EncodingFault(line); !fault.empty()) {
    throw std::runtime_error("column " + fault.substr(fault.find(':') + 1));
  }
  RecordReader reader(line);
  if (!reader.error().empty()) throw std::runtime_error(reader.error());
  if (!has_checksum && reader.Has("checksum")) {
    throw std::runtime_error(
        "the line was changed after it was written: found a checksum that does not end the line as "
        "it was written, expected ,\"checksum\":\"...\"} without blanks");
  }
  if (!has_checksum && reader.Has("format")) throw std::runtime_error(kWithoutChecksum);
  if (is_sealed != nullptr) *is_sealed = has_checksum;
  return reader.Take();
}

bool IsTornRecord(std::string_view line) {
  const bool begins = std::ranges::any_of(kBeginnings, [line](std::string_view beginning) {
    return line.starts_with(beginning) || beginning.starts_with(line);
  });
  return begins && RecordReader(line).ends_early();
}

std::string KeysOfLine(std::string_view line) {
  std::string keys;
  bool is_key = true;  // the next text is a key
  int depth = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == ',' && depth == 1) is_key = true;
    if (c != '"') continue;
    const std::size_t begin = i;
    for (++i; i < line.size() && line[i] != '"'; ++i) i += line[i] == '\\';
    if (is_key && depth == 1) keys += line.substr(begin, i - begin);
    is_key = false;
  }
  return keys;
}

ProblemReader::ProblemReader(std::filesystem::path path, const Selection& where)
    : file_(StoreFile(path)) {
  std::unordered_map<std::size_t, std::uint32_t> problems;
  std::unordered_set<std::string> kinds;
  const LineReader::Wanted may_match = LinesThatMayMatch(where);
  const auto look = [&](std::string_view line, const LinePlace& place) {
    last_at_ = place.offset;
    const bool is_fresh = kinds.insert(KeysOfLine(line)).second;
    if (!may_match(line, place)) return is_fresh;
    std::string_view problem = TextUnder("\"problem_id\":\"", line);
    if (problem.empty()) problem = TextUnder("\"case_id\":\"", line);
    const auto fresh = static_cast<std::uint32_t>(problems.size());
    const auto at = problems.try_emplace(std::hash<std::string_view>()(problem), fresh).first;
    lines_.push_back({place.offset, static_cast<std::uint32_t>(place.length), at->second});
    bytes_ += place.length;
    return is_fresh;  // others are read with their problem
  };
  ForEachRecord(
      file_, [this](Record one, const LinePlace&) { samples_.push_back(std::move(one)); }, nullptr,
      look);
  std::ranges::stable_sort(lines_, {}, &Line::problem);
}

void ProblemReader::ForEach(const std::function<void(std::vector<Record>)>& take,
                            std::vector<std::string>* warnings) const {
  std::ifstream in(file_, std::ios::binary);
  std::vector<Record> records;
  std::string text;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const Line& line = lines_[i];
    text.resize(line.length);
    if (!in.seekg(static_cast<std::streamoff>(line.offset)) ||
        !in.read(text.data(), static_cast<std::streamsize>(text.size()))) {
      FailOn("read", file_);
    }
    try {
      records.push_back(FromJsonLine(text));
    } catch (const std::runtime_error& error) {
      const std::string message = fmt::format("{}: at byte {}: {}: '{}'", file_.string(),
                                              line.offset, error.what(), Excerpt(text));
      if (line.offset != last_at_ || !IsTornRecord(text)) {
        throw std::runtime_error(message);
      }
      warnings->push_back(message + " (torn last line, skipped)");
    }
    const bool is_last = i + 1 == lines_.size();
    if (!is_last && (records.size() < kAtOnce || lines_[i + 1].problem == line.problem)) continue;
    take(std::exchange(records, {}));
  }
}

MergedStores::~MergedStores() {
  for (const auto& [part, descriptor] : open_) ::close(descriptor);
}

int MergedStores::Open(std::size_t part) const {
  const auto found = std::ranges::find(open_, part, &std::pair<std::size_t, int>::first);
  if (found != open_.end()) return found->second;
  constexpr std::size_t kMaxOpen = 256;  // of the usual limit of 1024 per process
  const std::filesystem::path file = StoreFile(stores_[part]);
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) FailOn("read", file);
  if (open_.size() == kMaxOpen) {
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
