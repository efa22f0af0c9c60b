// Pictures of a mechanism: data and writers.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "harness/judge/tables.h"
#include "mechanism/description/joint_frames.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

// The picture of a mechanism is plain data. A shape is a list of points, each fixed on a body. Its
// kind defines how they are joined, its style the part that they represent. A writer draws it from
// a pose for every body: the SVG writer once, web/scene.js for every frame. Poses are those of the
// user's bodies at their origins, in ground axes, however the mechanism is compiled. [m, rad]

/// A pose for each of the user's bodies, Ground included.
using Poses = std::vector<Frame>;

/// A point that moves with a body: p = p_body + R_body at + offset.
struct PicturePlace {
  int body = kGround;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();      ///< in body axes from its origin [m]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< in ground axes [m]

  Eigen::Vector3d In(const Poses& poses) const {
    const Frame& X = poses[body];
    return X.p + X.R * at + offset;
  }
};

enum class ShapeKind {
  kLine,    ///< from place to place
  kArea,    ///< closed, filled; widened by the radius
  kBar,     ///< thick line between two points with round ends of the radius
  kDisc,    ///< about one point, drawn as a circle from every view direction
  kCentre,  ///< quartered circle of a centre of mass, drawn as kDisc is
  kSpring,  ///< zig-zag between two places
  kDamper,  ///< dashpot between two places
  kArrow,   ///< line whose last place has a head
};

/// Semantic type of a shape.
enum class ShapeStyle {
  kBody,    ///< a link
  kGround,  ///< ground and its hatching
  kJoint,   ///< symbol of a joint, white fill
  kSolid,   ///< symbol of a joint, dark fill
  kGuide,   ///< guide or axle of a joint
  kRod,     ///< rod of constant length
  kCentre,  ///< centre of mass
  kSpring,  ///< spring
  kDamper,  ///< damper
  kForce,   ///< force or torque
  kDrive,   ///< prescribed motion
};

/// Properties of a style.
struct StyleTraits {
  std::string_view name;  ///< in JSON
  int floor;              ///< drawing order: ground below bodies, pins above them
  /// Shift towards the viewer [symbol sizes], in space. Symbols are above bodies, the ball of a
  /// joint above its cup, centres of mass above everything.
  double lift;
};
inline const StyleTraits& TraitsOf(ShapeStyle style) {
  static constexpr StyleTraits kTraits[] = {
      {"body", 2, 0.0},   {"ground", 0, 0.0}, {"joint", 4, 3.0},   {"solid", 4, 3.3},
      {"guide", 1, 1.0},  {"rod", 3, 1.5},    {"centre", 5, 12.0}, {"spring", 3, 1.5},
      {"damper", 3, 1.5}, {"force", 6, 4.0},  {"drive", 6, 4.0}};
  return kTraits[static_cast<std::size_t>(style)];
}

struct PictureShape {
  ShapeKind kind = ShapeKind::kLine;
  ShapeStyle style = ShapeStyle::kBody;
  int item = 0;         ///< item that the shape belongs to, index into Picture::items
  double radius = 0.0;  ///< [m]
  double aside = 0.0;   ///< springs and dampers: shift to the left of the connecting line [m]
  std::vector<PicturePlace> places;
};

enum class ItemKind { kBody, kJoint, kForce };

/// A named part: each body (Ground first), then each joint, then each force.
struct PictureItem {
  ItemKind kind = ItemKind::kBody;
  std::string name = "";                    ///< as the user wrote it; for forces, their type
  std::string detail = "";                  ///< one line with its parameters
  PicturePlace anchor = {};                 ///< position of its name
  std::string gone = "";                    ///< change by the compile step; empty if unchanged
  std::vector<std::string> redundant = {};  ///< constraints of a joint that others imply
};

/// A loop and its opening before assembly.
struct PictureLoop {
  int cut_joint = 0;                ///< index into joints
  std::vector<int> bodies, joints;  ///< along the loop; Ground if included
  PicturePlace from, to;            ///< for `given` poses: M of the cut joint, required and actual
  double gap = 0.0;                 ///< opening of the cut joint in the file [m]
  double turn = 0.0;                ///< its opening as a rotation [rad]
  double left = 0.0;                ///< opening after assembly [m]
  std::vector<std::string> redundant;
};

/// A named point of a body, whose path pages can show.
struct PicturePoint {
  std::string name;  ///< "rod:B"
  PicturePlace place;
};

/// One swing of one degree of freedom, or one pass of the prescribed motions.
struct PictureMotion {
  std::string name = "";           ///< its leading speed, or "prescribed motions"
  std::string text = "";           ///< range of the motion and meaning of the frames
  std::vector<Poses> frames = {};  ///< in order, equally spaced
  int start = 0;                   ///< the frame at the assembled start
  bool returns = true;             ///< swings to and fro; else restarts from the beginning
};

