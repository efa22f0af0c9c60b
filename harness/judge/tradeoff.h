// Work and precision: Pareto fronts, and what was equal among the methods compared.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "harness/record/record.h"
#include "harness/record/select.h"

namespace loopbench::harness {

// What accuracy costs: each accuracy run of a store beside the time that the very same case took,
// the Pareto front of each problem, and the cheapest method of each formulation for an error.
//
// A run that failed, or finished with doubts, is a row with its reason, but stands on no front and
// is nobody's cheapest: its error is not one to rely on.

/// What is compared with what.
struct TradeoffOptions {
  /// Key of records that is the error; "" for the first of UsualErrors() that records have.
  std::string error = "";
  /// Key that is the cost: of accuracy records, or else of the timing of the same case. "wall_s" is
  /// the median of timed simulations, never the wall time of accuracy runs, which share the machine
  /// and are observed. "" for that, or where nothing was timed for "rhs_equivalents".
  std::string cost = "";
  /// Rows that share the values of these keys are one problem, and only they are compared.
  std::vector<std::string> per = {"mechanism", "horizon"};
  std::vector<double> classes = {1e-3, 1e-6, 1e-9};  ///< errors that are asked for
  Selection where = {};  ///< of accuracy records with what their timings add
};

/// The errors that a store may have, the best known first: against a certified reference, against
/// exact motions; at the end what is no error but speaks of one.
std::span<const char* const> UsualErrors();

/// Whether an error is a length [m] between points and those of a certified reference.
bool IsErrorOfPositions(const std::string& key);

/// One accuracy run with what it cost.
struct TradeoffRow {
  Record record;  ///< the run's, and what its timing says besides
  Record timing;  ///< of the same case; without keys where there is none
  double error = std::numeric_limits<double>::quiet_NaN();
  double cost = std::numeric_limits<double>::quiet_NaN();
  /// The measured error is not above what the reference itself is certified to; `error` is then
  /// the bound that both allow, their sum.
  bool is_bound = false;
  std::string reason = "";  ///< why it is not compared, "" for a row that is
  bool on_front =
      false;  ///< no compared row of its problem is better in one and not worse in the other
};

/// The cheapest compared row of a formulation whose error is in a class.
struct Cheapest {
  double error_class = 0.0;
  std::string formulation;
  int row = -1;  ///< index into the problem's rows; -1: none reached it
  double ratio = std::numeric_limits<double>::quiet_NaN();  ///< to the cheapest of all formulations
};

/// Rows of one mechanism and horizon (TradeoffOptions::per), the cheapest first, those without a
/// cost last, and for each class in turn each formulation.
struct TradeoffProblem {
  std::string name;  ///< "four-bar, horizon 10"
  std::vector<TradeoffRow> rows;
  std::vector<Cheapest> cheapest;
};

struct Tradeoff {
  std::string error;  ///< the key that was taken
  std::string cost;   ///< likewise; "wall_s_median" for "wall_s"
  std::vector<TradeoffProblem> problems;
  std::vector<std::string> remarks;  ///< what was taken instead of what, one sentence each
};

/// @throws ConfigError when no accuracy record passes `where`, no record has the error or the cost,
/// or an option names a key that no record has.
Tradeoff MakeTradeoff(std::span<const Record> records, const TradeoffOptions& options);

// Whether rows that are compared differ in more than what the comparison is about: what was equal
// in all of them and what was not, read from the records.

/// One line each: what was equal among the compared rows of every problem, with its value where all
/// problems share it; what was not, with its values and how many rows had them; what no record
/// says; the error and the cost, and what they can be trusted to; how many rows were not compared,
/// and why; warnings ("warning: ...") where costs are times that do not compare.
std::vector<std::string> FairnessStatement(const Tradeoff& tradeoff);

}  // namespace loopbench::harness
