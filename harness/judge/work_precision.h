// Work-precision comparison: Pareto fronts, and equality of settings among the compared methods.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

// Cost of accuracy: each accuracy run of a store with the time of the same case, the Pareto front
// of each problem, and the cheapest method of each formulation for an error.
//
// A run that failed or has warnings is a row with its reason. It is excluded from fronts and from
// the cheapest methods, because its error is unreliable.

/// Options of the work-precision comparison.
struct WorkPrecisionOptions {
  /// Key of the error; "" for the first of UsualErrors() that records have.
  std::string error = "";
  /// Key of the cost, in accuracy records or in the timing of the same case. "wall_s" is the median
  /// of timed simulations, never the wall time of accuracy runs, which share the machine and are
  /// observed. "": "wall_s", or "rhs_equivalents" without timings.
  std::string cost = "";
  /// Rows with equal values of these keys form a problem; only rows of one problem are compared.
  std::vector<std::string> per = {"mechanism", "horizon"};
  std::vector<double> classes = {1e-3, 1e-6, 1e-9};  ///< error limits
  Selection where = {};  ///< selection of accuracy records, joined with their timings
};

/// Returns keys of errors, most reliable first: errors against a certified reference, errors
/// against exact motions, then indirect indicators of error.
std::span<const char* const> UsualErrors();

/// Returns true if an error is a distance [m] between points and a certified reference's points.
bool IsErrorOfPositions(const std::string& key);

/// Accuracy run with its cost.
struct WorkPrecisionRow {
  Record record;  ///< the run's record with additional keys of its timing
  Record timing;  ///< timing of the same case; without keys if there is none
  double error = std::numeric_limits<double>::quiet_NaN();
  double cost = std::numeric_limits<double>::quiet_NaN();
  /// True if the measured error is not above the certified error of the reference. `error` is then
  /// an upper bound, the sum of both.
  bool is_bound = false;
  std::string reason = "";  ///< reason why it is not compared, or ""
  bool on_front = false;    ///< Pareto-optimal among the compared rows of its problem
};

/// Cheapest compared row of a formulation within an error limit.
struct Cheapest {
  double error_class = 0.0;
  std::string formulation;
  int row = -1;  ///< index into the problem's rows; -1: none
  double ratio = std::numeric_limits<double>::quiet_NaN();  ///< cost relative to the cheapest of
                                                            ///< all formulations
};

/// Rows of one mechanism and horizon (WorkPrecisionOptions::per), cheapest first, rows without cost
/// last; and for each error limit the cheapest row of each formulation.
struct WorkPrecisionProblem {
  std::string name;  ///< "four-bar, horizon 10"
  std::vector<WorkPrecisionRow> rows;
  std::vector<Cheapest> cheapest;
};

struct WorkPrecision {
  std::string error;  ///< key of the error
  std::string cost;   ///< key of the cost; "wall_s_median" for "wall_s"
  std::vector<WorkPrecisionProblem> problems;
  std::vector<std::string> remarks;  ///< one sentence for each substituted key
};

/// @throws ConfigError if no accuracy record passes `where`, no record has the error or the cost,
/// or an option names a key that no record has.
WorkPrecision MakeWorkPrecision(std::span<const Record> records,
                                const WorkPrecisionOptions& options);

// Fairness of the comparison: settings that were equal and different among the compared rows, read
// from the records.

/// Returns one line each: equal settings, with values shared by all problems; different settings,
/// with values and numbers of rows; settings missing in records; the error and the cost, with their
/// accuracy; numbers of rows not compared, with reasons; warnings ("warning: ...") if costs are
/// incomparable times.
std::vector<std::string> FairnessStatement(const WorkPrecision& work_precision);

}  // namespace loopbench::harness
