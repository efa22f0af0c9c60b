// User's description of a mechanism: plain data, SI units, angles in rad, no algorithm.
//
// A planar problem uses the same 3-vectors as a spatial one (z = 0, rotation about z), so that one
// description can be compiled into either space (mechanism.h). Index 0 of `bodies` is always
// Ground.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/force.h"
#include "mechanism/description/joint_type.h"
#include "mechanism/description/time_function.h"

namespace loopbench {

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
  /// Joint axis in the axes of both frames before alignment, which turns the joint's own axis
  /// (JointTraits) onto it. Zero means the own axis, unchanged.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  double parameter = 0.0;  ///< of its kind (JointParameter): a pitch [m/rad], a length [m]
  bool cut = false;        ///< never part of the spanning tree (if the graph allows)
  /// Constrained directions, counted from 0 in the order of joint.h's D, that the joint does not
  /// impose because they are redundant (redundancy.h). Only for cut joints; never in a user's file.
  std::vector<int> released;
  /// The subset that moving rows impose at the start (mechanism.h).
  std::vector<int> moving;
  std::vector<PrescribedMotion> motions;  ///< at most one per coordinate; none with a quaternion
  /// Inertia of a rotor along the one coordinate [kg m^2, or kg]: of a drive, times the square of
  /// its gear ratio. It resists changes of the joint's speed, not of the bodies' own.
  double rotor_inertia = 0.0;
};

/// A linear relation of joint coordinates, sum_i ratio_i q_i = offset: gears, racks, differentials,
/// joints that follow another one. Two or more joints, each with one coordinate.
struct CouplingDescription {
  struct Part {
    int joint = 0;
    double ratio = 1.0;  ///< not zero
  };
  std::string name;
  std::vector<Part> parts;  ///< at most one per joint
  double offset = 0.0;
  bool in_loops = false;  ///< constraints of joints that depend on it are released
};

/// Initial values of one joint's coordinates or speeds (one number; free joints: see joint.h).
struct JointValues {
  int joint = 0;
  std::vector<double> values;
  double weight = 1.0;  ///< of guesses: of their differences from the start, > 0
};

/// A pose of a body, or the position of one of its points, at the start. Given in ground axes.
struct PoseTarget {
  int body = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< from the body's origin, in its axes [m]
  std::optional<Eigen::Vector3d> at = {};           ///< position of the point [m]
  std::optional<Eigen::Vector3d> rotation = {};     ///< of the body's axes, as a vector [rad]
  bool fixed = false;                               ///< the assembly must meet it
  double weight = 1.0;                              ///< as above
};

/// Partial initial data; the rest is assembled (assembly.h).
struct InitialDescription {
  std::vector<JointValues> coordinates;  ///< guesses, or exact if the joint is fixed
  std::vector<JointValues> speeds;       ///< all of them are fixed
  std::vector<int> held;                 ///< joints whose coordinates the assembly must not move
  /// Targets, of which `coordinates` are the result (ResolvePoses()). Copies that change bodies
  /// leave them out.
  std::vector<PoseTarget> poses = {};

  bool IsHeld(int joint) const { return std::ranges::find(held, joint) != held.end(); }
  /// The guess of a joint's coordinate, 0 if there is none.
  double GuessOf(int joint, std::size_t coordinate) const;
};

struct MechanismDescription {
  std::string name;
  SpaceKind space = SpaceKind::kPlanar;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();                      ///< [m/s^2], ground axes
  std::vector<BodyDescription> bodies = std::vector<BodyDescription>(1);  ///< [0] is Ground
  std::vector<JointDescription> joints;
  std::vector<CouplingDescription> couplings;
  std::vector<ForceDescription> forces;
  InitialDescription initial;
  /// Names of independent speeds of a fixed coordinate reduction: joint names for joint coordinates
  /// ("OA"), "<body>.angle", "<body>.x", ... for absolute ones. Names of another coordinate set are
  /// skipped; without names, they are chosen at the start.
  std::vector<std::string> independent;
  /// Accuracy of points, axes and initial values [rad, or lengths of the mechanism]: loops that
  /// close within it are closed, and constraints that differ by less depend on each other.
  double accuracy = 1e-5;
  /// True if released directions hold within `accuracy` only, so that they are no constraints.
  bool rounded = false;
};

/// A copy in which all constrained directions are imposed; if rounded, the directions imposed at
/// the start.
MechanismDescription Unreleased(const MechanismDescription& description);

/// Returns the first error of the description as text ("" if it is valid): masses and inertias not
/// positive, joints of a body with itself, forces, couplings or values on joints of another size, a
/// planar problem with parts out of plane, non-finite numbers.
std::string Validate(const MechanismDescription& description);

}  // namespace loopbench
