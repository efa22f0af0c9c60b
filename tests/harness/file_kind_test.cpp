// What kind a file is of: its top-level keys decide, and nothing that stands inside.
#include "harness/base/file_kind.h"

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::file_kind_test {

class FileKindTest : public CommandLineTest {
 protected:
  FileKind KindOf(const std::string& text) const {
    Write("file.json", text);
    return KindOfFile(folder_ / "file.json");
  }
  std::string MessageOfText(const std::string& text) const {
    return MessageOf([&] { KindOf(text); });
  }
};

TEST_F(FileKindTest, NamesInsideDecideNothing) {
  for (const char* name : {"rows", "groups", "claims", "problems", "methods", "benchmarks"}) {
    std::string text = mechanism_;
    for (std::size_t at = text.find("bar1"); at != std::string::npos; at = text.find("bar1", at)) {
      text.replace(at, 4, name);
    }
    EXPECT_EQ(KindOf(text), FileKind::kMechanism) << name;
    Expect("check file.json", 0, {"mechanism \"four-bar\", 3 bodies, 4 joints"});
    Expect("explain file.json", 0, {name});
  }
  EXPECT_EQ(KindOf(Replaced(kTinyExperiment, "two cases", "claims\\\", \\\"rows\\\": \\\"groups")),
            FileKind::kExperiment);
}

TEST_F(FileKindTest, EveryShippedFileIsOfTheKindOfItsFolder) {
  for (const char* folder : {"mechanisms", "experiments", "benchmarks", "references"}) {
    for (const fs::path& file : JsonFilesIn(kConfigs / folder)) {
      const std::string path = file.string(), name = file.filename().string();
      if (name.find("states") != std::string::npos) continue;
      // experiments/models/ has models and for each of them a folder with its ladder,
      // experiments/overconstrained/ the linkages of one experiment and its claims
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
      EXPECT_EQ(KindOfFile(file), expected) << file;
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
  const std::string message = MessageOfText("{\"name\": \"m\",\n \"problems\": [1,]}");
  ExpectWords(message, {"file.json:2:", "remove the comma"});
  Expect("check file.json", 2, {"remove the comma"});
  Expect("explain file.json", 2, {"remove the comma"});
  ExpectWords(MessageOfText("[1, 2]"), {"found [1,2], expected an object: a mechanism"});
}

TEST_F(FileKindTest, AnAmbiguousFileIsAnsweredWithWhatWasFound) {
  EXPECT_EQ(MessageOfText(R"({"name": "x", "bodies": [], "problems": []})"),
            (folder_ / "file.json").string() +
                ":1: (top level): found keys of a mechanism (\"name\", \"bodies\") and an "
                "experiment (\"name\", \"problems\"), expected those of one kind: a mechanism "
                "(\"bodies\", \"joints\") or an experiment (\"problems\", \"methods\")");
  for (const char* text :
       {"{}", "{\"benchmarks\": []}", "{\"name\": \"x\"}", "{\"title\": \"x\"}"}) {
    ExpectWords(MessageOfText(text), {"found no key that identifies the file type"});
  }
}

TEST_F(FileKindTest, AFileOfAnotherKindIsNamed) {
  Expect("run four-bar.json --out out", 2,
         {"found a mechanism (it has \"bodies\"), expected an experiment"});
  Expect("list claims.json", 2, {"found claims (it has \"claims\"), expected an experiment"});
  Expect("run tiny.json --no-timing --out out", 0, {"results in out"});
  Expect("check-claims out --claims tiny.json", 2,
         {"found an experiment (it has \"problems\"), expected claims"});
}

}  // namespace loopbench::harness::file_kind_test
