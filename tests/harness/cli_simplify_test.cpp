// loopbench simplify: what it lists, what it writes, what it refuses; and the ladders that come
// with Loopbench are what it writes.
//
// To renew them: LOOPBENCH_RENEW_EXPECTED=1 harness_tests --gtest_filter='ShippedLadders*'
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cli_simplify_test {

const fs::path kModels = kConfigs / "experiments/models";

class SimplifyTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    for (const char* name : {"light-rod-compressor", "hall", "excavator-arm"}) {
      fs::copy_file(kModels / (std::string(name) + ".json"),
                    folder_ / (std::string(name) + ".json"));
    }
  }

  std::vector<std::string> FilesIn(const std::string& folder) const {
    return NamesIn(folder_ / folder);
  }
};

TEST_F(SimplifyTest, ListsCandidatesWithTheNumberThatDecidedAndWritesNothing) {
  const std::vector<std::string> before = FilesIn(".");
  const Ending listed = Call("simplify light-rod-compressor.json");
  ExpectEnding(listed, 0,
               {"Trial run: 1 s", "light-links: links of small mass become massless rods",
                "link \"rod\" between \"crank\" and \"piston\"  0.00138  yes",
                "link \"crank\" between \"ground\" and \"rod\"  0.98     no", "taken up to 0.01",
                "two lumps have 0.0001125", "There is nothing for: welds, immovable", "Models",
                "light-links  changed", "rod\n"});
  EXPECT_EQ(FilesIn("."), before);
  EXPECT_EQ(Call("simplify light-rod-compressor.json --list").text, listed.text);
  std::istringstream lines(listed.text);
  for (std::string line; std::getline(lines, line);) {
    const bool is_table = line.starts_with("  ") && line.find("   ") != line.npos;
    EXPECT_TRUE(!is_table || line.size() <= 100) << line;
  }
}

TEST_F(SimplifyTest, WritesModelsAnExperimentAndAPageThatWork) {
  Expect("simplify hall.json --out ladder --horizon 0.2", 0,
         {"ladder: written. loopbench run ladder/hall-models.json runs all of them."});
  EXPECT_EQ(FilesIn("ladder"),
            (std::vector<std::string>{"combined.json", "constant-parts.json", "full.json",
                                      "hall-models.json", "immovable.json", "islands-1.json",
                                      "islands-2.json", "models.md", "welds.json"}));
  EXPECT_EQ(FilesIn(".").size(), 7u) << "nothing is left beside it";
  const Experiment experiment = ReadExperiment(folder_ / "ladder/hall-models.json");
  EXPECT_EQ(experiment.name, "hall-models");
  ASSERT_EQ(experiment.problems.size(), 7u);
  EXPECT_EQ(experiment.problems[0].name, "hall");
  EXPECT_EQ(experiment.problems[1].name, "hall-welds");
  for (const ExperimentProblem& problem : experiment.problems) {
    EXPECT_EQ(problem.horizons, std::vector<double>{0.2});
  }
  EXPECT_FALSE(experiment.compile.welds) << "the whole model would not be whole";
  Expect("check ladder/full.json ladder/combined.json ladder/hall-models.json", 0);
  Expect(
      "run ladder/hall-models.json --no-timing --filter formulation=odca --out out "
      "--fail-on warnings",
      0, {"ran 14 cases", "hall-combined"});
  ExpectWords(
      ReadFile(folder_ / "ladder/models.md"),
      {"loopbench simplify hall.json --out ladder --horizon 0.2", "| islands-2.json | the same |",
       "- body hook is removed; its points: root on load, tip on load",
       "- body \"left\": cannot move, fixed to \"ground\""});
}

