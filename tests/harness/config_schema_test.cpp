// The JSON schemas (configs/schema, for editors) against the readers: the same verdict on every
// shipped file and on every broken one whose fault a schema can see.
#include "harness/base/file_kind.h"
#include "harness/base/json_document.h"
#include "harness/config/benchmarks.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/published_series.h"
#include "harness/judge/judge.h"
#include "tests/harness/places.h"

namespace loopbench::harness::config_schema_test {

namespace fs = std::filesystem;

/// The names in tests/broken/beyond-schemas.txt, a space before and after each.
std::string AllBeyondSchemas() {
  std::istringstream lines(ReadFile(kRoot / "tests/broken/beyond-schemas.txt"));
  std::string all = " ";
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] != '#') all += line + ' ';
  }
  return all;
}

/// "valid", "invalid" or "no JSON" for each file.
std::vector<std::string> SchemaVerdicts(const std::string& schema,
                                        const std::vector<fs::path>& files) {
  // Debian's interpreter: another one in the path need not have the module
  std::string command = "/usr/bin/python3 -W ignore '" +
                        (kRoot / "tests/harness/schema_verdicts.py").string() + "' '" +
                        (kRoot / "configs/schema" / (schema + ".schema.json")).string() + "'";
  for (const fs::path& file : files) command += " '" + file.string() + "'";
  std::string output;
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {};
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) output += static_cast<char>(c);
  EXPECT_EQ(::pclose(pipe), 0) << output;
  std::vector<std::string> verdicts;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) verdicts.push_back(line);
  EXPECT_EQ(verdicts.size(), files.size()) << output;
  verdicts.resize(files.size());
  return verdicts;
}

/// Returns "" or the message of the reader. `file` gives the folder of the files that `text` names;
/// a series is read from there.
std::string FaultOf(FileKind kind, const std::string& text, const fs::path& file) {
  try {
    if (kind == FileKind::kMechanism) ParseMechanism(text, file.string());
    if (kind == FileKind::kExperiment) ParseExperiments(text, file);
    if (kind == FileKind::kClaims) ParseClaims(text, file);
    if (kind == FileKind::kMap) ParseMapRules(text, file);
    if (kind == FileKind::kBenchmarks) ParseBenchmarks(text, file);
    if (kind == FileKind::kSeries) ReadPublishedSeries(file);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

bool ReaderAccepts(FileKind kind, const fs::path& file) {
  try {
    return FaultOf(kind, ReadTextFile(file), file).empty();
  } catch (const ConfigError&) {
    return false;
  }
}

/// Returns the arrays and objects within a document, with their places.
std::vector<std::pair<Json::json_pointer, const Json*>> StructuredIn(
    const Json& value, const Json::json_pointer& pointer = Json::json_pointer()) {
  std::vector<std::pair<Json::json_pointer, const Json*>> found = {{pointer, &value}};
  const auto add = [&](const Json& child, const Json::json_pointer& at) {
    if (!child.is_structured()) return;
    std::ranges::move(StructuredIn(child, at), std::back_inserter(found));
  };
  for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) add(value[i], pointer / i);
  if (!value.is_object()) return found;
  for (const auto& [key, child] : value.items()) add(child, pointer / key);
  return found;
}

struct KindOfSchema {
  std::string schema, broken;  ///< names of the schema and of the folder of broken files
  FileKind kind;
  std::size_t shipped, refused;  ///< at least

  friend std::ostream& operator<<(std::ostream& out, const KindOfSchema& kind) {
    return out << kind.schema;
  }
};

class Schema : public testing::TestWithParam<KindOfSchema> {};

/// Mechanisms and experiments, claims and maps as they are shipped.
std::vector<fs::path> ShippedOf(FileKind kind) {
  std::vector<fs::path> files;
  for (const char* folder : {"mechanisms", "experiments", "references", "benchmarks"}) {
    for (const fs::path& file : JsonFilesIn(kRoot / "configs" / folder)) {
      const bool has_hashes = file.filename() == "default.states.json";
      if (!has_hashes && KindOfFile(file) == kind) files.push_back(file);
    }
  }
  return files;
}

TEST_P(Schema, AcceptsWhatIsShippedAsTheReaderDoes) {
  const std::vector<fs::path> files = ShippedOf(GetParam().kind);
  EXPECT_GE(files.size(), GetParam().shipped);
  const std::vector<std::string> verdicts = SchemaVerdicts(GetParam().schema, files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    EXPECT_EQ(verdicts[i], "valid") << files[i];
    EXPECT_TRUE(ReaderAccepts(GetParam().kind, files[i])) << files[i];
  }
}

TEST_P(Schema, MayBeNamedByTheFile) {
  const fs::path folder = fs::path(testing::TempDir()) / ("loopbench-named-" + GetParam().schema);
  fs::create_directories(folder);
  const fs::path file = folder / "named.json";
  for (const fs::path& shipped : ShippedOf(GetParam().kind)) {
    std::string text = ReadFile(shipped);
    if (text.find("\"../") != std::string::npos) continue;  // seen from its place
    text.replace(text.find('{'), 1, "{\"$schema\": \"" + GetParam().schema + ".schema.json\",");
    WriteFileAtomically(file, text);
    EXPECT_TRUE(ReaderAccepts(GetParam().kind, file)) << shipped;
    EXPECT_EQ(SchemaVerdicts(GetParam().schema, {file}).front(), "valid") << shipped;
    break;
  }
  EXPECT_TRUE(fs::exists(file));
  fs::remove_all(folder);
}

TEST_P(Schema, RefusesWhatTheReaderRefusesWhereItCanSeeTheFault) {
  const std::vector<fs::path> files = JsonFilesIn(kRoot / "tests/broken" / GetParam().broken);
  const std::vector<std::string> verdicts = SchemaVerdicts(GetParam().schema, files);
  std::size_t refused = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    EXPECT_FALSE(ReaderAccepts(GetParam().kind, files[i])) << files[i];
    const std::string name = GetParam().broken + "/" + files[i].stem().string();
    const bool beyond = AllBeyondSchemas().find(' ' + name + ' ') != std::string::npos;
    if (beyond) {
      EXPECT_EQ(verdicts[i], "valid") << name << " need not be in the list of exceptions";
    } else {
      EXPECT_NE(verdicts[i], "valid") << name << " is accepted by the schema";
    }
    refused += verdicts[i] == "invalid" ? 1 : 0;
  }
  EXPECT_GE(refused, GetParam().refused);
}

