// Formulations by name: those that come with Loopbench, and one that a program adds.
#include "harness/config/formulations.h"

#include "harness/figures/figures.h"
#include "harness/judge/tables.h"
#include "harness/suite/suite.h"
#include "lagrange/lagrange.h"
#include "tests/harness/in_child.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::formulations_test {

using Names = std::vector<std::string>;

const Names kBuiltIn = {"odca", "lagrange", "reduction", "peer/simbody", "peer/mujoco"};

/// Multipliers under another name.
FormulationRow Echo() { return Row<lagrange::Lagrange>("echo", "multipliers once more."); }

Experiment Asking(const std::string& level, const std::string& more = "") {
  return ParseExperiment(R"({"name": "own", "tolerances": 1e-6,
      "problems": [{"mechanism": "../mechanisms/four-bar.json", "horizon": 0.2}],
      "methods": [{"formulation": ["lagrange", "echo"], "enforcement": ")" +
                             level + "\"}]" + more + "}",
                         kConfigs / "experiments/own.json");
}

std::string MistakeOf(const std::string& level, const std::string& more = "") {
  return MessageOf([&] { CheckLadders(Asking(level, more)); });
}

TEST(FormulationsTest, ThoseBuiltInAreKnownInTheirOrder) {
  EXPECT_EQ(FormulationNames(), kBuiltIn);
  for (const FormulationRow& row : Formulations()) {
    EXPECT_EQ(FindFormulation(row.name), &row);
    EXPECT_TRUE(row.sentence.ends_with('.')) << row.sentence;
    EXPECT_EQ(row.is_peer(), row.name.starts_with("peer/"));
    EXPECT_EQ(row.levels.size(), row.is_peer() ? 1u : 0u);
  }
  EXPECT_EQ(FindFormulation("Odca"), nullptr);
}

TEST(FormulationsTest, ARowThatCannotBeIsRefused) {
  const auto refuses = [](FormulationRow row) {
    EXPECT_THROW(RegisterFormulation(std::move(row)), std::invalid_argument);
  };
  FormulationRow row = Echo();
  for (const char* name : {"", "Echo", "e cho", "-echo", "peer/echo", "odca"}) {
    row.name = name;
    refuses(row);
  }
  row = Echo();
  row.spatial = nullptr;
  refuses(row);
  row = Echo();
  row.sentence.clear();
  refuses(row);
  row = Echo();
  for (const char* color : {"red", "#12345", "#12345g"}) {
    row.color = color;
    refuses(row);
  }
  EXPECT_THROW(RegisterFormulation(Echo(), EIGEN_MAX_STATIC_ALIGN_BYTES + 16),
               std::invalid_argument);
  EXPECT_EQ(FormulationNames(), kBuiltIn);
}

TEST(FormulationsTest, WhatIsNotThereIsNotMade) {
  const MechanismFile file = ReadMechanism(kConfigs / "mechanisms/four-bar.json");
  const Mechanism<Planar, double> mechanism(file.description, Coordinates::kJoint);
  EXPECT_THROW(MakeFormulation<Planar>("echo", mechanism, {}), std::invalid_argument);
  EXPECT_NE(MakeFormulation<Planar>("lagrange", mechanism, {}), nullptr);
  ExpectPart(MistakeOf("acceleration"), "expected a formulation: \"odca\"");
}

TEST(FormulationsTest, ANewNameIsValidWhereverTheOthersAre) {
  InChild([] {
    RegisterFormulation(Echo());
    const Experiment experiment = Asking("acceleration");
    ASSERT_EQ(experiment.methods.size(), 2u);
    EXPECT_EQ(ToString(experiment.methods[1]), "echo/acceleration/joint/rank-revealing");
    std::vector<Record> records;
    for (const Case& one : Expand(experiment)) records.push_back(RunCase(experiment, one));
    EXPECT_EQ(records[1].Text("formulation"), "echo");
    EXPECT_EQ(records[1].Text("state_hash"), records[0].Text("state_hash"));

    const Figure figure = DriftFigure(records);
    ASSERT_EQ(figure.curves.size(), 2u);
    EXPECT_EQ(figure.curves[0].style.color, FindFormulation("lagrange")->color);
    EXPECT_EQ(figure.curves[1].style.color, FindFormulation("echo")->color);
    EXPECT_NE(figure.curves[1].style.color, figure.curves[0].style.color);

    const Table table = FactorialTable(records, 1e-6, 0.2);
    ASSERT_FALSE(table.rows.empty());
    for (const Record& row : table.rows) {
      EXPECT_EQ(row.Text("from"), "lagrange");
      EXPECT_EQ(row.Text("to"), "echo");
    }
  });
}

TEST(FormulationsTest, ColoursAreGivenInTurn) {
  InChild([] {
    RegisterFormulation(Echo());
    FormulationRow other = Echo();
    other.name = "other";
    RegisterFormulation(other);
    EXPECT_EQ(FormulationNames().size(), kBuiltIn.size() + 2);
    EXPECT_EQ(FormulationNames().back(), "other");
    EXPECT_NE(FindFormulation("echo")->color, FindFormulation("other")->color);
  });
}

TEST(FormulationsTest, ALevelThatItDoesNotHaveIsAMistakeOfTheFile) {
  InChild([] {
    FormulationRow row = Echo();
    row.levels = {Enforcement::kAcceleration, Enforcement::kPosition};
    RegisterFormulation(row);
    EXPECT_EQ(MistakeOf("projection"), "");
    const std::string mistake = MistakeOf("velocity");
    for (const char* part : {"/methods/0", "\"echo\" at level \"velocity\"",
                             "a level that it has: acceleration, projection"}) {
      ExpectPart(mistake, part);
    }
  });
}

TEST(FormulationsTest, RunsInSeveralScalarsKnowTheBuiltInOnes) {
  InChild([] {
    RegisterFormulation(Echo());
    const std::string mistake =
        MistakeOf("acceleration", R"(, "precision": {"scalars": ["float", "double"]})");
    ExpectPart(mistake, "echo/acceleration/joint");
    ExpectPart(mistake, "odca, lagrange, reduction");
  });
}

}  // namespace loopbench::harness::formulations_test
