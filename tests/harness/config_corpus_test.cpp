// Every broken file of tests/broken against the exact message beside it (tests/broken/README.md).
#include "harness/config/benchmarks.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/published_series.h"
#include "harness/exchange/import.h"
#include "harness/judge/judge.h"
#include "tests/harness/places.h"

namespace loopbench::harness::config_corpus_test {

namespace fs = std::filesystem;

const fs::path kBroken = kRoot / "tests/broken";

/// The reader's message, file names as seen from tests/broken; "" when the file is accepted.
template <class Read>
std::string ShortMessageOf(Read read) {
  std::string message = MessageOf(read);
  for (const std::string& folder : {kBroken.string() + "/", kRoot.string() + "/"}) {
    for (std::size_t at = message.find(folder); at != std::string::npos;
         at = message.find(folder, at)) {
      message.erase(at, folder.size());
    }
  }
  return message;
}

std::string MessageOfFile(const fs::path& path) {
  return ShortMessageOf([&path] {
    const fs::path kind = path.parent_path().filename();
    if (kind == "mechanisms") ReadMechanism(path);
    if (kind == "experiments") ReadExperiments(path);
    if (kind == "claims") ReadClaims(path);
    if (kind == "maps") ReadMapRules(path);
    if (kind == "series") ReadPublishedSeries(path);
    if (kind == "benchmarks") ReadBenchmarks(path);
    // as a text, which includes no other files
    if (kind == "imports") ImportText(ReadFile(path), path.filename().string());
  });
}

/// The broken files of a kind, sorted.
std::vector<fs::path> BrokenFiles(const std::string& kind) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kBroken / kind)) {
    if (entry.path().extension() != ".expected") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

class Corpus : public testing::TestWithParam<std::string> {};

TEST_P(Corpus, IsRefusedWithTheExpectedMessages) {
  const std::vector<fs::path> files = BrokenFiles(GetParam());
  // with LOOPBENCH_RENEW_EXPECTED set the messages are written, to be read before they are
  // committed
  const bool renew = std::getenv("LOOPBENCH_RENEW_EXPECTED") != nullptr;
  for (const fs::path& file : files) {
    const std::string message = MessageOfFile(file);
    EXPECT_NE(message, "") << file << " is accepted";
    fs::path beside = file;
    beside.replace_extension(".expected");
    if (renew && !message.empty()) std::ofstream(beside, std::ios::binary) << message << '\n';
    EXPECT_EQ(message + '\n', ReadFile(beside)) << file;
  }
}

const std::vector<std::string> kKinds = {"mechanisms", "experiments", "claims", "maps",
                                         "series",     "benchmarks",  "imports"};

INSTANTIATE_TEST_SUITE_P(Kinds, Corpus, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return kind.param; });

TEST(CorpusSize, IsAtLeastAHundredFilesAndNoMessageIsLeftOver) {
  std::size_t json = 0;
  for (const std::string& kind : kKinds) {
    const std::size_t files = BrokenFiles(kind).size();
    const auto entries =
        std::distance(fs::directory_iterator(kBroken / kind), fs::directory_iterator());
    EXPECT_EQ(static_cast<std::size_t>(entries), 2 * files) << kind;
    EXPECT_GE(files, kind == "imports" ? 200u : 10u) << kind;
    if (kind != "imports") json += files;
  }
  EXPECT_GE(json, 100u);
}

std::string MechanismMessage(const std::string& text) {
  return ShortMessageOf([&text] { ParseMechanism(text, "m.json"); });
}

std::string Repeated(const std::string& piece, std::size_t count) {
  std::string text;
  while (count-- > 0) text += piece;
  return text;
}

TEST(HugeInput, HundredMegabytesAreRefusedBeforeTheyAreRead) {
  const fs::path path = fs::path(testing::TempDir()) / "loopbench-huge.json";
  std::ofstream(path, std::ios::binary).put(' ');
  fs::resize_file(path, 100u << 20);  // sparse: takes no room
  const std::string message =
      path.string() + ": cannot be read: found more than 16 MiB, expected at most 16 MiB";
  EXPECT_EQ(ShortMessageOf([&path] { ReadMechanism(path); }), message);
  EXPECT_EQ(ShortMessageOf([&path] { ReadExperiments(path); }), message);
  fs::remove(path);
}

