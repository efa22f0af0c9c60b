// A mechanism in a wide scalar: its start, and the comparison of its state with runs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/precision/scalars.h"
#include "mechanism/description/outcome.h"
#include "mechanism/formulation/system.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

template <class Space, class S>
struct ClosedStart {
  Outcome outcome = Outcome::kFinished;
  std::string message;
  std::unique_ptr<Mechanism<Space, S>> mechanism;  ///< in joint coordinates
  std::unique_ptr<System<Space, S>> system;        ///< at the start; null if there is none
};

/// Assembles the start in double and closes its loops in S: positions, then speeds, by the
/// projection of level `projection`.
template <class Space, class S>
ClosedStart<Space, S> CloseStart(const MechanismDescription& description);

// A mechanism in the widest scalar: its initial state, and the reference for all runs' states.

class Exact {
 public:
  /// Assembles the start in double and closes its loops in Float128: positions, then speeds, by the
  /// projection of level `projection`.
  Exact(const MechanismDescription& description, Coordinates coordinates);

  Outcome outcome() const { return outcome_; }  ///< of the start
  const std::string& message() const { return message_; }
  const VectorX<Float128>& q() const { return q_; }
  const VectorX<Float128>& u() const { return u_; }

  /// Largest mismatch of the points of a constraint, or of a coupling, at time t [s] and q [m].
  Float128 Drift(const Float128& t, const VectorX<Float128>& q);
  /// Centres of mass at time t [s] and q [m], in ground axes, one below the other.
  VectorX<Float128> Centres(const Float128& t, const VectorX<Float128>& q);

 private:
  Mechanism<Planar, Float128> mechanism_;
  Kinematics<Planar, Float128> kinematics_;
  Outcome outcome_ = Outcome::kFinished;
  std::string message_;
  VectorX<Float128> q_, u_;
};

}  // namespace loopbench::harness
