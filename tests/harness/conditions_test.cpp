// Conditions with comparisons: what they choose, and what they say where they cannot.
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::conditions_test {

Record Row() {
  return RecordOf("mechanism", "four-bar", "rtol", 1e-6, "steps", 100, "absent", Value(), "nan",
                  NAN, "flag", true);
}

bool Meets(const std::string& condition) { return Matches(Row(), {ParseCondition(condition)}); }

TEST(Conditions, CompareNumbers) {
  for (const char* holds :
       {"rtol<1e-5", "rtol<=1e-6", "rtol>=0.000001", "rtol>1e-7", "steps<101", "steps>=100",
        "steps!=99", "steps=100", "rtol!=1e-5,1e-7", "mechanism!=n-four-bar", "steps>-1",
        "rtol=1e-6", "rtol=0.000001", "mechanism=lagrange,four-bar"}) {
    EXPECT_TRUE(Meets(holds)) << holds;
  }
  for (const char* fails : {"rtol<1e-6", "rtol>1e-6", "steps<=99.5", "steps!=100", "steps!=99,100",
                            "mechanism!=four-bar", "steps>1e3", "mechanism=lagrange", "steps=1"}) {
    EXPECT_FALSE(Meets(fails)) << fails;
  }
}

/// Every condition on a missing value, or on a value that is not a number, is false.
TEST(Conditions, NothingIsKnownOfWhatIsNotThere) {
  for (const char* key : {"absent", "nan", "other"}) {
    for (const char* rest : {"<1", "<=1", ">1", ">=1", "=1", "!=1"}) {
      EXPECT_FALSE(Meets(std::string(key) + rest)) << key << rest;
    }
  }
}

TEST(Conditions, TextsHaveNoOrder) {
  EXPECT_FALSE(Meets("mechanism<5"));
  EXPECT_FALSE(Meets("mechanism>=5"));
  EXPECT_FALSE(Meets("flag>0"));
}

TEST(Conditions, SeveralMakeARange) {
  const Selection range = {ParseCondition("steps>50"), ParseCondition("steps<=100")};
  EXPECT_TRUE(Matches(Row(), range));
  EXPECT_TRUE(Matches(Row(), {}));
  EXPECT_FALSE(Matches(Row(), {ParseCondition("mechanism=odca"), ParseCondition("rtol=1e-6")}));
  EXPECT_EQ(ToText(range), "steps>50 steps<=100");
  EXPECT_EQ(ToText({ParseCondition("a=1e-6,2"), ParseCondition("b!=x,y")}), "a=1e-6,2 b!=x,y");
}

std::string Refusal(const std::string& condition) {
  return MessageOf<std::exception>([&] { ParseCondition(condition); });
}

TEST(Conditions, SayWhatIsWrongWithThem) {
  for (const char* wrong : {"", "a", "=1", "<1", "a=", "a<", "a<=", "a!1", "!a=1", "a!"}) {
    ExpectWords(Refusal(wrong), {"expected key=value"});
  }
  EXPECT_EQ(Refusal("rtol<small"),
            "filter 'rtol<small': found \"small\", expected a number behind <");
  EXPECT_EQ(Refusal("rtol>=nan"), "filter 'rtol>=nan': found \"nan\", expected a number behind >=");
  EXPECT_EQ(Refusal("rtol<1,2"), "filter 'rtol<1,2': found 2 values, expected one number behind <");
  EXPECT_EQ(Refusal("rtol==1"), "") << "the value \"=1\", as before";
}

TEST(Conditions, AnOrderOfTextsIsRefusedWhereRecordsAreKnown) {
  const std::vector<Record> rows = {Row()};
  const auto require = [&](const std::string& condition) {
    RequireConditions("--where", {ParseCondition(condition)}, rows);
  };
  EXPECT_NO_THROW(require("rtol<1"));
  EXPECT_NO_THROW(require("mechanism!=x"));
  EXPECT_NO_THROW(require("absent<1")) << "measured in no record: none matches";
  EXPECT_THROW(require("mechanism<1"), ConfigError);
  EXPECT_THROW(require("stepps<1"), ConfigError);
}

class ConditionsProgram : public CommandLineTest {};

TEST_F(ConditionsProgram, ChooseRecordsByWhatTheyMeasured) {
  Expect("run tiny.json --out out", 0);
  Expect("table out --where 'steps>0' --where 'wall_s<1000' --columns formulation", 0,
         {"odca", "lagrange"});
  Expect("table out --where 'steps<1'", 2, {"no drift records match steps<1"});
  Expect("table out --where 'formulation!=odca' --columns formulation --format csv", 0,
         {"formulation\nlagrange\n#"});
  Expect("table out --where 'formulation<2'", 2,
         {"--where formulation<2: found \"lagrange\" in records"});
  Expect("plot out --out figures --where 'steps<1'", 2, {"no records match steps<1"});
  std::filesystem::copy(folder_ / "out", folder_ / "same",
                        std::filesystem::copy_options::recursive);
  Expect("compare out same --where 'steps>0'", 0, {"NO CHANGE"});
  Expect("compare out same --where 'steps<1'", 2, {"INCONCLUSIVE"});
}

TEST_F(ConditionsProgram, ChooseCasesByTheirKeysAlone) {
  Expect("list tiny.json --filter 'rtol<1e-5' --filter 'formulation!=odca'", 0, {"1 case"});
  Expect("run tiny.json --out out --filter 'rtol>1e-5'", 2, {"no case matches rtol>1e-5"});
  Expect("estimate tiny.json --filter 'horizon>=0.5'", 0, {"2 cases"});
  Expect("run tiny.json --out out --filter 'wall_s<1'", 2,
         {"--filter wall_s: no such key before a run, which measures it", "--where",
          "cases have kind, experiment, mechanism"});
}

}  // namespace loopbench::harness::conditions_test
