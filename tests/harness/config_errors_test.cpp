// What the readers of harness/config refuse, and in which words: file, place, value found, values
// expected, nearest spelling.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace config_errors_test {

constexpr std::string_view kMechanism = R"({
  "name": "two bars", "gravity": [0, -9.81],
  "bodies": [
    {"name": "bar1", "mass": 1, "inertia": 1, "points": {"A": [0, 0], "tip": [1, 0]}},
    {"name": "bar2", "mass": 1, "inertia": 1}],
  "joints": [
    {"name": "OA", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "bar1", "at": "A"}},
    {"name": "W", "type": "weld", "from": {"body": "bar1", "at": "tip"}, "to": {"body": "bar2"}}],
  "forces": [{"type": "joint_damper", "joint": "OA", "damping": 1}],
  "initial": {"coordinates": {"OA": 0.5}, "fixed": ["OA"]},
  "independent": ["OA", "bar1.angle"]
})";

constexpr std::string_view kTinyExperiment = R"({
  "name": "small", "tolerances": [1e-6],
  "problems": [{"mechanism": "mechanisms/pendulum.json", "horizon": 10}],
  "methods": [{"formulation": "odca", "enforcement": "acceleration"}],
  "ensembles": [{"size": 4, "seed": 1, "perturb": 0.1}],
  "limits": {"steps": 1000}
})";

/// One edit of a sound file and the words its refusal must contain.
struct Mistake {
  std::string title;
  std::string from, to;
  std::vector<std::string> words;

  friend std::ostream& operator<<(std::ostream& out, const Mistake& mistake) {
    return out << mistake.title;
  }
};

std::string Edited(std::string_view text, const Mistake& mistake) {
  std::string edited(text);
  const std::size_t place = edited.find(mistake.from);
  EXPECT_NE(place, std::string::npos) << mistake.from;
  return place == std::string::npos ? edited
                                    : edited.replace(place, mistake.from.size(), mistake.to);
}

