// A Model as a document of MuJoCo (MJCF), and where our coordinates are in it.
#pragma once

#include <string>
#include <vector>

#include "peers/model.h"

namespace loopbench::peers {

/// A coordinate of MuJoCo that is one of ours, or, of a ball, the first of a quaternion's.
struct MujocoCoordinate {
  bool ball = false;
  int q = 0, u = 0;              ///< places among our coordinates and speeds
  double sign = 1.0;             ///< ours = sign * MuJoCo's; a ball with -1 is turned round
  double constant_effort = 0.0;  ///< along MuJoCo's coordinate
};

/// A point of each of two bodies, in MuJoCo's body frames, held together; or at a distance.
struct MujocoClosure {
  std::string first, second;  ///< bodies
  Vec at_first = {}, at_second = {};
  double rod = -1.0;  ///< distance [m]; negative: none
};

struct MujocoModel {
  std::string document;                       ///< MJCF
  std::vector<MujocoCoordinate> coordinates;  ///< in the order of MuJoCo's joints
  std::vector<MujocoClosure> closures;        ///< in the order of MuJoCo's equality constraints
};

MujocoModel MakeMujocoModel(const Model& model);

}  // namespace loopbench::peers