TEST(HugeInput, DeepNestingIsRefusedWhereItBecomesTooDeep) {
  const std::string arrays = MechanismMessage(Repeated("[", 10'000'000));
  EXPECT_EQ(arrays, "m.json:1: " + Repeated("/0", 64) +
                        ": found nesting deeper than 64 levels, expected at most 64");
  const std::string objects = MechanismMessage(Repeated("{\"a\":\n", 1'000'000));
  EXPECT_EQ(objects, "m.json:65: " + Repeated("/a", 64) +
                         ": found nesting deeper than 64 levels, expected at most 64");
}

// Work that grows with the square of the size would take hours on these; the time limit of the test
// is what fails then.
TEST(HugeInput, ManyMistakesAreCountedAndNotSearched) {
  std::string keys = "{";
  for (int i = 0; i < 400'000; ++i) keys += "\"key" + std::to_string(i) + "\": 0,\n";
  const std::string message = MechanismMessage(keys + "\"name\": \"m\"}");
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 100);
  ExpectWords(message, {"m.json:1: /key0: found unknown key"});
  EXPECT_NE(message.find("\nm.json: and 3999"), std::string::npos)
      << message.substr(message.size() - 80);
  const std::string twice = MechanismMessage("{" + Repeated("\"a\": 0,\n", 400'000) + "\"a\": 0}");
  ExpectWords(twice, {"m.json:2: /a: found key \"a\" twice", "and 399900 more"});
}

TEST(HugeInput, ManyBodiesAndJointsAreReadInLinearTime) {
  std::string bodies, joints, coordinates, held, independent;
  constexpr int kCount = 40'000;
  for (int i = 0; i < kCount; ++i) {
    const std::string number = std::to_string(i), comma = i + 1 < kCount ? ",\n" : "";
    bodies += R"({"name":"b)" + number + R"(","mass":1,"inertia":1})" + comma;
    joints += R"({"name":"j)" + number +
              R"(","type":"revolute","from":{"body":"ground"},"to":{"body":"b)" + number +
              R"("}})" + comma;
    coordinates += "\"j" + number + "\":0" + comma;
    held += "\"j" + number + "\"" + comma;
    independent += "\"b" + number + ".angle\"" + comma;
  }
  const std::string text = R"({"name": "m", "gravity": [0, 0], "bodies": [)" + bodies +
                           R"(], "joints": [)" + joints + R"(], "initial": {"coordinates": {)" +
                           coordinates + R"(}, "fixed": [)" + held + R"(]}, "independent": [)" +
                           independent + "]}";
  EXPECT_EQ(ParseMechanism(text, "m.json").description.initial.held.size(), std::size_t{kCount});
}

TEST(HugeInput, LongTokensAreCutInMessages) {
  const std::string digits = MechanismMessage("{\"name\": 1" + Repeated("0", 1'000'000) + "}");
  EXPECT_LT(digits.size(), 200u) << digits.substr(0, 200);
  const std::string key = MechanismMessage("{\"" + Repeated("k", 1'000'000) + "\": 0}");
  for (std::size_t at = 0; at < key.size();) {  // each line short, the pointer too
    const std::size_t end = std::min(key.find('\n', at), key.size());
    EXPECT_LT(end - at, 600u);
    at = end + 1;
  }
}

TEST(UnreadableFiles, AreNamed) {
  EXPECT_EQ(ShortMessageOf([] { ReadMechanism("/nowhere/m.json"); }),
            "/nowhere/m.json: cannot be read: no such file");
  EXPECT_EQ(ShortMessageOf([] { ReadMechanism(kConfigs); }),
            "configs: cannot be read: it is a folder");
}

TEST(NearestSpelling, FindsTypingErrorsAndNothingFar) {
  const std::vector<std::string> words = {"revolute", "prismatic", "A", "bar1"};
  EXPECT_EQ(NearestSpelling("revolut", words), "revolute");
  EXPECT_EQ(NearestSpelling("PRISMATIC", words), "prismatic");
  EXPECT_EQ(NearestSpelling("abr1", words), "bar1");
  EXPECT_EQ(NearestSpelling("weld", words), "");
  EXPECT_EQ(NearestSpelling("B", words), "");
}

TEST(EditDistance, CountsASwapOfNeighboursOnce) {
  EXPECT_EQ(EditDistance("abcd", "abdc"), 1);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
  EXPECT_EQ(EditDistance("", "abc"), 3);
}

}  // namespace loopbench::harness::config_corpus_test
