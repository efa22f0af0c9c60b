// Records of runs and their timings, made by hand: for the tests of work-precision and its reports.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "harness/base/record.h"

namespace loopbench::harness::work_precision_records {

inline Record Keys(const std::string& kind, const std::string& formulation, double rtol) {
  Record record;
  record.Set("kind", kind);
  record.Set("experiment", std::string("e"));
  record.Set("mechanism", std::string("four-bar"));
  record.Set("formulation", formulation);
  record.Set("enforcement", std::string("projection"));
  record.Set("coordinates", std::string("joint"));
  record.Set("solver", std::string("rank-revealing"));
  record.Set("integrator", std::string("ode45"));
  record.Set("rtol", rtol);
  record.Set("atol", rtol);
  record.Set("horizon", 10.0);
  record.Set("case_id", kind + formulation + std::to_string(rtol));
  record.Set("outcome", std::string("finished"));
  return record;
}

inline Record RunOf(const std::string& formulation, double rtol, double error) {
  Record record = Keys("accuracy", formulation, rtol);
  record.Set("t_reached", 10.0);
  record.Set("warnings", std::string());
  record.Set("problem_id", std::string("problem"));
  record.Set("link_length", 2.0);
  record.Set("rhs_equivalents", 1.0 / error);
  record.Set("error_position_max", error);
  record.Set("machine", std::string("m"));
  record.Set("wall_s", 1e-9);  // beside other runs, observed: nobody's cost
  return record;
}

inline Record TimingOf(const std::string& formulation, double rtol, double wall) {
  Record record = Keys("timing", formulation, rtol);
  record.Set("wall_s_median", wall);
  record.Set("series.wall_s", std::vector<double>{wall});
  record.Set("machine", std::string("m"));
  record.Set("noise", std::string());
  return record;
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
