// Consistent starts: positions and speeds that satisfy every loop, from partial initial data.
//
// Positions: closed positions nearest to the guesses (closure.h). Speeds: the smallest change of
// the speeds not given that makes J u = 0. Both work at singular configurations (least squares with
// rank decision) and leave consistent data unchanged.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mechanism/description/outcome.h"
#include "mechanism/model/mechanism.h"

namespace loopbench {

/// A start in the coordinates of the mechanism it was made for.
template <class S>
struct Start {
  Outcome outcome = Outcome::kFinished;  ///< or kInconsistentStart, kLocked
  std::string message;                   ///< names the loop that does not close and by how much
  VectorX<S> q, u;
  double position_residual = 0.0;  ///< largest remaining violation [rad or m]
  double speed_residual = 0.0;     ///< largest remaining component of J u [rad/s or m/s]
  bool has_given_speeds = true;    ///< as given; false: the nearest ones that fit
};

/// Guesses and fixed values of the coordinates of a mechanism in joint coordinates; 0 for others.
template <class Space>
VectorX<double> GuessedPositions(const MechanismDescription& description,
                                 const Mechanism<Space, double>& mechanism);

/// Assembles the description's initial data at time 0. `mechanism` must be compiled from the same
/// description, in either coordinate set: the result is in its coordinates. The matrices of the
/// loops are dense; throws TooDense (dense_memory.h) before it begins with some that cannot be had.
template <class Space>
Start<double> Assemble(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism);

/// Distance from a guess beyond which it counts as missed [rad, or mean lengths of links].
inline constexpr double kFarGuess = 0.5;

/// A coordinate that starts further than kFarGuess from its guess.
struct MissedGuess {
  int joint = 0;       ///< of the description
  int coordinate = 0;  ///< of its kind; -1 for the orientation that a quaternion describes
  double guess = 0.0;  ///< [rad or m]; 0 for an orientation
  double by = 0.0;     ///< start less guess [rad or m]
};

/// Guesses missed by positions q, which are joint coordinates in the order of the description.
/// Angles of cut joints count modulo a turn unless a force depends on them.
std::vector<MissedGuess> FindMissedGuesses(const MechanismDescription& description,
                                           const VectorX<double>& q);

/// The description with each held coordinate moved by a uniform random amount in
/// [-amplitude, amplitude]; the same (seed, member) gives the same start everywhere.
MechanismDescription Perturb(MechanismDescription description, double amplitude, std::uint64_t seed,
                             int member);

}  // namespace loopbench
