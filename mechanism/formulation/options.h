// User options of a formulation: level of enforcement, kind of solver, gains.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace loopbench {

class SideBySide;

/// Level of the constraints in the right-hand side (docs/decisions/003; level.h). User-defined
/// levels follow.
enum class Enforcement {
  kAcceleration,  ///< accelerations satisfy the constraints, speeds are integrated as they come
  kVelocity,      ///< speeds used in the right-hand side satisfy them too
  kPosition,      ///< as kAcceleration, and after each accepted step positions, then speeds are
                  ///< projected back to the constraints
  kBaumgarte,     ///< as kAcceleration, with feedback of position and velocity violations
};

/// Growth of position drift with accepted steps at a level.
enum class DriftGrowth {
  kSquare,     ///< errors of speeds stay and are integrated
  kLinear,     ///< errors of positions stay
  kNone,       ///< nothing stays
  kForgotten,  ///< as kSquare, over the steps that feedback remembers
};

/// Name, description and expected drift growth of an enforcement level (behaviour: level.h).
struct LevelTraits {
  std::string name;      ///< in files and tables: a-z, 0-9, '-' and '_'
  std::string sentence;  ///< text of `explain`, after "name: "
  DriftGrowth growth = DriftGrowth::kSquare;
  std::string abbreviation = {};  ///< in tables of a terminal; empty: the name
  /// True if changes_speeds() and gains() of its Level fully describe the difference from the
  /// right-hand side of `acceleration`. Its derivative then exists (forward_jacobian.h). Without
  /// it, implicit profiles need difference quotients and are rejected otherwise.
  bool has_derivative = false;
};

/// Returns all levels in the order of Enforcement: the built-in ones, then user-defined ones
/// (level.h) in the order of registration with the next enumerators. References stay valid.
const std::deque<LevelTraits>& Levels();
std::vector<std::string> LevelNames();
const LevelTraits& TraitsOf(Enforcement level);
/// Returns nothing for an unregistered name: stores may hold records of other programs.
std::optional<Enforcement> FindLevel(std::string_view name);
/// Returns true for built-in levels, which exist in all scalars.
constexpr bool IsBuiltIn(Enforcement level) { return level <= Enforcement::kBaumgarte; }

/// Gains [1/s] of Baumgarte stabilisation: a position violation e obeys e'' + 2 alpha e' + beta^2 e
/// = 0 (Baumgarte 1972; alpha = beta damps it critically).
struct BaumgarteGains {
  double alpha = 0.0, beta = 0.0;

  friend bool operator==(const BaumgarteGains&, const BaumgarteGains&) = default;
};

enum class SolverKind {
  kAsPublished,    ///< plain factorisations; a lost pivot ends the run as `singular`
  kRankRevealing,  ///< rank from geometry, degenerating directions regularized (loop_solver.h); for
                   ///< reduction: the independent set is chosen, and chosen again if it degrades
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
  /// Maximum number of threads for one right-hand side, if the formulation can use them. The bits
  /// do not depend on it.
  int threads = 1;
  /// Solvers use only the code common to all scalars: no fast paths, no sparse factors.
  bool general = false;
  /// Other runs of its batch (side_by_side.h), if any; must outlive the solver.
  SideBySide* beside = nullptr;
};

}  // namespace loopbench
