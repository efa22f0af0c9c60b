// Growth of drift with time and of time with size: fits and their tests.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace loopbench::harness {

// Best-fitting law of growth: t^(1/2), t, t^(3/2), t^2, or e^(k t).

/// One run's drift: times since release in s, increasing, and drift in the unit of a length (signs
/// are dropped). Samples belong to accepted steps. A value that is not finite ends the run.
struct DriftSeries {
  std::vector<double> t;
  std::vector<double> value;
};

struct HypothesisOptions {
  /// Readings of a running maximum are correlated. 64 readings over about ten swings carry the
  /// information of this many independent ones. Used only for the penalty of a parameter.
  double independent_readings = 16;

  /// Maximum distance of the fitted exponent from an accepted hypothesis. It covers the bias of a
  /// running maximum (0.05) and of finite windows (fitted exponents of mechanisms are 1.84 to 2.08
  /// instead of 2). It is below a third of the half unit between hypotheses.
  double exponent_tolerance = 0.15;

  /// Minimum growth of e^(k t) within the window; slower growth looks like a plateau.
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
  /// Root-mean-square residual of log drift: best rival over winner (geometric means over the
  /// members). 1 is a tie, 3 is clear. NaN without data.
  double ratio;
  double rate;  ///< mean k of e^(k t) over the members [1/s], for any winner; NaN without data
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
/// Score differences between two hypotheses are formed member by member. Their standard error over
/// the members decides whether a rival is refuted: members are independent, readings of one run are
/// not (Vuong's model comparison, paired by run).
///
/// @param exponent  mean of the fitted exponents over the members, same window.
Hypothesis CompareHypotheses(std::span<const DriftSeries> readings, double exponent,
                             const HypothesisOptions& options = {});

// The exponent p in "drift grows like t^p", from an ensemble of runs, with an honest spread.

/// Cut-offs and minimum window lengths. Fractions of time refer to the end of the usable part of
/// the runs.
struct GrowthOptions {
  /// Starts of the two windows. Earlier growth is affected by the few first steps and by a first
  /// swing that may differ from later ones.
  double window_start = 0.1;
  double late_window_start = 0.5;

  /// Number of times at which the running maximum is read, evenly spaced in log t for equal weight
  /// per decade. The integrator's own samples would give the last decade nine tenths.
  int points = 64;

  /// Drift above this fraction of `length` is no longer small, and stops growing: cut off.
  double saturation = 0.1;

  /// Drift below this many round-offs of `length` is the evaluation's own noise: cut off.
  double floor = 10;

  /// A final drift below this many round-offs of `length` is called "round-off". A thousand is the
  /// effect of rounding after N = 1e4 steps: random velocity errors add up to eps v sqrt(N),
  /// positions to eps v T sqrt(N / 3), with v T about ten lengths. Truncation at the tightest
  /// tolerance in use (1e-12) leaves more than ten thousand.
  double round_off = 1e3;

  /// "too-short" unless the first window's end is this many times its start (saturation and floor
  /// may have clipped it) and every run has this many samples in the late window.
  double shortest_ratio = 4;
  int fewest_samples = 16;

  /// Fewer members than this never resolve an exponent.
  int fewest_members = 8;

  /// Means of the two windows that differ by less than this agree even if the spread is smaller.
  /// The running maximum of a drift with period P lags by up to P, which alone raises a slope p by
  /// some p P / (2 t), t being the window's start: 0.04 for p = 2 and seven periods. The spread
  /// does not show this bias, so windows should start after several periods.
  double slope_bias = 0.05;

  /// Largest standard error of either mean. Exponents that theory offers (1/2, 1, 3/2, 2) lie half
  /// a unit apart; two standard errors must stay within half of that.
  double largest_error = 0.125;

  HypothesisOptions hypotheses = {};
};

/// Result of the analysis. Exponents and spreads are NaN if not available.
struct Growth {
  double exponent;       ///< mean over the members, window [0.1 T, T]
  double spread;         ///< sample standard deviation over the members; NaN for one member
  double exponent_late;  ///< the same for the window [0.5 T, T]
  double spread_late;
  bool resolved;          ///< see AnalyseGrowth()
  std::string regime;     ///< "truncation", "round-off", "saturated" or "too-short"
  int members;            ///< number of runs
  double t_from;          ///< start of the first window, s; later than 0.1 T if the floor clips it
  double t_to;            ///< T, end of both windows, s; before the runs' end if drift saturates
  Hypothesis hypothesis;  ///< which law fits best in the first window
  bool hypothesis_resolved;  ///< see AnalyseGrowth()
};

/// Least-squares slope of log(running maximum) against log t, per run and window; mean and spread
/// over the ensemble.
///
/// The residual scatter of one fit underestimates its error by a factor of 3 to 12 because
/// residuals are periodic and correlated. The spread therefore comes from 16 to 32 runs with
/// perturbed starts. One run resolves nothing.
///
/// All members use the same windows: T is the earliest of t_end, a run's end and saturation, and
/// the first window starts no earlier than the last member leaves the floor.
///
/// *Resolved* means all of:
///  1. at least `fewest_members` members and windows that are not too short;
///  2. |exponent - exponent_late| <= max(s, slope_bias) with s^2 the mean of the squares of the two
///     spreads. The measure is the spread and not the standard error s / sqrt(m): the question is
///     whether one power law holds on both windows within the scatter of runs, and that must not
///     become harder to affirm the more runs there are;
///  3. s / sqrt(m) <= largest_error for either spread, because with a large spread the second
///     condition would hold for any numbers.
///
/// *Regime*: "round-off" if the geometric mean of the final running maxima is below `round_off`;
/// else "too-short" if a window is; else "saturated" if some member passes saturation before t_end
/// (the exponent then describes the time before); else "truncation". The regime is read off the
/// size of the drift alone, so it is a label, not a diagnosis.
///
/// *Hypothesis*: see CompareHypotheses(). It is resolved when it refutes its rivals and, for a
/// power law, the exponent is resolved too; so an exponential law can be resolved while no exponent
/// is.
///
/// @param length  characteristic length of the mechanism (a link), in the unit of the drift.
/// @throws std::invalid_argument if t and value differ in size or length is not positive.
Growth AnalyseGrowth(std::span<const DriftSeries> runs, double t_end, double length,
                     const GrowthOptions& options = {});

/// Returns the running maximum of |value| at `points` times spaced evenly in log t, from the first
/// positive time to the last. It is a compact log-log curve of drift. Empty if there is no interval
/// or points < 2.
DriftSeries Envelope(const DriftSeries& series, int points);

// Fits the exponent p of cost = c size^p.
//
// Least squares of log(cost) against log(size), one point per size. Costs of real programs are not
// powers (fixed costs at small sizes, caches at large ones), so the fit comes with two spreads: the
// standard error from the residuals, and the range of slopes between neighbouring sizes.

struct PowerFit {
  int sizes = 0;                         ///< points used; below 2 everything else is NaN
  double smallest = 0.0, largest = 0.0;  ///< sizes at the ends
  double exponent = 0.0;
  double standard_error = 0.0;  ///< of the exponent; NaN with two points, which fit any line
  double coefficient = 0.0;     ///< cost at size 1 of the fitted line
  double slope_min = 0.0, slope_max = 0.0;  ///< between neighbouring sizes
};

/// Points with a size or cost that is not positive and finite are left out; of equal sizes the
/// geometric mean of their costs counts as one point.
PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs);

}  // namespace loopbench::harness
