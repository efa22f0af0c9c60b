// What a description amounts to at its start: loops, freedom, rank, redundant constraints.
//
// Rank is decided on geometry alone (scaled_loops.h), at the start and at other positions that the
// loops admit (redundancy.h). Numbers only; the harness prints them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/description/islands.h"
#include "mechanism/simplify/redundancy.h"
#include "mechanism/start/assembly.h"

namespace loopbench {

/// One independent loop, closed by its cut joint.
struct LoopPath {
  int cut_joint = 0;
  std::vector<int> joints;  ///< along the loop, the cut joint first
  std::vector<int> bodies;  ///< along the loop, the cut joint's `to` first; Ground where it passes
  double open_shift = 0.0;  ///< mismatch of the cut joint at the start [m]
  double open_rotation = 0.0;  ///< [rad]
};

/// A constrained direction of a cut joint that says what the others say already.
struct RedundantDirection {
  int joint = 0;
  std::string name;       ///< in words
  bool released = false;  ///< at every position, so that runs do not impose it (redundancy.h)
};

struct Structure {
  SpaceKind space = SpaceKind::kPlanar;
  int bodies = 0;                      ///< without Ground
  int joints = 0;                      ///< of the user
  int rows = 0;                        ///< constraints of all joints
  int loop_rows = 0;                   ///< constraints of the cut joints
  int joint_q = 0, joint_u = 0;        ///< coordinates and speeds, set joint
  int absolute_q = 0, absolute_u = 0;  ///< set absolute
  /// Freedom by counting (Gruebler, Kutzbach): 3 or 6 per body less `rows`. Wrong where constraints
  /// are redundant.
  int counted_freedom = 0;
  double length = 1.0;                   ///< Mechanism::length() [m]
  std::vector<double> centre_distances;  ///< of centres of mass from the middle of the joints [m]
  std::vector<Island> islands;
  std::vector<LoopPath> loops;
  Start<double> start;  ///< as Assemble() left it, also where it failed

  bool analysed = false;  ///< whether what follows is known
  int rank = 0;           ///< of the cut joints' constraints at the start
  int rank_nearby = 0;    ///< at generic positions; `rank` where motions are prescribed
  /// Singular values of the scaled loops at the start, falling; none above kMostAnalysedSpeeds,
  /// where `analysed` says that all constraints are independent.
  Eigen::VectorXd singular_values;
  /// Constraints that can be dropped together; loop_rows - rank_nearby.
  std::vector<RedundantDirection> redundant;
  double rounding = 0.0;  ///< of Redundancy [lengths]

  /// Of parts that are analysed by themselves, where one of them cannot move and others can.
  std::optional<int> freedom_of_parts;

  /// Independent motions that lead somewhere.
  int freedom() const { return freedom_of_parts.value_or(locked() ? 0 : joint_u - rank_nearby); }
  /// Independent motions to first order, where the start is; more than freedom() where it is
  /// singular.
  int freedom_at_start() const { return joint_u - rank; }
  bool singular_start() const {
    return rank_nearby > rank || (start.outcome == Outcome::kLocked && freedom_at_start() > 0);
  }
  /// Smallest singular value that counts, over the largest; 1 without any.
  double conditioning() const;
  /// Nothing moves, to first order or (Start::message) at all.
  bool locked() const {
    return analysed && !freedom_of_parts &&
           (freedom_at_start() == 0 || start.outcome == Outcome::kLocked);
  }
};

/// Throws std::invalid_argument for a description that Validate() refuses.
Structure AnalyseStructure(const MechanismDescription& description);

}  // namespace loopbench
