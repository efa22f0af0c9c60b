// A Model as a document of MuJoCo (MJCF), and where our coordinates are in it. C++17, as model.h.
//
// MuJoCo's frame of a body is the user's. Tree joints are chains of slides, hinges and balls of
// one body. Joints that close loops are equality constraints: points held together (`connect`), or
// at a distance (a tendon). Constant efforts, forces at points and preloads are actuators without
// control (`biasprm`); springs and dampers are MuJoCo's own.
//
// MuJoCo's closures are soft: each is held by a spring and damper (`solref`) and by forces that
// leave a share 1 - `solimp` of the acceleration unopposed, and accelerations that come with speed
// (J' u) are left out. Here they are as stiff as it allows: a time constant of two steps,
// critically damped, and a share of 1e-4.
#pragma once

#include <string>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

/// A coordinate of MuJoCo that is one of ours, or, of a ball, the first of a quaternion's.
struct MjcfCoordinate {
  bool ball = false;
  int q = 0, u = 0;   ///< places among our coordinates and speeds
  double sign = 1.0;  ///< ours = sign * MuJoCo's; a ball with -1 is turned round
  Matrix axes = {};   ///< of a ball: the axes in which ours are, in those of the moved body
};

/// A point of each of two bodies, in MuJoCo's body frames, held together; or at a distance.
struct MjcfClosure {
  Vec at_first = {}, at_second = {};
  double rod = -1.0;  ///< distance [m]; negative: none
};

struct MjcfOptions {
  double time_step = 1e-3;  ///< [s], of which closures are as stiff as they may be
  bool shapes = false;      ///< for viewers; they cost time in every step
};

struct Mjcf {
  std::string document;
  std::vector<MjcfCoordinate> coordinates;  ///< in the order of MuJoCo's joints
  std::vector<MjcfClosure> closures;        ///< in the order of MuJoCo's equality constraints
  std::vector<Note> notes;
};

/// The model put where Model::q says: there its closures hold in the document if they do in the
/// model. Throws NotThere for what MJCF does not have: Model::missing, helical joints, closures
/// other than revolute, spherical, weld and rod, moments of inertia that no body has, masses and
/// moments below 1e-15.
Mjcf MakeMjcf(const Model& model, const MjcfOptions& options = {});

}  // namespace loopbench::exchange
