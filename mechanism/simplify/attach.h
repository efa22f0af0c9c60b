// Bodies fixed to other bodies: the description without them, and their new positions.
//
// Welded bodies are fixed to one of them, immovable ones to Ground. Mass, centre of mass and
// inertia are for the whole (parallel axes); points, joints and forces are re-expressed in the
// carrier's axes. A joint's frames do not move, so its coordinates keep their meaning.
#pragma once

#include <vector>

#include "mechanism/description/joint_frames.h"
#include "mechanism/description/parts.h"

namespace loopbench {

/// Position of a body on its carrier.
struct Attachment {
  int carrier = kGround;  ///< a body that is not attached itself
  Frame X;                ///< the body's axes and origin in the carrier's
  double turn = 0.0;      ///< plane: its angle as a number, not modulo a turn
  bool attached = false;  ///< else the body stays and the rest does not matter
};

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

}  // namespace loopbench
