// Which law of growth fits best: t^(1/2), t, t^(3/2), t^2, or e^(k t).
#pragma once

#include <span>
#include <string>
#include <vector>

namespace loopbench::harness {

/// One run's drift: times since release in s, increasing, and drift in the unit of a length (signs
/// are dropped). Samples belong to accepted steps. A value that is not finite ends the run.
struct DriftSeries {
  std::vector<double> t;
  std::vector<double> value;
};

struct HypothesisOptions {
  /// Readings of a running maximum are correlated: 64 of them over a window of some ten swings
  /// tell no more than so many independent ones. Used for the price of a parameter alone.
  double independent_readings = 16;

  /// How far the fitted exponent may lie from a hypothesis that is still said to hold: the bias of
  /// a running maximum (0.05, growth.h) and of windows that are not endless (exponents of
  /// mechanisms come out as 1.84 to 2.08 where theory says 2), below a third of the half unit
  /// between hypotheses.
  double exponent_tolerance = 0.15;

  /// e^(k t) must grow by this factor within the window; slower ones cannot be told from a plateau.
  double least_factor = 2.718281828459045;

  /// A rival is refuted when its mean score lags by so many standard errors: 99 % for 8 members
  /// (Student's t, one-sided, 7 degrees of freedom: 3.0), more for more.
  double standard_errors = 3.0;

  /// Fewer members than this refute nothing.
  int fewest_members = 8;
};

/// The answer.
struct Hypothesis {
  std::string name = "none";  ///< "t^0.5", "t^1", "t^1.5", "t^2", "exponential" or "none"
  bool refutes_rivals = false;
  /// Root-mean-square residual of log drift of the best rival over that of the winner (geometric
  /// means over the members): 1 is a tie, 3 is plain to see. NaN without data.
  double ratio;
  double rate;  ///< mean k of e^(k t) over the members, 1/s, whoever wins; NaN without data
};

/// Compares the hypotheses on running maxima read at times spaced evenly in log t, one series per
/// member of the ensemble, all over the same window.
///
/// Fit: least squares of log(drift), so that errors are relative and every decade counts the same.
/// Power laws have one free number (the factor), e^(k t) has two. The score of a hypothesis in one
/// member is ln(mean square residual) + m ln(n) / n with m free numbers and n
/// `independent_readings`: the Bayesian information criterion per reading. The winner has the least
/// mean score over the members. It is "none" when a power law wins whose exponent is further than
/// `exponent_tolerance` from the mean of the fitted ones, or when e^(k t) wins without growing by
/// `least_factor` or without beating a power law of free exponent.
///
/// Differences of score between two hypotheses are taken member by member, and their standard error
/// over the members says whether a rival is refuted: members are independent of each other,
/// readings of one run are not (Vuong's comparison of models, paired by run).
///
/// @param exponent  mean of the fitted exponents over the members, same window.
Hypothesis CompareHypotheses(std::span<const DriftSeries> readings, double exponent,
                             const HypothesisOptions& options = {});

}  // namespace loopbench::harness
