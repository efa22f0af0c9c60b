// migrate: replaces names in files of earlier versions by today's names.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <fstream>
#include <functional>
#include <ranges>
#include <stdexcept>
#include <string_view>

#include "harness/cli/command_line.h"
#include "harness/json/json_document.h"
#include "harness/record/record.h"
#include "harness/store/result_store.h"
#include "harness/store/store_lock.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

using std::string_view;

/// Name in a configuration file, and the keys of the objects that contain it, between slashes; "//"
/// is the top level.
struct OldKey {
  string_view old, now, within;
};

constexpr OldKey kKeys[] = {
    {"columns", "methods", "//groups/timing/families/"},
    {"scenes", "problems", "//ensembles/"},
    {"observe", "known_solution", "//mechanism/"},
    {"compile", "preprocess", "//groups/"},
    {"held", "fixed", "/initial/"},
    {"series", "published_data", "/reference/"},
    {"accuracy", "uncertainty", "/quantities/"},
    {"must_hold", "required", "/groups/rows/"},
    {"decides", "criteria", "/groups/rows/"},
    {"right", "expected_outcome", "/groups/rows/"},
    {"why", "rationale", "/groups/rows/"},
    {"of", "relative_to", "/decides/criteria/"},
    {"only_under", "partially_reproduced", "/wording/"},
};

struct OldName {
  string_view old, now;
};

/// Keys of records, which conditions and measures of configuration files also use.
constexpr OldName kRecordKeys[] = {
    {"scene_id", "problem_id"},
    {"content", "config_hash"},
    {"doubts", "warnings"},
    {"compiled", "preprocessed"},
    {"softened_steps", "regularized_steps"},
    {"softened_evaluations", "regularized_evaluations"},
    {"singularity_passages", "singularity_crossings"},
    {"trust_horizon", "reference_valid_until"},
    {"reference_witnesses", "reference_runs"},
    {"yardstick_ns", "calibration_ns"},
    {"yardstick_wall_ns", "calibration_wall_ns"},
    {"disturbed_rounds", "discarded_repetitions"},
    {"error_shape_max", "error_path_max"},
    {"error_over_accuracy", "error_over_uncertainty"},
    {"error_ruled_by", "error_dominated_by"},
    {"drift_ruled_by", "drift_dominated_by"},
};
constexpr string_view kConditions = "/select/require/where/when/benchmarks/";

/// Word among the values of some keys; several words are separated by spaces.
struct OldValue {
  string_view old, now, keys;
};
constexpr string_view kOutcomes = "/outcome/right/expected_outcome/when/word/";
constexpr OldValue kValues[] = {
    {"as-published", "plain", "/solver/"},
    {"position", "projection", "/enforcement/"},
    {"inexpressible", "unsupported", kOutcomes},
    {"bad-answer", "invalid-result", kOutcomes},
    {"singular-passage", "singular-crossing", "/doubts/warnings/"},
    {"members-failed", "ensemble-failures", "/doubts/warnings/"},
    {"softened", "regularized", "/doubts/warnings/"},
};

/// Returns true if `word` is one of the words between the slashes.
bool Holds(string_view words, string_view word) {
  return words.find("/" + std::string(word) + "/") != words.npos;
}

string_view RecordKey(string_view key) {
  const auto* known = std::ranges::find(kRecordKeys, key, &OldName::old);
  return known == std::end(kRecordKeys) ? key : known->now;
}

/// Returns today's name of `key` in the object under `within`.
string_view ConfigurationKey(string_view key, string_view within) {
  for (const OldKey& known : kKeys) {
    if (known.old == key && Holds(known.within, within)) return known.now;
  }
  return Holds(kConditions, within) ? RecordKey(key) : key;
}

