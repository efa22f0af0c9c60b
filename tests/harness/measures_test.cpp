// The table of measures knows every key once, and all keys of a run.
#include "harness/base/record.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::measures_test {

TEST(Measures, HaveEachKeyOnceAndATypeWhereTheyAreMore) {
  std::set<std::string_view> keys;
  for (const Measure& measure : Measures()) {
    EXPECT_TRUE(keys.insert(measure.key).second) << measure.key;
    const bool is_more = !measure.heading.words.empty() || measure.rule != Rule::kNone ||
                         measure.merging.how != Merge::kLost;
    EXPECT_TRUE(!is_more || measure.type != ValueType::kAny) << measure.key;
  }
}

TEST(Measures, AreMergedWithMeasuresThatAreMerged) {
  for (const Measure& measure : Measures()) {
    if (measure.merging.how != Merge::kWith) continue;
    const Measure* other = FindMeasure(measure.merging.with);
    ASSERT_NE(other, nullptr) << measure.key;
    EXPECT_TRUE(other->merging.how == Merge::kLargest || other->merging.how == Merge::kSmallest);
  }
}

TEST(Measures, AKeyHasItsOwnRowElseThatOfTheLongestBeginning) {
  EXPECT_EQ(FindMeasure("drift_position_max")->heading.unit, "m");
  EXPECT_EQ(FindMeasure("drift_of_a_later_version")->key, "drift_*");
  EXPECT_EQ(FindMeasure("drift.loop.OC")->key, "drift.loop.*");
  EXPECT_EQ(FindMeasure("series.opening.angle.OA")->key, "series.opening.angle.*");
  EXPECT_EQ(FindMeasure("stiffness"), nullptr);
  EXPECT_EQ(TypeOf("error_dominated_by"), ValueType::kText);
  EXPECT_EQ(TypeOf("error_of_a_later_version"), ValueType::kNumber);
  EXPECT_EQ(TypeOf("stiffness"), ValueType::kAny);
}

TEST(Measures, NoParameterMayBeCalledAsTheyAre) {
  for (const char* name :
       {"kind", "rtol", "seed", "wall_of_a_later_version", "machine", "warnings"}) {
    EXPECT_TRUE(IsReserved(name)) << name;
  }
  for (const char* name : {"mass", "wall", "driftwood", "kind_of"}) {
    EXPECT_FALSE(IsReserved(name)) << name;
  }
}

TEST(Measures, KnowEveryKeyOfARun) {
  const Experiment experiment = reference::Single(reference::Shipped("parallelogram"));
  Case one = reference::CaseOf(experiment, "parallelogram", {.enforcement = Enforcement::kPosition},
                               1e-6, 0.5);
  one.integrator = "trbdf2";
  one.ensemble = 2;
  one.perturb = 1e-3;
  const Record record = RunCase(experiment, one);
  EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  for (const auto& [key, value] : record.items()) EXPECT_NE(FindMeasure(key), nullptr) << key;
}

}  // namespace loopbench::harness::measures_test
