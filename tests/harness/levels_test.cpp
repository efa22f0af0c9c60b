// Levels of enforcement by name: those that come with Loopbench, and two that a program adds.
#include "examples/own-parts/half_velocity.h"
#include "harness/cli/commands.h"
#include "harness/figures/figures.h"
#include "harness/judge/analysis.h"
#include "harness/suite/suite.h"
#include "lagrange/lagrange.h"
#include "mechanism/formulation/level.h"
#include "tests/harness/in_child.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::levels_test {

using Names = std::vector<std::string>;

LevelRow Half() { return own::HalfVelocityRow(); }

/// Feedback with gains of its own.
template <class Space, class S>
class Spring final : public Level<Space, S> {
 public:
  Spring(const Mechanism<Space, S>& mechanism, const FormulationOptions&)
      : feedback_(VectorX<S>::Zero(mechanism.num_rows())) {
    this->gains_ = {3.0, 4.0};
  }
  const VectorX<S>& Feedback(const Kinematics<Space, S>& kinematics) override {
    feedback_.setZero();
    AddFeedback(kinematics, this->gains_, feedback_);
    return feedback_;
  }

 private:
  VectorX<S> feedback_;
};

LevelRow Feedback(bool has_derivative = true) {
  return LevelRowOf<Spring>({.name = "spring",
                             .sentence = "as acceleration, with a spring.",
                             .growth = DriftGrowth::kForgotten,
                             .has_derivative = has_derivative});
}

