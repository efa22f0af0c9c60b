// What kind a file is of: its top-level keys decide, and nothing that stands inside.
#include "harness/base/file_kind.h"

#include <gtest/gtest.h>

#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace file_kind_test {

class FileKindTest : public CommandLineTest {
 protected:
  FileKind KindOf(const std::string& text) const {
    Write("file.json", text);
    return KindOfFile(folder_ / "file.json");
  }
  std::string MessageOf(const std::string& text) const {
    try {
      KindOf(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(FileKindTest, NamesInsideDecideNothing) {
  for (const char* name : {"rows", "groups", "claims", "problems", "methods", "benchmarks"}) {
    std::string text = mechanism_;
    for (std::size_t at = text.find("bar1"); at != std::string::npos; at = text.find("bar1", at)) {
      text.replace(at, 4, name);
    }
    EXPECT_EQ(KindOf(text), FileKind::kMechanism) << name;
    ExpectEnding(Call("check file.json"), 0, {"mechanism \"four-bar\", 3 bodies, 4 joints"});
    ExpectEnding(Call("explain file.json"), 0, {name});
  }
  std::string experiment = kTinyExperiment;
  experiment.replace(experiment.find("two cases"), 9, "claims\\\", \\\"rows\\\": \\\"groups");
  EXPECT_EQ(KindOf(experiment), FileKind::kExperiment);
}

TEST_F(FileKindTest, EveryShippedFileIsOfTheKindOfItsFolder) {
  for (const char* folder : {"mechanisms", "experiments", "benchmarks", "references"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kConfigs / folder)) {
      const std::string name = entry.path().filename().string();
      if (entry.path().extension() != ".json" || name.find("states") != std::string::npos) continue;
      // experiments/models/ has models and for each of them a folder with its ladder,
      // experiments/overconstrained/ the linkages of one experiment and its claims
      const std::string path = entry.path().string();
      const bool is_model =
          (path.find("/experiments/models/") != path.npos &&
           name.find("-models.json") == name.npos) ||
          (path.find("/experiments/overconstrained/") != path.npos && name != "claims.json");
      const FileKind expected = folder == std::string("mechanisms")   ? FileKind::kMechanism
                                : is_model                            ? FileKind::kMechanism
                                : folder == std::string("benchmarks") ? FileKind::kBenchmarks
                                : folder == std::string("references") ? FileKind::kSeries
                                : name == "claims.json"               ? FileKind::kClaims
                                : name.find("map.json") != name.npos  ? FileKind::kMap
                                                                      : FileKind::kExperiment;
      EXPECT_EQ(KindOfFile(entry.path()), expected) << entry.path();
    }
  }
}

TEST_F(FileKindTest, AMisspeltKeyLeavesTheKindAsItIs) {
  EXPECT_EQ(KindOf(R"({"name": "m", "gravity": [0, 0], "bodeis": [], "joints": []})"),
            FileKind::kMechanism);
  EXPECT_EQ(KindOf(R"({"name": "m", "scnes": [], "methods": [], "tolerances": []})"),
            FileKind::kExperiment);
  EXPECT_EQ(KindOf(R"({"titel": "m", "methods": [], "groups": []})"), FileKind::kMap);
  EXPECT_EQ(KindOf(R"({"title": "m", "claims": []})"), FileKind::kClaims);
}

TEST_F(FileKindTest, ABrokenFileIsAnsweredWithItsFault) {
  const std::string message = MessageOf("{\"name\": \"m\",\n \"problems\": [1,]}");
  EXPECT_NE(message.find("file.json:2:"), std::string::npos) << message;
  EXPECT_NE(message.find("remove the comma"), std::string::npos) << message;
  ExpectEnding(Call("check file.json"), 2, {"remove the comma"});
  ExpectEnding(Call("explain file.json"), 2, {"remove the comma"});
  EXPECT_NE(MessageOf("[1, 2]").find("found [1,2], expected an object: a mechanism"),
            std::string::npos);
}

TEST_F(FileKindTest, AnAmbiguousFileIsAnsweredWithWhatWasFound) {
  EXPECT_EQ(MessageOf(R"({"name": "x", "bodies": [], "problems": []})"),
            (folder_ / "file.json").string() +
                ":1: (top level): found keys of a mechanism (\"name\", \"bodies\") and an "
                "experiment (\"name\", \"problems\"), expected those of one kind: a mechanism "
                "(\"bodies\", \"joints\") or an experiment (\"problems\", \"methods\")");
  for (const char* text :
       {"{}", "{\"benchmarks\": []}", "{\"name\": \"x\"}", "{\"title\": \"x\"}"}) {
    EXPECT_NE(MessageOf(text).find("found no key that identifies the file type"), std::string::npos)
        << text;
  }
}

TEST_F(FileKindTest, AFileOfAnotherKindIsNamed) {
  ExpectEnding(Call("run four-bar.json --out out"), 2,
               {"found a mechanism (it has \"bodies\"), expected an experiment"});
  ExpectEnding(Call("list claims.json"), 2,
               {"found claims (it has \"claims\"), expected an experiment"});
  ExpectEnding(Call("run tiny.json --no-timing --out out"), 0, {"results in out"});
  ExpectEnding(Call("check-claims out --claims tiny.json"), 2,
               {"found an experiment (it has \"problems\"), expected claims"});
  ExpectEnding(Call("robustness out --rules claims.json"), 2,
               {"found claims (it has \"claims\"), expected a robustness map"});
}

}  // namespace file_kind_test
}  // namespace loopbench::harness
