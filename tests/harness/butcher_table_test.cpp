// Butcher tables of ARKODE, of files and of programs, and their order conditions.
#include "harness/config/experiment_reader.h"
#include "harness/config/options.h"
#include "harness/run/run.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
using namespace integrator_test;

namespace butcher_table_test {

std::string FaultText(const ButcherTable& table) {
  const auto fault = FaultOf(table);
  return fault ? fault->key + ": " + fault->found + "; " + fault->expected : "";
}

/// The classical method of order 4.
ButcherTable Classical() {
  return {.name = "classical",
          .A = {{0, 0, 0, 0}, {0.5, 0, 0, 0}, {0, 0.5, 0, 0}, {0, 0, 1, 0}},
          .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6},
          .c = {0, 0.5, 0.5, 1},
          .order = 4};
}

/// ARKODE's names end with stages, embedded order and order; some have no embedded order.
TEST(ArkodeTables, HaveTheOrdersOfTheirNamesAndNoFault) {
  const std::vector<ButcherTable> tables = ArkodeTables();
  EXPECT_GE(tables.size(), 38u);  // 15 explicit and 23 implicit ones in version 6.4
  for (const ButcherTable& table : tables) {
    EXPECT_EQ(FaultText(table), "") << table.name;
    int stages = 0, embedded = 0, order = 0;
    const std::size_t three = table.name.find_last_not_of("0123456789_");
    const int found = std::sscanf(table.name.c_str() + table.name.find('_', three), "_%d_%d_%d",
                                  &stages, &embedded, &order);
    ASSERT_GE(found, 2) << table.name;
    if (found == 2) std::swap(embedded, order);
    EXPECT_EQ(table.stages(), stages) << table.name;
    EXPECT_EQ(table.order, order) << table.name;
    EXPECT_EQ(table.embedded_order, embedded) << table.name;
    EXPECT_EQ(table.is_implicit(),
              table.name.find("DIRK") != std::string::npos || FindProfile(table.name)->is_implicit);
    EXPECT_NE(FindProfile(table.name), nullptr);
  }
}

/// Published orders are the largest: each table violates a condition of the next order.
TEST(OrderConditions, RejectOneOrderMoreThanEveryTableHas) {
  for (ButcherTable table : ArkodeTables()) {
    const std::string order = std::to_string(table.order);
    ++table.order;
    EXPECT_TRUE(FaultText(table).starts_with("order: coefficients of order " + order + ":"))
        << table.name << " " << FaultText(table);
    --table.order;
    if (table.b_embedded.empty()) continue;
    ++table.embedded_order;
    EXPECT_TRUE(FaultText(table).starts_with("embedded_order: coefficients of order "))
        << table.name;
  }
}

/// An error in the ninth digit is found in each coefficient of b and below the diagonal of A.
TEST(OrderConditions, FindAnErrorInEachCoefficient) {
  const ButcherTable pair = FindProfile("dormand-prince")->table;
  for (std::size_t i = 0; i < pair.b.size(); ++i) {
    ButcherTable changed = pair;
    changed.b[i] += 1e-8;
    EXPECT_NE(FaultText(changed), "") << i;
    for (std::size_t j = 0; j < i; ++j) {
      changed = pair;
      changed.A[i][j] += 1e-8;
      changed.c[i] += 1e-8;  // the row sum stays
      // the last row matters for the embedded solution alone, with a weight of 1/40
      EXPECT_NE(FaultText(changed), "") << i << " " << j;
    }
  }
}

TEST(OrderConditions, NameTheConditionWithBothValues) {
  EXPECT_EQ(FaultText(Classical()), "");
  ButcherTable table = Classical();
  table.order = 5;
  EXPECT_EQ(FaultText(table),
            "order: coefficients of order 4: the condition of tree [t,t,t,t] has the sum "
            "0.208333333333; order 5 as claimed, with the sum 0.2");
  table = Classical();
  table.b = {0.25, 0.25, 0.25, 0.25};
  EXPECT_EQ(
      FaultText(table),
      "order: coefficients of order 2: the condition of tree [t,t] has the sum 0.375; order 4 "
      "as claimed, with the sum 0.333333333333");
}

TEST(ButcherTables, FaultsOfShapeAreNamed) {
  const auto fault = [](auto change) {
    ButcherTable table = Classical();
    change(table);
    return FaultText(table);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fault([](auto& t) { t.b.clear(); }), "b: 0 stages; 1 to 64");
  EXPECT_EQ(fault([](auto& t) { t.c.pop_back(); }),
            "c: 3 numbers; 4, the number of stages in \"b\"");
  EXPECT_EQ(fault([](auto& t) { t.A.pop_back(); }), "A: 3 rows; 4, the number of stages in \"b\"");
  EXPECT_EQ(fault([](auto& t) { t.A[1].pop_back(); }),
            "A: row 2 with 3 numbers; 4, the number of stages");
  EXPECT_EQ(fault([](auto& t) { t.A[0][2] = 0.5; }),
            "A: 0.5 in row 1, column 3; 0 above the diagonal: an explicit or diagonally implicit "
            "table");
  EXPECT_EQ(fault([](auto& t) { t.c[1] = 0.25; }),
            "c: 0.25 in place 2; 0.5, the sum of row 2 of \"A\"");
  EXPECT_TRUE(fault([=](auto& t) { t.A[1][0] = nan; }).starts_with("c: "));
  EXPECT_TRUE(fault([=](auto& t) { t.b[1] = nan; }).starts_with("order: "));
  EXPECT_TRUE(fault([](auto& t) { t.order = 0; }).starts_with("order: 0"));
  EXPECT_TRUE(fault([](auto& t) { t.order = 11; }).starts_with("order: 11"));
  EXPECT_TRUE(fault([](auto& t) { t.embedded_order = 3; }).starts_with("b_embedded: none"));
  EXPECT_TRUE(fault([](auto& t) {
                t.b_embedded = t.b, t.embedded_order = 4;
              }).starts_with("b_embedded: the weights of \"b\""));
}