// Each array and object of the shipped files, once per place in the schema, is made empty.
TEST_P(Schema, AgreesWithTheReaderAboutEmptyValues) {
  const fs::path folder = fs::path(testing::TempDir()) / ("loopbench-empty-" + GetParam().schema);
  std::set<std::string> done;
  std::vector<fs::path> files;
  std::vector<std::string> faults;  // messages of the reader
  for (const fs::path& shipped : ShippedOf(GetParam().kind)) {
    const Json whole = ParseDocument(ReadFile(shipped), shipped.string());
    if (whole.contains("sweep")) continue;  // it replaces values that are never read
    for (const auto& [pointer, value] : StructuredIn(whole)) {
      std::string place;  // without indices
      for (const char c : pointer.to_string()) place += c >= '0' && c <= '9' ? '#' : c;
      if (value->empty() || !done.insert(place).second) continue;
      Json changed = whole;
      changed[pointer] = value->is_array() ? Json::array() : Json::object();
      // beside the original, because mechanisms are named from there
      const fs::path file =
          shipped.parent_path() / fmt::format("{}-empty-{}.json", GetParam().schema, files.size());
      files.push_back(folder / file.filename());
      WriteFileAtomically(files.back(), changed.dump());
      const bool is_series = GetParam().kind == FileKind::kSeries;
      faults.push_back(FaultOf(GetParam().kind, changed.dump(), is_series ? files.back() : file));
      const std::size_t at = faults.back().find(pointer.to_string() + ": found an empty");
      if (at == std::string::npos && !faults.back().empty()) {
        faults.pop_back();  // the value is missing elsewhere
        files.pop_back();
      }
    }
  }
  const std::vector<std::string> verdicts = SchemaVerdicts(GetParam().schema, files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    EXPECT_EQ(verdicts[i], faults[i].empty() ? "valid" : "invalid") << ReadFile(files[i]) << '\n'
                                                                    << faults[i];
  }
  EXPECT_GE(files.size(), 2u);
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, Schema,
    testing::Values(KindOfSchema{"mechanism", "mechanisms", FileKind::kMechanism, 30, 30},
                    KindOfSchema{"experiment", "experiments", FileKind::kExperiment, 20, 30},
                    KindOfSchema{"claims", "claims", FileKind::kClaims, 2, 20},
                    KindOfSchema{"map", "maps", FileKind::kMap, 2, 20},
                    KindOfSchema{"series", "series", FileKind::kSeries, 3, 20},
                    KindOfSchema{"benchmarks", "benchmarks", FileKind::kBenchmarks, 5, 10}),
    [](const auto& kind) { return kind.param.schema; });

TEST(MapSchema, KnowsEveryEndingOfRuns) {
  const std::string schema = ReadFile(kRoot / "configs/schema/map.schema.json");
  for (const RunEnding& ending : kRunEndings) {
    EXPECT_NE(schema.find('"' + std::string(ending.word) + '"'), std::string::npos) << ending.word;
  }
}

TEST(SchemaExceptions, AreFilesThatExist) {
  std::istringstream names(AllBeyondSchemas());
  for (std::string name; names >> name;) {
    EXPECT_TRUE(fs::exists(kRoot / "tests/broken" / (name + ".json"))) << name;
  }
}

}  // namespace loopbench::harness::config_schema_test
