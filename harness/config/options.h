// Butcher tables, integrator profiles and options, independent of SUNDIALS.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench::harness {

/// Coefficients of an explicit or diagonally implicit Runge-Kutta method:
///   Y_i = y + h sum_j A_ij f(t + c_j h, Y_j),  y_new = y + h sum_i b_i f(t + c_i h, Y_i).
/// The embedded solution has the weights b_embedded; their difference estimates the error.
struct ButcherTable {
  std::string name;
  std::vector<std::vector<double>> A = {};
  std::vector<double> b, c;
  std::vector<double> b_embedded = {};  ///< empty: no error estimate, so fixed steps only
  int order = 0, embedded_order = 0;    ///< as claimed; 0: no embedding

  int stages() const { return static_cast<int>(b.size()); }
  bool is_implicit() const;  ///< a coefficient on the diagonal is not zero

  friend bool operator==(const ButcherTable&, const ButcherTable&) = default;
};

inline constexpr int kMaxOrder = 10;   ///< 1205 conditions
inline constexpr int kMaxStages = 64;  ///< more than any published method

/// Largest relative error of an order condition and absolute error of a row sum. Coefficients
/// published with twelve digits satisfy it; an error in one of the first eight digits does not.
inline constexpr double kOrderTolerance = 1e-9;

/// Violated property of a table.
struct TableFault {
  std::string key;  ///< of the file: "A", "b", "c", "b_embedded", "order" or "embedded_order"
  std::string found, expected;
};

/// Returns the first violated property, or nothing: sizes, finite coefficients, no coefficient
/// above the diagonal, c the row sums of A, and all order conditions up to the orders claimed
/// (rooted trees: E. Hairer, S. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
/// section II.2).
std::optional<TableFault> FaultOf(const ButcherTable& table);

/// Returns all data of the table, for the identity of cases.
std::string ToString(const ButcherTable& table);

/// Returns the tables of the installed ARKODE, explicit ones first, by ARKODE's names.
std::vector<ButcherTable> ArkodeTables();

/// Options of all profiles besides method and tolerances, as in experiment files. Each has a row in
/// experiment_integrators.cpp.
struct Integration {
  /// Longest step in seconds; 0 is the profile's own (ode45: a tenth of the interval; else none).
  double max_step = 0;

  /// Length of the first step in seconds; 0 is the profile's own choice.
  double initial_step = 0;

  /// Limit of Newton's iterations in a stage of an implicit profile; 0: 8, and 50 at a fixed step.
  int max_newton_iterations = 0;

  /// Newton's iteration ends at an estimated error of this part of the tolerances. At ARKODE's 0.1
  /// it dominates the global error.
  double newton_coefficient = 0.01;

  friend bool operator==(const Integration&, const Integration&) = default;
};

/// Options of the integrator. A profile is a Runge-Kutta pair with an error norm, a step-size
/// controller and a first-step rule. All of them change drift (by factors of two to four), so a
/// comparison must name its profile.
///
/// | profile          | pair                  | order | norm, controller                         |
/// |------------------|-----------------------|-------|------------------------------------------|
/// | ode45            | Dormand-Prince 5(4)   | 5     | MATLAB: max norm, I controller           |
/// | dormand-prince   | the same pair         | 5     | ARKODE: weighted RMS norm, PI controller |
/// | bogacki-shampine | Bogacki-Shampine 3(2) | 3     | as dormand-prince                        |
/// | cash-karp        | Cash-Karp 5(4)        | 5     | as dormand-prince                        |
/// | fehlberg         | Fehlberg 5(4)         | 5     | as dormand-prince                        |
/// | verner           | Verner 6(5)           | 6     | as dormand-prince                        |
/// | fehlberg-78      | Fehlberg 8(7)         | 8     | as dormand-prince                        |
///
/// Implicit, for stiff mechanisms; norm and controller as dormand-prince. Each step solves for its
/// stages one after the other by Newton's iteration with a dense matrix.
///
/// | profile              | pair              | order | stability; R(inf) of the embedding |
/// |----------------------|-------------------|-------|------------------------------------|
/// | trbdf2               | TR-BDF2           | 2     | L; unbounded                       |
/// | kennedy-carpenter-32 | ESDIRK3(2)4L[2]SA | 3     | L; 0.22                            |
/// | kennedy-carpenter-43 | ESDIRK4(3)6L[2]SA | 4     | L; 0                               |
/// | kvaerno-54           | ESDIRK5/4         | 5     | L; 0.75                            |
/// | kennedy-carpenter-54 | ESDIRK5(4)7L[2]SA | 5     | L; 0.35                            |
///
/// Sources: R. Bank et al., IEEE Trans. Electron Devices 32, 1985, and M. Hosea, L. Shampine, Appl.
/// Numer. Math. 20, 1996 (TR-BDF2); A. Kvaerno, BIT 44, 2004; C. Kennedy, M. Carpenter,
/// NASA/TM-2016-219173. Some other tables of ARKODE have an embedding that amplifies stiff
/// components, such as SDIRK 5(3)4.
///
/// Every table of the installed ARKODE is a profile, too, under ARKODE's own name such as
/// "ARKODE_ZONNEVELD_5_3_4", with norm and controller as dormand-prince. So are user-defined
/// tables, from experiments or RegisterIntegrator().
///
/// "ode45" follows MATLAB's function of that name (L. Shampine, M. Reichelt, The MATLAB ODE suite,
/// 1997): step counts agree with it within about 1 %.
struct IntegratorOptions : Integration {
  std::string profile = "ode45";

