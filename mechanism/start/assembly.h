// Consistent starts: positions and speeds that satisfy every loop, from partial initial data.
//
// Positions: Levenberg-Marquardt on the mismatch e(q) of the cut joints in joint coordinates, over
// the coordinates that are not held; near a solution the damping vanishes and convergence is
// quadratic. Speeds: the smallest change of the speeds not given that makes J u = 0. Both work at
// singular positions (least squares with rank decision), where they leave consistent data as they
// are.
#pragma once

#include <cstdint>
#include <string>

#include "mechanism/description/outcome.h"
#include "mechanism/model/mechanism.h"

namespace loopbench {

/// A start in the coordinates of the mechanism it was made for.
template <class S>
struct Start {
  Outcome outcome = Outcome::kFinished;  ///< or kInconsistentStart, kLocked
  std::string message;                   ///< names the loop that does not close and by how much
  VectorX<S> q, u;
  double position_residual = 0.0;  ///< largest mismatch left [rad or m]
  double speed_residual = 0.0;     ///< largest component of J u left [rad/s or m/s]
};

/// Assembles the description's initial data at time 0. `mechanism` must be compiled from the same
/// description, in either coordinate set: the result is in its coordinates. The matrices of the
/// loops are dense; throws TooDense (dense_memory.h) before it begins with some that cannot be had.
template <class Space>
Start<double> Assemble(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism);

/// The description with each held coordinate moved by a uniform random amount in
/// [-amplitude, amplitude]; the same (seed, member) gives the same start everywhere.
MechanismDescription Perturb(MechanismDescription description, double amplitude, std::uint64_t seed,
                             int member);

}  // namespace loopbench
