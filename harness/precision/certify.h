// What the witnesses of a reference say together (make_reference.h): the certified error.
#pragma once

#include <concepts>
#include <string>
#include <vector>

#include "harness/precision/scalars.h"
#include "harness/precision/witness.h"

namespace loopbench::harness {

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
