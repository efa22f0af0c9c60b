// A mechanism in plain numbers: what documents and programs for others are written from, and what
// peers build their own models from.
//
// A forest of tree joints from Ground and the joints that close its loops, bodies about their
// centres of mass, all in three dimensions (a planar mechanism lies in z = 0). No Eigen and nothing
// newer than C++17: the headers of peers ask for that, and what is built for them has other
// processor flags than Loopbench.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace loopbench::exchange {

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
  Vec com = {};         ///< centre of mass from the user's origin of the body, in body axes [m]
  std::vector<std::pair<std::string, Vec>> points;  ///< named ones, from the centre of mass [m]
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
  std::vector<std::string> coordinates;      ///< their names: "angle"
  bool from_is_child = false;                ///< P hangs on Q
  /// Of a joint in space that closes a loop and of which some directions say nothing that the loop
  /// does not say already (mechanism/simplify/redundancy.h): the others, as components of a motion
  /// [w; v] in axes of F. Empty: all that its kind constrains.
  std::vector<int> imposed;

  int parent() const { return from_is_child ? to : from; }
  int child() const { return from_is_child ? from : to; }
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

/// A constant force [N] in ground axes, or in those of the body.
struct PointForce {
  Point point;
  Vec force = {};
  bool in_body_axes = false;
};

/// The tension preload + stiffness (d - length) + damping d' between points at distance d.
struct SpringDamper {
  Point from, to;
  double stiffness = 0.0, damping = 0.0, length = 0.0, preload = 0.0;
};

struct Model {
  std::string name;
  bool planar = false;
  Vec gravity = {};
  std::vector<Body> bodies;  ///< [0] is Ground
  std::vector<Joint> tree;   ///< parents before children, one per body but Ground
  std::vector<Joint> cut;    ///< those that close loops
  std::vector<JointForce> joint_forces;
  std::vector<PointForce> point_forces;
  std::vector<SpringDamper> spring_dampers;
  int num_q = 0, num_u = 0;
  /// Where the model is put first, in the order of the tree: zero, turns as quaternions of one, or
  /// the assembled start.
  std::vector<double> q, u;
  /// What the mechanism has and a Model has not, each with the name of its joint or body.
  std::vector<std::string> missing;
};

/// What a format says in other words: with the same motion, or with a loss.
struct Note {
  bool loss = false;
  std::string text;
};

/// Thrown for parts of a model that a format or peer does not have; what() has all of them.
class NotThere : public std::runtime_error {
 public:
  explicit NotThere(std::vector<std::string> parts)
      : std::runtime_error(Joined(parts)), parts_(std::move(parts)) {}

  const std::vector<std::string>& parts() const { return parts_; }

 private:
  static std::string Joined(const std::vector<std::string>& parts) {
    std::string text;
    for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
    return text;
  }

  std::vector<std::string> parts_;
};

}  // namespace loopbench::exchange
