// The factorial table finds the factor that drift was planted with.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace factorial_test {

Record RunOf(const std::string& mechanism, const std::string& formulation,
             const std::string& enforcement, const std::string& coordinates, double drift,
             double exponent) {
  Record record;
  record.Set("mechanism", mechanism);
  record.Set("formulation", formulation);
  record.Set("enforcement", enforcement);
  record.Set("coordinates", coordinates);
  record.Set("solver", std::string("plain"));
  record.Set("integrator", std::string("ode45"));
  record.Set("rtol", 1e-8);
  record.Set("horizon", 10.0);
  record.Set("outcome", std::string("finished"));
  record.Set("drift_position_max", drift);
  record.Set("growth_exponent", exponent);
  return record;
}

// Drift as findings 1 describe it: level and geometry decide, the formulation does not; absolute
// coordinates undo what the square geometry gives.
std::vector<Record> Planted() {
  std::vector<Record> records;
  for (const char* mechanism :
       {"square-four-bar", "four-bar", "square-seven-bar", "general-seven-bar"}) {
    for (const char* formulation : {"odca", "lagrange", "reduction"}) {
      for (const char* enforcement : {"acceleration", "velocity"}) {
        for (const char* coordinates : {"joint", "absolute"}) {
          const bool square = std::string(mechanism).starts_with("square");
          const bool invariant = square && coordinates == std::string("joint");
          const bool velocity = enforcement == std::string("velocity");
          const double drift = invariant ? 1e-14 : velocity ? 1e-9 : 1e-7;
          records.push_back(
              RunOf(mechanism, formulation, enforcement, coordinates, drift, velocity ? 1 : 2));
        }
      }
    }
  }
  return records;
}

Record RowOf(const Table& table, const std::string& factor, const std::string& to,
             const std::string& within) {
  for (const Record& row : table.rows) {
    if (row.Text("factor") == factor && row.Text("to") == to && row.Text("within") == within) {
      return row;
    }
  }
  ADD_FAILURE() << "no row " << factor << " " << to << " " << within << "\n" << ToText(table);
  return {};
}

// Ratios are recovered through a logarithm and an exponential: a few units of round-off.
constexpr double kRoundOff = 1e-13;

TEST(Factorial, AFactorWithoutEffectHasRatioOne) {
  const Record row = RowOf(FactorialTable(Planted()), "formulation", "lagrange", "all");
  EXPECT_EQ(row.Number("pairs"), 16);
  EXPECT_NEAR(row.Number("ratio_mean"), 1.0, kRoundOff);
  EXPECT_EQ(row.Number("ratio_min"), 1.0);
  EXPECT_EQ(row.Number("ratio_max"), 1.0);
  EXPECT_EQ(row.Number("exponent_difference"), 0.0);
}

TEST(Factorial, CoordinatesMatterOnSquareProblemsOnly) {
  const Table table = FactorialTable(Planted());
  const Record square = RowOf(table, "coordinates", "absolute", "square");
  EXPECT_EQ(square.Number("pairs"), 12);
  EXPECT_NEAR(square.Number("ratio_mean") / 1e6, 1.0, kRoundOff);
  EXPECT_NEAR(square.Number("ratio_min") / 1e5, 1.0, kRoundOff);
  EXPECT_NEAR(square.Number("ratio_max") / 1e7, 1.0, kRoundOff);
  const Record general = RowOf(table, "coordinates", "absolute", "general");
  EXPECT_NEAR(general.Number("ratio_mean"), 1.0, kRoundOff);
}

TEST(Factorial, GeometryMattersInJointCoordinatesOnly) {
  const Table table = FactorialTable(Planted());
  EXPECT_NEAR(RowOf(table, "geometry", "general", "joint").Number("ratio_mean") / 1e6, 1.0,
              kRoundOff);
  EXPECT_NEAR(RowOf(table, "geometry", "general", "absolute").Number("ratio_mean"), 1.0, kRoundOff);
}

TEST(Factorial, TheLevelChangesTheExponent) {
  const Record row = RowOf(FactorialTable(Planted()), "enforcement", "acceleration", "general");
  EXPECT_EQ(row.Number("exponent_difference"), 1.0);
  EXPECT_NEAR(row.Number("ratio_mean") / 100.0, 1.0, kRoundOff);
}

TEST(Factorial, OtherTolerancesAndHorizonsTakeNoPart) {
  FactorialOptions options;
  options.rtol = 1e-6;
  EXPECT_TRUE(FactorialTable(Planted(), options).rows.empty());
  options = {};
  options.horizon = 100.0;
  EXPECT_TRUE(FactorialTable(Planted(), options).rows.empty());
}

TEST(Factorial, FailedRunsAreCountedAndTheLastOfEqualRunsWins) {
  std::vector<Record> records = {
      RunOf("four-bar", "odca", "acceleration", "joint", 1e-7, 2),
      RunOf("four-bar", "odca", "acceleration", "absolute", 1e-9, 2),
      RunOf("four-bar", "odca", "acceleration", "absolute", 3e-7, 2),
      RunOf("four-bar", "lagrange", "acceleration", "joint", 0.0, 2),
      RunOf("four-bar", "lagrange", "acceleration", "absolute", 1e-7, 2),
  };
  records[3].Set("outcome", std::string("singular"));
  const Record row = RowOf(FactorialTable(records), "coordinates", "absolute", "all");
  EXPECT_EQ(row.Number("pairs"), 1);
  EXPECT_EQ(row.Number("left_out"), 1);
  EXPECT_NEAR(row.Number("ratio_mean"), 3.0, kRoundOff);
}

TEST(Factorial, DriftBelowRoundOffCountsAsRoundOff) {
  const std::vector<Record> records = {RunOf("toggle", "odca", "acceleration", "joint", 0.0, 1),
                                       RunOf("toggle", "odca", "acceleration", "absolute",
                                             std::numeric_limits<double>::epsilon() / 4, 1)};
  EXPECT_NEAR(RowOf(FactorialTable(records), "coordinates", "absolute", "all").Number("ratio_mean"),
              1.0, kRoundOff);
}

// A sweep over a mass: each ratio compares runs of the same mass, whatever their order.
TEST(Factorial, RunsOfDifferentParametersAreNoPair) {
  std::vector<Record> records;
  for (const double mass : {1.0, 10.0}) {
    for (const char* coordinates : {"joint", "absolute"}) {
      const bool joint = coordinates == std::string("joint");
      Record record;
      record.Set("mass", mass);  // keys of a case stand before its results
      const Record run =
          RunOf("toggle", "odca", "acceleration", coordinates, (joint ? 1e-8 : 3e-8) * mass, 2);
      for (const auto& [key, value] : run.items()) record.Set(key, value);
      records.push_back(record);
    }
  }
  const Record row = RowOf(FactorialTable(records), "coordinates", "absolute", "all");
  EXPECT_EQ(row.Number("pairs"), 2);
  EXPECT_NEAR(row.Number("ratio_min"), 3, 1e-12);
  EXPECT_NEAR(row.Number("ratio_max"), 3, 1e-12);
}

}  // namespace factorial_test
}  // namespace loopbench::harness
