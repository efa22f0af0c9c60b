// A mechanism in plain numbers: what peers build their own models from.
//
// A forest of tree joints from Ground and the joints that close its loops, bodies about their
// centres of mass, all in three dimensions (a planar mechanism lies in z = 0). No Eigen and nothing
// newer than C++17: the headers of peers ask for that, and what is built for them has other
// processor flags than Loopbench.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace loopbench::peers {

using Vec = std::array<double, 3>;
/// Row by row.
using Matrix = std::array<double, 9>;

/// A frame in axes of a body, from its centre of mass.
struct Frame {
  Matrix R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec p = {0, 0, 0};
};

struct Body {
  std::string name;
  double mass = 0.0;    ///< [kg]
  Matrix inertia = {};  ///< about the centre of mass, in body axes [kg m^2]
};

/// From P to Q, with frame F on P and M on Q, as mechanism/model/joint.h has it: its kinds, axes,
/// coordinates and speeds.
struct Joint {
  std::string name;
  std::string kind;        ///< as in files: "revolute"
  double parameter = 0.0;  ///< pitch [m/rad] of "helical", length [m] of "rod"
  int from = 0, to = 0;    ///< indices of bodies P and Q
  Frame F, M;
  // of tree joints:
  int num_q = 0, num_u = 0, q = -1, u = -1;  ///< sizes, and place among all coordinates and speeds
  bool from_is_child = false;                ///< P hangs on Q
  /// Of a joint in space that closes a loop and of which some directions say nothing that the loop
  /// does not say already (mechanism/simplify/redundancy.h): the others, as components of a motion
  /// [w; v] in axes of F. Empty: all that its kind constrains.
  std::vector<int> imposed;
};

/// constant - stiffness (q - rest) - damping u along the one coordinate of a tree joint.
struct JointForce {
  int joint = 0;  ///< index into Model::tree
  double constant = 0.0, stiffness = 0.0, rest = 0.0, damping = 0.0;
};

/// A material point of a body, from its centre of mass in body axes [m].
struct Point {
  int body = 0;
  Vec at = {};
};

/// A constant force [N] in ground axes.
struct PointForce {
  Point point;
  Vec force = {};
};

/// The tension preload + stiffness (d - length) + damping d' between points at distance d.
struct SpringDamper {
  Point from, to;
  double stiffness = 0.0, damping = 0.0, length = 0.0, preload = 0.0;
};

struct Model {
  bool planar = false;
  Vec gravity = {};
  std::vector<Body> bodies;  ///< [0] is Ground
  std::vector<Joint> tree;   ///< parents before children, one per body but Ground
  std::vector<Joint> cut;    ///< those that close loops
  std::vector<JointForce> joint_forces;
  std::vector<PointForce> point_forces;
  std::vector<SpringDamper> spring_dampers;
  int num_q = 0, num_u = 0;
};

/// Thrown for a part of a model that a peer does not have.
class NotThere : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Thrown by a step that was not accepted however short it became.
class StepTooSmall : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace loopbench::peers
