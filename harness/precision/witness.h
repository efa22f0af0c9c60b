// One integration of a mechanism in a wide scalar: what a reference is certified by.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "harness/precision/scalars.h"
#include "mechanism/description/outcome.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

/// What a mechanism does at one time.
template <class Space, class S>
struct Moment {
  std::vector<Pose<Space, S>> poses;        ///< at centres of mass, Ground first
  std::vector<Velocity<Space, S>> motions;  ///< likewise
  S energy = S(0);                          ///< kinetic and potential [J]
};

/// Where a witness is put back onto its constraints.
enum class PutBack {
  kAtSteps,  ///< level `projection`
  /// Before every evaluation as well, so that derivatives are those of the constrained motion,
  /// which is smooth where constraints are singular but beside them is not. What is left is
  /// rounding, by the inverse of the distance to the singular position.
  kAtStages
};

template <class S>
struct WitnessOptions {
  std::string_view formulation;  ///< "lagrange" or "odca"
  S tolerance = S(0);
  /// Columns fewer than usual to extrapolate: where the times alone decide the steps, witnesses of
  /// as many columns round alike and would not see it.
  int fewer = 0;
  PutBack put_back = PutBack::kAtSteps;
  double cpu_s = 0.0;
};

template <class Space, class S>
struct Witness {
  Outcome outcome = Outcome::kFinished;
  std::string message;
  std::vector<VectorX<S>> positions;      ///< q of the mechanism in joint coordinates, by time
  std::vector<Moment<Space, S>> moments;  ///< by time, as far as it got
  std::int64_t rhs_evaluations = 0;
  double cpu_s = 0.0;
};

/// Follows the motion from its closed start (exact.h) through `times` [s], the first of them
/// 0, by Gragg's method without softening. Steps end at the times, and where a prescribed motion
/// or a table has a knot.
///
/// A witness that is put back at steps alone ends where a stretch between two times takes ten times
/// as many as any before, and a thousand more: a singular position is in it. One that is put back
/// at stages tries smaller steps about derivatives that cannot be had, and goes on from a step that
/// ends in a singular position, as from a start there, with the softened one.
template <class Space, class S>
Witness<Space, S> Follow(const MechanismDescription& description, const WitnessOptions<S>& options,
                         const std::vector<double>& times);

// What the witnesses of a reference say together (make_reference.h): the certified error.

/// The reference's tolerance in eps of the scalar: what round-off lets the extrapolation reach
/// (integrator.h), with room. At a tenth of it steps begin to be rejected for rounding alone. Near
/// singular positions rounding is larger by the inverse square of the distance to them: no stage
/// may come nearer than sqrt(eps / tolerance), 1e-6 in float128. Steps that shrink for truncation
/// bring their stages as near as 1e-5; at 1e10 eps not every passage of a kite succeeds.
template <class S>
constexpr double Tightest(PutBack put_back) {
  if (put_back == PutBack::kAtStages) return std::same_as<S, long double> ? 1e7 : 1e12;
  return std::same_as<S, long double> ? 1e3 : 1e6;
}
/// The other witnesses' tolerances over that one: multipliers', O-DCA's.
inline constexpr double kLooser = 30.0, kBetween = 5.0;
/// The looser witness errs by some kLooser times as much as the reference, so that their distance
/// alone would do; twice covers that round-off of the three may add up.
inline constexpr double kSafety = 2.0;

/// Distances of one moment, or bounds on them: of centres of mass [m], bodies' orientations [rad],
/// speeds of both kinds, and energy [J].
template <class S>
struct WideDistance {
  S position = S(0), rotation = S(0), velocity = S(0), angular_velocity = S(0), energy = S(0);
};

template <class Space, class S>
struct Certified {
  Outcome outcome = Outcome::kFinished;  ///< of the witness that got least far
  std::string message, witnesses;
  Witness<Space, S> reference;
  std::vector<WideDistance<S>> bounds;  ///< by time, as far as all witnesses got
  std::int64_t rhs_evaluations = 0;
  double cpu_s = 0.0;
};

/// `description` as it is run: its redundant constraints released. Each witness has `cpu_s`; where
/// the reference ends early the others follow it no further.
template <class Space, class S>
Certified<Space, S> Certify(const MechanismDescription& description,
                            const std::vector<double>& times, double cpu_s,
                            PutBack put_back = PutBack::kAtSteps);

}  // namespace loopbench::harness