TEST(ButcherTables, ProgramsRegisterThem) {
  EXPECT_EQ(FindProfile("classical"), nullptr);
  RegisterIntegrator(Classical());
  RegisterIntegrator(Classical());  // the same again
  const Profile* profile = FindProfile("classical");
  ASSERT_NE(profile, nullptr);
  EXPECT_TRUE(profile->is_own && profile->needs_fresh_derivative && !profile->is_implicit);
  EXPECT_EQ(std::ranges::count(IntegratorNames(), "classical"), 1);
  const auto refused = [](auto change) {
    ButcherTable table = Classical();
    change(table);
    EXPECT_THROW(RegisterIntegrator(table), std::invalid_argument);
  };
  refused([](auto& t) { t.order = 3; });  // another table of this name
  refused([](auto& t) { t.name = "verner"; });
  refused([](auto& t) { t.name = "Capital"; });
  refused([](auto& t) { t.name = "weak", t.order = 5; });
  EXPECT_EQ(FindProfile("weak"), nullptr);
}

/// The order of each table on the smooth problem of integrator_test.cpp, by halving fixed steps.
/// Steps keep the error above 1e-12, where round-off and Newton's iteration (1e-12) disturb.
TEST(ArkodeTables, ConvergeWithTheirOrders) {
  for (const ButcherTable& table : ArkodeTables()) {
    const auto error = [&](double step) {
      TestOde ode = SmoothProblem();
      IntegratorOptions options = WithTolerance(table.name, kToleranceOfFixedSteps);
      options.fixed_step = step;
      State y = SmoothSolution(0);
      EXPECT_EQ(Integrate(ode, 0, 1, y, options).outcome, Outcome::kFinished) << table.name;
      double worst = 0;
      for (std::size_t i = 0; i < y.size(); ++i) {
        worst = std::max(worst, std::abs(y[i] - SmoothSolution(1)[i]));
      }
      return worst;
    };
    const double step = table.order >= 8 ? 1.0 / 4 : table.order >= 5 ? 1.0 / 8 : 1.0 / 16;
    const double fine = error(step / 2);
    EXPECT_GT(fine, 1e-12) << table.name;
    EXPECT_NEAR(std::log2(error(step) / fine), table.order, kMaxOrderError) << table.name;
  }
}

Experiment FourBar(const std::string& rest) {
  return ParseExperiment(R"({"name": "e", "problems": [{"mechanism": "four-bar.json",
      "horizon": 1}], "methods": {"formulation": "odca", "enforcement": "velocity"}, )" +
                             rest + "}",
                         kConfigs / "mechanisms/e.json");
}

std::string HashOf(const std::string& rest) {
  const Experiment experiment = FourBar(rest);
  const Record record = RunCase(experiment, Expand(experiment).front());
  EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  return record.Text("state_hash");
}

/// Fractions are read to the nearest double: equal bits of an explicit and of an implicit run.
TEST(ButcherTablesOfFiles, RunAsThoseOfArkode) {
  const std::string heun = R"("integrator": {"name": "heun-euler", "A": [[0, 0], [1, 0]],
      "b": ["1/2", "1/2"], "c": [0, 1], "b_embedded": [1, 0], "order": 2, "embedded_order": 1})";
  EXPECT_EQ(HashOf(R"("tolerances": [1e-4], )" + heun),
            HashOf(R"("tolerances": [1e-4], "integrator": "ARKODE_HEUN_EULER_2_1_2")"));
  const std::string sdirk = R"("integrator": {"name": "sdirk", "A": [[1, 0], [-1, 1]],
      "b": ["1/2", "1/2"], "c": [1, 0], "order": 2})";
  EXPECT_EQ(HashOf(R"("fixed_steps": [0.01], )" + sdirk),
            HashOf(R"("fixed_steps": [0.01], "integrator": "ARKODE_SDIRK_2_1_2")"));
  EXPECT_EQ(HashOf(R"("tolerances": [1e-6], "integrator": "dormand-prince")"),
            HashOf(R"("tolerances": [1e-6], "integrator": "ARKODE_DORMAND_PRINCE_7_4_5")"));
}