TEST_F(SimplifyTest, BodiesJointsAndPointsKeepTheirNames) {
  Expect("simplify light-rod-compressor.json --only light-links --out one", 0);
  EXPECT_EQ(FilesIn("one"),
            (std::vector<std::string>{"full.json", "light-links.json",
                                      "light-rod-compressor-models.json", "models.md"}));
  const MechanismDescription model = ReadMechanism(folder_ / "one/light-links.json").description;
  ASSERT_EQ(model.bodies.size(), 3u);
  EXPECT_EQ(model.bodies[1].name, "crank");
  EXPECT_TRUE(model.bodies[1].points.contains("rod.A"));
  EXPECT_EQ(model.joints.back().name, "rod");
  EXPECT_EQ(model.joints.back().type, JointType::kRod);
  EXPECT_EQ(model.joints.back().parameter, 0.15);
  EXPECT_NEAR(model.bodies[1].mass + model.bodies[2].mass, 2.42, 1e-12) << "no mass is lost";
}

TEST_F(SimplifyTest, LimitsAreSaidByName) {
  Expect("simplify --help", 0,
         {"constant-parts=0.001, stiff-springs=30, light-links=0.01, nearly-planar=0.05",
          "links of small mass become massless rods", "--out", "BODY.POINT"});
  Expect("simplify hall.json --trial-duration 0 --only constant-parts", 0,
         {"Does not apply: there was no trial run"});
  Expect("simplify light-rod-compressor.json --threshold light-links=0.001", 0,
         {"0.00138  no", "taken up to 0.001", "cannot be simplified: no rule applies"});
  Expect("simplify excavator-arm.json --only stiff-springs", 0, {"10.6    no"});
  Expect("simplify excavator-arm.json --only stiff-springs --threshold stiff-springs=10", 0,
         {"10.6    yes", "taken from 10"});
  Expect("simplify light-rod-compressor.json --lump-mass none --only light-links", 0,
         {"0.02 kg removed"});
}

TEST_F(SimplifyTest, ErrorsAreDistancesOfPointsFromTheWholeModel) {
  const Ending both = Call("simplify hall.json --only welds,light-links --verify 0.5 --out off");
  ExpectEnding(both, 0, {"model error [m]", "evaluations", "welds  the same"});
  // exact to what steps in 1e-10 leave; the first digits are the compiler's
  EXPECT_TRUE(std::regex_search(both.text, std::regex("welds  the same .* \\d\\.\\de-1[0-9]  ")))
      << both.text;
  const Ending wrong = Call(
      "simplify hall.json --only light-links --threshold light-links=0.5 --lump-mass none --verify "
      "0.5");
  EXPECT_TRUE(
      std::regex_search(wrong.text, std::regex("light-links  changed .* \\d\\.\\de-0[123]  ")))
      << wrong.text;
  ExpectWords(ReadFile(folder_ / "off/models.md"), {"*model error*: the largest distance"});
}

TEST_F(SimplifyTest, TheWholeModelMaySayItsAssembledStart) {
  Expect("simplify four-bar.json --assembled --out start", 0,
         {"cannot be simplified", "start: written"});
  EXPECT_EQ(FilesIn("start"),
            (std::vector<std::string>{"four-bar-models.json", "full.json", "models.md"}));
  const InitialDescription said = ReadMechanism(folder_ / "start/full.json").description.initial;
  EXPECT_EQ(said.coordinates.size(), 3u);
  EXPECT_EQ(said.speeds.size(), 3u);
  Expect("check start/full.json", 0);
}

TEST_F(SimplifyTest, RefusesWhatItCannotDoAndSaysWhatItExpected) {
  for (const auto& [arguments, words] : std::map<std::string, std::string>{
           {"light-rod-compressor.json --only light-link",
            "--only light-link: found \"light-link\", expected one of welds, immovable, "
            "redundancy, "
            "planar, constant-parts, stiff-springs, light-links, nearly-planar, islands (did you "
            "mean \"light-links\"?)"},
           {"hall.json --threshold welds=1", "found a limit, expected none: welds has none"},
           {"hall.json --threshold light-links", "found no \"=\", expected NAME=VALUE"},
           {"hall.json --threshold light-links=-1", "found \"-1\", expected a number > 0"},
           {"hall.json --threshold light-links=nan", "found \"nan\", expected a number > 0"},
           {"hall.json --lump-mass all", "--lump-mass"},
           {"hall.json --list --out x", "--out"},
           {"missing.json", "missing.json"},
           {"tiny.json --out x", "tiny.json"},
           {"four-bar.json --out x", "found nothing to simplify"}}) {
    Expect("simplify " + arguments, 2, {words});
  }
  EditMechanism("[1.5, 0.0]", "[9.5, 0.0]");  // the second ground pin is out of reach
  Expect("simplify four-bar.json --out x", 2, {"its initial assembly fails"});
  EXPECT_FALSE(fs::exists(folder_ / "x"));
}