template <class Read>
std::string ErrorOf(Read read) {
  try {
    read();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string MechanismError(const std::string& text) {
  return ErrorOf([&text] { ParseMechanism(text, "m.json"); });
}

std::string ExperimentError(const std::string& text) {
  return ErrorOf([&text] { ParseExperiment(text, kConfigs / "e.json"); });
}

void ExpectWords(const std::string& error, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_NE(error.find(word), std::string::npos) << "no <" << word << "> in:\n" << error;
  }
}

class MechanismMistake : public testing::TestWithParam<Mistake> {};

TEST_P(MechanismMistake, IsRefusedOnceAndExplained) {
  const std::string error = MechanismError(Edited(kMechanism, GetParam()));
  EXPECT_EQ(error.rfind("m.json:", 0), 0u) << error;
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0) << error;
  ExpectWords(error, GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Syntax, MechanismMistake,
    testing::Values(
        Mistake{"trailing comma",
                R"("bar1.angle"])",
                R"("bar1.angle",])",
                {"m.json:11:", "found ']'", "remove the comma before the closing bracket"}},
        Mistake{"comment", "\"joints\"", "// no\n\"joints\"", {"m.json:6:", "comments are not"}},
        Mistake{"NaN", "-9.81", "NaN", {"m.json:2:", "NaN and Infinity are not allowed"}},
        Mistake{"overflow", "-9.81", "1e999", {"m.json:2:", "1e999"}},
        Mistake{"duplicate key",
                R"("mass": 1)",
                R"("mass": 1, "mass": 2)",
                {"m.json:4: /bodies/0/mass: found key \"mass\" twice"}},
        Mistake{"single quotes", "\"two bars\"", "'two bars'", {"double quotes"}}));

INSTANTIATE_TEST_SUITE_P(
    Values, MechanismMistake,
    testing::Values(Mistake{"unknown key",
                            R"("mass": 1)",
                            R"("mass": 1, "inertai": 2)",
                            {"/bodies/0/inertai: found unknown key",
                             "(did you mean \"inertia\"?)"}},
                    Mistake{"missing key",
                            R"("mass": 1, )",
                            "",
                            {"m.json:4: /bodies/0: found no \"mass\", expected a number > 0"}},
                    Mistake{"wrong type",
                            R"("mass": 1)",
                            R"("mass": "heavy")",
                            {"/bodies/0/mass: found \"heavy\", expected a number > 0"}},
                    Mistake{"negative mass",
                            R"("mass": 1)",
                            R"("mass": -1)",
                            {"/bodies/0/mass: found -1, expected a number > 0"}},
                    Mistake{"inertia",
                            R"("inertia": 1,)",
                            R"("inertia": [1, 1, 1, 2, 0, 0],)",
                            {"/bodies/0/inertia: found [1,1,1,2,0,0]", "positive definite"}},
                    Mistake{"out of plane",
                            "[1, 0]",
                            "[1, 0, 1]",
                            {"/bodies/0/points/tip", "z = 0 in a planar mechanism"}},
                    Mistake{"space",
                            R"("name": "two bars",)",
                            R"("name": "two bars", "space": "planer",)",
                            {"/space: found \"planer\"", "(did you mean \"planar\"?)"}},
                    Mistake{"axis on a weld",
                            R"("type": "weld",)",
                            R"("type": "weld", "axis": [0, 0, 1],)",
                            {"/joints/1/axis", "no axis on a weld"}},
                    Mistake{"negative damping",
                            R"("damping": 1)",
                            R"("damping": -1)",
                            {"m.json:9: /forces/0/damping: found -1, expected a number >= 0"}},
                    Mistake{"no accuracy",
                            R"("independent")",
                            R"("accuracy": 1e308, "independent")",
                            {"/accuracy: found 1e+308, expected a number > 0 and <= 0.1"}},
                    Mistake{"no motion",
                            R"({"name": "OA",)",
                            R"({"name": "OA", "motion": [],)",
                            {"/joints/0/motion: found an empty array, expected at least one"}},
                    Mistake{"number of values",
                            R"("OA": 0.5})",
                            R"("OA": [0.5, 1]})",
                            {"/initial/coordinates/OA: found [0.5,1], expected one number"}}));

INSTANTIATE_TEST_SUITE_P(
    Names, MechanismMistake,
    testing::Values(Mistake{"missing body",
                            R"("to": {"body": "bar2"})",
                            R"("to": {"body": "bra2"})",
                            {"/joints/1/to/body: found \"bra2\"", "(did you mean \"bar2\"?)"}},
                    Mistake{"missing point",
                            R"("at": "tip")",
                            R"("at": "tpi")",
                            {"/joints/1/from/at: found \"tpi\"", "(did you mean \"tip\"?)"}},
                    Mistake{"joint type",
                            "\"revolute\"",
                            "\"Revolute\"",
                            {"/joints/0/type", "(did you mean \"revolute\"?)"}},
                    Mistake{"same name",
                            R"("inertia": 1}])",
                            R"("inertia": 1}, {"name": "bar1", "mass": 1, "inertia": 1}])",
                            {"/bodies/2/name: found \"bar1\", expected a name that is not in use"}},
                    Mistake{"ground",
                            R"("inertia": 1}])",
                            R"("inertia": 1}, {"name": "ground", "mass": 1, "inertia": 1}])",
                            {"/bodies/2/name: found \"ground\""}},
                    Mistake{"itself",
                            R"("to": {"body": "bar2"})",
                            R"("to": {"body": "bar1"})",
                            {"/joints/1: found a joint of \"bar1\" with itself"}},
                    Mistake{"force on a weld",
                            R"("joint": "OA")",
                            R"("joint": "W")",
                            {"/forces/0/joint: found \"W\" (weld)", "one coordinate"}},
                    Mistake{"held",
                            R"("fixed": ["OA"])",
                            R"("fixed": ["W"])",
                            {"/initial/fixed/0", "a value in /initial/coordinates"}},
                    Mistake{"independent",
                            "\"bar1.angle\"",
                            "\"bar1.angel\"",
                            {"/independent/1", "(did you mean \"bar1.angle\"?)"}}));

TEST(MechanismErrors, AreReportedAllAtOnce) {
  std::string text = Edited(kMechanism, {"", R"("mass": 1)", R"("mass": 0)", {}});
  text = Edited(text, {"", "\"weld\"", "\"wold\"", {}});
  text = Edited(text, {"", "\"gravity\"", "\"gravitation\"", {}});
  const std::string error = MechanismError(text);
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 3) << error;
  ExpectWords(error, {"(top level): found no \"gravity\"", "/gravitation: found unknown key",
                      "/bodies/0/mass: found 0", "/joints/1/type: found \"wold\""});
}