/// Returns "/problems/0/mechanism/initial/fixed" for "/scenes/0/mechanism/initial/held".
std::string Pointer(string_view pointer) {
  if (!pointer.starts_with('/')) return std::string(pointer);
  std::string text, within;
  for (const auto part : std::views::split(pointer, '/')) {
    const string_view token(part.begin(), part.end());
    const bool is_index =
        token == "*" || (!token.empty() && token.find_first_not_of("0123456789") == token.npos);
    text +=
        (text.empty() && token.empty() ? "" : "/") + std::string(ConfigurationKey(token, within));
    if (!is_index) within = token;
  }
  return text;
}

/// Returns the new value under `key`, without its quotation marks.
std::string NewValue(string_view value, string_view key) {
  if (key == "field") return Pointer(value);
  if (key == "measure" || key == "of" || key == "relative_to") return std::string(RecordKey(value));
  std::string text;
  for (const auto part : std::views::split(value, ' ')) {
    string_view word(part.begin(), part.end());
    for (const OldValue& known : kValues) {
      if (known.old == word && Holds(known.keys, key)) word = known.now;
    }
    text += word;
    text += ' ';
  }
  if (!text.empty()) text.pop_back();
  return text;
}

/// Copies a JSON document with its old names replaced. The document must be valid.
class Renamer {
 public:
  Renamer(string_view text, bool is_record) : text_(text), is_record_(is_record) {
    Value("", 0);
    result_ += text_.substr(copied_);
  }
  std::string& result() { return result_; }
  std::size_t count() const { return count_; }

 private:
  void SkipTo(string_view any) { at_ = std::min(text_.find_first_of(any, at_), text_.size()); }
  void SkipSpace() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }

  /// Returns the string at the cursor as written, and moves the cursor after it.
  string_view String() {
    const std::size_t begin = ++at_;
    while (text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    return text_.substr(begin, at_++ - begin);
  }

  /// Writes `now` instead of the last string read.
  void Replace(string_view old, string_view now) {
    if (old == now) return;
    const auto place = static_cast<std::size_t>(old.data() - text_.data());
    result_ += text_.substr(copied_, place - copied_);
    result_ += now;
    copied_ = place + old.size();
    ++count_;
  }

  void Value(string_view key, int depth) {
    SkipSpace();
    if (at_ == text_.size()) return;
    if (text_[at_] == '{') {
      Object(key, depth);
    } else if (text_[at_] == '[') {
      for (++at_; SkipSpace(), text_[at_] != ']';) {
        if (text_[at_] == ',')
          ++at_;
        else
          Value(key, depth);
      }
      ++at_;
    } else if (text_[at_] == '"') {
      const string_view value = String();
      Replace(value, NewValue(value, key));
    } else {
      SkipTo(",]} \t\r\n");
    }
  }

  void Object(string_view within, int depth) {
    std::string swept;  // last part of the field of a sweep, whose values follow it
    for (++at_; SkipSpace(), text_[at_] != '}';) {
      if (text_[at_] == ',') {
        ++at_;
        continue;
      }
      const string_view key = String();
      Replace(key, is_record_ && depth == 0 ? RecordKey(key) : ConfigurationKey(key, within));
      SkipSpace();
      ++at_;  // the colon
      SkipSpace();
      if (key == "field" && text_[at_] == '"') {
        const string_view rest = text_.substr(at_ + 1, text_.find('"', at_ + 1) - at_ - 1);
        swept = rest.substr(rest.rfind('/') + 1);
      }
      Value(key == "values" && !swept.empty() ? string_view(swept) : key, depth + 1);
    }
    ++at_;
  }

  string_view text_;
  bool is_record_;
  std::size_t at_ = 0, copied_ = 0, count_ = 0;
  std::string result_;
};

/// Returns a rewritten line of a record file; counts the replaced names.
std::string RenamedLine(const std::string& line, const std::string& place, std::size_t* count) {
  ParseDocument(line, place);
  const bool is_sealed = VerifyChecksum(line);
  Renamer renamed(line, true);
  *count += renamed.count();
  if (renamed.count() == 0 || !is_sealed) return renamed.result();
  std::string object = renamed.result();
  object.resize(object.rfind(",\"checksum\":"));
  return WithChecksum(object + "}");
}

