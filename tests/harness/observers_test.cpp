// An observer that a program adds, and the keys that it writes.
#include "harness/judge/judge.h"
#include "harness/observers/registry.h"
#include "tests/harness/in_child.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::observers_test {

/// The largest speed, when, and how many states were seen.
template <class Space>
class Haste final : public Observer<Space> {
 public:
  explicit Haste(const Watched<Space>& run) : bodies_(run.mechanism.num_bodies() - 1) {}

  void Observe(const Sample<Space>& sample) override {
    const double speed = sample.formulation.u().cwiseAbs().maxCoeff();
    if (states_++ > 0 && speed <= largest_) return;
    largest_ = speed;
    when_ = sample.t;
  }
  void Write(Record& record) const override {
    if (states_ == 0) return;
    record.Set("speed_max", largest_);
    record.Set("speed_max_t", when_);
    record.Set("states_seen", states_);
    record.Set("bodies.moving", std::int64_t{bodies_});
  }

 private:
  int bodies_;
  std::int64_t states_ = 0;
  double largest_ = 0.0, when_ = 0.0;
};

using enum ValueType;

std::vector<Measure> Rows() {
  return {{"speed_max",
           kNumber,
           {"largest speed", "rad/s", Format::kScientific},
           {Merge::kLargest},
           Rule::kError},
          {"speed_max_t", kNumber, {"at time", "s", Format::kSeconds}, {Merge::kWith, "speed_max"}},
          {"states_seen", kNumber, {}, {Merge::kSum}},
          {"bodies.*", kNumber}};
}

ObserverRow Hasty(std::vector<Measure> measures = Rows()) {
  return ObserverRowOf<Haste>("haste", "the largest speed of a joint.", std::move(measures));
}

Record RunOf(const std::string& mechanism, bool islands) {
  Experiment experiment = reference::Single(reference::Shipped(mechanism));
  experiment.compile.islands = islands;
  const Case one = reference::CaseOf(experiment, mechanism, {}, 1e-6, 0.5);
  return RunCase(experiment, Identified(experiment, one));
}

TEST(ObserversTest, ItsKeysStandInRecordsAndTables) {
  InChild([] {
    RegisterObserver(Hasty());
    const auto folder = std::filesystem::path(testing::TempDir()) / "loopbench-observers";
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const std::string file = folder / "own.json", out = folder / "out";
    WriteFileAtomically(file, R"({"name": "own", "tolerances": 1e-6, "timing": {"repeats": 0},
      "problems": [{"mechanism": ")" +
                                  (kConfigs / "mechanisms/four-bar.json").string() +
                                  R"(", "horizon": 1}],
      "methods": [{"formulation": "odca", "enforcement": "acceleration"}]})");
    ExpectPart(Printed({"explain", file}), "  haste: the largest speed of a joint.\n");
    Printed({"run", file, "--out", out});
    const std::string csv = ReadFile(std::filesystem::path(out) / "drift.csv");
    ExpectPart(csv, ",message,speed_max,speed_max_t\n");
    ExpectPart(Printed({"table", out, "--columns", "mechanism,speed_max,states_seen"}),
               "largest speed [rad/s]");
    ExpectPart(Printed({"table", out, "--kind", "all", "--format", "csv"}), "bodies.moving");
    EXPECT_TRUE(IsReserved("speed_max"));
    EXPECT_TRUE(IsReserved("bodies.of_a_later_version"));
    std::filesystem::remove_all(folder);
  });
}

TEST(ObserversTest, PartsAreMergedByTheRulesOfItsKeys) {
  InChild([] {
    RegisterObserver(Hasty());
    const Record whole = RunOf("four-islands", false), parts = RunOf("four-islands", true);
    ASSERT_EQ(parts.Text("preprocessed"), "islands");
    EXPECT_NEAR(parts.Number("speed_max"), whole.Number("speed_max"), 1e-4);
    EXPECT_NEAR(parts.Number("speed_max_t"), whole.Number("speed_max_t"), 0.1);
    // the start too, of each part
    EXPECT_EQ(whole.Number("states_seen"), whole.Number("steps") + 1);
    EXPECT_EQ(parts.Number("states_seen"), parts.Number("steps") + 4);
    EXPECT_EQ(whole.Number("bodies.moving"), 12);
    EXPECT_EQ(parts.Find("bodies.moving"), nullptr);  // has no rule
  });
}

TEST(ObserversTest, ComparisonsJudgeItsKeysByTheirRule) {
  InChild([] {
    RegisterObserver(Hasty());
    const Record base = RunOf("four-bar", false);
    Record fresh = base;
    fresh.Set("speed_max", 10.0 * base.Number("speed_max"));
    const ComparisonReport report = Compare({base}, {fresh}, {});
    const auto judged = std::ranges::find_if(
        report.findings, [](const Finding& one) { return one.measure.key == "speed_max"; });
    ASSERT_NE(judged, report.findings.end());
    EXPECT_EQ(judged->judgement, Judgement::kWorse);
  });
}

TEST(ObserversTest, ARowThatCannotBeIsRefused) {
  const auto refusal = [](void (*change)(ObserverRow&)) {
    ObserverRow row = Hasty();
    change(row);
    return RefusalOf([&] { RegisterObserver(row); });
  };
  EXPECT_EQ(refusal([](ObserverRow& row) { row.name = "Haste"; }),
            "observer \"Haste\": found no word, expected a-z, 0-9, '-' and '_'");
  ExpectPart(refusal([](ObserverRow& row) { row.sentence.clear(); }),
             "observer \"haste\": found no sentence");
  ExpectPart(refusal([](ObserverRow& row) { row.spatial = nullptr; }),
             "observer \"haste\": found no factory");
  EXPECT_TRUE(RegisteredObservers().empty());
}

TEST(ObserversTest, AMeasureThatCannotBeIsRefusedAndNoneIsAdded) {
  const auto refusal = [](const Measure& measure) {
    return RefusalOf([&] { RegisterObserver(Hasty({{"first_of_two", kNumber}, measure})); });
  };
  EXPECT_EQ(refusal({"drift_position_max", kNumber}),
            "measure \"drift_position_max\": found a key that there is, expected each key once");
  for (const char* key : {"first_of_two", "drift_*", "dri*", "*"}) {
    EXPECT_NE(refusal({key, kNumber}), "none") << key;
  }
  for (const char* key : {"", "Speed", "speed max", "speed*max"}) {
    ExpectPart(refusal({key, kNumber}), "found no key, expected a-z");
  }
  ExpectPart(refusal({"speed_max"}), "found no type");
  for (const char* with : {"no_such_key", "first_of_two", "speed_max"}) {
    ExpectPart(refusal({"speed_max", kNumber, {}, {Merge::kWith, with}}),
               "found merged with no such key");
  }
  EXPECT_EQ(FindMeasure("first_of_two"), nullptr);
  EXPECT_EQ(Measures().size(), BuiltInMeasures().size());
  EXPECT_TRUE(RegisteredObservers().empty());
}

TEST(ObserversTest, EachNameAndKeyOnce) {
  InChild([] {
    RegisterObserver(Hasty());
    EXPECT_EQ(RefusalOf([] { RegisterObserver(Hasty({})); }),
              "observer \"haste\": found it again, expected each name once");
    ObserverRow other = Hasty();
    other.name = "other";
    ExpectPart(RefusalOf([&] { RegisterObserver(other); }), "measure \"speed_max\": found a key");
    EXPECT_EQ(RegisteredObservers().size(), 1u);
  });
}

}  // namespace loopbench::harness::observers_test
