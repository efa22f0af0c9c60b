// Advice: what it recommends keeps what was asked for, it says so where nothing does, and the
// command line with what it writes.
#include "harness/suite/advise.h"

#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "tests/harness/cli_fixture.h"
#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#include "tests/reference/cases.h"
#endif

namespace loopbench::harness::advise_test {

/// Times and errors by a law: methods of orders 3 to 8, in formulations that differ in cost. The
/// first run of a choice is disturbed.
class LawfulBench final : public TrialBench {
 public:
  Trial Try(const Choice& choice, double) override {
    Trial trial;
    trial.choice = choice;
    tried.push_back(choice);
    if (fails) {
      trial.outcome = Outcome::kSingular;
      return trial;
    }
    const double order = OrderOf(choice);
    trial.wall_s = (1.0 + 0.8 * (++tries_ % 3)) * WallOf(choice);
    trial.error = choice.step > 0.0 ? 1e3 * std::pow(choice.step, order) : 10 * choice.rtol;
    trial.rhs_evaluations = 100;
    return trial;
  }
  void Remeasure(Trial* trial) override {
    trial->wall_s = std::min(trial->wall_s, WallOf(trial->choice));
  }
  std::vector<Choice> tried;
  bool fails = false;
  /// The least error of any way within so many seconds, tolerances only.
  static double BestWithin(double wall_s) {
    double best = 1.0;
    for (const std::string& profile : ProfileNames()) {
      const double order = OrderOf({.method = {}, .integrator = profile});
      best = std::min(best, 10 * std::pow(kUnit_s / wall_s, order));
    }
    return best;
  }

 private:
  static constexpr double kUnit_s = 2e-5;
  static double OrderOf(const Choice& choice) {
    const std::vector<std::string> names = ProfileNames();
    return 3.0 +
           static_cast<double>((std::ranges::find(names, choice.integrator) - names.begin()) % 6);
  }
  static double WallOf(const Choice& choice) {
    const double dear = choice.method.formulation == "lagrange" ? 1.0 : 1.5;
    if (choice.step > 0.0) return dear * 3 * kUnit_s / choice.step;
    return dear * kUnit_s * std::pow(choice.rtol, -1 / OrderOf(choice));
  }
  int tries_ = 0;
};

TEST(AdviceByLaw, SpendsTheWholeBudgetWhateverTheOrder) {
  for (const double budget : {1e-4, 3e-4, 1e-3}) {
    LawfulBench bench;
    const Advice advice =
        Advise({.error = {}, .budget = budget, .cpu_s = 60.0}, bench, 1.0, 1.0, [](Trial&) {});
    ASSERT_TRUE(advice.reached);
    const Trial& best = advice.finalists.front();
    EXPECT_LE(best.wall_s, budget);
    // 0.94 of the budget at order 8 is an error 1.64 times the least, and tolerances have two
    // digits
    EXPECT_LE(best.error, 1.8 * LawfulBench::BestWithin(budget)) << ToString(best.choice);
  }
}

TEST(AdviceByLaw, RepeatsNoTrial) {
  // a tiny budget leads to the largest step, a tiny error and failures to the smallest tolerance
  for (const auto& [request, fails] :
       std::vector<std::pair<AdviceRequest, bool>>{{{.error = {}, .budget = 1e-12}, false},
                                                   {{.error = {}, .budget = 1e-12}, true},
                                                   {{.error = {}, .budget = 1e-2}, false},
                                                   {{.error = 1e-30, .budget = {}}, false},
                                                   {{.error = 1e-6, .budget = {}}, true}}) {
    LawfulBench bench;
    bench.fails = fails;
    Advise(request, bench, 1.0, 1.0, [](Trial&) {});
    const std::size_t num_formulations = 3;  // they are compared first
    const auto tried = std::span(bench.tried).subspan(num_formulations);
    for (const Choice& choice : tried) {
      EXPECT_EQ(std::ranges::count(tried, choice), 1) << ToString(choice);
    }
    EXPECT_GT(tried.size(), 20u);
  }
}

#ifdef LOOPBENCH_PRECISIONS

class AdviceTest : public testing::Test {
 protected:
  void Load(const std::string& name, double horizon) {
    file_ = ReadMechanism(kConfigs / "mechanisms" / (name + ".json"));
    horizon_ = horizon;
    reference_ = MakeReference(file_.description, horizon, LinkLength(file_.description),
                               {.scalar = "long-double", .points = 21, .cpu_s = 20.0});
    ASSERT_EQ(reference_.trust_horizon, horizon);
  }
  Advice Ask(const AdviceRequest& request) {
    const TrialProblem problem{file_.description, reference_, horizon_, {}};
    const auto bench = MakeTrialBench(problem);
    return Advise(request, *bench, horizon_, LinkLength(file_.description), [](Trial&) {});
  }

