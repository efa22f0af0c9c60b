// Structure of a description at its start: loops, mobility, rank, redundant constraints.
//
// Rank is decided on geometry alone (scaled_loops.h), at the start and at other positions that the
// loops admit (redundancy.h). Numbers only; the harness prints them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/description/topology.h"
#include "mechanism/simplify/redundancy.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

/// One independent loop, closed by its cut joint.
struct LoopPath {
  int cut_joint = 0;
  std::vector<int> joints;  ///< along the loop, the cut joint first
  std::vector<int> bodies;  ///< along the loop, the cut joint's `to` first; Ground where it passes
  double open_shift = 0.0;  ///< violation at the cut joint at the start [m]
  double open_rotation = 0.0;  ///< [rad]
};

/// A redundant constraint direction of a cut joint.
struct RedundantDirection {
  int joint = 0;
  std::string name;       ///< in words
  bool released = false;  ///< at every position, so that runs do not impose it (redundancy.h)
  int coupling = -1;      ///< that it belongs to instead; -1: none
};

struct Structure {
  SpaceKind space = SpaceKind::kPlanar;
  int bodies = 0;                      ///< without Ground
  int joints = 0;                      ///< of the user
  int couplings = 0;                   ///< of the user
  int rows = 0;                        ///< constraints of all joints and couplings
  int loop_rows = 0;                   ///< constraints of the cut joints and couplings
  int joint_q = 0, joint_u = 0;        ///< coordinates and speeds, set joint
  int absolute_q = 0, absolute_u = 0;  ///< set absolute
  /// Freedom by counting (Gruebler, Kutzbach): 3 or 6 per body less `rows`. Wrong where constraints
  /// are redundant.
  int counted_freedom = 0;
  double length = 1.0;                   ///< Mechanism::length() [m]
  std::vector<double> centre_distances;  ///< of centres of mass from the middle of the joints [m]
  std::vector<Island> islands;
  std::vector<LoopPath> loops;
  Start<double> start;  ///< result of Assemble(), also if it failed

  bool analysed = false;  ///< true if the following members are known
  int rank = 0;           ///< of the cut joints' constraints and couplings at the start
  int rank_nearby = 0;    ///< at generic positions; `rank` with prescribed motions or couplings
  /// Singular values of the scaled loops at the start, falling; empty above kMaxAnalysedSpeeds,
  /// where `analysed` means that all constraints are independent.
  Eigen::VectorXd singular_values;
  /// Constraints that can be dropped together, loop_rows - rank_nearby, and redundant couplings.
  std::vector<RedundantDirection> redundant;
  double rounding = 0.0;  ///< of Redundancy [lengths]
  /// Accelerations of constraints that no acceleration of the joints meets, at the speeds of a
  /// singular start [m/s^2 or rad/s^2]. 0: the speeds belong to a motion, to second order.
  double unmet_acceleration = 0.0;

  /// Mobility of parts analysed separately, if one of them cannot move and others can.
  std::optional<int> freedom_of_parts;

  /// Independent motions that lead somewhere.
  int freedom() const { return freedom_of_parts.value_or(locked() ? 0 : joint_u - rank_nearby); }
  /// Returns the independent motions to first order; more than freedom() if the start is singular.
  int freedom_at_start() const { return joint_u - rank; }
  bool singular_start() const {
    return rank_nearby > rank || (start.outcome == Outcome::kLocked && freedom_at_start() > 0);
  }
  /// Smallest singular value that counts, over the largest; 1 without any.
  double conditioning() const;
  /// Returns true if nothing moves, to first order or (Start::message) at all.
  bool locked() const {
    return analysed && !freedom_of_parts &&
           (freedom_at_start() == 0 || start.outcome == Outcome::kLocked);
  }
};

/// Throws std::invalid_argument for a description that Validate() rejects.
Structure AnalyseStructure(const MechanismDescription& description);

}  // namespace loopbench
