// Stores that are not held whole (32 MiB and more): what is said of them is true of all of it.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/base/record.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace large_store_test {

constexpr int kLines = 20'000;

class LargeStore : public CommandLineTest {
 protected:
  /// Masses 0 to 4.5; the last of them with a parameter and a measure that no other has.
  static std::string Line(int i) {
    Record record;
    record.Set("kind", std::string("accuracy"));
    record.Set("mass", 0.5 * (i % 10));
    if (i % 10 == 9) record.Set("friction", 0.1);
    record.Set("case_id", std::to_string(i));
    record.Set("outcome", std::string("finished"));
    record.Set("message", std::string(2000, 'x'));
    if (i % 10 == 9) record.Set("drift_position_max", 1e-9);
    return ToJsonLine(record) + '\n';
  }
  void SetUp() override {
    CommandLineTest::SetUp();
    for (int i = 0; i < kLines; ++i) text_ += Line(i);
    Write("large.jsonl", text_);
    ASSERT_TRUE(IsLarge(folder_ / "large.jsonl"));
  }
  std::string text_;
};

TEST_F(LargeStore, DamageIsNamedByItsLineInTheFile) {
  text_[text_.rfind("xxx")] = 'y';  // in the last line, far behind the first that is looked at
  Write("large.jsonl", text_);
  ExpectEnding(Call("run tiny.json --out large.jsonl"), 2,
               {"large.jsonl:20000: ", "nothing was changed"});
  ExpectEnding(Call("table large.jsonl --where mass=4.5"), 2, {"large.jsonl:20000: "});
}

TEST_F(LargeStore, AKeyThatOnlyOtherRecordsHaveIsKnown) {
  for (const std::string key : {"friction=0.1", "friction<1", "drift_position_max<1"}) {
    const Ending ending = Call("table large.jsonl --where mass=1.5 --where '" + key + "'");
    EXPECT_EQ(ending.text.find("which no record has"), std::string::npos) << ending.text;
    EXPECT_EQ(ending.text.find("no record has a number"), std::string::npos) << ending.text;
  }
  ExpectEnding(Call("table large.jsonl --where mass=1.5 --where frction=0.1"), 2,
               {"which no record has"});
  // and no more of the others is read than that
  const Selection where = {ParseCondition("mass=1.5"), ParseCondition("friction<1")};
  EXPECT_EQ(ReadRecords(folder_ / "large.jsonl", where, nullptr).size(), 2000u + 2u);
}

}  // namespace large_store_test
}  // namespace loopbench::harness
