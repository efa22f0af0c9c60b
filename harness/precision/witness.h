// One integration of a mechanism in a wide scalar: what a reference is certified by.
#pragma once

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

template <class Space, class S>
struct Witness {
  std::string_view formulation;  ///< "lagrange" or "odca"
  S tolerance = S(0);
  Outcome outcome = Outcome::kFinished;
  std::string message;
  std::vector<VectorX<S>> positions;      ///< q of the mechanism in joint coordinates, by time
  std::vector<Moment<Space, S>> moments;  ///< by time, as far as it got
  std::int64_t rhs_evaluations = 0;
  double cpu_s = 0.0;
};

/// Follows the motion from its closed start (closed_start.h) through `times` [s], the first of them
/// 0, by Gragg's method at level `position` without softening. Steps end at the times, and where a
/// prescribed motion or a table has a knot.
///
/// `fewer` columns than usual are extrapolated: where the times alone decide the steps, witnesses
/// of as many columns round alike and would not see it.
template <class Space, class S>
Witness<Space, S> Follow(const MechanismDescription& description, std::string_view formulation,
                         S tolerance, int fewer, const std::vector<double>& times, double cpu_s);

}  // namespace loopbench::harness
