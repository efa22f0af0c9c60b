// The picture of a mechanism as data, and the camera that sees it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

// The picture of a mechanism: plain data, and no word of the medium that it is drawn in.
//
// A shape is a list of places, each fixed on a body, with a kind that says how they are joined and
// a style that says what they stand for. Given a pose for every body, any writer can draw it: the
// SVG writer does so once, web/scene.js for every frame. What a symbol looks like (a slider is a
// box on a guide) is therefore decided here, once (shapes.h), and how a line or a disc is painted,
// in the writers.
//
// Lengths in m, angles in rad. Poses are those of the user's bodies at their origins, in ground
// axes, whatever the mechanism is compiled to.

/// A pose for each of the user's bodies, Ground included.
using Poses = std::vector<Frame>;

/// A point that moves with a body: p = p_body + R_body at + offset.
struct PicturePlace {
  int body = kGround;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();      ///< in body axes from its origin [m]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< in ground axes [m]

  Eigen::Vector3d In(const Poses& poses) const {
    const Frame& X = poses[static_cast<std::size_t>(body)];
    return X.p + X.R * at + offset;
  }
};

enum class ShapeKind {
  kLine,    ///< from place to place
  kArea,    ///< closed, filled; widened by the radius
  kBar,     ///< line of two places, thick: round ends of the radius
  kDisc,    ///< about one place, seen as a circle from everywhere
  kCentre,  ///< the quartered circle of a centre of mass, likewise
  kSpring,  ///< zig-zag between two places
  kDamper,  ///< dashpot between two places
  kArrow,   ///< line whose last place has a head
};

/// What a shape stands for.
enum class ShapeStyle {
  kBody,    ///< a link
  kGround,  ///< ground and its hatching
  kJoint,   ///< symbol of a joint, white inside
  kSolid,   ///< symbol of a joint, dark inside
  kGuide,   ///< what a joint slides or turns on
  kRod,     ///< a distance that is kept
  kCentre,  ///< centre of mass
  kSpring,  ///< spring
  kDamper,  ///< damper
  kForce,   ///< force or torque
  kDrive,   ///< prescribed motion
};

/// By how many symbol sizes a shape is drawn nearer to the viewer than it is, in space: symbols lie
/// on bodies, the ball of a joint in its cup, centres of mass on all.
double Lift(ShapeStyle style);

struct PictureShape {
  ShapeKind kind = ShapeKind::kLine;
  ShapeStyle style = ShapeStyle::kBody;
  int item = 0;         ///< whose it is, index into Picture::items
  double radius = 0.0;  ///< [m]
  double aside = 0.0;   ///< of springs and dampers: shift to the left of the way [m]
  std::vector<PicturePlace> places;
};

enum class ItemKind { kBody, kJoint, kForce };

/// What has a name: each body (Ground first), then each joint, then each force.
struct PictureItem {
  ItemKind kind = ItemKind::kBody;
  std::string name = "";     ///< as the user wrote it; of forces what they are
  std::string detail = "";   ///< a line of its numbers
  PicturePlace anchor = {};  ///< where its name belongs
  std::string gone = "";     ///< what the compile step made of it; empty where it stays as it is
  std::vector<std::string> redundant = {};  ///< constraints of a joint that others impose already
};

/// A loop, and how open it is before it is assembled.
struct PictureLoop {
  int cut_joint = 0;                ///< index into joints
  std::vector<int> bodies, joints;  ///< along the loop; Ground where it passes
  PicturePlace from, to;  ///< with `given` poses: where the cut joint's M should be, and is
  double gap = 0.0;       ///< what keeps the joint open as the file says it [m]
  double turn = 0.0;      ///< and [rad]
  double left = 0.0;      ///< [m] after assembly
  std::vector<std::string> redundant;
};

/// One swing of one degree of freedom, or one pass of the prescribed motions.
struct PictureMotion {
  std::string name = "";           ///< of the speed that drives it, or "prescribed motions"
  std::string text = "";           ///< how far it goes, and what the frames are
  std::vector<Poses> frames = {};  ///< in order, equally far apart
  int start = 0;                   ///< the frame at the assembled start
  bool returns = true;             ///< swings to and fro; else begins anew
};

struct Picture {
  std::string name, file;
  bool planar = true;
  bool assembled = true;  ///< `start` closes all loops; else it is `given`
  std::string message;    ///< why not
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< [m/s^2]
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();      ///< what the picture shows upwards
  double symbol = 1.0;                                ///< half the size of a pin [m]
  double extent = 1.0;                                ///< largest side of the box around all [m]
  std::size_t bodies = 0, joints = 0;                 ///< Ground included
  std::vector<PictureItem> items;
  std::vector<PicturePlace> centres;  ///< of mass, by body
  std::vector<PictureShape> shapes;
  Poses start;  ///< as assembled
  Poses given;  ///< as the file says it, before the assembly
  std::vector<PictureLoop> loops;
  std::vector<PictureMotion> motions;
  std::string freedom;             ///< degrees of freedom, in a sentence
  std::vector<std::string> notes;  ///< what the compile step did, what is not shown and why

  std::size_t ItemOfJoint(int joint) const { return bodies + static_cast<std::size_t>(joint); }
};

/// Above so many bodies centres of mass are left out, and so are numbers of parts.
inline constexpr std::size_t kMostDetailed = 500;
/// Above so many speeds of the tree no motion of loops is followed, and nothing is analysed.
inline constexpr int kMostFollowed = 240;
/// Motions that are shown, and places of bodies in all of them.
inline constexpr std::size_t kMostMotions = 12, kMostFrames = 40000;

/// Assembles, analyses and draws. `file` is where it came from, for people. Throws
/// std::invalid_argument for a description that Validate() refuses.
Picture MakePicture(const MechanismDescription& description, const std::string& file);

// How a picture is seen: orthographic, so that parallel links stay parallel and lengths compare.

/// A point of the paper [px], y downwards, with its height towards the viewer [m].
struct Spot {
  double x = 0.0, y = 0.0, depth = 0.0;
};

struct Camera {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< rows: right, up, towards the viewer
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double scale = 1.0;                     ///< [px/m]
  double middle_x = 0.0, middle_y = 0.0;  ///< where `centre` is [px]

  Spot See(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = R * (p - centre);
    return {middle_x + scale * v.x(), middle_y - scale * v.y(), v.z()};
  }
};

/// Names of views: of the plane there is one, "front".
const std::vector<std::string>& ViewNames();
/// Right, up and towards the viewer of a named view.
Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name);

/// A camera whose paper is `width` wide and just as high as all places of `poses` need it to be,
/// within limits; they end `margin` before its edges. The height goes to `*height`. [px]
Camera FitTo(const Picture& picture, const std::vector<const Poses*>& poses,
             const Eigen::Matrix3d& R, double width, double margin, double* height);

}  // namespace loopbench::harness
