// The committed schemas and tables are those that the lists of fields make (harness/base/fields.h).
//
// To renew them: LOOPBENCH_RENEW_EXPECTED=1 harness_tests --gtest_filter='SchemaFiles*'
#include "harness/base/fields.h"
#include "harness/cli/commands.h"
#include "harness/config/file_schemas.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::schema_files_test {

void ExpectCommitted(const fs::path& file, const std::string& made) {
  if (std::getenv("LOOPBENCH_RENEW_EXPECTED") != nullptr) WriteFileAtomically(file, made);
  EXPECT_EQ(ReadFile(file), made) << file << ": see the first lines of " << __FILE__;
}

TEST(SchemaFiles, AreMadeFromTheFields) {
  for (const std::string& kind : SchemaKinds()) {
    ExpectCommitted(kConfigs / "schema" / (kind + ".schema.json"), SchemaOfKind(kind));
  }
}

TEST(SchemaFiles, TablesOfTheDocumentAreMadeFromTheFields) {
  const fs::path file = kRoot / "docs/fields.md";
  std::string text = ReadFile(file);
  const std::size_t end = text.find("\n## ");
  ASSERT_NE(end, std::string::npos);
  text.resize(end + 1);  // what people wrote
  text += TablesOfKinds(SchemaKinds());
  text.pop_back();
  ExpectCommitted(file, text);
}

/// Every key of the top level has a list of fields, and the kinds are told apart by no other.
TEST(SchemaFiles, KnowTheKeysThatTellKindsApart) {
  const std::map<std::string, FileKind> kinds = {{"mechanism", FileKind::kMechanism},
                                                 {"experiment", FileKind::kExperiment},
                                                 {"benchmarks", FileKind::kBenchmarks},
                                                 {"claims", FileKind::kClaims},
                                                 {"map", FileKind::kMap},
                                                 {"series", FileKind::kSeries}};
  for (const std::string& kind : SchemaKinds()) {
    const Json schema = ParseDocument(SchemaOfKind(kind), kind);
    std::string keys;
    for (const auto& [key, field] : schema["properties"].items()) {
      keys += (keys.empty() ? "{\"" : ", \"") + key + (key == "format" ? "\": 1" : "\": \"x\"");
    }
    const Json document = ParseDocument(keys + "}", kind);
    ErrorList errors(kind, "");
    ExpectDocument(JsonNode(document, "", errors), kinds.at(kind));
    EXPECT_TRUE(errors.empty()) << kind << ": harness/base/file_kind.cpp lacks a key";
    const Json unknown = ParseDocument("{\"no such key\": 0, \"" + kind + "\": 0}", kind);
    ErrorList known(kind, "");
    ExpectDocument(JsonNode(unknown, "", known), kinds.at(kind));
    const std::string message = MessageOf([&] { known.ThrowIfAny(); });
    for (const auto& [key, field] : schema["properties"].items()) {
      EXPECT_NE(message.find('"' + key + '"'), std::string::npos) << key;
    }
  }
}

struct Plain {
  double mass = 2.5;
  int count = 3;
  bool flag = false;
  std::string word;
};

const Fields<Plain>& PlainFields() {
  static const Fields<Plain> fields(
      "plain", "A struct.",
      {{"mass", Number(&Plain::mass, kPositive), "Mass [kg].", "a number > 0 [kg]"},
       {"count", Integer(&Plain::count, 1, 9), "How many."},
       {"flag", Bool(&Plain::flag), "Whether."},
       {"word", Text(&Plain::word), "A word."}});
  return fields;
}

std::string MistakesOf(const std::string& text, Plain* plain) {
  const Json document = ParseDocument(text, "f.json");
  ErrorList errors("f.json", text);
  PlainFields().Read(JsonNode(document, "", errors), plain);
  return MessageOf([&] { errors.ThrowIfAny(); });
}

TEST(Fields, AreReadIntoTheStruct) {
  Plain plain;
  EXPECT_EQ(MistakesOf(R"({"mass": 7, "flag": true, "word": "w"})", &plain), "");
  EXPECT_EQ(plain.mass, 7.0);
  EXPECT_EQ(plain.count, 3);
  EXPECT_TRUE(plain.flag);
  EXPECT_EQ(plain.word, "w");
}

TEST(Fields, ReportAllMistakesInTheOrderOfRows) {
  Plain plain;
  EXPECT_EQ(MistakesOf(R"({"flag": 1, "cuont": 3, "count": 0})", &plain),
            "f.json:1: /cuont: found unknown key \"cuont\", expected one of \"mass\", \"count\", "
            "\"flag\", \"word\" (did you mean \"count\"?)\n"
            "f.json:1: (top level): found no \"mass\", expected a number > 0 [kg]\n"
            "f.json:1: /count: found 0, expected an integer from 1 to 9\n"
            "f.json:1: /flag: found 1, expected true or false");
  EXPECT_EQ(MistakesOf("[]", &plain),
            "f.json:1: (top level): found an empty array, expected an object with keys \"mass\", "
            "\"count\", \"flag\", \"word\"");
}

TEST(Fields, MakeASchemaWithTheStructsDefaults) {
  EXPECT_EQ(SchemaText("Plain", PlainFields().OwnSchema()), TestData("plain.schema.json"));
}

TEST(Fields, MakeATableWithTheStructsDefaults) {
  EXPECT_EQ(SchemaTables({{"plain", PlainFields().OwnSchema()}}), TestData("plain.md"));
}

using SchemaCommandTest = CommandLineTest;

TEST_F(SchemaCommandTest, PrintsTheSchemaOfAKind) {
  EXPECT_EQ(Call("schema mechanism").text, SchemaOfKind("mechanism"));
  EXPECT_EQ(Call("schema benchmarks --tables").text, TablesOfKinds({"benchmarks"}));
  Expect("schema mechanisms", 2, {"mechanisms"});
}

}  // namespace loopbench::harness::schema_files_test