struct Picture {
  std::string name, file;
  bool planar = true;
  bool assembled = true;  ///< `start` closes all loops; else it is `given`
  std::string message;    ///< reason if not assembled
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< [m/s^2]
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();      ///< direction shown upwards
  double symbol = 1.0;                                ///< half the size of a pin [m]
  double extent = 1.0;                                ///< largest side of the bounding box [m]
  std::size_t bodies = 0, joints = 0;                 ///< Ground included
  std::vector<PictureItem> items;
  std::vector<PicturePlace> centres;  ///< centres of mass, by body
  std::vector<PicturePoint> points;   ///< of moving bodies, the first 50
  std::vector<PictureShape> shapes;
  Poses start;  ///< as assembled
  Poses given;  ///< as given in the file, before assembly
  std::vector<PictureLoop> loops;
  std::vector<PictureMotion> motions;
  std::string freedom;             ///< number of degrees of freedom, as a sentence
  std::vector<std::string> notes;  ///< changes by the compile step, parts not shown and why

  std::size_t ItemOfJoint(int joint) const { return bodies + static_cast<std::size_t>(joint); }
};

/// Number of bodies above which centres of mass and numerical details are omitted.
inline constexpr std::size_t kMaxDetailed = 500;
/// Maximum number of body poses in all motions.
inline constexpr std::size_t kMaxFrames = 40000;

/// Assembles, analyses and draws. `file` is the displayed source. Throws std::invalid_argument for
/// a description that Validate() rejects.
Picture MakePicture(const MechanismDescription& description, const std::string& file);

/// Returns the names of views; planar pictures have only "front".
const std::vector<std::string>& ViewNames();
/// Returns the axes of a named view as rows: right, up, towards the viewer.
Eigen::Matrix3d ViewNamed(const Picture& picture, const std::string& name);

/// Returns faces of the convex hull as lists of indices into `points`. One point gives none, points
/// in line give one face with two corners, points in a plane one polygon, others triangles. Points
/// closer than `tolerance` [m] are merged. More than 24 points that span a volume give no faces.
std::vector<std::vector<int>> HullFaces(const std::vector<Eigen::Vector3d>& points,
                                        double tolerance);

/// Frames of a joint on its bodies, its axis included: in body axes, from body origins.
struct JointPlaces {
  Frame F, M;
};
JointPlaces PlacesOf(const JointDescription& joint);

/// Returns the points of each body where joints and point forces act, in body axes. With fewer than
/// two such points, the named points are added, then the centre of mass.
std::vector<std::vector<Eigen::Vector3d>> Attachments(const MechanismDescription& description);

/// Sets anchors of items and all shapes. Requires items, `start`, `up`, `symbol` and `extent`.
/// Sizes are multiples of `symbol`. A shape between two bodies (a spring, a rod, the guide of a
/// slider) has points on both, so that it follows them.
void AddShapes(const MechanismDescription& description, Picture* picture);

struct SvgOptions {
  std::string view = "oblique";  ///< name from ViewNames()
  /// Draws only the mechanism: no outline of the given poses, no loop openings, no text below.
  bool plain = false;
};

/// Returns SVG for papers: line widths for print, 8-point fonts, light fills and dark lines that
/// stay visible in greyscale. The file is self-contained, without style sheet and script.
std::string ToSvg(const Picture& picture, const SvgOptions& options);

/// Returns the largest length of 1, 2 or 5 times a power of ten that is at most `longest`.
double RoundLength(double longest);

/// Returns a JSON string without <, >, & and line separators, so that no text ends the element or
/// line that contains it. Control characters and invalid UTF-8 are made visible (text.h).
std::string ScriptString(std::string_view text);

/// Returns "[a,b]", where `write` converts each element.
template <class List, class Write>
std::string ListOf(const List& list, Write write) {
  std::string text = "[";
  for (const auto& one : list) {
    if (text.size() > 1) text += ',';
    text += write(one);
  }
  return text + "]";
}

inline std::string Strings(const std::vector<std::string>& list) {
  return ListOf(list, [](const std::string& one) { return ScriptString(one); });
}

/// Returns JSON for web/scene.js that is safe inside an HTML element: numbers with ten digits and
/// poses as described there.
std::string ToJson(const Picture& picture);

/// Returns only the poses, with `digits` digits, for drawing with a picture of the same mechanism.
std::string PosesJson(const Poses& poses, bool planar, int digits = 10);

/// web/scene.js (draws any poses of a picture) with the files that it needs, web/scene.css,
/// web/view.js and web/view.html (page of one mechanism), web/history.css and web/history.js,
/// embedded when the program is built.
extern const std::string_view kSceneScript, kSceneStyle, kViewScript, kViewBody, kHistoryStyle,
    kHistoryScript;

/// Returns the start of a page, up to its open style element, which contains kSceneStyle. The page
/// may load or send nothing, whatever a name contains. `title` is safe for XML.
std::string PageHead(std::string_view title);

/// Returns one self-contained HTML page: data, style and script are embedded.
std::string ToHtml(const Picture& picture);

/// Returns, for terminals and screen readers, tables of bodies, joints, forces, loops and motions
/// with their positions in ground axes [m, rad], which `explain` does not print.
std::vector<Table> ToTables(const Picture& picture);

}  // namespace loopbench::harness
