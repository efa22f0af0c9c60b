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

/// Where a witness is put back onto its constraints.
enum class PutBack {
  kAtSteps,  ///< level `position`
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

/// Follows the motion from its closed start (closed_start.h) through `times` [s], the first of them
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

}  // namespace loopbench::harness
