// Bodies fixed to other bodies: the description without them, and their new positions.
//
// Welded bodies are fixed to one of them, immovable ones to Ground. Mass, centre of mass and
// inertia are for the whole (parallel axes); points, joints and forces are re-expressed in the
// carrier's axes. A joint's frames do not move, so its coordinates keep their meaning.
#pragma once

#include <vector>

#include "mechanism/algebra/space.h"
#include "mechanism/description/joint_frames.h"
#include "mechanism/description/topology.h"

namespace loopbench {

/// Position of a body on its carrier.
struct Attachment {
  int carrier = kGround;  ///< a body that is not attached itself
  Frame X;                ///< the body's axes and origin in the carrier's
  double turn = 0.0;      ///< plane: its angle as a number, not modulo a turn
  bool attached = false;  ///< else the body stays and the rest does not matter
};

/// The axes and origin of a body with its centre of mass `com`, which has this pose.
template <class Space>
Frame OriginOf(const Pose<Space, double>& at_com, const Eigen::Vector3d& com) {
  Frame X;
  X.R.topLeftCorner<Space::kLin, Space::kLin>() = at_com.R.eigen();
  X.p.head<Space::kLin>() = at_com.p.eigen();
  X.p -= X.R * com;
  return X;
}

/// The carrier with the mass of another body, given by its place in the carrier's axes.
void AddMass(const BodyDescription& body, const Frame& X, BodyDescription* carrier);

/// The description without the attached bodies. Joints between bodies of one carrier are dropped,
/// with the forces in them, as are forces on Ground. A part that floated keeps its place: where its
/// first body gains mass, an explicit free joint of that body's name takes the virtual one's place.
///
/// `attachments` has one entry per body.
MechanismDescription MergeRigidBodies(const MechanismDescription& description,
                                      const std::vector<Attachment>& attachments,
                                      Renumbering* renumbering);

/// Attachments of welded bodies to the first of them in the description (Ground before all).
///
/// A weld that closes a loop in joint coordinates (topology.h) stays a joint, because the loop is
/// assembled there. Without it another joint, perhaps one with an initial value, would be cut. A
/// group stays as it is if its welds contradict each other, or if other joints connect its bodies.
/// Where forces are unknown, all groups stay.
std::vector<Attachment> FindWelded(const MechanismDescription& description);

/// Does the same with these joints alone, which must be welds; other welds count as any joint.
std::vector<Attachment> FindWelded(const MechanismDescription& description,
                                   const std::vector<bool>& welds);

/// Speeds of the forest above which nothing is looked for: the test is dense and runs before every
/// run.
inline constexpr int kMaxSpeedsForImmovable = 200;

/// Smallest over largest singular value of a sub-structure's constraints that counts as certain.
/// The assembled start is accurate to about 1e-13; a singular configuration would be below 1e-6.
inline constexpr double kCertain = 1e-3;

/// Returns attachments to Ground of all bodies in a rigid sub-structure at the assembled start;
/// empty if there are none, assembly fails or forces are unknown.
///
/// A sub-structure is a set of bodies with the joints among them and to Ground. It is rigid if the
/// Jacobian of its constraints at the start has full column rank, with a ratio of singular values
/// above kCertain. It then has no motion even to first order, so its position is isolated. Joints
/// with prescribed motions do not count. A slider at dead centre only stands still: the rest of its
/// loop moves.
std::vector<Attachment> FindImmovable(const MechanismDescription& description);

}  // namespace loopbench
