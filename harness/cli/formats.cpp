// schema and migrate: keys of files of each kind, and of earlier versions.
#include <unistd.h>

#include <fstream>

#include "harness/base/json_document.h"
#include "harness/cli/commands.h"
#include "harness/config/file_schemas.h"
#include "harness/judge/rule_schemas.h"

namespace loopbench::harness {
namespace {

struct Kind {
  std::string_view name, title;
  Json (*schema)();
};

constexpr Kind kKinds[] = {{"mechanism", "mechanism", MechanismSchema},
                           {"experiment", "experiment", ExperimentSchema},
                           {"benchmarks", "benchmarks", BenchmarksSchema},
                           {"claims", "claims", ClaimsSchema},
                           {"map", "robustness map", MapSchema},
                           {"series", "published series", PublishedSeriesSchema}};

const Kind& KindOf(const std::string& name) {
  return *std::ranges::find(kKinds, name, &Kind::name);
}

struct SchemaCommand {
  std::string kind;
  bool tables = false;

  std::vector<Option> Options() {
    return {{"kind", "File type", &kind, kRequired, OneOf(SchemaKinds())},
            {"--tables", "Tables of keys in Markdown instead", &tables}};
  }
};

int PrintSchema(const SchemaCommand& command, const Typed&) {
  PrintText(command.tables ? TablesOfKinds({command.kind}) : SchemaOfKind(command.kind));
  return 0;
}

using std::string_view;

/// Word of earlier versions. `where` holds the keys with it, between slashes; "": any key.
struct OldWord {
  string_view old, now, where = "";
};

/// Keys of configuration files, and the keys of the objects that contain them; "//" is the top
/// level.
constexpr OldWord kKeys[] = {
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

/// Keys of records, which conditions and measures of configuration files also use.
constexpr OldWord kRecordKeys[] = {
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
constexpr string_view kConditions = "/select/require/where/when/benchmarks/of/relative_to/";

constexpr string_view kOutcomes = "/outcome/right/expected_outcome/when/word/";
/// Words among the values of these keys; several words are separated by spaces.
constexpr OldWord kValues[] = {
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

template <std::size_t size>
string_view Renamed(const OldWord (&words)[size], string_view word, string_view where = "") {
  for (const OldWord& known : words) {
    if (known.old == word && (known.where.empty() || Holds(known.where, where))) return known.now;
  }
  return word;
}

/// Returns today's name of `key` in the object under `within`.
string_view ConfigurationKey(string_view key, string_view within) {
  const string_view now = Renamed(kKeys, key, within);
  return now == key && Holds(kConditions, within) ? Renamed(kRecordKeys, key) : now;
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
  if (key == "measure" || key == "of" || key == "relative_to")
    return std::string(Renamed(kRecordKeys, value));
  std::string text;
  for (const auto part : std::views::split(value, ' ')) {
    text += Renamed(kValues, string_view(part.begin(), part.end()), key);
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

  /// Returns the last name in the field of the sweep axis that begins at `begin`: its values are
  /// values of this key.
  string_view SweptKey(std::size_t begin) const {
    const std::size_t field = text_.find("\"field\"", begin);
    if (field == text_.npos) return "";
    const std::size_t first = std::min(text_.find('"', field + 7), text_.size() - 1) + 1;
    string_view path = text_.substr(first, text_.find('"', first) - first), name;
    do {
      const std::size_t slash = path.rfind('/');
      name = slash == path.npos ? path : path.substr(slash + 1);
      path = path.substr(0, slash == path.npos ? 0 : slash);
    } while (!path.empty() && name.find_first_not_of("0123456789*") == name.npos);
    return name;
  }

  void Object(string_view within, int depth) {
    const std::size_t begin = at_;
    for (++at_; SkipSpace(), text_[at_] != '}';) {
      if (text_[at_] == ',') {
        ++at_;
        continue;
      }
      const string_view key = String();
      const bool is_top = is_record_ && depth == 0;
      Replace(key, is_top ? Renamed(kRecordKeys, key) : ConfigurationKey(key, within));
      SkipSpace();
      ++at_;  // the colon
      SkipSpace();
      if (is_top && key == "format") {
        Replace(text_.substr(at_, text_.find_first_of(",} ", at_) - at_),
                std::to_string(kRecordFormat));
      }
      Value(key == "values" ? SweptKey(begin) : key, depth + 1);
    }
    ++at_;
  }

  string_view text_;
  bool is_record_;
  std::size_t at_ = 0, copied_ = 0, count_ = 0;
  std::string result_;
};

/// Returns a rewritten line of a record file without its line end; counts the replaced names.
std::string RenamedLine(string_view line, const std::string& place, std::size_t* count) {
  const string_view end = line.substr(line.find_last_not_of(" \t\r") + 1);
  line.remove_suffix(end.size());
  if (line.empty()) return std::string(end);
  ParseDocument(line, place);
  Renamer renamed(line, true);
  *count += renamed.count();
  if (renamed.count() == 0) return std::string(line).append(end);
  std::string object = std::move(renamed.result());
  ParseDocument(object, place);  // a key of the user may have today's name
  if (const std::size_t sealed = object.rfind(",\"checksum\":"); sealed != object.npos) {
    if (WithChecksum(std::string(line.substr(0, line.rfind(",\"checksum\":"))) + "}") != line) {
      throw std::runtime_error(place + ": wrong checksum: the line was changed");
    }
    object.resize(sealed);
    object = WithChecksum(object + "}");
  }
  return object.append(end);
}

/// Writes the lines of a record file to `output`, if any; returns the number of replaced names.
std::size_t RenameLines(const std::filesystem::path& file, OutputFile* output) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be read");
  std::size_t count = 0, number = 0;
  for (std::string line; std::getline(stream, line);) {
    const bool is_torn = stream.eof();  // no line end: possibly torn by a crash
    try {
      line = RenamedLine(line, fmt::format("{}:{}", file.string(), ++number), &count);
    } catch (const ConfigError&) {
      if (!is_torn || number == 1) throw;
    }
    if (!is_torn) line += '\n';
    if (output != nullptr) output->Write(line);
  }
  return count;
}

/// Returns true if the file has one record per line: a store, or the single record of a reference.
bool HasRecordLines(const std::filesystem::path& file) {
  if (file.extension() == ".jsonl") return true;
  constexpr std::streamoff kEnd = 48;  // the checksum is closer to the end of a sealed line
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  stream.seekg(std::max<std::streamoff>(0, stream.tellg() - kEnd));
  std::string end(kEnd, ' ');
  stream.read(end.data(), kEnd);
  return end.find(",\"checksum\":\"") != end.npos;
}

struct Lock {
  ~Lock() { ::close(descriptor); }
  const int descriptor;
};

std::size_t MigrateFile(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw std::runtime_error(file.string() + ": expected a regular file");
  }
  if (HasRecordLines(file)) {
    const Lock lock{OpenLocked(file, false, "wait for it")};
    const std::size_t count = RenameLines(file, nullptr);
    if (count == 0) return 0;
    OutputFile output(file, Onto::kAnyFile);
    RenameLines(file, &output);
    output.Finish();
    return count;
  }
  const std::string text = ReadTextFile(file);
  ParseDocument(text, file.string());
  const bool has_own_hash = WithOwnHash(text) == text;
  Renamer renamed(text, false);
  if (renamed.count() == 0) return 0;
  ParseDocument(renamed.result(), file.string());  // old and new names may not occur together
  OutputFile output(file, Onto::kAnyFile);
  output.Write(has_own_hash ? WithOwnHash(renamed.result()) : renamed.result());
  output.Finish();
  return renamed.count();
}

/// Returns the files of `path`: itself, or a store with its mechanisms and references.
std::vector<std::filesystem::path> FilesOf(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::filesystem::path> files = {StoreFile(path)};
  for (const char* folder : {"mechanisms", "references"}) {
    if (!std::filesystem::is_directory(path / folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(path / folder)) {
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    }
  }
  std::sort(files.begin() + 1, files.end());
  return files;
}

struct MigrateCommand {
  std::vector<std::filesystem::path> files;

  std::vector<Option> Options() {
    return {{"file", "Configuration files (JSON), stores and files of records", &files, kRequired}};
  }
};

/// Rewrites configuration files, stores and other record files (.jsonl) in place, each atomically.
/// All other bytes stay, and record checksums are renewed. Prints the number of replaced names per
/// file. Returns 2 if a file cannot be rewritten; it then stays unchanged.
int Migrate(const MigrateCommand& command, const Typed&) {
  int code = 0;
  for (const std::filesystem::path& path : command.files) {
    for (const std::filesystem::path& file : FilesOf(path)) {
      try {
        const std::size_t count = MigrateFile(file);
        Print("{}: {}\n", file.string(),
              count == 0 ? "no old names" : fmt::format("{} names replaced", count));
      } catch (const std::exception& error) {
        PrintError("{}\n", Lines{error.what()});
        code = 2;
      }
    }
  }
  return code;
}

}  // namespace

std::vector<std::string> SchemaKinds() { return Mapped<std::string>(kKinds, &Kind::name); }

std::string SchemaOfKind(const std::string& kind) {
  return SchemaText(fmt::format("Loopbench {}", KindOf(kind).title), KindOf(kind).schema());
}

std::string TablesOfKinds(const std::vector<std::string>& kinds) {
  std::vector<std::pair<std::string, Json>> schemas;
  for (const std::string& kind : kinds) schemas.emplace_back(kind, KindOf(kind).schema());
  return SchemaTables(schemas);
}

void AddFormats(Commands& commands) {
  commands.Add("schema", "Print the JSON Schema (draft 07) of a file type", PrintSchema);
  commands.Add("migrate", "Replace names of earlier versions in files", Migrate);
}

std::string WithMigrationHint(std::string message) {
  const auto holds = [&message](const std::string& part) {
    return message.find(part) != message.npos;
  };
  const auto is_key = [&](string_view old) {
    return holds(fmt::format("unknown key \"{}\"", old));
  };
  const auto is_value = [&](string_view old) { return holds(fmt::format("found \"{}\",", old)); };
  if (std::ranges::any_of(kKeys, is_key, &OldWord::old) ||
      std::ranges::any_of(kRecordKeys, is_key, &OldWord::old) ||
      std::ranges::any_of(kValues, is_value, &OldWord::old) ||
      holds("no key that identifies the file type") ||
      holds(fmt::format(kExpectedFormat, kRecordFormat))) {
    message += "\n`loopbench migrate FILE` replaces names of earlier versions";
  }
  return message;
}

}  // namespace loopbench::harness