/// Two tables of one name cannot exist in a program, so the second is registered in a copy of the
/// name: contents differ by the coefficients as by the name.
TEST(ButcherTablesOfFiles, AreContentOfTheirCases) {
  const auto content = [](const std::string& name, const std::string& third) {
    const Experiment experiment =
        FourBar(R"("fixed_steps": 0.1, "integrator": {"name": ")" + name + R"(", "A": [[0, 0], [)" +
                third + R"(, 0]], "b": [0, 1], "c": [0, )" + third + R"(], "order": 1})");
    return AccuracyContent(experiment, Expand(experiment).front());
  };
  const std::string midpoint = content("one-stage", "\"1/2\"");
  EXPECT_EQ(content("one-stage", "0.5"), midpoint);
  EXPECT_NE(content("other-stage", "0.25"), midpoint);
  const Experiment plain = FourBar(R"("fixed_steps": 0.1)");
  EXPECT_NE(AccuracyContent(plain, Expand(plain).front()), midpoint);
  EXPECT_THROW(content("one-stage", "0.25"), ConfigError);
}

TEST(ButcherTables, DifferAsTextInEachCoefficient) {
  const ButcherTable table = ArkodeTables().front();
  ButcherTable other = table;
  const auto expect_difference = [&] {
    EXPECT_NE(ToString(other), ToString(table));
    other = table;
  };
  other.A.back().front() += 1e-15;
  expect_difference();
  for (std::vector<double>* list : {&other.b, &other.c, &other.b_embedded}) {
    ASSERT_FALSE(list->empty());
    list->back() += 1e-15;
    expect_difference();
  }
  ++other.order;
  expect_difference();
  ++other.embedded_order;
  expect_difference();
}

TEST(ButcherTablesOfFiles, WithoutEmbeddingHaveNoTimingAtATolerance) {
  const Experiment experiment =
      FourBar(R"("fixed_steps": 0.1, "integrator": ["ode45", "ARKODE_KNOTH_WOLKE_3_3"])");
  EXPECT_EQ(Expand(experiment).size(), 2u);
  EXPECT_EQ(ExpandTiming(experiment).size(), 1u);
}

class IntegratorsProgram : public CommandLineTest {};

TEST_F(IntegratorsProgram, ListsThemAndRunsThoseOfFiles) {
  Expect("integrators", 0,
         {"ode45", "ARKODE_DORMAND_PRINCE_7_4_5", "ARKODE_KNOTH_WOLKE_3_3", "implicit"});
  Expect("integrators --json", 0,
         {R"({"integrator":"ARKODE_ZONNEVELD_5_3_4","order":4,"embedded_order":3,"stages":5,)"
          R"("kind":"explicit")"});
  Write("rule.json", R"({"name": "three-eighths", "A": [[0, 0, 0, 0], ["1/3", 0, 0, 0],
    ["-1/3", 1, 0, 0], [1, -1, 1, 0]], "b": ["1/8", "3/8", "3/8", "1/8"],
    "c": [0, "1/3", "2/3", 1], "order": 4})");
  Write("own.json", R"({"name": "own", "fixed_steps": [0.05], "timing": {"repeats": 0},
    "integrator": ["rule.json", "ARKODE_ZONNEVELD_5_3_4"],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}]})");
  Expect("run own.json --out out", 0, {"ran 2 cases"});
  Expect(
      "explain own.json --set /tolerances=1e-6 --set /integrator=verner --set "
      "'/atol={\"length\": 1e-9}'",
      0, {"relative tolerances: 1e-06", "1e-09 m, 0 rad, 0 m/s, 0 rad/s"});
  Expect("table out --columns integrator,steps,rhs_evaluations --format csv", 0,
         {"three-eighths,10,", "ARKODE_ZONNEVELD_5_3_4,10,"});
  Write("rule.json", R"({"name": "three-eighths", "A": [[0]], "b": [1], "c": [0], "order": 2})");
  Expect("check own.json", 2,
         {"rule.json:1: /order: found coefficients of order 1", "expected order 2"});
}

/// The orders of the shipped example, as the legend of the figure has them: 3 and 4 within 0.1.
TEST_F(IntegratorsProgram, DrawObservedOrders) {
  const std::string example = (kConfigs / "experiments/examples/butcher-tables.json").string();
  Expect("run " + example + " --out out", 0, {"ran 19 cases"});
  Expect("work-precision out --cost-key rhs_evaluations --figures --out out", 0,
         {"wrote 5 figures to out/figures"});
  const fs::path figures = folder_ / "out/figures";
  const std::string orders = ReadFile(figures / "order-four-bar-horizon-1-velocity.svg");
  for (const auto& [table, order] :
       {std::pair("ESDIRK325L2SA_5_2_3", 3.0), std::pair("three-eighths", 4.0)}) {
    const std::size_t at = orders.find(", order ", orders.find(table));
    ASSERT_NE(at, std::string::npos) << orders.substr(0, 200);
    EXPECT_NEAR(std::stod(orders.substr(at + 8)), order, 0.1) << table;
  }
  EXPECT_TRUE(fs::exists(figures / "integrators-four-bar-horizon-1-velocity.svg"));
}

}  // namespace butcher_table_test
}  // namespace loopbench::harness