/// Writes the lines of a record file through `write`; returns the number of replaced names.
std::size_t RenameLines(const std::filesystem::path& file,
                        const std::function<void(string_view)>& write) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be read");
  std::size_t count = 0, number = 0;
  for (std::string line; std::getline(stream, line);) {
    const bool is_torn = stream.eof();  // no line end: possibly torn by a crash
    const std::string place = fmt::format("{}:{}", file.string(), ++number);
    try {
      if (!line.empty()) line = RenamedLine(line, place, &count);
    } catch (const ConfigError&) {
      if (!is_torn || number == 1) throw;
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
    }
    write(line);
    if (!is_torn) write("\n");
  }
  return count;
}

/// Returns true if the file has one record per line: a store, or the single record of a reference.
bool HasRecordLines(const std::filesystem::path& file) {
  if (file.extension() == ".jsonl") return true;
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  std::getline(stream, line);
  return line.starts_with("{") && line.ends_with("\"}") &&
         line.find(",\"checksum\":\"") != std::string::npos;
}

std::size_t MigrateFile(const std::filesystem::path& file) {
  if (HasRecordLines(file)) {
    if (IsLocked(file)) throw std::runtime_error(file.string() + ": another process writes to it");
    const std::size_t count = RenameLines(file, [](string_view) {});
    if (count == 0) return 0;
    OutputFile output(file, Onto::kAnyFile);
    RenameLines(file, [&output](string_view part) { output.Write(part); });
    output.Finish();
    return count;
  }
  const std::string text = ReadTextFile(file);
  ParseDocument(text, file.string());
  Renamer renamed(text, false);
  if (renamed.count() == 0) return 0;
  ParseDocument(renamed.result(), file.string());  // old and new names may not occur together
  OutputFile output(file, Onto::kAnyFile);
  output.Write(renamed.result());
  output.Finish();
  return renamed.count();
}

/// Rewrites configuration files, stores and other record files (.jsonl) in place, each atomically.
/// All other bytes stay, and record checksums are renewed. Prints the number of replaced names per
/// file. Returns 2 if a file cannot be rewritten; it then stays unchanged.
int Migrate(const std::vector<std::filesystem::path>& files) {
  int code = 0;
  for (const std::filesystem::path& path : files) {
    try {
      const std::filesystem::path file =
          std::filesystem::is_directory(path) ? StoreFile(path) : path;
      const std::size_t count = MigrateFile(file);
      Print("{}: {}\n", file.string(),
            count == 0 ? "no old names" : fmt::format("{} names replaced", count));
    } catch (const std::exception& error) {
      PrintError("{}\n", Lines{error.what()});
      code = 2;
    }
  }
  return code;
}

}  // namespace

void AddMigrate(Commands& commands) {
  auto& files = commands.Keep<std::vector<std::filesystem::path>>();
  CLI::App* app = commands.Add("migrate", "Replace names of earlier versions in files",
                               [&](const Typed&) { return Migrate(files); });
  app->add_option("file", files, "Configuration files (JSON), stores and files of records")
      ->required();
  app->footer(
      "Keys and values with old names are replaced in place; all other bytes stay, and checksums "
      "of\n"
      "records are renewed. A file without old names is not written.\n"
      "  loopbench migrate my-experiment.json results/runs/my-experiment");
}

std::string WithMigrationHint(std::string message) {
  const auto is_named = [&message](string_view old) {
    return message.find(fmt::format("unknown key \"{}\"", old)) != message.npos;
  };
  if (std::ranges::any_of(kKeys, is_named, &OldKey::old) ||
      std::ranges::any_of(kRecordKeys, is_named, &OldName::old)) {
    message += "\n`loopbench migrate FILE` replaces names of earlier versions";
  }
  return message;
}

}  // namespace loopbench::harness
