// What users choose of a formulation: level of enforcement, kind of solver, gains.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace loopbench {

/// At which level the constraints hold in the right-hand side (docs/design.md D3; level.h).
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
  std::string_view name;          ///< in files and tables
  std::string_view abbreviation;  ///< in tables of a terminal
  DriftGrowth growth;
  std::string_view sentence;  ///< what `explain` says of it, after "name: "
};

/// In the order of Enforcement.
inline constexpr std::array<LevelTraits, 4> kLevelTraits = {{
    {"acceleration", "accel", DriftGrowth::kSquare,
     "the loops' accelerations are imposed. Speeds and positions follow by integration, and errors "
     "in them stay."},
    {"velocity", "veloc", DriftGrowth::kLinear,
     "the speeds satisfy the loops too; positions follow by integration."},
    {"position", "posit", DriftGrowth::kNone,
     "as acceleration, and after each accepted step positions and speeds are moved back to where "
     "the loops hold."},
    {"baumgarte", "baumgarte", DriftGrowth::kForgotten,
     "as acceleration, with feedback: a mismatch e obeys e'' + 2 alpha e' + beta^2 e = 0, alpha = "
     "beta = 0.05 over the longest step unless given."},
}};

constexpr const LevelTraits& TraitsOf(Enforcement level) {
  return kLevelTraits[static_cast<std::size_t>(level)];
}

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
  /// steps shorter still (docs/numerics.md, section 3).
  std::optional<BaumgarteGains> gains = std::nullopt;
};

}  // namespace loopbench
