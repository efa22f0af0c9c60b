// One integration of a mechanism in a wide scalar; several of them certify a reference.
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

/// State of a mechanism at one time.
template <class Space, class S>
struct Moment {
  std::vector<Pose<Space, S>> poses;        ///< at centres of mass, Ground first
  std::vector<Velocity<Space, S>> motions;  ///< as in the line above
  S energy = S(0);                          ///< kinetic and potential [J]
};

/// Times at which an integration is projected onto its constraints.
enum class PutBack {
  kAtSteps,  ///< level `projection`
  /// Also before every evaluation, so that derivatives belong to the constrained motion. That
  /// motion stays smooth at singular configurations; off the constraints it does not. The remaining
  /// error is rounding over the distance to the singular configuration.
  kAtStages
};

template <class S>
struct WitnessOptions {
  std::string_view formulation;  ///< "lagrange" or "odca"
  S tolerance = S(0);
  /// Number of extrapolation columns fewer than usual. If the times alone decide the steps,
  /// integrations with equal columns round alike and would not detect it.
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

/// Follows the motion from its closed start (exact.h) through `times` [s], the first of them 0, by
/// Gragg's method without regularization. Steps end at the times, and at knots of prescribed
/// motions or tables.
///
/// With projection at steps alone, a stretch between two times that needs ten times as many steps
/// as any before, and a thousand more, ends the integration: it contains a singular configuration.
/// With projection at stages, failing derivatives lead to smaller steps. From a step that ends in a
/// singular configuration, as from a start there, it continues with the regularized derivative.
template <class Space, class S>
Witness<Space, S> Follow(const MechanismDescription& description, const WitnessOptions<S>& options,
                         const std::vector<double>& times);

// Certified error of a reference from its independent integrations (make_reference.h).

/// The reference's tolerance in eps of the scalar: the round-off limit of the extrapolation
/// (integrator.h), with a margin. At a tenth of this tolerance, steps begin to be rejected for
/// rounding alone. Near singular configurations rounding grows with the inverse square of the
/// distance: no stage may come nearer than sqrt(eps / tolerance), 1e-6 in float128. Steps that
/// shrink for truncation have stages as near as 1e-5; at 1e10 eps some crossings of a kite fail.
template <class S>
constexpr double Tightest(PutBack put_back) {
  if (put_back == PutBack::kAtStages) return std::same_as<S, long double> ? 1e7 : 1e12;
  return std::same_as<S, long double> ? 1e3 : 1e6;
}
/// Tolerances of the other integrations over the reference's: multipliers', O-DCA's.
inline constexpr double kLooser = 30.0, kBetween = 5.0;
/// The looser integration's error is about kLooser times the reference's, so their distance alone
/// would suffice; the factor two covers the sum of round-off of all three.
inline constexpr double kSafety = 2.0;

/// Distances of one moment, or bounds on them: of centres of mass [m], bodies' orientations [rad],
/// speeds of both kinds, and energy [J].
template <class S>
struct WideDistance {
  S position = S(0), rotation = S(0), velocity = S(0), angular_velocity = S(0), energy = S(0);
};

template <class Space, class S>
struct Certified {
  Outcome outcome = Outcome::kFinished;  ///< outcome of the shortest integration
  std::string message, witnesses;
  Witness<Space, S> reference;
  std::vector<WideDistance<S>> bounds;  ///< by time, as far as all integrations got
  std::int64_t rhs_evaluations = 0;
  double cpu_s = 0.0;
};

/// `description` as it is run, with redundant constraints released. Each integration has `cpu_s`;
/// if the reference ends early, the others stop there.
template <class Space, class S>
Certified<Space, S> Certify(const MechanismDescription& description,
                            const std::vector<double>& times, double cpu_s,
                            PutBack put_back = PutBack::kAtSteps);

}  // namespace loopbench::harness