  MechanismFile file_;
  double horizon_ = 0.0;
  Reference reference_;
};

TEST_F(AdviceTest, KeepsTheErrorInARunOfItsOwn) {
  for (const char* name : {"four-bar", "bennett"}) {
    Load(name, 1.0);
    for (const double error : {1e-3, 1e-7}) {
      const Advice advice = Ask({.error = error, .budget = {}, .cpu_s = 60.0});
      ASSERT_TRUE(advice.reached) << name << " " << error;
      const Trial& best = advice.finalists.front();
      EXPECT_LE(best.error, kErrorShare * error);
      const Experiment experiment = reference::Single(file_);
      Case one = reference::CaseOf(experiment, file_.description.name, best.choice.method,
                                   best.choice.rtol, horizon_);
      one.integrator = best.choice.integrator;
      const Record record = RunCase(experiment, one, &reference_);
      EXPECT_EQ(record.Number("error_position_max"), best.error) << ToString(best.choice);
      // what was looked at covers every explicit method at every level
      EXPECT_GE(advice.looked_at.size(), 21u);
    }
  }
}

TEST_F(AdviceTest, SaysThatNothingReachedIt) {
  Load("four-bar", 0.3);
  const Advice advice = Ask({.error = 1e-16, .budget = {}, .cpu_s = 60.0});
  EXPECT_FALSE(advice.reached);
  ASSERT_FALSE(advice.finalists.empty());
  // the nearest first
  EXPECT_LT(advice.finalists.front().error, 1e-11);
  EXPECT_FALSE(Ask({.error = {}, .budget = 1e-9, .cpu_s = 60.0}).reached);
}

TEST_F(AdviceTest, SpendsABudgetOnAccuracy) {
  Load("four-bar", 0.3);
  // a hundredth of a second for each is far more than round-off takes here on any machine
  const Advice advice = Ask({.error = {}, .budget = 0.01, .cpu_s = 60.0});
  ASSERT_TRUE(advice.reached);
  EXPECT_LT(advice.finalists.front().error, 1e-9);
}

TEST_F(AdviceTest, SweepTriesTheWholeProduct) {
  Load("pendulum", 0.5);
  const TrialProblem problem{file_.description, reference_, horizon_, {}};
  const auto bench = MakeTrialBench(problem);
  const Advice sweep =
      Sweep({.error = 1e-6, .budget = {}, .cpu_s = 60.0}, *bench, horizon_, 1.0, [](Trial&) {});
  EXPECT_TRUE(sweep.reached);
  // 3 formulations, 3 levels, 2 coordinate sets, 12 profiles, 13 tolerances
  EXPECT_EQ(sweep.trials, 3 * 3 * 2 * static_cast<int>(ProfileNames().size()) * 13);
}

TEST_F(AdviceTest, FlaggedWaysAreNoAdvice) {
  Load("four-bar", 1.0);
  const TrialProblem problem{file_.description, reference_, horizon_, {}};
  const auto bench = MakeTrialBench(problem);
  int asked = 0;
  const Advice advice =
      Advise({.error = 1e-5, .budget = {}, .cpu_s = 60.0}, *bench, horizon_, 1.0,
             [&](Trial& trial) { trial.warnings = ++asked == 1 ? "energy" : ""; });
  ASSERT_GE(advice.finalists.size(), 2u);
  EXPECT_EQ(advice.finalists[0].warnings, "");
  EXPECT_EQ(advice.finalists[1].warnings, "energy");
}

TEST(AdviceByLaw, KeepsAMarginInARunWithAllObserversToo) {
  LawfulBench bench;
  const AdviceRequest request{.error = 1e-5, .budget = {}, .cpu_s = 60.0};
  int asked = 0;
  const Advice advice = Advise(request, bench, 1.0, 1.0, [&](Trial& trial) {
    EXPECT_LE(trial.error, kErrorShare * 1e-5);
    if (++asked == 1) trial.error = 0.9e-5;  // less than requested, with no margin
  });
  ASSERT_TRUE(advice.reached);
  EXPECT_EQ(asked, 2);
  EXPECT_LE(advice.finalists.front().error, kErrorShare * 1e-5);
  const Advice none = Advise(request, bench, 1.0, 1.0, [](Trial& trial) { trial.error = 0.9e-5; });
  EXPECT_FALSE(none.reached);
}

TEST_F(CommandLineTest, AdviceIsPrintedAndWritten) {
  const Ending ending = Call("advise four-bar.json --max-error 1e-5 --horizon 1 --out best.json");
  EXPECT_EQ(ending.code, 0) << ending.text;
  for (const char* words :
       {"Recommended: ", "Runner-up", "Dominant error", "reference: long-double"}) {
    EXPECT_NE(ending.text.find(words), std::string::npos) << words << "\n" << ending.text;
  }
  EXPECT_EQ(Call("check best.json").code, 0);
  const Ending run = Call("run best.json --out best --fail-on warnings --no-timing");
  EXPECT_EQ(run.code, 0) << run.text;
  // a point of its own, and a table for programs
  const Ending csv =
      Call("advise four-bar.json --max-error 1e-5 --horizon 1 --points bar2.B --format csv");
  EXPECT_EQ(csv.text.substr(0, 12), "formulation,") << csv.text;
  EXPECT_EQ(Call("advise four-bar.json --budget 1e-9 --horizon 1").code, 1);
}

TEST_F(CommandLineTest, AdviceRefusesWhatItCannotGive) {
  const Ending point = Call("advise four-bar.json --points bar9.X");
  EXPECT_EQ(point.code, 2);
  ExpectWords(point.text, {"found \"bar9.X\", expected BODY"});
  EXPECT_EQ(Call("advise four-bar.json --max-error 1e-3 --budget 1").code, 2);
  EXPECT_EQ(Call("advise four-bar.json --max-error -1").code, 2);
  EXPECT_EQ(Call("advise nothing.json").code, 2);
}

/// A parallelogram of bars of `crank` and `ground`, whose first turn is at `speed`: it passes its
/// flat positions, near which references are certified less far.
std::string Parallelogram(double ground, double crank, double angle, double speed) {
  const auto bar = [](const char* name, double length) {
    return fmt::format(
        R"({{"name": "{0}", "mass": 1, "inertia": {1}, "com": [{2}, 0],
        "points": {{"A": [0, 0], "B": [{3}, 0]}}}})",
        name, length * length / 12, length / 2, length);
  };
  const auto pin = [](const char* name, const char* from, const char* at, const char* to,
                      const char* point) {
    return fmt::format(
        R"({{"name": "{}", "type": "revolute", "from": {{"body": "{}", "at": "{}"}},
        "to": {{"body": "{}", "at": "{}"}}}})",
        name, from, at, to, point);
  };
  return fmt::format(
      R"({{"name": "parallelogram", "gravity": [0, -9.81],
      "ground": {{"points": {{"O": [0, 0], "C": [{}, 0]}}}}, "bodies": [{}, {}, {}],
      "joints": [{}, {}, {}, {}],
      "initial": {{"coordinates": {{"O": {}, "A": {}, "C": {}}}, "fixed": ["O"], "speeds": {{"O": {}}}}}}})",
      ground, bar("crank", crank), bar("coupler", ground), bar("rocker", crank),
      pin("O", "ground", "O", "crank", "A"), pin("A", "crank", "B", "coupler", "A"),
      pin("C", "ground", "C", "rocker", "A"), pin("B", "coupler", "B", "rocker", "B"), angle,
      -angle, angle, speed);
}