TEST_F(SimplifyTest, AFolderWithFilesIsRefusedUnlessForced) {
  Write("ladder/notes.txt", "mine");
  Write("ladder/full.json", "old");
  Expect("simplify hall.json --out ladder", 2,
         {"ladder: found a folder with files, expected a new one; --force"});
  EXPECT_EQ(FilesIn("ladder"), (std::vector<std::string>{"full.json", "notes.txt"}));
  EXPECT_EQ(ReadFile(folder_ / "ladder/full.json"), "old");
  Expect("simplify hall.json --out ladder --force", 0, {"written"});
  EXPECT_EQ(ReadFile(folder_ / "ladder/notes.txt"), "mine");
  EXPECT_EQ(ReadMechanism(folder_ / "ladder/full.json").description.name, "hall");
  EXPECT_EQ(FilesIn("ladder").size(), 10u);
  fs::create_directory(folder_ / "empty");
  Expect("simplify hall.json --out empty/", 0, {"written"});
}

TEST_F(SimplifyTest, WhatCannotBeWrittenLeavesNothing) {
  Write("file", "");
  Expect("simplify hall.json --out file/ladder", 2, {"file"});
  Expect("simplify hall.json --out file", 2, {"file"});
  EXPECT_EQ(ReadFile(folder_ / "file"), "");
}

/// With each number rounded to nine digits: the last ones are the compiler's.
std::string Rounded(const std::string& text) {
  static const std::regex number(R"(-?\d+\.?\d*(?:e[-+]?\d+)?)");
  std::string rounded;
  auto last = text.begin();
  for (auto it = std::sregex_iterator(text.begin(), text.end(), number);
       it != std::sregex_iterator(); ++it) {
    rounded.append(last, (*it)[0].first);
    char digits[40];
    const double value = std::strtod(it->str().c_str(), nullptr);
    // and what rounding leaves of a zero
    std::snprintf(digits, sizeof digits, "%.9g", std::abs(value) < 1e-12 ? 0.0 : value);
    rounded += digits;
    last = (*it)[0].second;
  }
  rounded.append(last, text.end());
  return rounded;
}

/// models.md contains the command that wrote it.
std::string CommandIn(const fs::path& page) {
  const std::string text = ReadFile(page);
  const std::size_t begin = text.find("`loopbench ") + std::string("`loopbench ").size();
  return text.substr(begin, text.find('`', begin) - begin);
}

TEST(ShippedLadders, AreWhatTheirCommandsWrite) {
  const fs::path fresh = fs::path(testing::TempDir()) / "loopbench-shipped-ladders";
  const bool renew = std::getenv("LOOPBENCH_RENEW_EXPECTED") != nullptr;
  int ladders = 0;
  for (const auto& entry : fs::directory_iterator(kModels)) {
    if (!entry.is_directory()) continue;
    ++ladders;
    fs::remove_all(fresh);
    const std::string command = CommandIn(entry.path() / "models.md");
    const std::string out = " --out configs/experiments/models/";
    const std::size_t to = command.find(out);
    ASSERT_NE(to, command.npos) << entry.path();
    const auto call = [&](const std::string& arguments) {
      return std::system(
          ("cd '" + kRoot.string() + "' && '" LOOPBENCH_BINARY "' " + arguments + " > /dev/null")
              .c_str());
    };
    if (renew) {
      EXPECT_EQ(call(command + " --force"), 0) << command;
      continue;
    }
    ASSERT_EQ(call(command.substr(0, to) + " --out '" + fresh.string() + "'"), 0) << command;
    for (const auto& file : fs::directory_iterator(fresh)) {
      const fs::path committed = entry.path() / file.path().filename();
      ASSERT_TRUE(fs::exists(committed)) << committed << ": see the first lines of " << __FILE__;
      if (file.path().extension() != ".json") continue;  // it says the command, with its folder
      EXPECT_EQ(Rounded(ReadFile(committed)), Rounded(ReadFile(file.path())))
          << committed << ": see the first lines of " << __FILE__;
    }
    EXPECT_EQ(NamesIn(entry.path()), NamesIn(fresh)) << entry.path();
  }
  EXPECT_GE(ladders, 6);
  fs::remove_all(fresh);
}

