// Records of runs and their timings, made by hand: for the tests of work-precision and its reports.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "tests/harness/records.h"

namespace loopbench::harness::work_precision_records {

inline Record Keys(const std::string& kind, const std::string& formulation, double rtol) {
  return RecordOf("kind", kind, "experiment", "e", "mechanism", "four-bar", "formulation",
                  formulation, "enforcement", "projection", "coordinates", "joint", "solver",
                  "rank-revealing", "integrator", "ode45", "rtol", rtol, "atol", rtol, "horizon",
                  10.0, "case_id", kind + formulation + std::to_string(rtol), "outcome",
                  "finished");
}

inline Record RunOf(const std::string& formulation, double rtol, double error) {
  Record record =
      Changed(Keys("accuracy", formulation, rtol), "t_reached", 10.0, "warnings", "", "problem_id",
              "problem", "link_length", 2.0, "rhs_equivalents", 1.0 / error, "error_position_max",
              error, "machine", "m", "wall_s", 1e-9);  // beside other runs, observed: nobody's cost
  return record;
}

inline Record TimingOf(const std::string& formulation, double rtol, double wall) {
  return Changed(Keys("timing", formulation, rtol), "wall_s_median", wall, "series.wall_s",
                 std::vector<double>{wall}, "machine", "m", "noise", "");
}

/// Runs of error `errors[i]` with timings of `walls[i]`, all of them different cases.
inline std::vector<Record> Store(const std::vector<double>& errors,
                                 const std::vector<double>& walls) {
  std::vector<Record> records;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const std::string formulation = i % 2 == 0 ? "odca" : "lagrange";
    const double rtol = std::pow(10.0, -3.0 - static_cast<double>(i));
    records.push_back(RunOf(formulation, rtol, errors[i]));
    records.push_back(TimingOf(formulation, rtol, walls[i]));
  }
  return records;
}

}  // namespace loopbench::harness::work_precision_records