TEST_F(CommandLineTest, TheExperimentOfAnAdviceHasItsErrorOverItsTime) {
  for (const auto& [ground, crank, angle, speed] :
       {std::array{2.0, 1.0, 0.5, 8.0}, std::array{1.3, 0.7, -0.4, 5.0}}) {
    Write("flat.json", Parallelogram(ground, crank, angle, speed));
    const Ending ending = Call(
        "advise flat.json --max-error 1e-4 --horizon 3 --cpu-limit 20 --format json --out "
        "best.json");
    ASSERT_EQ(ending.code, 0) << ending.text;
    const std::string key = "\"error_position_max\":";
    const std::size_t at = ending.text.find(key);
    ASSERT_NE(at, std::string::npos) << ending.text;
    const double claimed = std::stod(ending.text.substr(at + key.size()));
    EXPECT_LE(claimed, kErrorShare * 1e-4);
    fs::remove_all(folder_ / "best");
    ASSERT_EQ(Call("run best.json --out best --no-timing").code, 0);
    const std::vector<Record> records = ReadRecords(folder_ / "best");
    const auto run = std::ranges::find_if(
        records, [](const Record& record) { return record.Text("kind") == "accuracy"; });
    ASSERT_NE(run, records.end());
    EXPECT_EQ(run->Number("reference_valid_until"), run->Number("horizon"));
    EXPECT_EQ(run->Number("error_position_max"), claimed);
  }
}

