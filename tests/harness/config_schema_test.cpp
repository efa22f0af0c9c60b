// The JSON schemas (configs/schema, for editors) against the readers: the same verdict on every
// shipped file and on every broken one whose fault a schema can see.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "harness/base/file_kind.h"
#include "harness/base/text.h"
#include "harness/config/benchmarks.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/published_series.h"
#include "harness/judge/judge.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace config_schema_test {

namespace fs = std::filesystem;

/// Broken files that the schemas accept, by the reason why a schema cannot see the fault.
const std::map<std::string_view, std::string_view> kBeyondSchemas = {
    {"names are compared with names elsewhere in the file",
     "mechanisms/body-name-twice mechanisms/body-named-ground mechanisms/body-unknown "
     "mechanisms/joint-name-twice mechanisms/joint-with-itself mechanisms/point-unknown "
     "mechanisms/point-of-body-without mechanisms/observe-unknown-body "
     "mechanisms/initial-unknown-joint mechanisms/coupling-name-twice "
     "mechanisms/coupling-of-free-joint mechanisms/coupling-unknown-joint "
     "mechanisms/held-without-value mechanisms/independent-component "
     "mechanisms/independent-owner mechanisms/point-force-on-ground "
     "experiments/ensemble-unknown-problem experiments/series-unknown-problem "
     "series/quantity-twice claims/id-twice claims/label-twice maps/column-twice "
     "maps/row-twice maps/must-hold-unknown maps/must-hold-not-applicable "
     "maps/not-applicable-unknown experiments/ensemble-unused-tolerance "
     "experiments/ensemble-between-unheld experiments/problem-twice "
     "experiments/ensemble-tolerance-of-fixed-steps experiments/exclude-unknown-key "
     "experiments/sweep-same-name"},
    {"numbers of either sign, and sizes of a family, have a largest size",
     "mechanisms/coupling-huge benchmarks/size-too-large"},
    {"bodies of a force and their points are names, too",
     "mechanisms/spring-damper-one-body mechanisms/spring-damper-point-unknown "
     "mechanisms/drag-on-ground"},
    {"what is right depends on the type of a joint or on the space",
     "mechanisms/axis-in-plane mechanisms/axis-on-weld mechanisms/force-on-weld "
     "mechanisms/gravity-out-of-plane mechanisms/decimal-comma mechanisms/initial-of-weld "
     "mechanisms/spherical-in-plane mechanisms/spherical-quaternion-zero "
     "mechanisms/spherical-three-angles mechanisms/initial-two-values "
     "mechanisms/rotation-out-of-plane mechanisms/spring-damper-out-of-plane "
     "mechanisms/helical-in-plane mechanisms/initial-of-rod mechanisms/motion-and-initial "
     "mechanisms/motion-coordinate-range mechanisms/motion-coordinate-twice "
     "mechanisms/motion-list-of-pin-in-slot mechanisms/motion-of-rod "
     "mechanisms/motion-of-spherical mechanisms/motion-of-weld mechanisms/spatial-not-said "
     "mechanisms/motion-empty mechanisms/point-out-of-plane"},
    {"order conditions and sums of rows",
     "experiments/butcher-embedded-order experiments/butcher-full experiments/butcher-order "
     "experiments/butcher-row-sum experiments/butcher-sizes"},
    {"properties of a named integrator or formulation, or of a file",
     "experiments/butcher-file-broken experiments/butcher-file-missing "
     "experiments/butcher-without-embedding experiments/integration-explicit "
     "experiments/integrator-table-misspelt experiments/peer-with-integration "
     "experiments/atol-beside-precision"},
    {"parts of a run on their own have no common rows", "experiments/output-islands"},
    {"what a row of a map lacks may stand in its group", "maps/nothing-decides"},
    {"endings that decide must be among the right ones", "maps/when-not-right"},
    {"arithmetic over several numbers",
     "mechanisms/axis-zero mechanisms/pose-out-of-reach experiments/output-times-fall "
     "mechanisms/table-lengths mechanisms/table-times-equal mechanisms/motion-table-length "
     "mechanisms/motion-table-order mechanisms/inertia-indefinite mechanisms/inertia-triangle "
     "mechanisms/inertia-triangle-turned experiments/range-ends-equal "
     "experiments/range-log-signs experiments/family-range-rounded-twice "
     "experiments/ensemble-between-order experiments/family-too-large "
     "experiments/cases-too-many experiments/sweep-too-many "
     "experiments/series-one-for-two-problems series/lengths series/times-falling "
     "series/times-not-rising"},
    {"equal after expansion, or without effect",
     "experiments/method-twice experiments/gains-of-position "
     "experiments/ensemble-matches-nothing experiments/exclude-everything "
     "experiments/exclude-matches-nothing experiments/exclude-step-of-no-case "
     "experiments/sweep-value-again experiments/sweep-same-field "
     "experiments/sweep-zip-lengths benchmarks/benchmark-twice"},
    {"what a formulation does not have is known to its row",
     "experiments/peer-plain experiments/peer-at-another-level "
     "experiments/peer-in-absolute-coordinates experiments/peer-with-fixed-steps "
     "experiments/peer-with-gains experiments/peer-with-threads benchmarks/peer"},
    {"a default is that of another section", "experiments/precision-without-tolerances"},
    {"names of record keys", "experiments/sweep-name-taken"},
    {"a field is looked up, and its values are read, in the whole document",
     "experiments/sweep-field-into-number experiments/sweep-field-misspelt "
     "experiments/sweep-field-unknown experiments/sweep-new-key experiments/sweep-new-point "
     "experiments/sweep-value-refused"},
    {"the fault is in another file, or in its absence",
     "experiments/series-body-unknown experiments/series-joint-unknown "
     "experiments/series-point-unknown experiments/series-ground "
     "experiments/series-axis-out-of-plane experiments/series-joint-of-two-coordinates "
     "experiments/series-missing-file experiments/series-is-a-mechanism "
     "experiments/mechanism-broken experiments/mechanism-folder "
     "experiments/mechanism-is-an-experiment experiments/mechanism-missing-file "
     "experiments/mechanism-no-json experiments/repeated-broken-mechanism "
     "benchmarks/mechanism-missing-file"},
    {"a number or character that the validator's own parser takes",
     "mechanisms/mass-huge mechanisms/number-overflow mechanisms/number-underflow "
     "mechanisms/lone-surrogate series/number-overflow"}};

/// Returns the names of all of them, each with the space after it.
std::string AllBeyondSchemas() {
  std::string all = " ";
  for (const auto& [reason, names] : kBeyondSchemas) all += std::string(names) + ' ';
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

bool ReaderAccepts(FileKind kind, const fs::path& file) {
  try {
    if (kind == FileKind::kMechanism) ReadMechanism(file);
    if (kind == FileKind::kExperiment) ReadExperiments(file);
    if (kind == FileKind::kClaims) ReadClaims(file);
    if (kind == FileKind::kMap) ReadMapRules(file);
    if (kind == FileKind::kBenchmarks) ReadBenchmarks(file);
    if (kind == FileKind::kSeries) ReadPublishedSeries(file);
    return true;
  } catch (const ConfigError&) {
    return false;
  }
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

}  // namespace config_schema_test
}  // namespace loopbench::harness