  /// Relative and absolute tolerance of one step's error estimate. ode45 accepts if
  /// max_i |e_i| / max(rtol |y_i|, atol) <= 1, the others if rms_i |e_i| / (rtol |y_i| + atol)
  /// <= 1.
  double rtol = 1e-8;
  double atol = 1e-8;
  /// If not empty, the absolute tolerance of each component, without quadratures, instead of atol.
  std::vector<double> atols = {};

  /// Accepted steps before the run ends with kStepLimit.
  std::int64_t step_limit = 10'000'000;

  /// CPU time of the thread in seconds before the run ends with kTimeLimit, without waiting for a
  /// processor. Checked after every accepted step and on every 16th derivative.
  double time_limit_s = 600;

  /// If positive, every step has this length and no error test is made. The last step, and steps
  /// that end at a stop time, are clipped. Tolerances are then used by Newton's iteration only.
  double fixed_step = 0;

  /// Times, in order, at which a step must end because f or a derivative of it jumps there: knots
  /// of prescribed motions and of tables. The step that ends at such a time evaluates f before it
  /// only (at the last representable time before it if a stage lies at the end). The next step
  /// evaluates f again at it, with the step length before clipping. Without stops a method loses
  /// its order at the jump, and the error test detects only part of the error. Times outside (t0,
  /// t_end] have no effect; times closer than 100 round-offs of the interval's ends are merged.
  std::vector<double> stop_times;
};

/// Exclusive lower limit of the relative tolerance: at the spacing of doubles, errors are
/// indistinguishable from rounding, and ARKODE takes no step (ARK_TOO_MUCH_ACC).
inline constexpr double kMinTolerance = std::numeric_limits<double>::epsilon();

/// Tolerance of Newton's iteration for implicit profiles in runs with a fixed step. The iteration
/// error is a hundredth, 1e-12: far below the error of useful steps, and a thousand times
/// above round-off, where the iteration would not converge.
inline constexpr double kToleranceOfFixedSteps = 1e-10;

/// Returns "" for valid options, otherwise a sentence with an option, its value and allowed ones.
std::string Validate(const IntegratorOptions& options);

/// Returns the names of the tables above, in their order.
std::vector<std::string> ProfileNames();

/// ARKODE's step-size controller. Every value is set by the profile, because ARKODE's own defaults
/// change between versions. Factors are of the step size, per step.
struct Controller {
  bool proportional;        ///< PI (0.8, 0.31) instead of I (1)
  bool uses_method_order;   ///< exponent 1/q of the solution instead of 1/p of the embedding
  double safety;            ///< multiplies the step that would just be accepted
  double bias;              ///< multiplies the error estimate before the controller sees it
  double growth;            ///< greatest factor between steps
  double first_growth;      ///< the same after the first step
  double reduction;         ///< least factor after a failed attempt
  double repeated_failure;  ///< greatest factor from the second failure of one step on
  double keep_below;        ///< the step is kept if it would grow by less than this factor
};

/// A Runge-Kutta method with the properties of a profile.
struct Profile {
  std::string name;
  ButcherTable table;
  Controller controller;
  bool is_ode45;  ///< MATLAB's norm, weights, first step and longest step
  bool is_own;    ///< user-defined: its coefficients are part of the identity of cases

  bool is_implicit;  ///< diagonally implicit, stages by Newton's iteration
  /// ARKODE 6.4.1 assumes that every table whose last abscissa is 1 is first-same-as-last, and
  /// loses order for other tables; a post-step hook, even an empty one, makes it evaluate the
  /// derivative at the new solution (LLNL/sundials issue 311, fixed in 6.7).
  bool needs_fresh_derivative;

  bool has_embedding() const { return !table.b_embedded.empty(); }
};

/// Returns the profile of that name, or nullptr. References stay valid.
const Profile* FindProfile(std::string_view name);

/// Returns all profiles: the table above, ARKODE's tables, user-defined tables.
const std::deque<Profile>& Profiles();
std::vector<std::string> IntegratorNames();

/// Adds a user-defined table with norm and controller as dormand-prince; not while experiments run.
/// Does nothing for a table that is registered already. Throws std::invalid_argument for the fault
/// that FaultOfIntegrator() returns.
void RegisterIntegrator(const ButcherTable& table);

/// Returns a fault of the table or its name: no word of a-z, 0-9, '-' and '_', or not a new one.
std::optional<TableFault> FaultOfIntegrator(const ButcherTable& table);

}  // namespace loopbench::harness
