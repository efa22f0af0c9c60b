// A mechanism in plain numbers, source of all exported documents, programs and peer models.
//
// A forest of tree joints from Ground, the joints that close its loops, and bodies about their
// centres of mass, all in 3D (a planar mechanism lies in z = 0). No Eigen and only C++17: required
// by headers of peers, which are built with other processor flags than Loopbench.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopbench {
struct MechanismDescription;
}

namespace loopbench::exchange {

using Vec = std::array<double, 3>;
/// Row by row.
using Matrix = std::array<double, 9>;

/// A frame in body axes, relative to the centre of mass.
struct Frame {
  Matrix R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec p = {0, 0, 0};
};

struct Body {
  std::string name;
  double mass = 0.0;    ///< [kg]
  Matrix inertia = {};  ///< about the centre of mass, in body axes [kg m^2]
  Vec com = {};         ///< centre of mass from the user's body origin, in body axes [m]
  std::vector<std::pair<std::string, Vec>> points;  ///< named points, from the centre of mass [m]
};

/// A joint from P to Q, with frame F on P and M on Q; kinds, axes, coordinates and speeds as in
/// mechanism/model/joint.h.
struct Joint {
  std::string name;
  std::string kind;        ///< as in mechanism files: "revolute"
  double parameter = 0.0;  ///< pitch [m/rad] of "helical", length [m] of "rod"
  int from = 0, to = 0;    ///< indices of bodies P and Q
  Frame F, M;
  // for tree joints:
  int num_q = 0, num_u = 0, q = -1, u = -1;  ///< sizes, and first index among all
  std::vector<std::string> coordinates;      ///< their names: "angle"
  bool from_is_child = false;                ///< P is the child of Q
  double rotor_inertia = 0.0;                ///< along the one coordinate
  /// Constrained directions of a spatial cut joint that the loop does not already imply
  /// (mechanism/simplify/redundancy.h): components of a motion [w; v] in axes of F. Empty: all
  /// directions that its kind constrains.
  std::vector<int> imposed;

  int parent() const { return from_is_child ? to : from; }
  int child() const { return from_is_child ? from : to; }
};

/// Effort constant - stiffness (q - rest) - damping u along the one coordinate of a tree joint.
struct JointForce {
  int joint = 0;  ///< index into Model::tree
  double constant = 0.0, stiffness = 0.0, rest = 0.0, damping = 0.0;
};

/// The sum of ratio times coordinate over joints of one coordinate is `offset`.
struct Coupling {
  std::string name;
  std::vector<std::pair<int, double>> parts;  ///< indices into Model::tree, ratios
  double offset = 0.0;
};

/// A material point of a body, from its centre of mass, in body axes [m].
struct Point {
  int body = 0;
  Vec at = {};
};

/// A constant force [N] in ground or body axes.
struct PointForce {
  Point point;
  Vec force = {};
  bool in_body_axes = false;
};

/// Tension preload + stiffness (d - length) + damping d' between points at distance d.
struct SpringDamper {
  Point from, to;
  double stiffness = 0.0, damping = 0.0, length = 0.0, preload = 0.0;
};

struct Model {
  std::string name;
  bool planar = false;
  Vec gravity = {};
  std::vector<Body> bodies;         ///< [0] is Ground
  std::vector<Joint> tree;          ///< parents before children, one per body but Ground
  std::vector<Joint> cut;           ///< joints that close loops
  std::vector<Coupling> couplings;  ///< also of the assembled start
  std::vector<JointForce> joint_forces;
  std::vector<PointForce> point_forces;
  std::vector<SpringDamper> spring_dampers;
  int num_q = 0, num_u = 0;
  /// Initial state in the order of the tree: the assembled start, or zero with unit quaternions.
  std::vector<double> q, u;
  /// Parts of the mechanism that a Model cannot contain, each with its joint or body.
  std::vector<std::string> missing;
};

/// A part that a format expresses differently: with the same motion, or with a loss.
struct Note {
  bool loss = false;
  std::string text;
};

/// Exported document or source text for another program.
struct ExportedFile {
  std::string text;
  std::vector<Note> notes;
};

/// Error for parts of a model that a format or peer does not support; what() lists all.
class Unsupported : public std::runtime_error {
 public:
  explicit Unsupported(std::vector<std::string> parts)
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

/// Makes a model with the tree and order of Mechanism(description, Coordinates::kJoint), at zero
/// coordinates and speeds. Model::missing then lists prescribed motions, time-dependent forces,
/// drag, forces along coordinates of cut joints, and joints and forces of other programs.
Model MakeModel(const MechanismDescription& description);

/// Makes the model at the assembled start. Throws std::runtime_error if assembly fails.
Model MakeModelAtStart(const MechanismDescription& description);

inline constexpr double kTimeStep = 1e-3;  ///< default of MuJoCo's step [s]

/// An export format.
struct ExportFormat {
  std::string_view name, ending;
  ExportedFile (*write)(const MechanismDescription& description, double time_step);
};

const std::vector<ExportFormat>& ExportFormats();

/// Exports the mechanism at its assembled start, byte-reproducibly. Throws Unsupported with all
/// unsupported parts, and std::runtime_error if assembly fails.
inline ExportedFile Export(const MechanismDescription& description, const ExportFormat& format,
                           double time_step = kTimeStep) {
  return format.write(description, time_step);
}

}  // namespace loopbench::exchange