TEST(ShippedLadders, HaveAModelBesideThem) {
  for (const auto& entry : fs::directory_iterator(kModels)) {
    if (entry.is_directory()) continue;
    EXPECT_EQ(ReadMechanism(entry.path()).description.name, entry.path().stem().string());
    EXPECT_TRUE(fs::is_directory(kModels / entry.path().stem())) << entry.path();
  }
}

#ifdef LOOPBENCH_PRECISIONS

TEST_F(SimplifyTest, JudgesEachModelByTheErrorItCausesAndKeepsARecord) {
  // half a second of the compressor: its massless rod is off by micrometres
  const std::string judge =
      "simplify light-rod-compressor.json --verify 0.5 --store s --max-model-error ";
  Expect(judge + "1e-3", 0,
         {"Compared with the certified motion of the full model", "full model",
          "accepted at 0.001 m", "2 records in s/results.jsonl"});
  Expect(judge + "1e-9", 0, {"rejected at 1e-09 m"});
  const std::vector<Record> records = ReadRecords(folder_ / "s");
  ASSERT_EQ(records.size(), 4u);
  const Record &whole = records[0], &rod = records[1];
  EXPECT_EQ(whole.Text("model"), "full");
  EXPECT_EQ(rod.Text("model"), "light-links");
  EXPECT_EQ(rod.Number("model_error"), records[3].Number("model_error")) << "as certain as that";
  EXPECT_GT(rod.Number("model_error"), 1e6 * rod.Number("reference_error"));
  EXPECT_LT(rod.Number("model_error"), 1e-3);
  EXPECT_EQ(rod.Number("reference_valid_until"), 0.5);
  EXPECT_DOUBLE_EQ(rod.Number("model_rhs_ratio"),
                   rod.Number("rhs_evaluations") / whole.Number("rhs_evaluations"));
  EXPECT_GT(rod.Number("model_wall_ratio"), 0.0);
  Expect(
      "table s --kind models --where 'model_error>1e-9' --format csv --columns "
      "model,model_error,model_accepts,model_verdict,model_wall_ratio",
      0, {"light-links,", "rejected at 1e-09 m"});
  Expect("table s --format latex", 0, {"light-links"});
}

TEST_F(SimplifyTest, ExactModelsCauseNothing) {
  // the hall's portal is made ground: its points stay where they are
  Expect("simplify hall.json --verify 0.2 --max-model-error 1e-12 --store s", 0);
  std::size_t exact = 0;
  for (const Record& record : ReadRecords(folder_ / "s")) {
    if (record.Text("model_motion") != "the same" || record.Text("model") == "full") continue;
    EXPECT_LE(record.Number("model_error"), 1e-13) << record.Text("model");  // lengths of some m
    EXPECT_EQ(record.Text("model_verdict"), "accepted at 1e-12 m") << record.Text("model");
    ++exact;
  }
  EXPECT_GE(exact, 4u) << "welds, immovable and two islands";
}

TEST_F(SimplifyTest, AsksForWhatAVerdictNeeds) {
  Expect("simplify hall.json --store s", 2, {"--store requires --max-model-error"});
  Expect("simplify hall.json --store s --max-model-error 1e-3", 2, {"requires --verify"});
  Expect("simplify hall.json --verify 1 --max-model-error nan --store s", 2, {"--max-model-error"});
  EXPECT_FALSE(fs::exists(folder_ / "s"));
}

#endif

}  // namespace loopbench::harness::cli_simplify_test
