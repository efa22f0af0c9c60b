// What users choose of a formulation: level of enforcement, kind of solver, gains.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench {

class SideBySide;

/// At which level the constraints hold in the right-hand side (docs/decisions/003; level.h). Levels
/// of other programs follow.
enum class Enforcement {
  kAcceleration,  ///< accelerations satisfy the constraints, speeds are integrated as they come
  kVelocity,      ///< speeds used in the right-hand side satisfy them too
  kPosition,      ///< as kAcceleration, and after each accepted step positions, then speeds are
                  ///< projected back to the constraints
  kBaumgarte,     ///< as kAcceleration, with feedback of the mismatch of positions and speeds
};

/// How drift of positions grows with accepted steps at a level.
enum class DriftGrowth {
  kSquare,     ///< errors of speeds stay and are integrated
  kLinear,     ///< errors of positions stay
  kNone,       ///< nothing stays
  kForgotten,  ///< as kSquare, over the steps that feedback remembers
};

/// What a level is called and what it lets one expect; what it does stands in level.h.
struct LevelTraits {
  std::string name;      ///< in files and tables: a-z, 0-9, '-' and '_'
  std::string sentence;  ///< what `explain` says of it, after "name: "
  DriftGrowth growth = DriftGrowth::kSquare;
  std::string abbreviation = {};  ///< in tables of a terminal; empty: the name
  /// Whether its Level's changes_speeds() and gains() say all by which the right-hand side differs
  /// from that of `acceleration`: then there is a derivative of it (forward_jacobian.h). Without
  /// one, implicit profiles have to make difference quotients, and are refused otherwise.
  bool has_derivative = false;
};

/// All levels in the order of Enforcement: the built-in ones, then those of other programs in the
/// order of their registration (level.h), whose enumerators are the next values. They stay where
/// they are.
const std::deque<LevelTraits>& Levels();
std::vector<std::string> LevelNames();
const LevelTraits& TraitsOf(Enforcement level);
/// Nothing for a name that is not registered: stores may hold records of other programs.
std::optional<Enforcement> FindLevel(std::string_view name);
/// Whether it comes with Loopbench, in all scalars.
constexpr bool IsBuiltIn(Enforcement level) { return level <= Enforcement::kBaumgarte; }

/// Gains [1/s] of Baumgarte's stabilisation: a mismatch e of positions obeys
/// e'' + 2 alpha e' + beta^2 e = 0 (Baumgarte 1972; alpha = beta damps it critically).
struct BaumgarteGains {
  double alpha = 0.0, beta = 0.0;

  friend bool operator==(const BaumgarteGains&, const BaumgarteGains&) = default;
};

enum class SolverKind {
  kAsPublished,    ///< plain factorisations; a lost pivot ends the run as `singular`
  kRankRevealing,  ///< rank from geometry, degenerating directions softened (loop_solver.h);
                   ///< for reduction: the independent set is chosen, and chosen again when it ages
};

std::string_view ToString(Enforcement level);
std::string_view ToString(SolverKind solver);

struct FormulationOptions {
  Enforcement enforcement = Enforcement::kAcceleration;
  SolverKind solver = SolverKind::kRankRevealing;
  /// kBaumgarte only. Without them alpha = beta = 0.05/h with the longest accepted step h so far:
  /// zero while steps still double from one to the next, set again when h has doubled. Gains near
  /// 1/h hold steps back; gains that follow shorter steps magnify round-off by 1/h^2, which makes
  /// steps shorter still (docs/theory/constraints-and-drift.md).
  std::optional<BaumgarteGains> gains = std::nullopt;
  /// That may work on one right-hand side, where a formulation has work for them. The same bits for
  /// any number.
  int threads = 1;
  /// Solvers use the text that serves all scalars alone: no short cuts, no sparse factors.
  bool general = false;
  /// Runs beside which this one goes on (side_by_side.h), if any; it must outlive the solver.
  SideBySide* beside = nullptr;
};

}  // namespace loopbench