/// The four-bar at these levels, as JSON.
std::string Text(const std::string& levels, const std::string& more = "") {
  return R"({"name": "own", "tolerances": 1e-6, "timing": {"repeats": 0},
      "problems": [{"mechanism": ")" +
         (kConfigs / "mechanisms/four-bar.json").string() + R"(", "horizon": 1}],
      "methods": [{"formulation": "lagrange", "enforcement": [)" +
         levels + "]}]" + more + "}";
}
Experiment Asking(const std::string& levels, const std::string& more = "") {
  return ParseExperiment(Text(levels, more), kConfigs / "experiments/own.json");
}
std::string MistakeOf(const std::string& levels, const std::string& more = "") {
  try {
    CheckLadders(Asking(levels, more));
  } catch (const ConfigError& mistake) {
    return mistake.what();
  }
  return "none";
}

std::vector<Record> RecordsOf(const Experiment& experiment) {
  std::vector<Record> records;
  for (const Case& one : Expand(experiment)) records.push_back(RunCase(experiment, one));
  for (const Record& record : records) {
    EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  }
  return records;
}

TEST(LevelsTest, ThoseBuiltInAreKnownInTheirOrder) {
  EXPECT_EQ(LevelNames(), (Names{"acceleration", "velocity", "projection", "baumgarte"}));
  for (const LevelTraits& level : Levels()) {
    const auto found = FindLevel(level.name);
    ASSERT_TRUE(found);
    EXPECT_EQ(&TraitsOf(*found), &level);
    EXPECT_TRUE(IsBuiltIn(*found) && level.has_derivative) << level.name;
    EXPECT_TRUE(level.sentence.ends_with('.')) << level.sentence;
  }
  EXPECT_EQ(FindLevel("half-velocity"), std::nullopt);
  ExpectPart(MistakeOf("\"half-velocity\""), "expected a level of enforcement: \"acceleration\"");
}

TEST(LevelsTest, ARowThatCannotBeIsRefused) {
  const auto refusal = [](LevelRow row) {
    return RefusalOf([&] { RegisterLevel(std::move(row)); });
  };
  LevelRow row = Half();
  row.traits.name = "velocity";
  EXPECT_EQ(refusal(row), "level \"velocity\": found it again, expected each name once");
  for (const char* name : {"", "Half", "half velocity", "-half"}) {
    row.traits.name = name;
    ExpectPart(refusal(row), "found no word, expected a-z, 0-9, '-' and '_'");
  }
  row = Half();
  row.traits.sentence.clear();
  ExpectPart(refusal(row), "level \"half-velocity\": found no sentence, expected");
  row = Half();
  row.planar = nullptr;
  ExpectPart(refusal(row), "level \"half-velocity\": found no factory, expected");
  ExpectPart(RefusalOf([] { RegisterLevel(Half(), EIGEN_MAX_STATIC_ALIGN_BYTES + 16); }),
             "found EIGEN_MAX_STATIC_ALIGN_BYTES=");
  EXPECT_EQ(Levels().size(), 4u);
}

TEST(LevelsTest, ANewNameIsValidWhereverTheOthersAre) {
  InChild([] {
    const Enforcement half = RegisterLevel(Half()), spring = RegisterLevel(Feedback());
    EXPECT_EQ(ToString(half), "half-velocity");
    EXPECT_EQ(TraitsOf(spring).abbreviation, "spring");
    EXPECT_FALSE(IsBuiltIn(half));
    FormulationRow row = Row<lagrange::Lagrange>("some", "with one level.");
    EXPECT_TRUE(row.Has(half));
    row.levels = {spring};
    EXPECT_FALSE(row.Has(half));

    const std::vector<Record> records =
        RecordsOf(Asking(R"("acceleration", "half-velocity", "velocity")"));
    ASSERT_EQ(records.size(), 3u);
    const Record &plain = records[0], &own = records[1], &velocity = records[2];
    EXPECT_EQ(own.Text("enforcement"), "half-velocity");
    // half of the speeds' drift is mended, and positions follow them
    const auto ratio = [&](const char* key) { return own.Number(key) / plain.Number(key); };
    EXPECT_NEAR(ratio("drift_velocity_max"), 0.5, 0.05);
    EXPECT_NEAR(ratio("drift_position_max"), 0.5, 0.2);
    EXPECT_GT(own.Number("drift_velocity_max"), 100 * velocity.Number("drift_velocity_max"));
    EXPECT_EQ(own.Text("warnings"), "");
    EXPECT_EQ(GrowthAt(own), DriftGrowth::kSquare);

    const Figure figure = DriftFigure(records);
    ASSERT_EQ(figure.curves.size(), 3u);
    for (const int other : {0, 2}) {
      EXPECT_NE(figure.curves[1].style.dash, figure.curves[other].style.dash);
    }
    std::string schema = SchemaOfKind("experiment");
    std::erase_if(schema, [](char c) { return c == ' ' || c == '\n'; });
    ExpectPart(schema, R"("velocity","projection","baumgarte","half-velocity","spring"])");
  });
}

TEST(LevelsTest, TheProgramKnowsItInAllCommands) {
  InChild([] {
    RegisterLevel(Half());
    const auto folder = std::filesystem::path(testing::TempDir()) / "loopbench-levels";
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const std::string file = folder / "own.json", out = folder / "out";
    WriteFileAtomically(file, Text(R"("velocity", "half-velocity")"));
    ExpectPart(Printed({"explain", file}), "half-velocity: half of the violation of the speeds");
    ExpectPart(Printed({"run", file, "--out", out}), "half");
    ExpectPart(Printed({"table", out, "--where", "enforcement=half-velocity", "--format", "csv"}),
               "lagrange,half-velocity,joint");
    WriteFileAtomically(folder / "map.json", R"({"title": "Own",
      "methods": [{"label": "half", "select": {"enforcement": "half-velocity"}}],
      "groups": [{"label": "all", "rows": [{"label": "four-bar", "select": {"mechanism": "four-bar"},
        "criteria": [{"measure": "drift_position_max", "limit": 1}]}]}]})");
    ExpectPart(Printed({"robustness", out, "--rules", folder / "map.json"}), "holds");
    std::filesystem::remove_all(folder);
  });
}

TEST(LevelsTest, ADerivativeIsThatOfTheGains) {
  InChild([] {
    RegisterLevel(Feedback());
    Experiment experiment = Asking(R"("spring", "baumgarte")", R"(, "integrator": "trbdf2")");
    experiment.methods[1].gains = {3.0, 4.0};
    const std::vector<Record> records = RecordsOf(experiment);
    EXPECT_EQ(records[0].Text("state_hash"), records[1].Text("state_hash"));
    EXPECT_EQ(records[0].Number("newton_failures"), records[1].Number("newton_failures"));
  });
}

TEST(LevelsTest, WithoutADerivativeImplicitProfilesMakeDifferenceQuotients) {
  InChild([] {
    const Enforcement half = RegisterLevel(Half());
    const std::string implicit = R"(, "integrator": "trbdf2")";
    EXPECT_EQ(MistakeOf("\"half-velocity\""), "none");
    EXPECT_EQ(MistakeOf("\"velocity\"", implicit), "none");
    const std::string mistake = MistakeOf("\"half-velocity\"", implicit);
    ExpectPart(mistake, "/integrator: found \"trbdf2\" at level \"half-velocity\", which has no");
    ExpectPart(mistake, R"(expected "jacobian": "finite-difference" beside it)");
    RecordsOf(Asking("\"half-velocity\"", implicit + R"(, "jacobian": "finite-difference")"));

    const MechanismFile file = ReadMechanism(kConfigs / "mechanisms/four-bar.json");
    const Mechanism<Planar, double> mechanism(file.description, Coordinates::kJoint);
    const auto system = MakeSystem<lagrange::Lagrange>(mechanism, {.enforcement = half});
    EXPECT_EQ(RefusalOf([&] { ForwardJacobian<Planar>(file.description, *system); }),
              "level \"half-velocity\": found a forward Jacobian, expected difference quotients: "
              "no derivative");
  });
}

TEST(LevelsTest, RunsInSeveralScalarsKnowTheBuiltInOnes) {
  InChild([] {
    RegisterLevel(Half());
    const std::string mistake =
        MistakeOf("\"half-velocity\"", R"(, "precision": {"scalars": ["float", "double"]})");
    ExpectPart(mistake, "found lagrange/half-velocity/joint/rank-revealing");
    ExpectPart(mistake, "expected methods at levels that come with Loopbench");
  });
}

}  // namespace loopbench::harness::levels_test
