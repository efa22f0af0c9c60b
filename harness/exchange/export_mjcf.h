// A Model as a MuJoCo document (MJCF), with the mapping of coordinates. C++17, as model.h.
//
// MuJoCo's body frame is the user's body frame. Tree joints become chains of slides, hinges and
// balls of one body. Cut joints become equality constraints: coincident points (`connect`), or
// points at a distance (a tendon). Couplings become constraints of two joints, or of a fixed
// tendon. Constant efforts, point forces and preloads become actuators without control (`biasprm`).
// Springs and dampers are MuJoCo's own.
//
// MuJoCo's closures are soft: a spring and damper (`solref`) hold each. Its forces leave a share 1
// - `solimp` of the acceleration unopposed, and the acceleration term J' u is neglected. Closures
// are exported as stiff as allowed: a time constant of two steps, critically damped, and a share of
// 1e-4.
#pragma once

#include "harness/exchange/model.h"

namespace loopbench::exchange {

/// A MuJoCo coordinate that equals a Model coordinate, or the first one of a ball's quaternion.
struct MjcfCoordinate {
  bool ball = false;
  int q = 0, u = 0;   ///< indices among the Model's coordinates and speeds
  double sign = 1.0;  ///< Model's = sign * MuJoCo's; -1 inverts a ball's rotation
  Matrix axes = {};   ///< ball: axes of the Model's coordinates, in axes of the moved body
};

/// A closure of two body points, in MuJoCo's body frames: coincident, or at a distance.
struct MjcfClosure {
  Vec at_first = {}, at_second = {};
  double rod = -1.0;  ///< distance [m]; negative: none
};

struct Mjcf {
  std::string document;
  std::vector<MjcfCoordinate> coordinates;  ///< in the order of MuJoCo's joints
  std::vector<MjcfClosure> closures;        ///< in the order of MuJoCo's equality constraints
  std::vector<Note> notes;
};

/// Makes the document at Model::q. Its closures hold there if they hold in the model. `time_step`:
/// step [s], which limits their stiffness; `shapes`: shapes for viewers, which slow down every
/// step. Throws Unsupported for parts that MJCF does not have: Model::missing, helical joints,
/// closures other than revolute, spherical, weld and rod, inertias that no body can have, masses
/// and moments below 1e-15.
Mjcf MakeMjcf(const Model& model, double time_step = kTimeStep, bool shapes = false);

}  // namespace loopbench::exchange