TEST_F(CommandLineTest, ThereIsNoAdviceForWhatDoesNotMove) {
  Write("rest.json", R"({"name": "rest", "gravity": [0, 0], "bodies": [
    {"name": "disc", "mass": 1, "inertia": 0.1, "points": {"rim": [0.5, 0]}}],
    "joints": [{"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "disc"}}]})");
  Expect("advise rest.json --max-error 1e-5 --horizon 1", 2, {"no joint moves"});
  // an upright pendulum leaves its position only by the rounding of its angle
  Write("upright.json", R"({"name": "upright", "gravity": [0, -9.81], "bodies": [
    {"name": "bar", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}], "joints": [
    {"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "bar"}}],
    "initial": {"coordinates": {"O": 1.5707963267948966}}})");
  Expect("advise upright.json --horizon 4", 2, {"less than the error bound of 1e-06 m"});
  // it turns, and its centre of mass stays where it is
  Write("disc.json", R"({"name": "disc", "gravity": [0, 0], "bodies": [
    {"name": "disc", "mass": 1, "inertia": 0.1, "points": {"rim": [0.5, 0]}}],
    "joints": [{"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "disc"}}],
    "initial": {"speeds": {"O": 1.0}}})");
  Expect("advise disc.json --max-error 1e-5 --horizon 1 --points disc", 2,
         {"none of the measured points moves", "--points"});
  Expect("advise disc.json --max-error 1e-5 --horizon 1 --points disc.rim", 0, {"Recommended"});
}

TEST_F(CommandLineTest, AdviceTimesGeneratedCode) {
  ExpectEnding(
      Call("advise four-bar.json --max-error 1e-5 --horizon 1 --generated"), 0,
      {"Generated code with the same integrator, level and tolerance: ", "times the time"});
}

TEST_F(CommandLineTest, AdviceRefusesModelsWhoseErrorIsTooLarge) {
  const std::string model = (kConfigs / "experiments/models/light-rod-compressor.json").string();
  // the rod's mass moves it by 1e-4 m in a few seconds
  const Ending fine = Call("advise " + model + " --max-error 1e-7 --horizon 2 --simplify");
  ExpectWords(fine.text, {"rejected: its error is too large"});
  const Ending coarse = Call("advise " + model + " --max-error 1e-2 --horizon 2 --simplify");
  ExpectWords(coarse.text, {"light-links"});
  ExpectNone(coarse.text, {"rejected"});
}

#endif

}  // namespace loopbench::harness::advise_test