TEST(MechanismErrors, SoundFileHasNone) {
  EXPECT_EQ(MechanismError(std::string(kMechanism)), "");
  EXPECT_EQ(ExperimentError(std::string(kTinyExperiment)), "");
}

TEST(MechanismErrors, EmptyAndForeignDocumentsAreRefused) {
  ExpectWords(MechanismError(""), {"m.json:1:1: found an empty file"});
  ExpectWords(MechanismError("[]"), {"(top level): found an empty array, expected an object"});
  ExpectWords(MechanismError(std::string(100, '[')), {"nesting deeper than 64"});
  ExpectWords(MechanismError(R"({"name": "m", "gravity": [0, 0], "bodies": [], "joints": []})"),
              {"/bodies: found an empty array, expected at least one body"});
}

TEST(MechanismErrors, UnreadableFilesAreNamed) {
  ExpectWords(ErrorOf([] { ReadMechanism("/nowhere/m.json"); }),
              {"/nowhere/m.json: cannot be read: no such file"});
  ExpectWords(ErrorOf([] { ReadMechanism(kConfigs); }), {"it is a folder"});
}

class ExperimentMistake : public testing::TestWithParam<Mistake> {};

TEST_P(ExperimentMistake, IsRefusedOnceAndExplained) {
  const std::string error = ExperimentError(Edited(kTinyExperiment, GetParam()));
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0) << error;
  ExpectWords(error, GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Values, ExperimentMistake,
    testing::Values(
        Mistake{"fraction", "1000", "2.7", {"/limits/steps: found 2.7, expected an integer"}},
        Mistake{"tolerance by quantity",
                "[1e-6]",
                "[-1], \"atol\": {\"length\": 1e-9}",
                {"/tolerances/0: found -1, expected a number"}},
        Mistake{"formulation",
                "\"odca\"",
                "\"ocda\"",
                {"/methods/0/formulation: found \"ocda\"", "(did you mean \"odca\"?)"}},
        Mistake{"same column",
                "\"odca\", ",
                "\"odca\", \"solver\": [\"rank-revealing\", \"x\"], ",
                {"/methods/0/solver/1: found \"x\""}},
        Mistake{"horizon",
                "\"horizon\": 10",
                "\"horizon\": [10, 0]",
                {"/problems/0/horizon/1: found 0, expected a number > 0"}},
        Mistake{"mechanism",
                "pendulum.json",
                "pendulm.json",
                {"/problems/0/mechanism", "pendulm.json does not exist",
                 "(did you mean \"mechanisms/pendulum.json\"?)"}},
        Mistake{"unused tolerance",
                "\"seed\"",
                "\"tolerances\": 1e-7, \"seed\"",
                {"/ensembles/0/tolerances: found 1e-07", "1e-06"}},
        Mistake{"unused rule",
                "\"seed\"",
                "\"enforcement\": \"velocity\", \"seed\"",
                {"/ensembles/0: found a rule that matches no case"}},
        Mistake{"integrator",
                "\"limits\"",
                "\"integrator\": \"ode46\", \"limits\"",
                {"/integrator: found \"ode46\"", "(did you mean \"ode45\"?)"}}));

TEST(ExperimentErrors, TheSameTwiceIsRefused) {
  const std::string problem = R"({"mechanism": "mechanisms/pendulum.json", "horizon": 10})";
  ExpectWords(ExperimentError(Edited(kTinyExperiment, {"", problem, problem + ", " + problem, {}})),
              {"/problems/1: found problem \"pendulum\" again"});
  const std::string column = R"({"formulation": "odca", "enforcement": "acceleration"})";
  ExpectWords(ExperimentError(Edited(kTinyExperiment, {"", column, column + ", " + column, {}})),
              {"/methods/1: found odca/acceleration/joint/rank-revealing again"});
}

TEST(ExperimentErrors, IncludeThoseInsideTheMechanismFile) {
  const std::string error = ExperimentError(Edited(
      kTinyExperiment, {"", "mechanisms/pendulum.json", "schema/mechanism.schema.json", {}}));
  ExpectWords(error, {"mechanism.schema.json:1: (top level): found no \"gravity\""});
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

}  // namespace config_errors_test
}  // namespace loopbench::harness
