// What a user says about a mechanism: plain data, SI units, angles in rad, no algorithm.
//
// A planar scene is described with the same 3-vectors as a spatial one (z = 0, rotation about z),
// so that one description can be compiled into either space (mechanism.h). Index 0 of `bodies` is
// always Ground.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "mechanism/description/time_function.h"

namespace loopbench {

/// Index of Ground in every list of bodies.
inline constexpr int kGround = 0;

enum class SpaceKind { kPlanar, kSpatial };

/// What a joint leaves free. The coordinates and directions of each are defined in joint.h. From
/// cylindrical on they exist in space only.
enum class JointType {
  kRevolute,
  kPrismatic,
  kWeld,
  kFree,
  kPinInSlot,
  kRod,
  kCylindrical,
  kSpherical,
  kPlanar,
  kUniversal,
  kHelical,
};
inline constexpr int kNumJointTypes = 11;

std::string_view ToString(JointType type);
/// Whether a planar scene may have it.
bool ExistsInPlane(JointType type);
/// The axis of a joint's own frames that JointDescription::axis names: 'x' (slides along it), 'z'
/// (turns about it, or is normal to its plane), or '-' for joints without one.
char OwnAxis(JointType type);
/// Coordinates (or speeds) of a joint that a user can give: none for a rod, which is never
/// followed.
int NumValues(JointType type, SpaceKind space, bool speeds);
std::string_view ToString(SpaceKind space);

/// A rigid body. All vectors in body axes from the body's origin.
struct BodyDescription {
  std::string name;
  double mass = 0.0;                                  ///< [kg], > 0 except for Ground
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      ///< centre of mass [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass [kg m^2]
  std::map<std::string, Eigen::Vector3d> points;      ///< named points [m]
};

/// One side of a joint: a frame fixed on a body.
struct JointSide {
  int body = kGround;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< origin of the frame in body axes [m]
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< rotation vector body -> frame [rad]
};

/// A coordinate of a joint as a given function of time: a drive.
struct PrescribedMotion {
  int coordinate = 0;             ///< in the order of joint.h
  TimeFunctionDescription value;  ///< [rad] or [m]
};

/// A joint from P to Q. Its frame F is fixed on P, its frame M on Q; coordinates describe M in F.
struct JointDescription {
  std::string name;
  JointType type = JointType::kRevolute;
  JointSide from;  ///< P and F
  JointSide to;    ///< Q and M
  /// Joint axis in the axes of both frames before alignment: the joint's own axis (OwnAxis()) is
  /// turned onto it. Zero means the own axis as it is.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  double pitch = 0.0;   ///< of a helical joint: advance along its axis per angle [m/rad]
  double length = 0.0;  ///< of a rod: distance between its two points [m], > 0
  bool cut = false;     ///< never part of the spanning tree (if the graph allows)
  /// Constrained directions, counted in the order of joint.h's D from 0, that the joint does not
  /// impose because the others do (redundancy.h). Of cut joints only; none of a user's file.
  std::vector<int> released;
  /// Where directions are released: the axes (columns, in frame F) along which forces are counted,
  /// in place of x, y and z. Forces only; in the plane the first two.
  Eigen::Matrix3d force_axes = Eigen::Matrix3d::Identity();
  std::vector<PrescribedMotion> motions;  ///< at most one per coordinate; none with a quaternion
};

/// Given moment (revolute) [N m] or force (prismatic) [N] on `to`, its opposite on `from`: constant
/// (a polynomial of one coefficient; it has a potential) or a function of time (it supplies power).
struct JointTorque {
  int joint = 0;
  TimeFunctionDescription value = Polynomial{{0.0}};
};

/// Linear spring on the joint's coordinate: preload - stiffness * (q - rest).
struct JointSpring {
  int joint = 0;
  double stiffness = 0.0;  ///< [N m/rad] or [N/m], >= 0
  double rest = 0.0;       ///< coordinate at which only the preload is left [rad] or [m]
  double preload = 0.0;    ///< [N m] or [N]
};

/// Linear damper on the joint's speed: -damping * u.
struct JointDamper {
  int joint = 0;
  double damping = 0.0;  ///< [N m s/rad] or [N s/m], >= 0
};

/// Constant force at a material point of a body.
struct PointForce {
  int body = kGround;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();     ///< in body axes from the body's origin [m]
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< [N]
  bool in_body_axes = false;                        ///< force turns with the body
};

/// A material point of a body.
struct BodyPoint {
  int body = kGround;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< in body axes from the body's origin [m]
};

/// Spring and damper between points of two bodies: with their distance d, the tension
///   T = preload + stiffness (d - length) + damping ddot
/// pulls them together (T < 0 pushes them apart). Where the points meet, d = 0, there is no
/// direction to pull in and no force: an equilibrium, by the symmetry of all directions, and
/// unless T is proportional to d a jump that an integrator meets as such.
struct SpringDamper {
  BodyPoint from, to;      ///< of different bodies; one may be Ground
  double stiffness = 0.0;  ///< [N/m], >= 0
  double damping = 0.0;    ///< [N s/m], >= 0
  double length = 0.0;     ///< distance at which the spring is free [m], >= 0
  double preload = 0.0;    ///< tension at that distance [N]
};

/// Resistance of a medium at rest at a material point of velocity v: -(linear + quadratic |v|) v.
struct Drag {
  BodyPoint point;
  double linear = 0.0;     ///< [N s/m], >= 0
  double quadratic = 0.0;  ///< [N s^2/m^2], >= 0
};

using ForceDescription =
    std::variant<JointTorque, JointSpring, JointDamper, PointForce, SpringDamper, Drag>;

/// Initial values of one joint's coordinates or speeds (one number; free joints: see joint.h).
struct JointValues {
  int joint = 0;
  std::vector<double> values;
};

/// Partial initial data; the rest is assembled (assembly.h).
struct InitialDescription {
  std::vector<JointValues> coordinates;  ///< guesses, or exact where the joint is held
  std::vector<JointValues> speeds;       ///< all of them are held
  std::vector<int> held;                 ///< joints whose coordinates the assembly must not move
};

struct MechanismDescription {
  std::string name;
  SpaceKind space = SpaceKind::kPlanar;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();                      ///< [m/s^2], ground axes
  std::vector<BodyDescription> bodies = std::vector<BodyDescription>(1);  ///< [0] is Ground
  std::vector<JointDescription> joints;
  std::vector<ForceDescription> forces;
  InitialDescription initial;
  /// Names of speeds that a fixed coordinate reduction takes as independent: joint names for joint
  /// coordinates ("OA"), "<body>.angle", "<body>.x", ... for absolute ones. Those that do not
  /// belong to the coordinate set in use are skipped; none at all means: chosen at the start.
  std::vector<std::string> independent;
};

/// The same with every constrained direction imposed.
MechanismDescription Unreleased(const MechanismDescription& description);

/// First thing that makes the description unusable, as text ("" when it is usable): masses and
/// inertias not positive, joints of a body with itself, forces or values on joints of another size,
/// a planar scene with parts out of plane, non-finite numbers.
std::string Validate(const MechanismDescription& description);

}  // namespace loopbench
