// What a description amounts to at its start: loops, freedom, rank, redundant constraints.
//
// Rank is decided on geometry alone (scaled_loops.h). One position cannot tell a constraint that is
// redundant everywhere from one that is lost only there, so a second position is looked at: the
// start moved by kNearby along a direction that the loops permit, and assembled again. Numbers
// only; the harness prints them.
#pragma once

#include <vector>

#include "mechanism/assembly.h"
#include "mechanism/islands.h"

namespace loopbench {

/// How far the second position is from the start [rad or m, largest coordinate].
inline constexpr double kNearby = 0.05;
/// Speeds of the forest above which rank is not analysed: the matrices are dense.
inline constexpr int kMostAnalysedSpeeds = 2000;

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
  bool moment = false;  ///< a moment about the axis, else a force along it
  /// x, y or z (in the plane moments are about z); r: along a rod; n: about the normal of a
  /// universal joint's two axes.
  char axis = 'x';
  bool drive = false;        ///< the direction of a prescribed coordinate
  bool ground_axes = false;  ///< the axes are Ground's (planar pins, welds), else the joint's F
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
  std::vector<Island> islands;
  std::vector<LoopPath> loops;
  Start<double> start;  ///< as Assemble() left it, also where it failed

  bool analysed = false;  ///< whether what follows is known
  int rank = 0;           ///< of the cut joints' constraints at the start
  int rank_nearby = 0;    ///< the same at the second position; `rank` where there is none
  /// Singular values of the scaled loops at the start, falling.
  Eigen::VectorXd singular_values;
  /// Constraints that can be dropped together, at the second position; loop_rows - rank_nearby.
  std::vector<RedundantDirection> redundant;

  int freedom() const { return joint_u - rank_nearby; }
  /// Independent motions to first order, where the start is; more than freedom() where it is
  /// singular.
  int freedom_at_start() const { return joint_u - rank; }
  bool singular_start() const { return rank_nearby > rank; }
  /// Smallest singular value that counts, over the largest; 1 without loops.
  double conditioning() const;
  bool locked() const { return analysed && freedom_at_start() == 0; }
};

/// Throws std::invalid_argument for a description that Validate() refuses.
Structure AnalyseStructure(const MechanismDescription& description);

}  // namespace loopbench
