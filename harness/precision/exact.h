// A mechanism in a wide scalar: its start, comparison of its state with runs, and its motion with a
// certified error from independent integrations (make_reference.h).
#pragma once

#include <cstdint>
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

/// A mechanism in the widest scalar: its initial state, and the reference for all runs' states.
class Exact {
 public:
  /// Closes the start in Float128 as CloseStart() does.
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

/// One integration.
template <class Space, class S>
struct Witness {
  Outcome outcome = Outcome::kFinished;
  std::string message;
  std::vector<VectorX<S>> positions;      ///< q of the mechanism in joint coordinates, by time
  std::vector<Moment<Space, S>> moments;  ///< by time, as far as it got
  std::int64_t rhs_evaluations = 0;
  double cpu_s = 0.0;
};

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

/// Integrates `description` as it is run, with redundant constraints released, from its closed
/// start through `times` [s], the first of them 0. Each integration has `cpu_s`; if the
/// reference ends early, the others stop there.
template <class Space, class S>
Certified<Space, S> Certify(const MechanismDescription& description,
                            const std::vector<double>& times, double cpu_s,
                            PutBack put_back = PutBack::kAtSteps);

}  // namespace loopbench::harness
